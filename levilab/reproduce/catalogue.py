"""The chapters, in their order: a row each."""

from __future__ import annotations

from levilab.reproduce import (
    beyond,
    dipole,
    driven,
    errata,
    gans,
    limits,
    paths,
    simon,
    spindown,
    statistics,
    windows,
)
from levilab.reproduce.chapter import Chapter

CHAPTERS: dict[str, Chapter] = {
    chapter.name: chapter
    for chapter in (
        Chapter("stability", "Where a top can float", windows.make),
        Chapter("limits", "Limits of the spin", limits.make),
        Chapter("paths", "Paths, the fall, and a tilted moment", paths.make),
        Chapter("driven", "The driven top", driven.make),
        Chapter("spindown", "Four spin-downs", spindown.make),
        Chapter("statistics", "Ten measured limits", statistics.make),
        Chapter("dipole", "The dipole approximation", dipole.make),
        Chapter("errata", "Errata", errata.make),
        Chapter("beyond", "What the thesis could not do", beyond.make),
        Chapter("simon", "Simon, Heflinger & Ridgway 1997", simon.make),
        Chapter("gans", "Gans, Jones & Washizu 1998", gans.make),
    )
}

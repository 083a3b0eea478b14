"""The chapters, in their order; what computes one is imported by its call, so that a wrong name is refused at once."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.reproduce.check import Found


@dataclass(frozen=True)
class Chapter:
    """A chapter.

    Attributes:
        name: by which it is chosen.
        title: its heading.
        make: computes it.
    """

    name: str
    title: str
    make: Callable[[], Found]


def _in(module: str) -> Callable[[], Found]:
    """Return what computes the chapter in a module, which is imported then."""
    return lambda: import_module(f"levilab.reproduce.{module}").make()


CHAPTERS: dict[str, Chapter] = {
    chapter.name: chapter
    for chapter in (
        Chapter("stability", "Where a top can float", _in("windows")),
        Chapter("limits", "Limits of the spin", _in("limits")),
        Chapter("paths", "Paths, the fall, and a tilted moment", _in("paths")),
        Chapter("driven", "The driven top", _in("driven")),
        Chapter("drive", "Why it stopped at 61 Hz", _in("drive")),
        Chapter("spindown", "Four spin-downs", _in("spindown")),
        Chapter("statistics", "Ten measured limits", _in("statistics")),
        Chapter("dipole", "The dipole approximation", _in("dipole")),
        Chapter("errata", "Errata", _in("errata")),
        Chapter("beyond", "What the thesis could not do", _in("beyond")),
        Chapter("simon", "Simon, Heflinger & Ridgway 1997", _in("simon")),
        Chapter("gans", "Gans, Jones & Washizu 1998", _in("gans")),
    )
}

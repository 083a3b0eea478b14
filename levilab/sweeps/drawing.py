"""The figures of a store, beside it: one of each column."""

from __future__ import annotations

from typing import TYPE_CHECKING

from levilab.files import writing
from levilab.sweeps.adaptive import in_words, report_in
from levilab.sweeps.observables import GROUPS, columns_of

if TYPE_CHECKING:
    from pathlib import Path

    from levilab.sweeps.observables import Observable
    from levilab.sweeps.store import Map, Store

#: A map with more points is not drawn: it would have to be in memory, and a picture cannot show so many.
MOST_POINTS = 20_000_000


def load_drawn(store: Store) -> tuple[Map, tuple[Observable, ...]] | None:
    """Return a map and its columns that are drawn; None of one with more than `MOST_POINTS`, or that has no figure."""
    from levilab.sweeps.figure import has_figure

    if not has_figure(store.plan) or store.plan.size > MOST_POINTS:
        return None
    found = store.load()
    columns = columns_of(name for name in store.plan.observables if name not in GROUPS)
    return (found, columns) if found.computed.any() else None


def draw_figures(store: Store) -> list[Path]:
    """Draw each column of a map into STORE.NAME.png beside its store; older figures there are replaced.

    Returns:
        The pictures: none where the plan is no map, or has more than `MOST_POINTS`, or nothing is computed.

    Raises:
        CannotWrite: a picture cannot be written.
    """
    from levilab.present.style import save_png
    from levilab.sweeps.figure import map_figure

    drawn = None if store.path is None else load_drawn(store)
    if store.path is None or drawn is None:
        return []
    found, columns = drawn
    report = report_in(store)
    notes = in_words(report, store.plan) if report else []
    pictures = []
    for column in columns:
        picture = store.path.with_name(f"{store.path.name}.{column.name}.png")
        with writing(f"{picture} cannot be written", "free space, or change the folder's permissions"):
            save_png(map_figure(found, column.name, notes), picture)
        pictures.append(picture)
    return pictures

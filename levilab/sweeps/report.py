"""A sweep, as it lies in its store → its figures, and a section of a report.  Nothing is simulated."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.numbers import digits
from levilab.errors import as_typed
from levilab.files import writing
from levilab.motion.report import SYNTHETIC, scene_blocks
from levilab.present.clock import in_utc
from levilab.present.document.blocks import (
    Block,
    Bullets,
    Code,
    Fact,
    Facts,
    Note,
    Picture,
    Section,
    Tabular,
    Verdict,
    Warnings,
)
from levilab.software import command_text, versions_text
from levilab.sweeps.adaptive import in_words, report_in
from levilab.sweeps.axes import in_words as axis_in_words
from levilab.sweeps.quantities import GROUPS, Observable, columns_of
from levilab.sweeps.store import Map, Store
from levilab.sweeps.summary import Summary, columns_table, headline, points_table, summarise
from levilab.texts.text import Text

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from levilab.present.style import Figure

#: Columns that are drawn; a store with more has its figures beside it.
MOST_FIGURES = 6
#: Rows of a table of points, at most.
MOST_ROWS = 500
#: A store of more points is read from itself, by programs that read Zarr.
MOST_IN_A_TABLE = 100_000
#: A map with more points is not drawn: it would have to be in memory, and a picture cannot show them.
MOST_POINTS = 20_000_000


def sweep_section(path: Path) -> Section:
    """Return the section of a store.  Raises DataError for a folder that is none, or damaged."""
    store = Store.open(path)
    summary = summarise(store)
    report = report_in(store)
    filled = in_words(report, store.plan) if report else []
    explained: tuple[Block, ...] = (Note("Points that were filled in:"), Bullets(tuple(filled))) if filled else ()
    blocks: list[Block] = [
        SYNTHETIC,
        Verdict(Text("{what}.", what=headline(summary))),
        *_warnings(store, summary),
        *_figures(store, filled),
        Tabular("sweep-columns", columns_table(summary), "Least, mean and greatest over the points that have a value."),
        *_points(store),
        *explained,
        Section("What was simulated", scene_blocks(store.plan.scene, tuple(_facts(store)))),
        Section("How to reproduce it", tuple(_reproduction(store))),
    ]
    name = store.plan.scene.name or "scene"
    return Section(Text("Sweep: {name:s}", name=name), tuple(blocks), "sweep", path.name, new_page=True)


def sweep_values(path: Path) -> tuple[tuple[str, ...], tuple[tuple[Any, ...], ...]] | None:
    """Return heads and rows of a table for programs: the points that are computed; None for too many."""
    store = Store.open(path)
    plan = store.plan
    if plan.size > MOST_IN_A_TABLE:
        return None
    found = store.load()
    heads = ("synthetic", *(axis.key for axis in plan.axes), *found.values)
    rows = []
    for index in np.argwhere(found.computed):
        place = tuple(index.tolist())
        rows.append((True, *plan.point(place).values(), *(_cell(values[place]) for values in found.values.values())))
    return heads, tuple(rows)


def _cell(value: Any) -> Any:
    plain = value.item()
    return None if isinstance(plain, float) and not math.isfinite(plain) else plain


def _warnings(store: Store, summary: Summary) -> Iterator[Warnings]:
    if left := store.plan.size - summary.points:
        text = Text(
            "{left} of {all} points are not computed; levilab sweep {path:s} --resume goes on",
            left=left, all=store.plan.size, path=as_typed(store.path),
        )  # fmt: skip
        yield Warnings(((text,),))


def _figures(store: Store, notes: Sequence[str]) -> Iterator[Block]:
    if (drawn := load_drawn(store)) is None:
        return
    found, columns = drawn
    axes = " × ".join(axis.key for axis in store.plan.axes)
    for column in columns[:MOST_FIGURES]:
        title = Text("{column:s} over {axes:s}, SYNTHETIC.", column=column.name, axes=axes)
        alt = Text("Map of {column:s} over {axes:s}", column=column.name, axes=axes)
        draw = partial(_draw, found, column.name, tuple(notes))
        yield Picture(f"sweep-{column.name.replace('_', '-')}", title, column.meaning, alt, draw)
    if len(columns) > MOST_FIGURES:
        left = len(columns) - MOST_FIGURES
        yield Note(Text("{n} more columns are not drawn here; levilab sweep draws all of them.", n=left))


def _draw(found: Map, column: str, notes: Sequence[str]) -> Figure:
    from levilab.sweeps.figure import map_figure  # with matplotlib

    return map_figure(found, column, notes)


def _points(store: Store) -> Iterator[Block]:
    """Point by point, where the points are a line or the rows of a table, and not too many."""
    plan = store.plan
    if len(plan.shape) == 1 and plan.size <= MOST_ROWS:
        yield Tabular("sweep-points", points_table(store.load()))


def _facts(store: Store) -> Iterator[Fact]:
    plan = store.plan
    yield Fact("Axes", tuple(axis_in_words(axis) for axis in plan.axes))
    yield Fact("Length", (Text("each motion up to {seconds:g} s", seconds=plan.duration_s),))
    longest = "the longest step that each chunk allows"
    step = longest if plan.step_share is None else Text("{share:g} of the longest step", share=plan.step_share)
    wanted = Text("wanted error at the end {error:n}, in m and in rad; {step}", error=digits(plan.tolerance), step=step)
    yield Fact("Accuracy", (wanted,))
    yield Fact("Cost", (Text("{n} chunks, {done} of them computed", n=plan.chunk_count, done=store.done),))


def _reproduction(store: Store) -> Iterator[Block]:
    words = store.attribute("command_line")
    if isinstance(words, list) and words:
        yield Code(command_text([str(word) for word in words]))
    software, processor = store.attribute("software"), store.attribute("processor")
    facts = []
    if isinstance(software, dict):
        facts.append(Fact("Software", (versions_text(software),)))
    if isinstance(processor, dict) and "name" in processor:
        facts.append(Fact("Processor", (str(processor["name"]),)))
    begun = in_utc(str(store.group.attrs.get("created_utc", "—")))
    facts.append(Fact("When", (Text("begun {time:s}", time=begun),)))
    yield Facts(tuple(facts))
    yield Note("On a processor of the same kind the same command gives the same numbers to the last digit.")


# --- figures beside the store ---


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

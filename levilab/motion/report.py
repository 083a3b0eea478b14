"""A simulated motion, as it lies in a run folder → a section of a report.

All numbers are those that run.json has.  The figure is drawn from the motion computed once more, if its last state is
the one in states.csv to the last digit; otherwise, or where that would take long, from the picture in the folder.
"""

from __future__ import annotations

import contextlib
import hashlib
import math
from functools import partial
from typing import TYPE_CHECKING, Any

from levilab.errors import DataError, LevilabError, unquote
from levilab.motion.effects import KINDS, field_kinds
from levilab.motion.simulation import COLUMNS, FIGURE, SimulationRequest, run_simulation
from levilab.motion.summary import Summary, as_document
from levilab.present.clock import in_utc
from levilab.present.document.blocks import (
    Banner,
    Block,
    Code,
    Details,
    Fact,
    Facts,
    Note,
    Picture,
    Section,
    Tabular,
    Verdict,
    Warnings,
)
from levilab.present.numbers import plain, with_decimals
from levilab.present.tables import table
from levilab.runs.run import STATES, Run
from levilab.simulator.scene import Scene, SceneError, changes, scene_of
from levilab.software import command_text, versions_text
from levilab.texts.text import Sentences, Text, in_language

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from levilab.present.style import Figure

#: Motions that took longer to compute are not computed again for a figure [s].
LONGEST_S = 10.0
NUMBERS = ("quantity", "value", "unit")
SYNTHETIC = Banner("SYNTHETIC.", "This is a simulation: nothing of it was measured.")


def motion_section(run: Run) -> Section:
    """Return the section of a simulated motion.  Raises DataError for a folder in which one is not, or not whole."""
    found, scene = _document(run), _scene(run)
    if summary := _simulate_again(run, scene, found):  # its texts can be said in other languages
        notes = [unquote(in_language(note)) for note in summary.notes]
        texts = as_document(summary) | {"notes": notes}
        found = {**found, **{key: texts[key] for key in ("fell", "lines", "no_lines_because", "notes")}}
    name = str(found.get("scene") or scene.name or "without a name")
    blocks: list[Block] = [
        SYNTHETIC,
        Verdict(_verdict(found, name)),
        *_notes(found),
        *_pictures(run, name, summary),
        Tabular("motion", table("The motion in numbers", NUMBERS, _numbers(found, scene), numbers=NUMBERS[1:2])),
        *_lines(found),
        Section("Accuracy and cost", (Facts(tuple(_accuracy(found))),)),
        Section("What was simulated", scene_blocks(scene, _how_long(run))),
        Section("How to reproduce it", tuple(_reproduction(run))),
    ]
    title = Text("Simulated motion: {name:s}", name=name)
    return Section(title, tuple(blocks), "motion", run.folder.name, new_page=True)


def motions_overview(runs: Sequence[Run]) -> Section:
    """Return one section of many simulated motions: a row for each, no figures."""
    heads = ("run", "scene", "how it ended", "up for [s]", "spin at the end [Hz]")
    rows, unusable = [], []
    for run in runs:
        try:
            found = _document(run)
        except DataError as error:
            unusable.append((str(error),))
            continue
        fell = found.get("fell")
        ended = str(fell.get("text", "fell")) if isinstance(fell, dict) else "stayed up"
        numbers = (_digits(found, "end_s", 4), _digits(found, "spin_end_hz", 5))
        rows.append((run.folder.name, str(found.get("scene") or "—"), ended, *numbers))
    shown = Tabular("motions", table("", heads, rows, numbers=heads[3:]), first_column_wraps=True)
    note = Note("A report of up to twelve simulated motions has a chapter with figure, lines and accuracy for each.")
    warnings = [Warnings(tuple(unusable))] if unusable else []
    title = Text("{n} simulated motions", n=len(runs))
    return Section(title, (SYNTHETIC, *warnings, shown, note), "motions", new_page=True)


def motion_values(runs: Sequence[Run]) -> tuple[tuple[str, ...], tuple[tuple[str | float | bool | None, ...], ...]]:
    """Return heads and rows of a table for programs: the single numbers and words of each motion in run.json."""
    found = []
    for run in runs:
        with contextlib.suppress(DataError):
            found.append((run, _document(run)))
    plain_keys = {
        key: None
        for _, document in found
        for key, value in document.items()
        if value is None or isinstance(value, str | int | float)
    }
    rows = [(run.folder.name, True, *map(document.get, plain_keys)) for run, document in found]
    return ("input", "synthetic", *plain_keys), tuple(
        tuple(None if isinstance(cell, dict | list) else cell for cell in row) for row in rows
    )


def _document(run: Run) -> Mapping[str, Any]:
    found = (run.record.model_extra or {}).get("simulation")
    if not isinstance(found, dict) or not isinstance(found.get("end_s"), int | float):
        raise DataError(f"{run.folder}: is {run.status} and says nothing of its motion; simulate it again")
    return found


def _scene(run: Run) -> Scene:
    try:
        return scene_of(run.record.configuration["scene"])
    except (KeyError, TypeError, AttributeError, SceneError) as error:
        raise DataError(f"{run.folder}: its scene cannot be read ({error}); simulate it again") from error


# --- the motion in numbers -----------------------------------------------------------------------------------


_LOCKED = {"True": "It is locked to its drive.", "False": "It is not locked to its drive."}


def _verdict(found: Mapping[str, Any], name: str) -> str:
    fell = found.get("fell")
    if isinstance(fell, dict):
        time, how = plain(fell.get("time_s"), 4), fell.get("text", "fell")
        said = Text("{name:s}: the top was up for {s:n} s: it {how}.", name=name, s=time, how=how)
    else:
        said = Text("{name:s}: the top stayed up for all of {s:g} s.", name=name, s=found["end_s"])
    accuracy = "The estimated error at the end is NOT within the tolerance of {x:n}."
    if found.get("tolerance_reached"):
        accuracy = "The estimated error at the end is within the tolerance of {x:n}."
    locked = _LOCKED.get(str(found.get("locked")), "")
    return Sentences(said, locked, Text(accuracy, x=_digits(found, "tolerance", 1)))


def _notes(found: Mapping[str, Any]) -> Iterator[Warnings]:
    if notes := found.get("notes"):
        yield Warnings(tuple((str(note),) for note in notes))


#: What run.json says, in the units of a laboratory: quantity, unit, factor, key.
_QUANTITIES = (
    ("mean height", "cm", 1e2, "height_mean_m"),
    ("least height", "cm", 1e2, "height_min_m"),
    ("greatest height", "cm", 1e2, "height_max_m"),
    ("greatest distance from the axis", "cm", 1e2, "distance_from_axis_max_m"),
    ("greatest tilt of the axis", "°", 180 / math.pi, "tilt_max_rad"),
    ("spin at the start", "Hz", 1.0, "spin_start_hz"),
    ("spin at the end", "Hz", 1.0, "spin_end_hz"),
    ("mean spin", "Hz", 1.0, "spin_mean_hz"),
    ("least spin", "Hz", 1.0, "spin_min_hz"),
    ("greatest spin", "Hz", 1.0, "spin_max_hz"),
    ("spin of the washers at the end", "Hz", 1.0, "washer_spin_end_hz"),
)


def _numbers(found: Mapping[str, Any], scene: Scene) -> Iterator[tuple[str, str, str]]:
    # of a top that did not fall this is the time that was simulated, and no lifetime
    time_up = "lifetime" if isinstance(found.get("fell"), dict) else "up for the whole time"
    for name, unit, factor, key in (*_QUANTITIES, (time_up, "s", 1.0, "end_s")):
        value = found.get(key)
        if scene.observed == "spin" and "spin" not in name and key != "end_s":
            continue
        if isinstance(value, int | float):
            yield name, plain(factor * value + 0.0, 5), unit
    change = found.get("energy_change_relative")
    if isinstance(change, int | float):
        conserved = found.get("energy_conserved")
        name = (
            "error of the energy, which is conserved" if conserved else "change of the energy, which drag or drive make"
        )
        yield name, plain(change, 2), "of itself"


def _lines(found: Mapping[str, Any]) -> Iterator[Block]:
    lines = [line for line in found.get("lines", ()) if isinstance(line, dict)]
    if not lines:
        because = found.get("no_lines_because")
        if because:
            yield Note(Text("No lines of the axis: {why}.", why=because))
        return
    heads = ("frequency [Hz]", "amplitude [mrad]", "identified as")
    rows = [
        (
            with_decimals(line.get("frequency_hz", math.nan), 3),
            plain(1e3 * line.get("amplitude_rad", math.nan)),
            line.get("name") or "not identified",
        )
        for line in lines
    ]
    resolution, until = found.get("line_resolution_hz"), found.get("lines_until_s")
    is_part = isinstance(until, int | float) and until < 0.99 * found["end_s"]
    of = Text(", of the first {s:.3g} s", s=until) if is_part else ""
    note = Text("positive in the sense of a positive spin; resolution {hz:n} Hz{of}", hz=plain(resolution, 2), of=of)
    drawn = table("Lines of the axis, n_x + i n_y", heads, rows, numbers=heads[:2])
    yield Tabular("lines", drawn, note)


def _accuracy(found: Mapping[str, Any]) -> Iterator[Fact]:
    reached = "reached" if found.get("tolerance_reached") else "NOT reached"
    said = "an error of at most {x:n} at the end, in m and in rad: {reached}"
    yield Fact("Asked for", (Text(said, x=_digits(found, "tolerance", 1), reached=reached),))
    position, axis = (_digits(found, key, 1) for key in ("position_error_m", "axis_error_rad"))
    said = "{place:n} m of the place, {axis:n} rad of the axis, at the end"
    yield Fact("Estimated", (Text(said, place=position, axis=axis),))
    if steps := found.get("steps"):
        size = plain(1e3 * found.get("step_s", math.nan))
        said = "{steps} steps of at most {ms:n} ms by {scheme:s}"
        yield Fact("Integrated", (Text(said, steps=steps, ms=size, scheme=found.get("scheme", "—")),))
    took, speed = _digits(found, "computing_time_s"), _digits(found, "times_real_time", 2)
    yield Fact("Cost", (Text("{s:n} s on that machine, {n:n} times as fast as the top itself", s=took, n=speed),))


def _digits(found: Mapping[str, Any], key: str, count: int = 3) -> str:
    value = found.get(key)
    return plain(value, count) if isinstance(value, int | float) else "—"


# --- the simulated scene --------------------------------------------------------------------------------


def scene_blocks(scene: Scene, more: Sequence[Fact] = ()) -> tuple[Block, ...]:
    """Return a scene's description: differences from its preset, effects that it has and lacks, its keys."""
    changed = changes(scene)
    kinds = (*field_kinds(scene), *KINDS)
    included = [kind.name for kind in kinds if kind.included(scene)]
    left_out = [kind.name for kind in kinds if not kind.included(scene)]
    own = "a scene of its own; all its keys stand below"
    same = "none" if changed is not None else own
    said = tuple(f"{key} = {value}" for key, value in (changed or {}).items())
    facts = (
        Fact("Scene", tuple(filter(None, (scene.name or "without a name", scene.description)))),
        Fact("Changed keys", said or (same,), code=bool(said)),
        Fact("In it", (Sentences(*included, between=", ") or "none of the effects that the simulator can add",)),
        Fact("Left out", (Sentences(*left_out, between=", ") or "no effect that the simulator knows",)),
        *more,
    )
    note = Note("levilab simulate computes the change by each effect where it is asked to explain.")
    # a preset and its changes say all of it in few lines
    keys = Details(
        "All keys of the scene", (Code(scene.as_toml().strip()),), on_paper="whole" if changed is None else "out"
    )
    return Facts(facts), note, keys


def _how_long(run: Run) -> tuple[Fact, ...]:
    settings = run.record.configuration
    kept = (("duration_s", "up to {x} s"), ("rate_hz", "states kept: {x} per second"))
    texts = tuple(Text(said, x=settings[key]) for key, said in kept if key in settings)
    return (Fact("Length", texts),) if texts else ()


# --- figure --------------------------------------------------------------------------------------------


def _pictures(run: Run, name: str, summary: Summary | None) -> Iterator[Picture]:
    stored = run.folder / FIGURE
    if summary is None and not stored.is_file():
        return
    caption = "Path from the side and from above; height, spin, tilt and energy in time; the spectrum of the axis."
    draw = partial(_draw, summary) if summary else partial(_load_figure, stored)
    alt = Text("Simulated motion of {name:s}, SYNTHETIC.", name=name)
    yield Picture("motion", alt, caption, alt, draw, raster=summary is None)


def _simulate_again(run: Run, scene: Scene, found: Mapping[str, Any]) -> Summary | None:
    """Return the motion computed once more; None where that takes long, or does not end in the same state."""
    settings, took = run.record.configuration, found.get("computing_time_s")
    if not isinstance(took, int | float) or took > LONGEST_S:
        return None
    try:
        duration, tolerance, rate = (float(settings[key]) for key in ("duration_s", "tolerance", "rate_hz"))
        request = SimulationRequest(scene, duration, tolerance, rate)
        summary = run_simulation(request, lambda _: None).summary
    except (LevilabError, KeyError, TypeError, ValueError):
        return None
    last = ",".join(repr(float(values(summary.motion)[-1])) for _, _, _, values in COLUMNS)
    return summary if last == _last_state(run.folder / STATES) else None


def _last_state(path: Path) -> str:
    try:
        with path.open("rb") as file:
            file.seek(0, 2)
            file.seek(max(0, file.tell() - 4096))
            return file.read().decode(errors="replace").strip().rpartition("\n")[2]
    except OSError:
        return ""


def _draw(summary: Summary) -> Figure:
    from levilab.motion.figure import motion_figure  # with matplotlib

    return motion_figure(summary)


def _load_figure(path: Path) -> Figure:
    from levilab.present.style import figure_of_png  # with matplotlib

    return figure_of_png(path.read_bytes())


# --- how to reproduce it -------------------------------------------------------------------------------


def _reproduction(run: Run) -> Iterator[Block]:
    record = run.record
    if record.command_line:
        yield Code(command_text(record.command_line))
    facts = [
        Fact("When", (in_utc(record.started_utc),) if record.started_utc else ()),
        Fact("Software", (versions_text(record.software),)),
        Fact("states.csv", tuple(f"sha256 {digest}" for digest in _hash_of(run.folder / STATES)), code=True),
    ]
    yield Facts(tuple(fact for fact in facts if any(fact.texts)))


def _hash_of(path: Path) -> Iterator[str]:
    try:
        with path.open("rb") as file:
            yield hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return

"""What one process of a laboratory has shown and left behind, and what must hold of it."""

import html
import math
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from levilab.acquisition.session import Row, Session
from levilab.errors import LevilabError
from levilab.laboratory.bench import LaboratoryBench
from levilab.laboratory.events import out_s
from levilab.laboratory.plan import Plan
from levilab.runs.run import Run
from levilab.simulator.laws import LAWS
from levilab.world.spin_world import SpinWorld, World

#: An analysed value further from the truth than this [u] needs a warning; a single reading may be a little further,
#: since there are a thousand times as many of them.
_MOST_U, _MOST_U_OF_READING = 5.0, 7.0
#: Events after which a reading comes late, at the time that it says.
_LATE = {"slow disk", "lid"}
#: Readings that are compared with those of a run that was not broken off, and the columns of their u.
_U = {"spin_frequency_hz": "spin_frequency_u_hz", "flux_density_t": "flux_density_u_t"}
#: Readings from which on a scatter of them is known well enough for 5 u to be far off: Student's law with 8 degrees of
#: freedom has one value in 1000 beyond, in laboratories whose counter states no u.
_FEW = 10
#: Two numbers that should be the same differ by less.
_ROUNDED = 1e-9
#: An instrument that is out for less is reached again; levilab tries for half a minute [s].
_BRIEF_S = 20.0
#: What no message may hold: Python's own words.
_PYTHON = re.compile(r"Traceback|<[a-z_.]+ object at|\bNone\b|\bNaN\b|Error\(|\{\}|errno")


@dataclass(frozen=True)
class Compared:
    """A value of a reading beside the truth.

    Attributes:
        row: the reading.
        value, truth: in the unit of the value.
        u: of the value; 0: the two are the same.
    """

    row: Row
    value: float
    truth: float
    u: float


@dataclass
class Life:
    """What one process of a laboratory has shown and left behind.

    Attributes:
        number: from 0 on.
        ended: finished, interrupted, failed, killed, refused (before anything was begun) or broken (by a defect).
        status: its exit status; None: it was killed, or is broken.
        text: its last message.
        error: that ended it.
        folder: of its run.
        gone: whether the person has removed it, and the process was killed before it wrote again.
        shown, events, messages: rows, texts of events, and all texts that were shown.
        zero: time on the bench of time_s = 0 [s].
        first: index of the first of the rows that this process has read.
        left: the status of its run, as others read it then; empty where there is none.
        output_on: whether the drive was on when it had ended.
        driven: readings of a top that should coast, shown while the drive was on.
        spinning: falls that were shown while the top still spun.
        truth: what the world says of the rows that it has read.
    """

    number: int
    ended: str = "broken"
    status: int | None = None
    text: str = ""
    error: BaseException | None = None
    folder: Path | None = None
    gone: bool = False
    shown: list[Row] = field(default_factory=list)
    events: list[str] = field(default_factory=list)
    messages: list[str] = field(default_factory=list)
    zero: float | None = None
    first: int = 0
    left: str = ""
    output_on: bool = False
    driven: int = 0
    spinning: int = 0
    truth: list[Compared] = field(default_factory=list)


@dataclass(frozen=True)
class Finding:
    """Something that must not be.

    Attributes:
        oracle: what was broken.
        text: what was seen.
    """

    oracle: str
    text: str


def compare_spins(session: Session[Any], world: World, plan: Plan, first: int) -> list[Compared]:
    """Return the spins of a coasting top that a process has read beside those of the world."""
    if plan.experiment != "spin" or session.zero is None or not isinstance(world, SpinWorld):
        return []
    rows = session.rows[first:]
    gate = session.settings.gate_s
    found = []
    for row in rows:
        at = session.zero + row["time_s"]
        spin, _ = world.motion(np.linspace(at - gate / 2, at + gate / 2, 9))
        truth = float(np.sum(spin)) / max(int(np.count_nonzero(spin)), 1) / (2 * math.pi)  # up to a fall
        u = math.hypot(row.get("spin_frequency_u_hz", 0.0), math.sqrt(2) * plan.scene.jitter / gate)
        found.append(Compared(row, row["spin_frequency_hz"], truth, u))
    return found


def compare_at_once(row: Row, plan: Plan, world: World, height_m: float | None, now: float) -> list[Compared]:
    """Return what a reading says beside what is so at the moment in which it is shown.

    Args:
        row: the reading.
        plan: of the laboratory.
        world: with the probe, which stands where it was read, and the tops.
        height_m: where the person believes the probe to be.
        now: the time on the bench [s].
    """
    if plan.experiment == "field" and height_m is not None:
        field = Compared(row, row["flux_density_t"], world.flux_density(now), row["flux_density_u_t"])
        return [Compared(row, row["height_m"], height_m, 0.0), field]
    was_taken = any(event.what == "top taken" for event in plan.events)
    if plan.experiment == "limit" and isinstance(world, SpinWorld) and not was_taken:
        return [Compared(row, row["spin_frequency_hz"], world.fall_at(now), row["spin_frequency_u_hz"])]
    return []


def is_false_fall(text: str, plan: Plan, world: World, now: float) -> bool:
    """Return whether a text says that the top fell, and it still spins at this time on the bench [s]."""
    if plan.experiment != "spin" or "the top fell" not in text or not isinstance(world, SpinWorld):
        return False
    spin, _ = world.motion(np.array([now]))
    return bool(spin[0] > 0)


def drives(bench: LaboratoryBench) -> bool:
    """Return whether a generator of the bench has its output on."""
    outputs = [device.signal() for device in bench.instruments.values() if hasattr(device, "signal")]
    return any(output.amplitude or output.offset or output.triggered for output in outputs)


# --- the processes ---


def lives(plan: Plan, processes: Sequence[Life], folders: Sequence[Path]) -> Iterator[Finding]:
    """Yield what is wrong with what the processes have shown, said and left."""
    for life in processes:
        yield from _ended_well(life)
        yield from _outputs(life)
        yield from _falls(life)
        yield from _gave_up(plan, life)
        yield from _readings_are_true(life)
    yield from _files_are_whole(plan, processes, folders)


def _ended_well(life: Life) -> Iterator[Finding]:
    if life.ended == "broken":
        yield Finding("traceback", life.text)
        return
    if life.error is not None:
        yield from message(life.text, f"process {life.number + 1}")
    if life.ended == "failed" and life.left == "finished":
        yield Finding("status", f"the process failed ({life.text}), and the run says finished")
    if life.ended == "killed" and life.left not in {"", "interrupted", "finished", "failed"}:
        yield Finding("status", f"the process was killed, and the run says {life.left}")
    if life.ended in {"finished", "interrupted"} and life.left != life.ended:
        yield Finding("status", f"the process {life.ended}, and the run says {life.left}")


def message(text: str, whose: str) -> Iterator[Finding]:
    """Yield what is wrong with the text of a failure: it is one line, without words of Python."""
    if not text.strip() or "\n" in text or _PYTHON.search(text):
        yield Finding("message", f"{whose}: {text!r}")


def _outputs(life: Life) -> Iterator[Finding]:
    said = any("MAY STILL BE ON" in text for text in (life.text, *life.messages))
    if life.output_on and life.ended != "killed" and not said:
        yield Finding("output", f"process {life.number + 1} {life.ended}, and the drive is on: {life.text}")
    if life.driven:
        text = f"{life.driven} readings of a top that coasts, and the drive is on"
        yield Finding("output", f"process {life.number + 1}: {text}")


def _falls(life: Life) -> Iterator[Finding]:
    if life.spinning:
        yield Finding("false fall", f"process {life.number + 1} says that the top fell, and it still spins")


def _gave_up(plan: Plan, life: Life) -> Iterator[Finding]:
    """Yield a process that did not finish, though nothing went wrong, or an instrument was out once, for a moment."""
    calm = not plan.events and not plan.typed and life.ended != "finished"
    of_life = [event for event in plan.events if event.life == life.number]
    brief = len(of_life) == 1 and of_life[0].what in {"cable", "plug"} and out_s(of_life[0].value) < _BRIEF_S
    by_hand = plan.experiment == "field" or "spin.drive_waveform=NONE" in plan.settings
    if calm or (brief and by_hand and life.shown and life.ended == "failed"):
        yield Finding("gave up", f"process {life.number + 1} {life.ended}: {life.text}")


def _readings_are_true(life: Life) -> Iterator[Finding]:
    for one in life.truth:
        if abs(one.value - one.truth) > _MOST_U_OF_READING * one.u + _ROUNDED:
            off = f"{(one.value - one.truth) / one.u:+.1f} u from" if one.u else "not"
            text = f"{one.value:.6g} in {one.row} is {off} the truth, {one.truth:.6g}"
            yield Finding("wrong reading", f"process {life.number + 1}: {text}")


# --- the files ---


def _files_are_whole(plan: Plan, processes: Sequence[Life], folders: Sequence[Path]) -> Iterator[Finding]:
    runs = [run for folder in folders if (run := _loaded(folder))]
    rows = [_rows_of(run) for run in runs]
    events = {event["text"] for run in runs for event in run.events()}
    gone = [life.folder for life in processes if life.gone]
    for life in processes:
        if life.folder not in gone and "readings again that were removed" not in life.text:  # the disk failed
            yield from _nothing_lost(life, rows, events)
    for run, stored in zip(runs, rows, strict=True):
        times = [row.get("time_s", math.nan) for row in stored]
        if any(not after > before for before, after in pairwise(times)):
            yield Finding("doubled", f"{run.folder}: times {times}")
        if plan.experiment == "spin" and not any(event.what in _LATE for event in plan.events):
            yield from _at_intervals(run, times)


def _nothing_lost(life: Life, rows: Sequence[list[Row]], events: Collection[str]) -> Iterator[Finding]:
    """Yield the readings and events that were shown and are nowhere."""
    shown = [_rounded(row) for row in life.shown]
    if shown and not any(_follow(shown, stored) for stored in rows):
        missing = [row for row in shown if not any(row in stored for stored in rows)]
        yield Finding("lost", f"process {life.number + 1} has shown {len(shown)} readings; missing: {missing[:3]}")
    for text in life.events:
        if text not in events:
            yield Finding("lost", f"process {life.number + 1} has shown the event {text!r}, which is in no run")


def _at_intervals(run: Run, times: list[float]) -> Iterator[Finding]:
    """Yield gaps between readings that no event explains, and readings that catch up with others."""
    interval = run.record.configuration["spin"]["interval_s"]
    said = [event["time_s"] for event in run.events() if event["time_s"] is not None]
    for before, after in pairwise(times):
        if after - before > 1.5 * interval and not any(before <= time <= after for time in said):
            yield Finding("skipped", f"{run.folder}: no reading between {before:g} s and {after:g} s, and no event")
        if after - before < 0.5 * interval:
            yield Finding("crowded", f"{run.folder}: readings at {before:g} s and {after:g} s, {interval:g} s apart")


def _follow(shown: list[Row], stored: list[Row]) -> bool:
    """Return whether the rows that were shown stand in a run one after the other, with none between them."""
    starts = [k for k, row in enumerate(stored) if row == shown[0]]
    return any(stored[k : k + len(shown)] == shown for k in starts)


def _rows_of(run: Run) -> list[Row]:
    try:
        columns = run.readings().columns
    except LevilabError:
        return []
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return [_rounded(dict(zip(columns, row, strict=True))) for row in rows]


def _rounded(row: Row) -> Row:
    """Return a row without what is not known; numbers are read to the last bit but one."""
    return {name: float(f"{value:.14g}") for name, value in row.items() if not math.isnan(value)}


def _loaded(folder: Path | None) -> Run | None:
    try:
        return Run.load(folder) if folder is not None else None
    except LevilabError:
        return None


def rows_in(folder: Path | None) -> list[Row]:
    """Return the rows of the run in a folder."""
    run = _loaded(folder)
    return _rows_of(run) if run else []


def same_rows(plan: Plan, first: list[Row], second: list[Row]) -> Iterator[Finding]:
    """Yield where a run that was broken off and resumed differs from one that was not, which is the second one."""
    # counts of a swaying top follow each other up to its fall, and a resumed run begins one at another time
    apart = 1 if plan.experiment == "sway" else 0
    if abs(len(first) - len(second)) > apart:
        yield Finding("resumed", f"{len(first)} readings, and {len(second)} of a run that was not broken off")
        return
    for one, other in zip(first, second, strict=not apart):
        for name, u_name in _U.items():
            if not {name, u_name} <= one.keys():  # counts of a sway run have no u
                continue
            if abs(one[name] - other[name]) > _MOST_U_OF_READING * math.hypot(one[u_name], other[u_name]):
                yield Finding("resumed", f"{one}, and in a run that was not broken off {other}")


# --- the analyses ---


def report(page: str) -> Iterator[Finding]:
    """Yield the words of Python in a report as HTML, outside of its figure."""
    words = html.unescape(re.sub(r"<(script|style|svg)\b.*?</\1>|<[^>]*>", " ", page, flags=re.DOTALL))
    if found := _PYTHON.search(words):
        yield Finding("report", f"{found.group()!r} in {words[max(found.start() - 60, 0) : found.end() + 60]!r}")


def values(plan: Plan, analysis: str, result: Any) -> Iterator[Finding]:
    """Yield the values of an analysis that are wrong, without a warning."""
    if result.all_warnings and not plan.is_calm:
        return
    scene = plan.scene
    if analysis == "spindown":
        (run,) = result.runs
        fit = next((fit for fit in run.fits if fit.name == scene.drag), None)
        for name, truth in zip(LAWS[scene.drag].names, scene.constants, strict=True):
            yield from _value(
                fit.parameters.get(name) if fit and len(run.time) >= _FEW else None, truth, f"{scene.drag} {name}"
            )
    elif analysis == "field":
        for name, of_base in {"strength": "strength_t_m", "origin": "origin_m"}.items():
            yield from _value(result.values.get(name), getattr(scene.base, of_base), name)


def _value(found: Any, truth: float, name: str) -> Iterator[Finding]:
    if found is not None and found.u and abs(found.value - truth) > _MOST_U * found.u:
        off = (found.value - truth) / found.u
        yield Finding("wrong value", f"{name} = {found.value:.6g}, {off:+.1f} u from the truth {truth:.6g}")

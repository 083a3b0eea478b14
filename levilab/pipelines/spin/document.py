"""Spin frequencies → uncertainty budgets and result.json."""

import math
from collections.abc import Iterator
from typing import Any

from analysis.budget import Budget, Component, rest
from analysis.numbers import digits
from analysis.pulses import SpinFrequency
from analysis.uncertainty import Estimate
from levilab.pipelines.budget import direct_row, time_base
from levilab.pipelines.document import Analysis, values_of
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import SpinOptions
from levilab.pipelines.row import find_all, symbols_of
from levilab.pipelines.spin.analysis import (
    OF_A_RUN,
    QUANTITIES,
    SPIN_ROW,
    SpinAnalysis,
    SpinRun,
    UParts,
    spin_of_source,
)
from levilab.pipelines.spin.readings import Records, read_spin_file, read_spin_run
from levilab.pipelines.spin.report import spin_columns, spin_part, spin_tables
from levilab.runs.traces import INDEX
from levilab.runs.waveforms import has_traces
from levilab.texts.text import Text

#: Powers of the record's length by which u falls, with as much noise, and pulses as often.
_BY_LENGTH = {"frequency": "√8", "chirp": "√32"}

#: What noise is of, what helps against it, and what is beyond it with its reason.
_OF_PULSES = (
    "train of such pulses",
    "more light",
    "scatter of the pulses beyond the noise",
    "jitter of the pulses, neighbours that are alike, and few pulses to see both by",
)
_OF_A_LINE = (
    "line of such amplitudes",
    "the magnetometer nearer to the top",
    "drift, mains and other lines",
    "what of the samples they may take from the line",
)


def budget_of_run(source: Source[Records], run: SpinRun, options: SpinOptions) -> tuple[Budget, ...]:
    """Return the budgets of one record; of a long one or of several, of the window or record in the middle."""
    made = []
    for name, by_clock in (("frequency", 1.0), ("chirp", 2.0)):
        estimate: Estimate = getattr(run.spin, name)
        if name not in run.parts or estimate.value is None or not estimate.u:
            continue
        rows = [*_of_pulses(run, name, run.parts[name], estimate), *_of_the_rest(run.parts[name], estimate)]
        what = "" if source.run else "clock of the phone" if run.line else "clock of the recording"
        rows.append(time_base(source, "oscilloscope", by_clock * estimate.value, options.clock_u, what=what))
        made.append(Budget(name, estimate.value, estimate.u, estimate.unit, tuple(rows)))
    return tuple(made)


def _of_pulses(run: SpinRun, name: str, parts: UParts, estimate: Estimate) -> Iterator[Component]:
    """Yield the parts of the pulses: noise of the samples, which is a bound, and the scatter beyond it."""
    spin = run.spin
    longer = Text("a record twice as long (u falls by {factor:n})", factor=_BY_LENGTH[name])
    bound = _bound(spin, name)
    whole = parts.pulses
    if bound is None:
        late = digits(1e3 * spin.scatter)
        note: str = Text("{n} pulses, each {ms:n} ms from its place", n=spin.pulses, ms=late)
        what = "scatter of the pulses' times"
        if spin.scatter > 0:
            yield Component("scatter", what, "A", spin.scatter, "s", whole / spin.scatter, note=note, remedy=longer)
        else:
            yield direct_row("scatter", what, whole, estimate.unit, note, longer, "A")
        return
    noise = min(bound, whole)
    if run.code is not None and run.code > 0:
        of_codes = noise * min(run.code / math.sqrt(12), 1.0)
        step = "one step of its numbers is {times:n} times the noise of a sample, in which it is contained"
        note = Text(step, times=digits(run.code))
        yield direct_row(
            "resolution", "bits of the oscilloscope", of_codes, estimate.unit, note, "a finer vertical scale"
        )
        noise = rest(noise, of_codes)
    of, more, jitter, why = _OF_A_LINE if run.line else _OF_PULSES
    note = Text("the Cramér–Rao bound of a {of}: no method does better", of=of)
    remedy = Text("{more}, or {longer}", more=more, longer=longer)
    yield direct_row("noise", "noise of the samples", noise, estimate.unit, note, remedy, "A")
    beyond = rest(whole, min(bound, whole))
    if beyond > 0:
        yield direct_row("jitter", jitter, beyond, estimate.unit, why, longer, "A")


def _bound(spin: SpinFrequency, name: str) -> float | None:
    """Return the Cramér–Rao bound of a frequency [Hz], and of a slope [Hz/s]: √60/T times as large."""
    if spin.bound is None or not spin.frequency.value:
        return None
    span = (spin.pulses + spin.missing - 1) / spin.frequency.value
    return spin.bound if name == "frequency" else spin.bound * math.sqrt(60) / span


def _of_the_rest(parts: UParts, estimate: Estimate) -> Iterator[Component]:
    """Return the change of the slope, and the file's own sampling interval."""
    if parts.drag > 0:
        note = "as a drag in proportion to ω^(1.5 ± 0.5), an even drive or a swing changes it, and as the pulses show"
        yield direct_row("drag", "law by which the slope changes", parts.drag, estimate.unit, note, "a shorter record")
    if parts.step > 0:
        note = "from a straight line through times that lost digits when they were printed"
        yield direct_row(
            "step", "sampling interval", parts.step, estimate.unit, note, "a file with its interval in the header"
        )


def _entries(analysis: SpinAnalysis) -> dict[str, Any]:
    return _run_entries(analysis.runs[0]) if len(analysis.runs) == 1 else {"values": {}, "method": None}


def _run_entries(run: SpinRun) -> dict[str, Any]:
    found = find_all(QUANTITIES, run.spin) | find_all(OF_A_RUN, run)
    return {"values": values_of(found), "method": run.spin.method}


SPIN = Analysis(
    name="spin",
    experiments=frozenset({"trace"}),
    read_file=read_spin_file,
    read_run=read_spin_run,
    data=INDEX,
    also=has_traces,
    wanted="run with traces",
    kind=SpinAnalysis,
    options=SpinOptions,
    fit=spin_of_source,
    of_files=frozenset({"columns", "rate"}),  # a run may have records of several channels
    skips=True,
    budget_of_run=budget_of_run,
    finding=SpinRun,
    entries=_entries,
    run_entries=_run_entries,
    tables=spin_tables,
    part=spin_part,
    columns=spin_columns,
    row=SPIN_ROW,
    symbols=symbols_of(QUANTITIES),
    compared=("frequency",),
)

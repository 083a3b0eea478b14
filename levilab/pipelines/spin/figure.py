"""Spin frequencies → their figure."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.numbers import digits, with_minus
from analysis.pulses import SpinFrequency
from analysis.rotation import FieldSpin, LineSamples, samples_of_line
from levilab.formats.waveforms.waveform import Waveform
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.spin.analysis import MOST_DRAWN, SpinAnalysis, SpinRun
from levilab.pipelines.spin.readings import Records
from levilab.present.drawing import SMALL, band, new_figure, panel, write
from levilab.present.looks import LOOKS
from levilab.present.numbers import short_name, with_uncertainty
from levilab.present.style import TALLEST, WIDE, without_formula
from levilab.texts.text import Text

#: Points of a panel.
MOST_POINTS = 4000
#: Turns of the trace that are shown, and the longest part of it that is folded [s].
TURNS_SHOWN, LONGEST_FOLDED_S = 6, 12.0
READINGS, PULSES, FIT = LOOKS["readings"].colour, LOOKS["pulses"].colour, LOOKS["fit"].colour
#: Height of the sentence above all, of a panel, and of the lowest one, where several inputs share a page; of what is
#: around a panel, and of the name of an input [inch].
_HEAD, _PANEL, _LOWEST, _AROUND, _NAME = 0.42, 1.35, 0.72, 0.7, 0.25
#: Bins of the folded pulse, and of the field of a magnetometer.
BINS, FOLDED_BINS = 240, 24
#: Colours of the axes of a magnetometer, which differ in darkness, too.
AXES = ("#0072b2", "#d55e00", "#009e73")


@dataclass(frozen=True, eq=False)
class _Excerpt:
    """Samples about the reference time: time [s], signal [unit], turns; arrivals and residuals of the pulses [s]."""

    time: Array
    signal: Array
    turns: Array
    unit: str
    arrivals: Array
    residuals: Array


def spin_figure(analysis: SpinAnalysis) -> Figure:
    """Draw for each input its trace with the turns, all turns over each other, residuals, and frequency."""
    shown = analysis.each[:MOST_DRAWN]
    several = len(analysis.runs) > 1
    head = _HEAD if several else _HEAD - 0.2
    high = min(max(((TALLEST - head) / len(shown) - _NAME) / 2 - _AROUND, _LOWEST), _PANEL)
    each = 2 * (high + _AROUND) + _NAME
    height = head + each * len(shown)
    with new_figure(height, _finding(analysis), [one.synthetic for one in analysis.sources]) as figure:
        for k, (source, run) in enumerate(shown):
            top = head + each * k
            panels = [panel(figure, x, top + 0.5 + y, 2.62, high) for y in (0.0, high + _AROUND) for x in (0.72, 4.25)]
            if several:
                write(figure, 0.1, top, _title(source, run), fontsize=9)
            _draw(panels, source, run, k)
        more = len(analysis.runs) - len(shown)
        if more > 0:
            write(figure, WIDE - 0.1, 0.3, Text("{n} more inputs are not drawn", n=more), ha="right", fontsize=SMALL)
    return figure


def _finding(analysis: SpinAnalysis) -> str:
    if len(analysis.runs) == 1:
        spin = analysis.runs[0].spin
        return Text("Spin {spin:n} at {time:n}", spin=with_uncertainty(spin.frequency), time=_reference(spin))
    return Text("Spin of {n} inputs", n=len(analysis.runs))


def _title(source: Source[Records], run: SpinRun) -> str:
    spin = run.spin
    made_up = "  (SYNTHETIC)" if source.synthetic else ""
    name = without_formula(short_name(source.name), 40)
    return f"{name}: spin {with_uncertainty(spin.frequency)} at {_reference(spin)}{made_up}"


def _reference(spin: SpinFrequency) -> str:
    return with_minus(f"{spin.reference_time:.4g} s")


def _draw(panels: list[Axes], source: Source[Records], run: SpinRun, k: int) -> None:
    if source.readings.field and run.line:
        samples = samples_of_line(source.readings.field.times, source.readings.field.field, run.line)
        axes = source.readings.field.axes
        _draw_field(panels[0], samples, axes, run.spin)
        _draw_folded_field(panels[1], samples, axes)
        _draw_spectrum(panels[2], samples, run.line)
        _draw_series(panels[3], run, samples.time, gid=f"readings-{k}")
        return
    excerpt = _excerpt(source.readings, run.spin)
    if source.readings.pulses:
        _draw_intervals(panels[0], excerpt)
        _draw_phases_of_pulses(panels[1], excerpt, run.spin)
    else:
        _draw_trace(panels[0], excerpt, run.spin)
        _draw_folded(panels[1], excerpt)
    _draw_residuals(panels[2], excerpt, run.spin)
    _draw_series(panels[3], run, excerpt.time, gid=f"readings-{k}")


# --- what is drawn -------------------------------------------------------------------------------------


def turns_of(spin: SpinFrequency, time: Array) -> Array:
    """Return turns at given times [s] since the pulse before the reference time."""
    away = time - spin.reference_time
    values = spin.phase.value, spin.frequency.value, spin.chirp.value
    phase, frequency, chirp = (value or 0.0 for value in values)
    turns: Array = phase + frequency * away + chirp * away**2 / 2 + _bend(spin) * away**3 / 6
    return turns


def _bend(spin: SpinFrequency) -> float:
    """Return the change of the slope [Hz/s²]; 0 where it was said to stay."""
    return (spin.bend.value if spin.bend else None) or 0.0


def _excerpt(records: Records, spin: SpinFrequency) -> _Excerpt:
    """Return the part about the reference time to which the numbers belong."""
    if records.pulses:
        times = records.pulses.times
        times = times[_near(times, spin)]
        turns = turns_of(spin, times)
        late = (turns - np.rint(turns)) / (spin.frequency.value or 1.0)
        return _Excerpt(times, np.zeros(len(times)), turns, "", times, late)
    waveform = min(records.waveforms, key=lambda w: abs(w.start + w.duration / 2 - spin.reference_time))
    first, count = 0, waveform.count
    if waveform.duration > LONGEST_FOLDED_S:
        first, last = waveform.numbers_at(spin.reference_time - 1.0, spin.reference_time + 1.0)
        count = last - first
    channel = records.channel if len(records.waveforms) == 1 else None
    signal = _part(waveform, channel, first, count)
    time = waveform.times_of(first, first + len(signal))
    turns = turns_of(spin, time)
    unit = waveform.signals[waveform.signal(channel)].unit
    at, residuals = _arrivals(time, signal, turns, spin)
    off = _middle(residuals, spin.scatter)  # the fit may put the middle of a pulse at another place of its shape
    turns -= off * (spin.frequency.value or 1.0)
    return _Excerpt(time, signal, turns, unit, at + off, residuals - off)


def _middle(late: Array, scatter: float) -> float:
    """Return the mean of what the pulses' times leave over [s], without those that stand alone."""
    if not len(late):
        return 0.0
    median = float(np.median(late))
    near = np.abs(late - median) <= 6 * max(scatter, float(np.median(np.abs(late - median))))
    return float(late[near].mean())


def _near(times: Array, spin: SpinFrequency) -> NDArray[np.bool_]:
    if times[-1] - times[0] <= LONGEST_FOLDED_S:
        return np.ones(len(times), dtype=bool)
    return np.abs(times - spin.reference_time) <= 1.0


def _part(waveform: Waveform, channel: str | None, first: int, count: int) -> Array:
    """Return samples from one number on, read in blocks."""
    kept: list[Array] = []
    seen = 0
    for block in waveform.blocks(channel):
        low, high = max(first - seen, 0), min(first + count - seen, len(block))
        if high > low:
            kept.append(block[low:high])
        seen += len(block)
        if seen >= first + count:
            break
    return np.concatenate(kept)


def _arrivals(time: Array, signal: Array, turns: Array, spin: SpinFrequency) -> tuple[Array, Array]:
    """Return times of pulses [s] and how far they are from the fit [s]: the centre of what rises out of the noise."""
    base, height = _levels(signal, turns)
    level = (signal - base) / height
    noise = 1.4826 * float(np.nanmedian(np.abs(level)))  # most of a turn is between the pulses
    above = np.clip(level - min(max(4 * noise, 0.1), 0.5), 0.0, 1.0)
    whole = np.rint(turns)
    off = turns - whole
    above[~np.isfinite(above) | (np.abs(off) > 0.25)] = 0.0
    index = (whole - whole.min()).astype(np.intp)
    weight = np.bincount(index, above)
    moment = np.bincount(index, above * off)
    seen = np.flatnonzero(weight > 0.2 * np.median(weight[weight > 0])) if (weight > 0).any() else np.zeros(0, np.intp)
    number = seen + whole.min()
    seen = seen[(number - 0.25 >= turns.min()) & (number + 0.25 <= turns.max())]  # the ends may cut a pulse
    shift = moment[seen] / weight[seen]
    return np.interp(seen + whole.min(), turns, time), shift / (spin.frequency.value or 1.0)


def _levels(signal: Array, turns: Array) -> tuple[float, float]:
    """Return the level between pulses and the height of a pulse, which may be negative."""
    folded = _fold(signal, turns)[1]
    base = float(np.nanmedian(folded))
    k = len(folded) // 2
    middle = folded[k - 3 : k + 4]
    peak = float(np.nanmax(middle)) if np.nanmax(middle) - base > base - np.nanmin(middle) else float(np.nanmin(middle))
    return base, (peak - base) or 1.0


def _fold(signal: Array, turns: Array) -> tuple[Array, Array]:
    """Return the mean signal against the part of a turn, −½ to ½."""
    off = turns - np.rint(turns)
    good = np.isfinite(signal)
    bins = np.clip(((off[good] + 0.5) * BINS).astype(np.intp), 0, BINS - 1)
    count = np.bincount(bins, minlength=BINS)
    total = np.bincount(bins, signal[good], minlength=BINS)
    with np.errstate(invalid="ignore"):
        return (np.arange(BINS) + 0.5) / BINS - 0.5, total / np.where(count, count, np.nan)


# --- the panels ----------------------------------------------------------------------------------------


def _draw_trace(axes: Axes, excerpt: _Excerpt, spin: SpinFrequency) -> None:
    """Draw a few turns about the reference time, and where the fit has the pulses."""
    frequency = spin.frequency.value or 1.0
    half = TURNS_SHOWN / 2 / frequency
    near = np.abs(excerpt.time - spin.reference_time) <= half
    if not near.any():
        near = excerpt.time <= excerpt.time[0] + 2 * half
    axes.plot(excerpt.time[near], excerpt.signal[near], color="black", linewidth=0.8)
    turns = excerpt.turns[near]
    for turn in np.arange(np.ceil(turns.min()), np.floor(turns.max()) + 1):
        at = np.interp(turn, turns, excerpt.time[near])
        axes.axvline(at, linewidth=0.9, zorder=1, **LOOKS["pulses"].as_line)
    axes.set(xlabel="time  [s]", ylabel=f"signal  [{excerpt.unit}]")
    axes.locator_params(axis="x", nbins=6)
    axes.set_title("Trace; dashed: the turns found in it", loc="left")


def _draw_folded(axes: Axes, excerpt: _Excerpt) -> None:
    """Draw all turns over each other."""
    part = slice(None, None, max(len(excerpt.turns) // MOST_POINTS, 1))
    off = excerpt.turns - np.rint(excerpt.turns)
    style: Any = {"marker": ".", "markersize": 2, "linestyle": "none", "color": FIT, "alpha": 0.4, "rasterized": True}
    axes.plot(off[part], excerpt.signal[part], **style)
    phase, mean = _fold(excerpt.signal, excerpt.turns)
    good = np.isfinite(mean)
    axes.plot(phase[good], mean[good], color="black", linewidth=1)
    axes.axvline(0, linewidth=0.9, zorder=1, **LOOKS["pulses"].as_line)
    turns = round(float(np.ptp(excerpt.turns)))
    axes.set(xlabel="part of a turn", ylabel=f"signal  [{excerpt.unit}]", xlim=(-0.5, 0.5))
    axes.set_title(Text("{turns} turns over each other; black: mean", turns=turns), loc="left")


def _draw_field(panel: Axes, samples: LineSamples, axes: Sequence[str], spin: SpinFrequency) -> None:
    """Draw a few turns about the reference time: samples without drift and mains, and the line."""
    half = TURNS_SHOWN / 2 / (spin.frequency.value or 1.0)
    near = np.abs(samples.time - spin.reference_time) <= half
    fine = np.linspace(samples.time[near][0], samples.time[near][-1], 400)
    turns = np.interp(fine, samples.time, samples.turns)
    for k, name in enumerate(axes):
        colour = AXES[k]
        panel.plot(samples.time[near], 1e6 * samples.field[near, k], ".", color=colour, markersize=4, label=name)
        panel.plot(fine, 1e6 * _wave(samples, k, turns), color=colour, linewidth=0.9)
    panel.legend(loc="upper right", ncols=3, fontsize=SMALL, borderaxespad=0, columnspacing=1, handlelength=1)
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + 0.25 * (high - low))
    panel.set(xlabel="time  [s]", ylabel="field  [µT]")
    panel.locator_params(axis="x", nbins=6)
    panel.set_title("Field without drift and mains; the line", loc="left")


def _wave(samples: LineSamples, k: int, turns: Array) -> Array:
    """Return the line in an axis at other turns [T]."""
    angle = 2 * np.pi * samples.turns
    columns = np.column_stack([np.cos(angle), np.sin(angle)])
    cosine, sine = np.linalg.lstsq(columns, samples.line[:, k])[0]
    wave: Array = cosine * np.cos(2 * np.pi * turns) + sine * np.sin(2 * np.pi * turns)
    return wave


def _draw_folded_field(panel: Axes, samples: LineSamples, axes: Sequence[str]) -> None:
    """Draw all turns over each other: means over a part of a turn with their standard errors, and the line."""
    part = samples.turns % 1.0
    bins = np.minimum((part * FOLDED_BINS).astype(np.intp), FOLDED_BINS - 1)
    count = np.maximum(np.bincount(bins, minlength=FOLDED_BINS), 1)
    at, fine = (np.arange(FOLDED_BINS) + 0.5) / FOLDED_BINS, np.linspace(0, 1, 200)
    for k in range(len(axes)):
        values = 1e6 * samples.field[:, k]
        mean = np.bincount(bins, values, minlength=FOLDED_BINS) / count
        error = np.std(values - 1e6 * samples.line[:, k]) / np.sqrt(count)
        panel.errorbar(at, mean, error, color=AXES[k], fmt=".", markersize=3, elinewidth=0.7)
        panel.plot(fine, 1e6 * _wave(samples, k, fine), color=AXES[k], linewidth=0.9)
    turns = round(float(np.ptp(samples.turns)))
    panel.set(xlabel="part of a turn", ylabel="field  [µT]", xlim=(0, 1))
    panel.set_title(Text("{turns} turns over each other: means and line", turns=turns), loc="left")


def _draw_spectrum(panel: Axes, samples: LineSamples, found: FieldSpin) -> None:
    """Draw amplitudes against frequency, and without the line: whether another one is in the way."""
    nyquist = found.rate / 2
    trial = np.arange(1.0, max(nyquist, 1.1 * found.frequency), 0.5 / found.duration)
    turns = samples.turns / found.frequency  # along its slope the line is sharp, and no other one
    wave = np.exp(-2j * np.pi * np.outer(trial, turns)) / samples.time.size
    for field, colour, label in (
        (samples.field, "0.6", "field"),
        (samples.field - samples.line, "black", "without the line"),
    ):
        size = 2e6 * np.sqrt(np.sum(np.abs(wave @ field) ** 2, axis=1))
        panel.plot(trial, size, color=colour, linewidth=0.7, label=label)
    panel.axvline(found.frequency, linewidth=0.9, zorder=1, **LOOKS["pulses"].as_line)
    panel.set(xlabel="frequency  [Hz]", ylabel="amplitude  [µT]", xlim=(0, trial[-1]))
    panel.set_ylim(bottom=0, top=1.3 * panel.get_ylim()[1])
    panel.legend(loc="upper right", ncols=2, fontsize=SMALL, borderaxespad=0, columnspacing=1, handlelength=1.2)
    panel.set_title("Amplitudes; dashed: the spin", loc="left")


def _draw_intervals(axes: Axes, excerpt: _Excerpt) -> None:
    style: Any = {"marker": ".", "markersize": 4, "linestyle": "none", "color": "black"}
    axes.plot(excerpt.time[1:], 1e3 * np.diff(excerpt.time), **style)
    axes.set(xlabel="time  [s]", ylabel="interval  [ms]")
    axes.set_title("Intervals between pulses", loc="left")


def _draw_phases_of_pulses(axes: Axes, excerpt: _Excerpt, spin: SpinFrequency) -> None:
    axes.hist(1e6 * excerpt.residuals, bins=30, color=FIT, alpha=0.6)
    axes.axvline(0, linewidth=1, **LOOKS["pulses"].as_line)
    axes.margins(x=0.08, y=0.12)
    axes.set(xlabel="pulse − fit  [µs]", ylabel="pulses")
    axes.set_title(Text("Scatter of a pulse: {us:n} µs", us=digits(1e6 * spin.scatter, 3)), loc="left")


def _draw_residuals(axes: Axes, excerpt: _Excerpt, spin: SpinFrequency) -> None:
    """Draw what the pulses' times leave over: noise about zero, without a shape."""
    axes.axhline(0, color="black", linewidth=0.6)
    limit = 6 * 1e6 * max(spin.scatter, float(np.median(np.abs(excerpt.residuals))) if len(excerpt.residuals) else 0.0)
    scale, unit = (1e-3, "ms") if limit >= 5e3 else (1.0, "µs")  # five digits would not find room beside the axis
    limit *= scale
    values = 1e6 * scale * excerpt.residuals
    inside = np.abs(values) <= limit
    style: Any = {"linestyle": "none", "color": "black", "markersize": 4}
    axes.plot(excerpt.arrivals[inside], values[inside], marker=".", **style)
    edges = excerpt.arrivals[~inside], np.clip(values[~inside], -limit, limit)
    axes.plot(*edges, marker="x", **style | {"color": LOOKS["left out"].colour}, label="beyond the panel")
    room = 1.1
    if (~inside).any():
        axes.legend(loc="upper right", fontsize=SMALL, borderaxespad=0)
        room = 1.45
    if limit > 0:
        axes.set_ylim(-1.1 * limit, room * limit)
    axes.set(xlabel="time  [s]", ylabel=Text("pulse − fit  [{unit}]", unit=unit))
    axes.set_title("Residuals of the pulses' times", loc="left")


def _draw_series(axes: Axes, run: SpinRun, time: Array, gid: str) -> None:
    """Draw frequency against time: of windows or records, or by the fit of the only one."""
    series, spin = run.series, run.spin
    if len(series) == 1:
        t = np.linspace(float(time[0]), float(time[-1]), 50)
        along = [spin.at(float(x)) for x in t]
        nu = np.array([one.value for one in along], dtype=np.float64)
        u = np.array([one.u if one.u is not None else np.nan for one in along])
        band(axes, t, nu, u, FIT)
        axes.plot(t, nu, **LOOKS["fit"].as_line)
        axes.plot(spin.reference_time, spin.frequency.value or 0.0, markersize=4, **LOOKS["readings"].as_points)
        axes.set_title("Frequency by the fit, ± u", loc="left")
    else:
        axes.errorbar(series.time, series.frequency, series.u, color=READINGS, fmt="none", elinewidth=0.7)
        axes.plot(series.time, series.frequency, ".", color=READINGS, markersize=3, gid=gid)
        for kind, start, end in series.phases:
            if kind in ("coasting", "held", "speeding-up"):
                known = axes.get_legend_handles_labels()[1]
                look, label = LOOKS[kind], None if kind in known else kind
                axes.axvspan(start, end, facecolor=look.colour, alpha=0.15, linewidth=0, label=label, hatch=look.hatch)
        if axes.get_legend_handles_labels()[1]:
            low, high = axes.get_ylim()
            axes.set_ylim(low, high + 0.25 * (high - low))
            axes.legend(loc="upper center", ncols=3, fontsize=SMALL, borderaxespad=0, columnspacing=1, handlelength=1.6)
        title = Text("Frequency of {n} {of}, ± u", n=len(series), of=f"{series.of}s")
        axes.set_title(title, loc="left")
    axes.ticklabel_format(axis="y", useOffset=False)
    axes.set(xlabel="time  [s]", ylabel="spin ν  [Hz]")

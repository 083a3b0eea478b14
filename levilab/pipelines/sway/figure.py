"""Slow swings → their figure."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from levilab.pipelines.sway.analysis import SwayAnalysis
from levilab.present.drawing import SMALL, new_figure, panel, run_look
from levilab.present.looks import LOOKS
from levilab.present.numbers import with_uncertainty
from levilab.present.style import label_of_run
from levilab.texts.text import Text

#: Left edge and width of the panels [inch], and where what explains them begins, in parts of the width.
_LEFT, _WIDTH, _BESIDE = 0.7, 4.05, 1.03
#: The spectrum is drawn to both sides of zero up to this frequency [Hz], from this part of its greatest line on.
_WIDEST_HZ, _LEAST = 1.8, 2e-3


def sway_figure(analysis: SwayAnalysis) -> Figure:
    """Draw the split against the spin with the prediction and the null, and the spectrum of a window."""
    with new_figure(5.6, _finding(analysis), [one.synthetic for one in analysis.sources]) as figure:
        _draw_splits(panel(figure, _LEFT, 0.5, _WIDTH, 2.2), analysis)
        _draw_spectrum(panel(figure, _LEFT, 3.3, _WIDTH, 1.75), analysis)
    return figure


def _finding(analysis: SwayAnalysis) -> str:
    found = analysis.runs[0].geometry
    return Text(
        "The slow swings split by {split:n} at {spin:g} Hz, {ratio:n} of geometric magnetism",
        split=with_uncertainty(found.measured),
        spin=found.spin,
        ratio=with_uncertainty(found.ratio),
    )


def _draw_splits(axes: Axes, analysis: SwayAnalysis) -> None:
    count = len(analysis.runs)
    for k, (source, run) in enumerate(analysis.each):
        found, order = run.geometry, np.argsort(run.spin)
        u = 1e3 * found.u_shares * found.splits / found.shares
        look = run_look(k, count) if count > 1 else LOOKS["readings"]
        axes.errorbar(
            run.spin, 1e3 * found.splits, np.abs(u), capsize=2, gid=f"readings-{k}", zorder=3,
            label=label_of_run(source.name, k, count, "as seen, shift by their\nsize taken away"), **look.as_points,
        )  # fmt: skip
        label = "geometric magnetism by\nthe form of the field" if k == 0 else None
        axes.plot(run.spin[order], 1e3 * found.expected[order], label=label, **LOOKS["theory"].as_line)
    axes.axhline(0, linewidth=1, label="moment of a fixed direction", **LOOKS["locked"].as_line)
    axes.set(xlabel="spin  [Hz]", ylabel="split of the slow swings  [mHz]")
    axes.legend(loc="upper left", bbox_to_anchor=(_BESIDE, 1.0), borderaxespad=0, labelspacing=0.7)


def _draw_spectrum(axes: Axes, analysis: SwayAnalysis) -> None:
    """Draw the amplitudes of the first track's window in the middle; its lines are marked."""
    run, readings = analysis.runs[0], analysis.sources[0].readings
    k = len(run.swings) // 2
    one = run.swings[k]
    half = (run.swings[1].time - run.swings[0].time) / 2 if len(run.swings) > 1 else np.inf
    inside = np.abs(readings.time - one.time) <= half
    t, y = readings.time[inside], readings.y[inside] * (-1 if run.mirrored else 1)
    even = np.linspace(t[0], t[-1], t.size)
    places = np.interp(even, t, readings.x[inside]) + 1j * np.interp(even, t, y)
    window = np.hanning(t.size)
    length = 8 * t.size
    height = 1e3 * np.abs(np.fft.fft((places - places.mean()) * window, length)) / window.sum()
    frequency = np.fft.fftfreq(length, (t[-1] - t[0]) / (t.size - 1))
    shown = np.abs(frequency) < _WIDEST_HZ
    order = np.argsort(frequency[shown])
    x, y = frequency[shown][order], height[shown][order]
    axes.semilogy(x, y, linewidth=1, **LOOKS["path"].as_line)
    axes.set_ylim(max(_LEAST * y.max(), 0.3 * float(np.median(y))), 3 * y.max())
    for f, a in zip(one.frequency[:2].tolist(), one.amplitude[:2].tolist(), strict=True):
        axes.annotate(
            Text("{hz:n} Hz", hz=f"{f:+.3f}".replace("-", "−")), (f, 1e3 * a), xytext=(0, 5),
            textcoords="offset points", ha="center", fontsize=SMALL,
        )  # fmt: skip
    axes.axvline(0, color="black", linewidth=0.6)
    axes.set(xlabel="frequency; negative: against the spin  [Hz]", ylabel="amplitude  [mm]")
    text = Text(
        "spectrum of x + iy around {time:.0f} s,\nat a spin of {spin:.1f} Hz; smaller lines\nbeside the slow swings "
        "belong to\nthe vertical swing, {vertical:.2f} Hz",
        time=one.time,
        spin=run.spin[k],
        vertical=one.vertical.value,
    )
    axes.text(_BESIDE, 1.0, text, transform=axes.transAxes, va="top", fontsize=8)

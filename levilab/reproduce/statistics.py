"""The ten lower limits that the thesis measured: their mean, what their rounding does, and whether they are normal."""

import math
from functools import partial

import numpy as np

from analysis.arrays import Array
from analysis.limits import Sample, compare, summarize
from levilab.present.document.blocks import Picture
from levilab.present.numbers import with_sign
from levilab.reproduce.check import Finding, Found, check, statement
from levilab.reproduce.figure import statistics_figure
from levilab.reproduce.tops import THESIS, known
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.published.printed import several
from levilab.simulator.scene import preset

#: The limits are printed in steps of this [Hz].
STEP_HZ = 0.1


def normality(values: Array) -> tuple[float, float]:
    """Shapiro and Wilk's W of the values, and the probability of a smaller one."""
    from scipy.stats import shapiro

    found = shapiro(values)
    return float(found.statistic), float(found.pvalue)


def _trend(p: float) -> str:
    """Return the verdict of a trend's p-value.

    >>> _trend(0.5), _trend(0.06), _trend(0.04)
    ('no trend', 'a trend is neither shown nor excluded', 'a trend')
    """
    return "a trend" if p < 0.05 else "a trend is neither shown nor excluded" if p < 0.2 else "no trend"


def make() -> Found:
    """Make the chapter."""
    values = np.array([one.value for one in several("thesis", "measured.limits")])
    found = summarize(Sample(values))
    scatter, mean, trend = (known(one) for one in (found.scatter, found.mean, found.trend))
    spread, spread_u, middle, middle_u = (known(one) for one in (scatter.value, scatter.u, mean.value, mean.u))
    trend_p = known(found.trend_p)
    w, p = normality(values)
    step = STEP_HZ / math.sqrt(12)
    edge = compare(found, "edge", known(stability_of(preset("undriven")).floating).spins[0][0])
    above, edge_p = known(edge.difference.value), known(edge.p)
    findings: list[Finding] = [
        check("mean of ten", THESIS["measured.mean"], middle),
        statement(
            "rounding to 0.1 Hz",
            THESIS["measured.limits.0"].place,
            "",
            f"adds {1e3 * step:.0f} mHz to the scatter, "
            f"{100 * (1 - math.sqrt(1 - (step / spread) ** 2)):.1f} % of it, and "
            f"{1e3 * step / math.sqrt(10):.0f} mHz to the mean: nothing to correct",
            holds=step < 0.2 * spread,
        ),
        statement(
            "are the ten normal?",
            THESIS["measured.limits.0"].place,
            "",
            f"Shapiro and Wilk: W = {w:.3f}, p = {p:.2f}; no outlier; {_trend(trend_p)} "
            f"({with_sign(1e3 * known(trend.value), 0)} mHz a top, p = {trend_p:.3f}); ten values leave the "
            f"scatter ± {spread_u:.2f} Hz",
            holds=p > 0.05 and not found.outliers,
        ),
        statement(
            "against the exact edge of small motions",
            THESIS["measured.mean"].place,
            "21.86 Hz measured; 14.005 Hz by its own estimate",
            f"scatter {spread:.2f} Hz, standard error {middle_u:.2f} Hz; "
            f"{with_sign(above, 2)} Hz above the edge at {edge.expected:.2f} Hz (p = {edge_p:.2f}), "
            f"{middle - THESIS['stability.estimate'].value:.1f} Hz above the estimate",
            holds=0 < above < 0.5,
        ),
    ]
    picture = Picture(
        "ten",
        "Ten falls beside what theory and simulation say.",
        "The ten limits in their order; band: the mean with its standard error, dashed: the scatter of one; dotted: "
        "the lower edge of the window of small motions. On the right, the values in order over normal quantiles: on a "
        "line, as normal ones are.",
        "Ten lower limits and their normal quantiles",
        partial(statistics_figure, values, found, edge.expected),
    )
    return Found(
        tuple(findings), (picture,), "The only readings that the thesis prints: ten spins at which a top fell."
    )

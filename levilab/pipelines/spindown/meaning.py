"""What the fits of a spin-down mean, in sentences that a student understands."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from analysis.numbers import digits
from analysis.spindown.drag import LAWS
from levilab.pipelines.spindown.laws import SYMBOLS
from levilab.pipelines.spindown.words import is_seen
from levilab.present.numbers import enumeration, plain, with_uncertainty

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from analysis.uncertainty import Estimate
    from levilab.pipelines.spindown.analysis import SpinDownAnalysis

#: Laws of one power, and the power, in its order.
_POWERS: Mapping[str, float] = MappingProxyType(
    {law.name: n for law in sorted(LAWS.values(), key=lambda one: one.orders) if (n := law.exponent) is not None}
)
#: C₃/₂ of a bare disc as large as the thesis's top in laminar air, without a free parameter (PHYSICS.md §5) [SI].
KARMAN = 2.235e-4
#: Power of the laminar layer of air on a disc.
_LAMINAR = 1.5
#: A difference of so many u is one.
_DIFFERS = 2.0
#: Runs that scatter by so many times what their readings explain differ.
_SCATTERS = 1.5


def meaning(analysis: SpinDownAnalysis) -> tuple[str, ...]:
    """Return the sentences, of all runs together."""
    return tuple(text for part in _PARTS for text in part(analysis))


def _law(analysis: SpinDownAnalysis) -> Iterator[str]:
    verdict = analysis.combined.verdict
    if not verdict.describes:
        yield (
            "No constant below is one of the top: something other than drag moved its spin, or the counter counted "
            "something else."
        )
    elif verdict.decided:
        yield _torque(verdict.best)


def _torque(law: str) -> str:
    """Return what the drag's torque depends on, as a sentence."""
    return f"The torque of the drag is proportional to {LAWS[law].torque}."


def _loss(analysis: SpinDownAnalysis) -> Iterator[str]:
    """Yield how fast the top gets slower, which needs no law."""
    combined = analysis.combined
    if not combined.verdict.describes:
        return
    run = analysis.runs[0]
    fit = run.fit(combined.best)
    if fit.has_tilt:
        return
    reference, duration = fit.reference
    spins = np.array([float(run.frequency[0]), float(run.frequency[-1])])
    loss = LAWS[fit.name].slowing(spins / reference, fit.solution) * reference / duration
    first, last = (
        f"{digits(float(each))} Hz a second at {spin:.3g} Hz" for each, spin in zip(loss, spins, strict=True)
    )
    which = "In the first run the" if len(analysis.runs) > 1 else "The"
    yield f"{which} top loses {first}, and {last}."


def answer(analysis: SpinDownAnalysis) -> str:
    """Return the constants of the best law with their u, as a sentence; empty where no law describes the readings."""
    verdict = analysis.combined.verdict
    known = [
        f"{SYMBOLS[name]} = {with_uncertainty(value)}"
        for name, value in _constants(analysis).items()
        if value.value is not None and value.u
    ]
    if not verdict.describes or not known:
        return ""
    law = f"by the {verdict.best} law" if verdict.decided else f"if the {verdict.best} law holds"
    return f"{enumeration(known)} {law}."


def _constant(analysis: SpinDownAnalysis) -> Iterator[str]:
    """Yield the constants of the best law, and the meaning of that of a law of one power."""
    if not (named := answer(analysis)):
        return
    yield named
    combined = analysis.combined
    if combined.best not in _POWERS:
        return
    ((name, value),) = _constants(analysis).items()
    if value.value is None or not value.u or value.value <= 0:
        return
    n = _POWERS[combined.best]
    if n == 1:
        yield f"The spin halves in {plain(math.log(2) / value.value)} s, whatever it is."
    elif n == _LAMINAR:
        off = value.value / KARMAN - 1
        u = value.u / KARMAN
        way = "above" if off > 0 else "below"
        compared = f"{SYMBOLS[name]} lies {digits(100 * abs(off))} % {way}"
        karman = "von Kármán's value for a bare disc as large as the thesis's top, 2.235×10⁻⁴"
        if abs(off) < _DIFFERS * u:
            yield f"{SYMBOLS[name]} agrees with {karman}."
        elif off > 0:
            yield f"{compared} {karman}: rim, stem and washers drag, too, if this top is as large."
        else:
            yield f"{compared} {karman}: this top is smaller or heavier, if nothing drives it."


def _exponent(analysis: SpinDownAnalysis) -> Iterator[str]:
    """Yield the distance of the exponent from those of the laws of one power."""
    combined = analysis.combined
    power = next((fit for fit in combined.fits if fit.name == "power"), None)
    if power is None or not combined.verdict.describes:
        return
    estimates = power.constants if len(analysis.runs) > 1 else analysis.runs[0].fit("power").parameters
    exponent: Estimate = estimates["exponent"]
    if exponent.value is None or not exponent.u:
        return
    away = {name: abs(exponent.value - n) / exponent.u for name, n in _POWERS.items()}
    near = [f"{name} ({_POWERS[name]:g})" for name, far in away.items() if far < _DIFFERS]
    far = [f"{name} ({_POWERS[name]:g}) by {far:.0f} u" for name, far in away.items() if far >= _DIFFERS]
    agrees = f"agrees with {enumeration(near)}" if near else "agrees with none of the laws of one power"
    misses = f" and misses {enumeration(far)}" if far else ""
    yield f"With a free exponent the readings choose n = {with_uncertainty(exponent)}: that {agrees}{misses}."


def _tilt(analysis: SpinDownAnalysis) -> Iterator[str]:
    tilt = analysis.combined.tilt
    if tilt and tilt.value and is_seen(tilt):
        yield (
            f"The magnet's moment points {digits(math.degrees(tilt.value))}° off the axis of the top: it wobbles with "
            "its spin, more and more towards the fall, and the counter counts a little more than the spin."
        )


def _runs(analysis: SpinDownAnalysis) -> Iterator[str]:
    """Yield the meaning of the scatter between runs."""
    if len(analysis.runs) == 1:
        yield (
            "This is one run. Another one of the same top may differ by more than this u: draught, temperature and "
            "how the top was set spinning are not in it."
        )
        return
    # the constants of a general law trade against each other: their large u would hide that the runs differ
    verdict = analysis.combined.verdict
    law = next((name for name in (*verdict.indistinguishable, *verdict.weak) if name in _POWERS), verdict.best)
    for name, mean in analysis.combined.fit(law).constants.items():
        if name == "exponent" or mean.value is None or mean.scatter is None:
            continue
        scatter: float = mean.scatter
        own = [run.fit(law).parameters[name].u for run in analysis.runs]
        known = [u for u in own if u]
        if len(known) != len(own):
            continue
        ratio = scatter / math.sqrt(sum(u**2 for u in known) / len(known))
        share = f"{digits(100 * scatter / abs(mean.value))} %"
        if ratio > _SCATTERS:
            yield (
                f"From one run to the next {SYMBOLS[name]} differs by {share}, {digits(ratio)} times as much as the "
                "readings of each explain: the runs differ, and the mean is as good as their scatter lets it be."
            )
        else:
            yield f"The {len(own)} runs agree: {SYMBOLS[name]} differs by {share}, no more than their readings explain."


def _constants(analysis: SpinDownAnalysis) -> Mapping[str, Estimate]:
    """Return the constants of the best law: of one run its own, of several their means."""
    combined = analysis.combined
    if len(analysis.runs) > 1:
        return combined.fit(combined.best).constants
    parameters = analysis.runs[0].fit(combined.best).parameters
    return {name: parameters[name] for name in LAWS[combined.best].constants}


_PARTS = (_constant, _law, _loss, _exponent, _tilt, _runs)

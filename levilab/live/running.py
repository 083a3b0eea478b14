"""What the readings so far say: the running fit, from the analyses themselves, at a low rate."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.special import stdtrit

from analysis.arrays import Array
from analysis.errors import AnalysisError, TooFewReadings
from analysis.limits import U_OF_WAY, Sample, summarize
from analysis.precession.sweep import Sweep, fit_sweep
from analysis.spindown.drag import LAWS
from analysis.spindown.fall import times_of_fall
from analysis.spindown.fit import fit_spin_down
from analysis.spindown.lawfit import LawFit
from analysis.spindown.tilt import PARAMETERS as WOBBLE
from analysis.uncertainty import Estimate
from levilab.live.envelope import Groups
from levilab.pipelines.spindown.readings import release_of
from levilab.pipelines.spindown.words import law_name, law_names
from levilab.present.numbers import plain, with_uncertainty
from levilab.runs.events import RunEvent
from levilab.texts.text import Text, text_of

#: Points of a curve.
_POINTS = 400
#: A curve goes on beyond the readings, but for no longer than this many times their duration.
_BEYOND = 4.0
#: Parameters that no law is known by: the start, and what the counter sees of the wobble.
_NOT_OF_THE_LAW = {"start_frequency", *WOBBLE}


@dataclass(frozen=True)
class Curve:
    """A line through the readings.

    Attributes:
        x, y: shape (n,), in SI.
        band: half the width of its 95 % band, shape (n,), empty where it is not known.
        solid_to: beyond this x it is a forecast.
    """

    x: Array
    y: Array
    band: Array = field(default_factory=lambda: np.empty(0))
    solid_to: float = np.inf


@dataclass(frozen=True)
class Running:
    """The running fit.

    Attributes:
        head: the law or the quantity, in a few words, with an equation.
        lines: what was found, each a line of plain text.
        curve: None where none can be drawn yet.
        end_s: between which times the run is expected to end, on its own clock; None where that is not known [s].
        look: name of its colour, that of a law or "fit".
        dashed: what the curve is beyond the readings, where that is not what the head names.
        final: the head once the run has ended, where it is another one then.
    """

    head: str
    lines: tuple[str, ...] = ()
    curve: Curve | None = None
    end_s: tuple[float, float] | None = None
    look: str = "fit"
    dashed: str = ""
    final: str = ""


Columns = dict[str, "Array"]


def fit_so_far(
    experiment: str,
    columns: tuple[str, ...],
    groups: Groups,
    settings: Mapping[str, Any] = MappingProxyType({}),
    *,
    events: Iterable[Mapping[str, Any]] = (),
    ended: bool = False,
) -> Running | None:
    """Fit the readings of a run so far; None for an experiment without a running fit.

    Args:
        experiment: its name.
        columns: names of the readings' channels.
        groups: the readings.
        settings: of the experiment.
        events: of the run.
        ended: whether no reading will come any more: nothing is forecast then.
    """
    method = METHODS.get(experiment)
    if method is None:
        return None
    by_name = {name: groups.mean[k] for k, name in enumerate(columns)}
    try:
        found = method(by_name, groups.size, settings, events)
    except TooFewReadings as error:
        so_far = Text("it begins with {needed} readings; so far {seen}", error.needed, error.seen)
        why = text_of(error) if ended else so_far
        return Running("no fit" if ended else "no fit yet", (why,))
    except (AnalysisError, KeyError) as error:
        missing = Text("there is no column {name}", name=str(error))
        text = text_of(error) if isinstance(error, AnalysisError) else missing
        return Running("no fit" if ended else "no fit yet", (text,))
    return _without_forecast(found) if ended else found


def _without_forecast(found: Running) -> Running:
    """Return the fit of a run that has ended, with a line up to the last reading."""
    curve = found.curve
    if curve is not None and np.isfinite(curve.solid_to):
        x = np.append(curve.x[curve.x < curve.solid_to], curve.solid_to)
        curve = replace(curve, x=x, y=np.interp(x, curve.x, curve.y), solid_to=np.inf)
    return replace(found, head=found.final or found.head, curve=curve, end_s=None, dashed="")


def spin_down(
    columns: Mapping[str, Array],
    size: int,
    _: Mapping[str, Any] = MappingProxyType({}),
    events: Iterable[Mapping[str, Any]] = (),
) -> Running:
    """Fit the drag laws through a spin-down, the best of them drawn on to the fall."""
    time, spin, u = columns["time_s"], columns["spin_frequency_hz"], columns.get("spin_frequency_u_hz")
    used = np.isfinite(spin) & (np.isfinite(u) if u is not None else True)
    time, spin = time[used], spin[used]
    u = None if u is None else u[used] / np.sqrt(size)
    found = fit_spin_down(time, spin, u, release=release_of(events))
    best = found.fit(found.best)
    last, duration = float(time[-1]), float(time[-1] - time[0])
    end = _times_of_fall(best, last, duration)
    x = np.linspace(time[0], end[1] if end else last, _POINTS)
    y = np.where(x <= last, best.spin_frequency(x), best.forecast(x, last))
    constants = [with_uncertainty(value) for name, value in best.parameters.items() if name not in _NOT_OF_THE_LAW]
    others = [name for name in found.verdict.indistinguishable if name != found.best]
    lines = [
        Text("{constants:n}", constants=tuple(constants)),
        Text("as good: {laws}", laws=law_names(others)) if others else "",
        Text("excluded: {laws}", laws=law_names(found.verdict.excluded)) if found.verdict.excluded else "",
    ]
    law = law_name(found.best)
    return Running(
        Text("{law} law, the best so far   {equation}", law=law, equation=LAWS[found.best].equation),
        tuple(filter(None, lines)),
        Curve(x, y, solid_to=last),
        end,
        found.best,
        "dashed: the law alone; the count also sees the wobble" if best.has_tilt and end else "",
        Text("{law} law   {equation}", law=law, equation=LAWS[found.best].equation),
    )


def _times_of_fall(best: LawFit, last: float, duration: float) -> tuple[float, float] | None:
    """Return the times at which a law reaches the spins of a fall; None where the later one is far off [s]."""
    between = times_of_fall(lambda times: best.forecast(times, last), last, last + _BEYOND * duration)
    return between if math.isfinite(between[1]) else None


def locked_line(columns: Mapping[str, Array], size: int, *_: object) -> Running:
    """Fit the line through precession against drive, and the joint test of slope 1 and intercept 0."""
    drive, precession = columns["drive_frequency_hz"], columns["precession_frequency_hz"]
    u = columns.get("precession_frequency_u_hz")
    used = np.isfinite(drive) & np.isfinite(precession) & (np.isfinite(u) if u is not None else True)
    fit = fit_sweep(Sweep(drive[used], precession[used], None if u is None else u[used] / np.sqrt(size)))
    line = fit.line
    x = np.linspace(drive[used].min(), drive[used].max(), _POINTS)
    b, a = _value(line.slope, line.u_slope), _value(line.intercept, line.u_intercept, "Hz")
    p = "" if fit.p_locked is None else Text("p = {p:n} for b = 1, a = 0", p=plain(fit.p_locked, 2))
    return Running(
        "line so far   ν_p = a + b ν_d",
        (Text("b = {b:n}, a = {a:n}", b=b, a=a), p, "preliminary: “Analyze” takes the u of all gates together"),
        Curve(x, line.at(x), np.nan_to_num(line.confidence_band(x))),
        final="line   ν_p = a + b ν_d",
    )


def mean_limit(
    columns: Mapping[str, Array], size: int, settings: Mapping[str, Any], events: Iterable[Mapping[str, Any]]
) -> Running:
    """Return the mean of the limits so far, or of tops that all level off, with the u of `levilab analyze limit`."""
    spin, time, u = columns["spin_frequency_hz"], columns["time_s"], columns.get("spin_frequency_u_hz")
    levelled_off = [event["top"] for event in events if event["kind"] == RunEvent.LEVELS_OFF]
    levels = np.isin(np.arange(1, spin.size + 1), levelled_off)
    used = np.isfinite(spin) & (np.isfinite(u) if u is not None else True) & (~levels | levels.all())
    spin, time = spin[used], time[used]
    if not len(spin):
        return Running("no limit yet")
    sample, note = Sample(spin), ""
    if u is not None:
        stepped = settings.get("which") == "upper" and settings.get("drive") != "triggered"
        sample = (Sample.within_steps if stepped else Sample)(spin, u[used] / np.sqrt(size))
    if levels.all():
        sample = replace(sample, common=U_OF_WAY * (spin - columns["spin_seen_hz"][used]))
        note = "the drive pulls no further: no limits of the top"
    elif levels.any():
        note = Text("without {some} of {all} tops that only got no faster", some=int(levels.sum()), all=levels.size)
    found = summarize(sample)
    students = float(stdtrit(np.inf if found.freedom is None else found.freedom, 0.975))
    band = np.empty(0) if found.mean.u is None else np.full(2, students * found.mean.u)
    curve = Curve(np.array([time[0], time[-1]]), np.full(2, found.mean.value), band)
    mean = Text("{mean:n}", mean=with_uncertainty(found.mean))
    return Running("mean so far", tuple(filter(None, (mean, note))), curve, final="mean")


def _value(value: float, u: float | None, unit: str = "") -> str:
    return with_uncertainty(Estimate(value, u, unit))


METHODS: dict[str, Callable[[Mapping[str, Array], int, Mapping[str, Any], Iterable[Mapping[str, Any]]], Running]] = {
    "spin": spin_down,
    "precession": locked_line,
    "limit": mean_limit,
}

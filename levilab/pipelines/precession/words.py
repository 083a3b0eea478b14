"""Quantities of a sweep, the sentences that it says, and remarks on its numbers."""

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

from analysis.numbers import digits
from analysis.precession.miscounts import Miscount
from analysis.precession.power import Power
from analysis.precession.sweep import EXCLUDED_P, RATIOS_OF_UNITS, Point, SweepFit
from analysis.uncertainty import Estimate
from levilab.pipelines.note import FEW_LEFT, Weighed, note_of
from levilab.pipelines.row import Quantity, columns_of, entry, statistic
from levilab.present.numbers import plain, pulses_too_many, with_uncertainty
from levilab.texts.text import Sentences, Text


def slope_of(fit: SweepFit) -> Estimate:
    """Return the slope."""
    return Estimate(fit.line.slope, fit.line.u_slope, "1")


def intercept_of(fit: SweepFit) -> Estimate:
    """Return the intercept."""
    return Estimate(fit.line.intercept, fit.line.u_intercept, "Hz")


def verdict(fit: SweepFit) -> str:
    """Return what a sweep says, in a few sentences."""
    slope, intercept = with_uncertainty(slope_of(fit)), with_uncertainty(intercept_of(fit))
    line = Text("Slope {slope:n}, intercept {intercept:n}.", slope=slope, intercept=intercept)
    return Sentences(_about_lock(fit), line, _about_power(fit.power) if fit.power else "")


def _about_lock(fit: SweepFit) -> str:
    p = fit.p_locked
    if p is None:
        return "Whether the top was locked to the drive cannot be tested without the u of the points."
    if p >= EXCLUDED_P:
        return Text(
            "The stem goes round once for each turn of the drive: slope 1 and intercept 0 agree with the {n} points "
            "(p = {p:n}).",
            n=fit.line.n, p=plain(p, 2),
        )  # fmt: skip
    return Text(
        "The stem does not go round once for each turn of the drive: slope 1 and intercept 0 are excluded (p = {p:n}), "
        "and the precession that was counted lies {off:n} Hz {side} the drive at {drive:.4g} Hz.",
        plain(p, 1), digits(abs(_offset(fit))), "above" if _offset(fit) > 0 else "below", fit.line.centre,
    )  # fmt: skip


def _offset(fit: SweepFit) -> float:
    return fit.line.height - fit.line.centre


def _about_power(power: Power) -> str:
    if power.enough:
        said = "A slope of {slope:g} would have shown with a probability of {p:n}."
        return Text(said, slope=power.slope, p=at_most(power.now))
    points = "more than a million" if power.points_needed is None else str(power.points_needed)
    return Text(
        "These points would distinguish a slope of {slope:g} from 1 in {percent:.0f} % of cases only. It takes "
        "{points} points such as these ({now} now), a range of {range:n} Hz ({range_now:n} Hz now), or a u of {u:n} Hz "
        "a point ({u_now:n} Hz now), for nine cases of ten.",
        slope=power.slope, percent=100 * power.now, points=points, now=power.points,
        range=plain(power.range_needed_hz, 2), range_now=plain(power.range_hz, 2), u=plain(power.u_needed_hz, 2),
        u_now=plain(power.u_hz, 2),
    )  # fmt: skip


def at_most(probability: float) -> str:
    """Return a probability, never shown as certainty."""
    return "more than 0.999" if probability > 0.999 else f"{math.floor(1000 * probability) / 1000:.3f}"


# --- remarks -------------------------------------------------------------------------------------------


def miscount_as_text(of: Miscount) -> str:
    """Return a miscount as text."""
    if of.times is not None:
        above, below = of.times
        simple = {(1, 2): "half the frequency was counted", (2, 1): "twice the frequency was counted"}
        part = Text("{above}/{below} of the frequency was counted", above=above, below=below)
        return simple.get(of.times, part)
    if of.counts is not None:
        return Text("{pulses} in each gate", pulses=pulses_too_many(of.counts))
    return "far off the line, and no miscount explains it"


def remarks_of(fit: SweepFit) -> tuple[str, ...]:
    """Return the remarks on a sweep as sentences, without their full stops."""
    return tuple(note_of(of, _REMARKS, fit.points, *of.values) for of in fit.remarks)


def _miscount(points: tuple[Point, ...], k: float, gates_known: float = 1.0) -> str:
    point = points[int(k)]
    assert point.miscount is not None
    gate = "" if gates_known else "; whether whole pulses are missing only the counter's gate could say"
    end = (
        ("" if point.used else ", left out of the line") if point.miscount.named else Text("{gate} (it stays in)", gate)
    )
    return Text(
        "point {number:.0f}, {hz:.5g} Hz at a drive of {drive:.5g} Hz: {what}{end}",
        number=k + 1, hz=point.precession, drive=point.drive, what=miscount_as_text(point.miscount), end=end,
    )  # fmt: skip


def _point(points: tuple[Point, ...], k: float) -> str:
    return Text("point {number:.0f}, at {drive:.5g} Hz", number=k + 1, drive=points[int(k)].drive)


#: What makes the precession each multiple of the drive.
_OF_RATIOS = (
    "two pulses a turn were counted",
    "every second pulse was counted",
    "three pulses a turn were counted",
    "the precession is in 1/min",
    "the drive is in 1/min",
    "the precession is in rad/s",
    "the drive is in rad/s",
)
_CAUSES = dict(zip(RATIOS_OF_UNITS, _OF_RATIOS, strict=True))


_REMARKS: Mapping[str, str | Callable[..., str] | Weighed] = MappingProxyType(
    {
        "many miscounts": Weighed(
            "{named:.0f} of {n:.0f} points look like miscounts: too many to leave out, so the line goes "
            "through all of them; look at the laser's signal and the trigger level",
            "doubt",
        ),
        "miscount": _miscount,
        "unexplained": _miscount,
        "sweep scatters": (
            "the points scatter {times:n} times as much as their u says (p = {p:n}): all uncertainties "
            "are enlarged by that"
        ),
        "sweep overstated": Weighed(
            "the points scatter much less than their u says (χ² of {chi:n} for {freedom:.0f} degrees of "
            "freedom): their u is too large, and so is that of the line; gates in a row scatter more "
            "than their mean, for a locked top swings about its drive and comes back",
            "advice",
        ),
        "sweep exact": "the points lie on the line to the last digit: without their u nothing can be tested; give it",
        "few left": FEW_LEFT,
        "moves the slope": lambda points, k, change, share: Text(
            "{point}, alone moves the slope by {change:n}, {share:.1f} of its u",
            point=_point(points, k),
            change=digits(change),
            share=share,
        ),
        "holds the line": lambda points, k, leverage: Text(
            "{point}, holds the line nearly by itself (leverage {leverage:.2f}): measure more points near it",
            point=_point(points, k),
            leverage=leverage,
        ),
        "uncertain drive": (
            "u of the drive's frequency is up to {times:n} u of the precession: let it count with `orthogonal` = True"
        ),
        "uncertain clock": (
            "u of the drive's frequency is {share:n} of it at all points, as that of a clock: the slope "
            "is uncertain by {slope:n} beside its u of {u:n}"
        ),
        "drive u unknown": "u of the drive's frequency is not known and taken as large as that of the precession",
        "ratio": Weighed(
            lambda _, ratio: Text(
                "the precession is {times:.3g} times the drive: {cause}", times=ratio, cause=_CAUSES[ratio]
            ),
            "doubt",
        ),
        "spins off": Weighed(
            lambda _, n, points, most: Text(
                "the spin of {n:.0f} of {points:.0f} points lies up to {hz:n} Hz farther off the drive than the "
                "others: the top was not locked there; leave them out",
                n=n,
                points=points,
                hz=digits(most, 3),
            ),
            "doubt",
        ),
        "spin off": Weighed(
            lambda _, off: Text(
                "the spin that was counted lies {hz:n} Hz {way} the drive: a locked top spins with it; is "
                "the tape on a loose washer, or was the top not locked?",
                hz=digits(abs(off), 3),
                way="below" if off < 0 else "above",
            ),
            "doubt",
        ),
        "slopes differ": (
            "the slopes of the {n:.0f} runs differ by more than their u says (p = {p:n}): the line "
            "through all points has too small a u; look at the runs one by one"
        ),
    }
)

#: Of `analysis.precession.sweep.SweepFit`.
QUANTITIES = (
    Quantity("slope", "1", "slope of precession against drive", of=slope_of),
    Quantity("intercept", "Hz", "intercept of precession against drive", of=intercept_of),
    Quantity("p_locked", "1", "joint test of slope 1 and intercept 0", has_u=False),
    Quantity("robust_slope", "1", "slope of the median line", of="robust.slope"),
    Quantity("robust_intercept", "Hz", "intercept of the median line", of="robust.intercept"),
    Quantity("spin_offset", "Hz", "spin less the frequency of the drive", u="u_spin_offset", optional=True),
    Quantity("power", "1", "probability with which these points distinguish a slope of 1.05 from 1",
             of="power.now", has_u=False, optional=True),
    Quantity("smallest_slope_difference", "1", "difference of slopes that they show in nine cases of ten",
             of="power.smallest_difference", has_u=False, optional=True),
    Quantity("points_needed", "1", "points that a slope of 1.05 takes", of="power.points_needed", has_u=False,
             optional=True),
    Quantity("range_needed", "Hz", "range of the drive that it takes", of="power.range_needed_hz", has_u=False,
             optional=True),
    Quantity("u_needed", "Hz", "uncertainty of a point that it takes", of="power.u_needed_hz", has_u=False,
             optional=True),
)  # fmt: skip

PRECESSION_ROW = (
    statistic("n", "1", "points that were used", "points", kind="count"),
    *columns_of(QUANTITIES),
    statistic("reduced_chi_square", "1", "χ² per degree of freedom of the line"),
    statistic("rms_residual", "Hz", "root mean square of the residuals of the line"),
    entry("verdict", "text", "what the points say"),
)

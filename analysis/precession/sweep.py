"""A sweep of the drive's frequency: does the laser count the drive's frequency itself?

A top that is locked to its drive wobbles at the drive's frequency, and its stem cuts the laser's beam once in each
period: ν_p = ν_d, slope 1, intercept 0.  The two are tested jointly.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.checks import check_finite, check_positive
from analysis.errors import ShapesDiffer
from analysis.precession.gates import Gates
from analysis.precession.line import FEWEST, NO_FIT, Line, fit_line, fit_orthogonal, influence
from analysis.precession.miscounts import MAD, Miscount, Robust, find_miscounts, robust_line
from analysis.precession.power import Power, power_of
from analysis.remarks import Remark
from analysis.uncertainty import FEW_LEFT, student

#: A joint test below this excludes slope 1 and intercept 0.
EXCLUDED_P = 0.01
#: Precession over drive where pulses are counted twice or every second one, or a unit is 1/min or rad/s: within 2 %.
RATIOS_OF_UNITS, _NEAR_RATIO = (2.0, 0.5, 3.0, 60.0, 1 / 60, 2 * math.pi, 1 / (2 * math.pi)), 0.02
#: A point deserves a warning above this studentised residual, or this leverage in units of the mean one.
_FAR, _HEAVY = 3.5, 3.0
#: Least ratio of the drive's u to the precession's u that matters.
_MATTERS = 0.3
#: Relative uncertainties of the drive's frequency that differ by less than this are those of one clock.
_ONE_CLOCK = 1e-3
#: A spin that differs from the drive's frequency by this number of u, and by this share, deserves a warning.
_SPIN_FAR, _SPIN_SHARE = 5.0, 1e-3


@dataclass(frozen=True)
class Point:
    """A point of the sweep.

    Attributes:
        drive, precession: [Hz].
        u: of the precession, as the fit uses it [Hz]; None: all weigh alike.
        u_drive: [Hz]; None: not known.
        spin, u_spin: [Hz], where they were measured.
        leverage, residual, studentised, slope_change, intercept_change: see `analysis.precession.line.Influence`; None
            for a point that is left out, and if undefined.  A point that is left out has a residual, too.
        miscount: a count of something else than the precession, as it seems; None: the point is sound.
        used: whether the line goes through it.
    """

    drive: float
    precession: float
    u: float | None
    u_drive: float | None
    spin: float | None
    u_spin: float | None
    leverage: float | None
    residual: float
    studentised: float | None
    slope_change: float | None
    intercept_change: float | None
    miscount: Miscount | None
    used: bool


@dataclass(frozen=True)
class SweepFit:
    """The line through a sweep, and its test.

    Attributes:
        line: the weighted or the orthogonal one.
        robust: the median line through all points, miscounts included.
        p_locked: probability that a locked top shows such a departure from slope 1, intercept 0, or a larger one.
        power: what the test needs to distinguish a slope of 1.05 from 1.
        points: in the order given.
        spin_offset, u_spin_offset: mean of spin − drive [Hz], where the spin was measured.
        remarks: what to know before using the numbers.
    """

    line: Line
    robust: Robust
    p_locked: float | None
    power: Power | None
    points: tuple[Point, ...]
    spin_offset: float | None
    u_spin_offset: float | None
    remarks: tuple[Remark, ...]

    @property
    def locked(self) -> bool | None:
        """Whether the points agree with a locked top; None if they leave it open."""
        return None if self.p_locked is None else self.p_locked >= EXCLUDED_P

    def column(self, name: str) -> Array:
        """Return one attribute of all points, NaN where a point has none, shape (n,)."""
        return np.array([math.nan if (v := getattr(p, name)) is None else v for p in self.points], dtype=np.float64)


@dataclass(frozen=True)
class Sweep:
    """The measured points, shape (n,) each [Hz]; u and the spin are None if they are not known.

    Attributes:
        gate_s: of the counter [s].
        gates: of the laser behind each point, where they are known.
    """

    drive: Array
    precession: Array
    u: Array | None = None
    u_drive: Array | None = None
    spin: Array | None = None
    u_spin: Array | None = None
    gate_s: float | None = None
    gates: tuple[Gates, ...] | None = None


def fit_sweep(sweep: Sweep, *, orthogonal: bool = False, keep_miscounts: bool = False) -> SweepFit:
    """Fit a line to a sweep, and test slope 1 and intercept 0.

    Args:
        sweep: the points.
        orthogonal: use the uncertainties of the drive's frequency, too; if they are not known, they are taken as large
            as those of the precession.
        keep_miscounts: keep points whose miscount has a name.

    Raises:
        TooFewReadings: fewer than three points.
        NoRange: all points are at one drive frequency.
        ShapesDiffer, NotFinite, NotPositive: the arrays are no sweep.
    """
    _check(sweep)
    fit_line(sweep.drive, sweep.precession)  # raises if no line goes through the points
    robust = robust_line(sweep.drive, sweep.precession)
    found = find_miscounts(sweep.drive, sweep.precession, sweep.u, robust, gate_s=sweep.gate_s, gates=sweep.gates)
    used, remarks = _used_points(sweep, found, keep=keep_miscounts)
    chosen = _part(sweep, used)
    line = _fit(chosen, orthogonal=orthogonal)
    spin_offset, u_spin_offset = _spin_offset(chosen)
    u = _weight(chosen, line) ** -0.5  # of the points, as the fit uses them [Hz]
    fit = SweepFit(
        line=line,
        robust=robust,
        p_locked=line.p_against(),
        power=power_of(line, float(np.ptp(chosen.drive)), line.scale * float(np.median(u))),
        points=_points(sweep, used, found, line),
        spin_offset=spin_offset,
        u_spin_offset=u_spin_offset,
        remarks=(),
    )
    return replace(fit, remarks=(*remarks, *_doubts(fit, chosen, found)))


# --- the points ---


def _check(sweep: Sweep) -> None:
    columns = {
        "the drive frequency": sweep.drive,
        "the precession frequency": sweep.precession,
        "u of the precession": sweep.u,
        "u of the drive": sweep.u_drive,
        "the spin": sweep.spin,
        "u of the spin": sweep.u_spin,
    }
    for quantity, values in columns.items():
        if values is None:
            continue
        if values.shape != sweep.drive.shape or values.ndim != 1:
            raise ShapesDiffer(quantity=quantity, seen=values.shape, expected=sweep.drive.shape)
        check_finite(quantity, values)
        check_positive(quantity, values)


def _used_points(sweep: Sweep, found: list[Miscount], *, keep: bool) -> tuple[NDArray[np.bool_], list[Remark]]:
    """Return which points the line uses, all but those whose miscount has a name; and remarks."""
    used = np.ones(sweep.drive.size, dtype=np.bool_)
    named = [one.index for one in found if one.named]
    if keep or not named:
        return used, []
    used[named] = False
    if used.sum() >= max(FEWEST, sweep.drive.size / 2) and np.ptp(sweep.drive[used]) > 0:
        return used, []
    return np.ones_like(used), [Remark("many miscounts", values=(len(named), sweep.drive.size))]


def _part(sweep: Sweep, used: NDArray[np.bool_]) -> Sweep:
    def part(values: Array | None) -> Array | None:
        return None if values is None else values[used]

    return Sweep(
        sweep.drive[used],
        sweep.precession[used],
        part(sweep.u),
        part(sweep.u_drive),
        part(sweep.spin),
        part(sweep.u_spin),
        sweep.gate_s,
    )


# --- the line ---


def _fit(sweep: Sweep, *, orthogonal: bool) -> Line:
    if not orthogonal:
        return fit_line(sweep.drive, sweep.precession, sweep.u)
    u = np.ones_like(sweep.drive) if sweep.u is None else sweep.u
    u_drive = u if sweep.u_drive is None or sweep.u is None else sweep.u_drive
    return fit_orthogonal(sweep.drive, sweep.precession, u_drive, u, known=sweep.u is not None)


def _weight(sweep: Sweep, line: Line) -> Array:
    """Return 1/u² of each point in the fit, shape (n,)."""
    u = np.ones_like(sweep.drive) if sweep.u is None else sweep.u
    if not line.orthogonal:
        return np.asarray(u**-2.0)
    u_drive = u if sweep.u_drive is None or sweep.u is None else sweep.u_drive
    return np.asarray(1 / (u**2 + line.slope**2 * u_drive**2))


def _points(sweep: Sweep, used: NDArray[np.bool_], found: list[Miscount], line: Line) -> tuple[Point, ...]:
    chosen = _part(sweep, used)
    effects = influence(chosen.drive, chosen.precession, line, _weight(chosen, line))
    place = np.cumsum(used) - 1
    miscounts = {one.index: one for one in found}
    left = sweep.precession - line.at(sweep.drive)

    def at(values: Array | None, i: int) -> float | None:
        return None if values is None or not np.isfinite(values[i]) else float(values[i])

    def of_used(values: Array, i: int) -> float | None:
        return at(values, int(place[i])) if used[i] else None

    return tuple(
        Point(
            drive=float(sweep.drive[i]),
            precession=float(sweep.precession[i]),
            u=at(sweep.u, i),
            u_drive=at(sweep.u_drive, i),
            spin=at(sweep.spin, i),
            u_spin=at(sweep.u_spin, i),
            leverage=of_used(effects.leverage, i),
            residual=float(left[i]),
            studentised=of_used(effects.studentised, i),
            slope_change=of_used(effects.slope_change, i),
            intercept_change=of_used(effects.intercept_change, i),
            miscount=miscounts.get(i),
            used=bool(used[i]),
        )
        for i in range(sweep.drive.size)
    )


def _spin_offset(sweep: Sweep) -> tuple[float | None, float | None]:
    """Return the mean of spin − drive, weighted if u is known, and its u: from the scatter or the u, the larger one."""
    if sweep.spin is None:
        return None, None
    off = sweep.spin - sweep.drive
    weight = np.ones_like(off) if sweep.u_spin is None else sweep.u_spin**-2.0
    mean = float(np.sum(weight * off) / np.sum(weight))
    scatter = math.sqrt(float(np.sum(weight * (off - mean) ** 2)) / (off.size - 1) / float(np.sum(weight)))
    own = 0.0 if sweep.u_spin is None else float(np.sum(weight)) ** -0.5
    return mean, max(scatter, own)


# --- remarks ---


def _doubts(fit: SweepFit, sweep: Sweep, found: list[Miscount]) -> list[Remark]:
    gates_known = float(bool(sweep.gate_s or sweep.gates))
    said = [
        Remark("miscount", values=(one.index,)) if one.named else Remark("unexplained", values=(one.index, gates_known))
        for one in found
    ]
    line = fit.line
    if line.p_fit is not None and line.p_fit < NO_FIT:
        said.append(Remark("sweep scatters", values=(line.scale, line.p_fit)))
    if line.chi_square is not None and line.p_fit is not None and 1 - line.p_fit < NO_FIT:
        said.append(Remark("sweep overstated", values=(line.chi_square, line.degrees_of_freedom)))
    if fit.p_locked is None:
        said.append(Remark("sweep exact"))
    elif sweep.u is None and line.freedom <= FEW_LEFT:
        said.append(Remark("few left", values=(line.n, student(line.freedom))))
    said += [
        Remark("moves the slope", values=(k, change, share))
        for k, p in enumerate(fit.points)
        if p.slope_change is not None
        and line.u_slope
        and (share := (change := abs(p.slope_change)) / line.u_slope) > _FAR
    ]
    heavy = max(_HEAVY * 2 / line.n, 0.9)
    said += [
        Remark("holds the line", values=(k, p.leverage))
        for k, p in enumerate(fit.points)
        if p.leverage is not None and p.leverage > heavy
    ]
    if not line.orthogonal and sweep.u is not None and sweep.u_drive is not None:
        said += _about_drive(sweep.drive, sweep.u_drive, sweep.u, line)
    if line.orthogonal and (sweep.u is None or sweep.u_drive is None):
        said.append(Remark("drive u unknown"))
    return [*said, *_about_ratio(sweep, line.slope), *_about_spins(fit, sweep)]


def _about_ratio(sweep: Sweep, slope: float) -> list[Remark]:
    """Return a remark where the precession is a multiple of the drive by a count or a unit, in slope and in size."""
    times = float(sweep.precession.mean() / sweep.drive.mean())
    near = (one for one in RATIOS_OF_UNITS if max(abs(slope / one - 1), abs(times / one - 1)) < _NEAR_RATIO)
    return [Remark("ratio", values=(ratio,)) for ratio in near]


def _about_spins(fit: SweepFit, sweep: Sweep) -> list[Remark]:
    """Return remarks where the spin lies off the drive: at some points more than at most, or in the mean."""
    said, mean, u = list[Remark](), fit.spin_offset, fit.u_spin_offset
    if sweep.spin is None or mean is None or u is None:
        return said
    off = sweep.spin - sweep.drive
    away = np.abs(off - np.median(off))
    scatter = MAD * float(np.median(away))  # of few points it is known badly
    far = away > np.maximum(_SPIN_SHARE * sweep.drive, student(off.size - 1, _SPIN_FAR) * scatter)
    if far.any():
        said.append(Remark("spins off", values=(int(far.sum()), off.size, float(away[far].max()))))
    if abs(mean) >= max(_SPIN_SHARE * sweep.drive.mean(), _SPIN_FAR * u):
        said.append(Remark("spin off", values=(mean,)))
    return said


def _about_drive(drive: Array, u_drive: Array, u: Array, line: Line) -> list[Remark]:
    """Return a remark if u of the drive's frequency matters.

    A relative u that is the same at all points is that of a clock.  It scales all frequencies by one factor, which
    changes the slope and moves no point off the line, so it needs no other regression.
    """
    share = float(np.median(u_drive / drive))
    if np.ptp(u_drive / drive) > _ONE_CLOCK * share:
        worst = float(np.max(u_drive / u))
        return [Remark("uncertain drive", values=(worst,))] if worst > _MATTERS else []
    of_slope = share * abs(line.slope)
    if line.u_slope is None or of_slope <= _MATTERS * line.u_slope:
        return []
    return [Remark("uncertain clock", values=(share, of_slope, line.u_slope))]

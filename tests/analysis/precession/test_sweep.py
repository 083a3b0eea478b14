"""The sweep: miscounts, what it takes to tell a slope, warnings."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy import stats

from analysis.errors import NotPositive, ShapesDiffer
from analysis.precession.gates import Gates
from analysis.precession.line import fit_line
from analysis.precession.miscounts import Miscount, robust_line
from analysis.precession.power import power_of
from analysis.precession.sweep import Sweep, fit_sweep
from analysis.remarks import Remark

DRIVE = np.arange(26.0, 46.0, 2.0)
NOISE = 0.02


def counted(seed=0, **wrong):
    """What the laser counts at DRIVE.  wrong: p3=0.5 multiplies point 3, n5=1 adds 1 Hz to point 5."""
    precession = DRIVE + NOISE * np.random.default_rng(seed).standard_normal(DRIVE.size)
    for name, value in wrong.items():
        i = int(name[1:])
        precession[i] = precession[i] * value if name[0] == "p" else precession[i] + value
    return precession


def sweep(precession, **known):
    return Sweep(DRIVE, precession, np.full(DRIVE.size, NOISE), **known)


# --- miscounts ---


def test_the_median_line_has_the_median_of_all_slopes():
    precession = counted(p2=0.5)
    slopes = [(precession[j] - precession[i]) / (DRIVE[j] - DRIVE[i]) for i, j in combinations(range(DRIVE.size), 2)]
    robust = robust_line(DRIVE, precession)
    assert robust.slope.value == pytest.approx(np.median(slopes), rel=1e-12)
    assert robust.intercept.value == pytest.approx(np.median(precession - np.median(slopes) * DRIVE), rel=1e-9)
    interval = stats.theilslopes(precession, DRIVE, alpha=0.6827)
    assert robust.slope.interval == (pytest.approx(interval.low_slope), pytest.approx(interval.high_slope))


@pytest.mark.parametrize(
    ("wrong", "miscount"),
    [
        ({"p3": 0.5}, Miscount(3, (1, 2))),
        ({"p3": 2.0}, Miscount(3, (2, 1))),
        ({"n3": 1.0}, Miscount(3, counts=2)),
        ({"n3": -0.5}, Miscount(3, counts=-1)),
    ],
)
def test_a_miscount_is_named_and_the_line_goes_on_without_it(wrong, miscount):
    fit = fit_sweep(sweep(counted(**wrong), gate_s=2.0))
    others = np.arange(DRIVE.size) != 3
    assert fit.points[3].miscount == miscount
    assert [point.used for point in fit.points] == others.tolist()
    assert Remark("miscount", values=(3,)) in fit.remarks
    assert fit.line == fit_line(DRIVE[others], counted()[others], np.full(9, NOISE))
    kept = fit_sweep(sweep(counted(**wrong), gate_s=2.0), keep_miscounts=True)
    assert kept.line.n == DRIVE.size


def test_a_point_that_no_miscount_explains_stays_in_the_line():
    fit = fit_sweep(sweep(counted(n3=0.3), gate_s=2.0))
    assert fit.points[3].used
    assert fit.remarks[0] == Remark("unexplained", values=(3, 1))
    assert fit.line.scale > 2  # and says that the points scatter more than their u


def test_noise_alone_is_no_miscount():
    fits = [fit_sweep(sweep(counted(seed), gate_s=2.0)) for seed in range(100)]
    assert all(point.used for fit in fits for point in fit.points)


@pytest.mark.parametrize("n", [3, 5, 9])
def test_a_few_points_without_u_are_seldom_off_their_line_by_chance(n):
    drive, random = np.linspace(44, 28, n), np.random.default_rng(n)
    fits = [fit_sweep(Sweep(drive, drive + NOISE * random.standard_normal(n))) for _ in range(50)]
    kinds = [{of.kind for of in fit.remarks} for fit in fits]
    assert sum("unexplained" in said for said in kinds) <= 3  # 1 % each; by five standard deviations 50, 14, 5
    assert all(("few left" in said) == (n == 3) for said in kinds)


@pytest.mark.parametrize("ratio", [2.0, 0.5, 60.0, 2 * np.pi])
def test_a_precession_that_is_a_multiple_of_the_drive_by_count_or_unit_is_named(ratio):
    drive, noise = np.arange(44.0, 26, -2), np.random.default_rng(1).standard_normal(9)
    said = fit_sweep(Sweep(drive, ratio * (drive + 0.02 * noise))).remarks
    assert [one.values for one in said if one.kind == "ratio"] == [(ratio,)]


@pytest.mark.parametrize(("lost", "said"), [(0, []), (2, [2])])
def test_points_whose_spin_is_off_the_drive_are_named(lost, said):
    drive, random = np.arange(44.0, 26, -2), np.random.default_rng(2)
    spin = drive + 1e-3 * random.standard_normal(9)
    spin[9 - lost :] += 1.5
    found = fit_sweep(Sweep(drive, spin + 0.02 * random.standard_normal(9), spin=spin)).remarks
    assert [one.values[0] for one in found if one.kind == "spins off"] == said


def test_a_rounded_point_a_step_beside_the_line_is_no_miscount():
    drive = np.arange(44.0, 26, -2)
    counted = drive - 0.1 * (drive == 42)  # in steps of 0.1 Hz the others lie on the line
    assert all(point.miscount is None for point in fit_sweep(Sweep(drive, counted)).points)


def test_counts_that_are_mostly_alike_have_a_line():
    drive = np.array([30.0, 30.0, 30.0, 36.0, 30.0])
    exact = fit_sweep(Sweep(drive, drive))
    assert exact.line.slope == pytest.approx(1)
    assert exact.p_locked is None
    assert exact.remarks[-1] == Remark("sweep exact")
    many = np.append(np.full(2000, 30.0), [36.0, 37.0])
    assert robust_line(many, many).slope.value == pytest.approx(1)


# --- power ---


@pytest.mark.parametrize(("freedom", "off"), [(4, 0.06), (8, 0.04), (20, 0.02)])
def test_the_power_is_nearly_that_of_the_noncentral_t_distribution(freedom, off):
    limit = stats.t(freedom).ppf(0.975)
    for shift in (1.0, 3.0, 5.0):
        line = replace(fit_line(DRIVE, counted(), np.full(10, NOISE)), freedom=freedom, u_slope=0.05 / shift)
        expected = stats.nct(freedom, shift).sf(limit)
        assert power_of(line, 10.0, NOISE).now == pytest.approx(expected, abs=off)


@pytest.mark.parametrize("known", [True, False])
def test_the_power_needed_detects_a_slope_of_105_nine_times_in_ten(known):
    drive = np.linspace(30, 32, 6)
    random = np.random.default_rng(3)
    line = fit_line(drive, drive + 0.1 * random.standard_normal(6), np.full(6, 0.1) if known else None)
    scatter = (0.1 if known else 1.0) * line.scale
    power = power_of(line, 2.0, scatter)
    cases = {
        "points": (np.tile(drive, -(-power.points_needed // 6))[: power.points_needed], scatter),
        "range": (30 + (drive - 30) * power.range_needed_hz / 2, scatter),
        "u": (drive, power.u_needed_hz),
    }
    for x, sigma in cases.values():
        detected = 0
        for _ in range(300):
            y = 1.05 * x + sigma * random.standard_normal(x.size)
            found = fit_line(x, y, np.full(x.size, sigma) if known else None)
            detected += abs(found.slope - 1) > found.u_slope * found.quantile
        assert detected / 300 == pytest.approx(0.9, abs=0.06)  # 3 standard errors of a share from 300


# --- the whole ---


def test_a_locked_top_agrees_and_a_slope_of_105_is_excluded():
    assert fit_sweep(sweep(counted())).locked
    tilted = fit_sweep(sweep(1.05 * counted()))
    assert not tilted.locked
    assert tilted.p_locked < 1e-9


def test_a_spin_beside_the_drive_is_warned_of():
    slow = DRIVE - 0.4 + NOISE * np.random.default_rng(1).standard_normal(DRIVE.size)
    fit = fit_sweep(sweep(counted(), spin=slow))
    assert fit.spin_offset == pytest.approx(-0.4, abs=0.03)
    assert fit.remarks == (Remark("spin off", values=(fit.spin_offset,)),)
    assert not fit_sweep(sweep(counted(), spin=DRIVE + (slow - DRIVE + 0.4))).remarks


def test_an_uncertain_drive_asks_for_the_orthogonal_line():
    u_drive = np.full(DRIVE.size, NOISE)
    (remark,) = fit_sweep(sweep(counted(), u_drive=u_drive)).remarks
    assert remark.kind == "uncertain drive"
    both = fit_sweep(sweep(counted(), u_drive=u_drive), orthogonal=True)
    assert both.line.orthogonal
    one, two = fit_sweep(sweep(counted())).line, both.line
    assert two.u_slope / two.scale == pytest.approx(2**0.5 * one.u_slope / one.scale, rel=0.01)


def test_what_is_no_sweep_is_named():
    with pytest.raises(NotPositive, match="the precession frequency number 2"):
        fit_sweep(sweep(counted(p1=-1.0)))
    with pytest.raises(ShapesDiffer, match="u of the drive"):
        fit_sweep(sweep(counted(), u_drive=np.ones(3)))


def test_a_clock_that_is_off_by_one_share_does_not_ask_for_the_orthogonal_line():
    exact = fit_sweep(sweep(counted(), u_drive=2e-5 * DRIVE))
    assert not exact.remarks
    fit = fit_sweep(sweep(counted(), u_drive=2e-3 * DRIVE))
    (remark,) = fit.remarks
    assert remark.kind == "uncertain clock"
    assert remark.values == pytest.approx((2e-3, 2e-3 * fit.line.slope, fit.line.u_slope))


def test_whole_counts_are_judged_by_the_gates_where_they_are_known():
    begin = 1.2 * np.arange(10)
    length = np.linspace(0.75, 1.25, 10)
    gates = [Gates(begin, begin + length, np.full(10, f)) for f in DRIVE]
    missed = [*gates[:3], Gates(begin, begin + length, DRIVE[3] - 1 / length), *gates[4:]]
    precession = counted(n3=-1.0)
    fit = fit_sweep(sweep(precession, gates=tuple(missed)))
    assert fit.points[3].miscount == Miscount(3, counts=-1)
    slower = [*gates[:3], Gates(begin, begin + length, np.full(10, DRIVE[3] - 1.0)), *gates[4:]]
    assert fit_sweep(sweep(precession, gates=tuple(slower))).points[3].used  # 1 Hz less in all gates: no whole counts

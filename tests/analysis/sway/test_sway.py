"""Slow swings in a place over time, their shift at finite amplitude, and geometric magnetism."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.errors import ShapesDiffer, TimesNotIncreasing, TooFewReadings
from analysis.field.ring import Ring, on_axis
from analysis.stability import SymmetricTop, modes
from analysis.sway import Known, Swings, choose_lines, geometric_magnetism, mirrored, slow_swings, swings_of
from analysis.sway.lines import NoSwings
from analysis.sway.orbit import NoSwing
from analysis.sway.vertical import BESIDE, Vertical, beside, of_heights, of_places
from levilab.simulator import preset, simulate

RING = Ring(1.40e-3, 0.0, 0.0, 0.030, 0.055)
HEIGHT = 0.0729913  # where 25.26 g float
TOP = SymmetricTop(0.02526, 1.04e-6, 1.731314e-6, -0.714)


def field(z):
    return on_axis(RING, np.atleast_1d(z), 5)


def swing(times, slow, amplitudes=(4e-4, 6e-4), precession=6.0):
    backward, forward = slow
    waves = zip((backward, forward, precession), (*amplitudes, 8e-5), (0.3, 1.1, 2.0), strict=True)
    return sum(a * np.exp(2j * np.pi * f * times + 1j * phase) for f, a, phase in waves)


# --- lines ---


@pytest.mark.slow
@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_errors_of_frequencies_are_as_large_as_u_says(fresh, correlation):
    times, trials = np.arange(500) / 25, 12
    pulls = []
    for _ in range(trials):
        slow = (fresh.uniform(-0.68, -0.4), fresh.uniform(0.55, 0.9))
        noise = 6e-5 * (fresh.normal(size=times.size) + 1j * fresh.normal(size=times.size))
        noise = lfilter([1 - correlation], [1, -correlation], noise)  # of the same power where the swings are
        first = swings_of(times, swing(times, slow) + noise)[0]
        found = min((first, *first.rivals), key=lambda one: np.abs(one.frequency[:2] - slow).max())
        pulls.append((found.frequency - [*slow, 6.0]) / found.u)
    pulls = np.array(pulls)[:, : 2 if correlation else 3]  # at 6 Hz there is less of that noise
    assert abs(pulls.mean()) < 4 / np.sqrt(pulls.size)  # 4 standard errors
    assert abs(pulls.std() - 1) < 4 / np.sqrt(2 * pulls.size)


def test_times_may_be_uneven(fresh):
    times = np.cumsum(fresh.choice([1 / 75, 1 / 50], size=1200))
    found = swings_of(times, swing(times, (-0.59, 0.77)))[0]
    assert found.frequency == pytest.approx([-0.59, 0.77, 6.0], abs=1e-6)


def test_a_line_of_the_vertical_swing_beside_the_backward_one_is_none_of_it(fresh):
    times = np.arange(2400) / 120
    places = swing(times, (-0.5945, 0.7400), (1.1e-4, 9.4e-4)) + 1e-4 * np.exp(2j * np.pi * (0.74 - 1.196) * times)
    places += 1e-4 * (fresh.normal(size=times.size) + 1j * fresh.normal(size=times.size))
    found = swings_of(times, places)[0]
    assert abs(found.frequency[0] + 0.5945) < 4 * found.u[0]


def test_the_vertical_swing_is_that_of_the_lines_beside(fresh):
    times = np.arange(2400) / 120
    back, ahead = (a * np.exp(2j * np.pi * f * times) for a, f in ((4e-4, -0.5945), (6e-4, 0.7400)))
    up = 0.15j * np.exp(2j * np.pi * 1.23 * times)  # one share of either swing goes into the line beside the other
    places = back + ahead + back * up + ahead * up.conj()
    places += 1e-4 * (fresh.normal(size=times.size) + 1j * fresh.normal(size=times.size))
    # the usual field has 1.198 Hz, with u of 0.03 Hz; lines of this strength are known to 1 mHz
    assert swings_of(times, places)[0].vertical.value == pytest.approx(1.23, abs=0.004)


@pytest.mark.parametrize("strength", [0.0, 4e-4, 4e-3])
@pytest.mark.parametrize("seen", ["heights", "places"])
def test_the_vertical_swing_has_its_uncertainty(fresh, seen, strength):
    """Lines that are not there, at the limit of the noise, and clear: 50 trials each."""
    late, expected, noise, trials = (np.arange(120) - 59.5) / 6, Vertical(1.198, 0.03), 1e-3, 50
    waves = np.exp(2j * np.pi * np.outer(late, (-0.5945, 0.7400)))
    pulls, u = [], []
    for _ in range(trials):
        rise = fresh.normal(*expected)
        first = np.exp(1j * fresh.uniform(0, 2 * np.pi))
        if seen == "heights":
            heights = strength * (np.exp(2j * np.pi * rise * late) * first).real + noise * fresh.normal(size=late.size)
            found = of_heights(late, heights, expected, 0.7400 + 0.5945)
        else:
            swings = waves * [4e-3, 6e-3]
            places = swings.sum(axis=1) + noise * fresh.normal(size=(2, late.size)).T @ [1, 1j]
            share = first * strength / np.hypot(4e-3, 6e-3)
            places += beside(swings, np.exp(2j * np.pi * rise * late), BESIDE[:2]) @ [share.conjugate(), share]
            found = of_places(late, places, swings, np.ones((late.size, 1)), expected, rows=())
        pulls.append((found.value - rise) / found.u)
        u.append(found.u)
    assert abs(np.mean(pulls)) < 3 / np.sqrt(trials)  # three standard errors, as of the standard deviation
    assert np.std(pulls) == pytest.approx(1.0, abs=3 / np.sqrt(2 * trials))
    if not strength:  # nothing shows it
        assert np.mean(u) == pytest.approx(expected.u, rel=0.05)
    if strength == 4e-3:  # bound of Cramér and Rao: one line, of which heights show one part and places both
        alone = np.sqrt(6 / late.size) * noise / strength / (np.pi * 20)
        assert np.mean(u) == pytest.approx(alone if seen == "heights" else alone * np.sqrt(0.5), rel=0.15)


def test_heights_that_are_all_alike_say_nothing(fresh):
    times = np.arange(1000) / 50
    places = swing(times, (-0.59, 0.77)) + 1e-4 * (fresh.normal(size=1000) + 1j * fresh.normal(size=1000))
    (without,), (alike,) = swings_of(times, places), swings_of(times, places, np.zeros(1000))
    assert alike.frequency == pytest.approx(without.frequency, abs=1e-6)  # 1 % of u
    assert alike.vertical == pytest.approx(without.vertical, rel=0.05)  # the grid of its prior is cut at 4 u


@pytest.mark.parametrize("beyond", [0.0, 1e-3])
def test_a_forward_swing_at_the_vertical_swing_of_the_heights_is_found_beside_it(fresh, beyond):
    times, rise = np.arange(1000) / 50, 0.95
    heights = 3e-4 * np.cos(2 * np.pi * rise * times + 0.4)
    places = swing(times, (-0.74, rise + beyond), (2e-4, 3e-4)) + 0.1 * heights  # of a sensor that leans
    places += 5e-5 * (fresh.normal(size=1000) + 1j * fresh.normal(size=1000))
    (found,) = swings_of(times, places, heights + 5e-5 * fresh.normal(size=1000), rising=True)
    assert (np.abs(found.frequency[:2] - [-0.74, rise + beyond]) < 4 * found.u[:2]).all()


def test_the_image_of_a_line_hides_no_swing(fresh):
    """A sensor whose image is 5 % larger than the whole record shows, at a line of the vertical swing."""
    times, slow, rise = np.arange(1000) / 50, (-0.4216, 0.6701), 1.355
    heights = 3e-4 * np.cos(2 * np.pi * rise * times) + 1e-4 * np.cos(2 * np.pi * (slow[1] - slow[0]) * times)
    places = swing(times, slow, (2e-4, 1e-3), 6.4) + 7e-5 * np.exp(2j * np.pi * (slow[1] - rise) * times)
    places += 5e-5 * (fresh.normal(size=1000) + 1j * fresh.normal(size=1000))
    places += 0.05 * np.exp(1j) * places.conj()
    (found,) = swings_of(times, places, heights + 5e-5 * fresh.normal(size=1000), rising=True)
    off = [np.abs((one.frequency[:2] - slow) / one.u[:2]).max() for one in (found, *found.rivals)]
    assert min(off) < 4


def test_a_mirrored_view_is_known_by_the_precession(fresh):
    times = np.arange(1000) / 50
    places = swing(times, (-0.59, 0.77)) + 1e-4 * (fresh.normal(size=1000) + 1j * fresh.normal(size=1000))
    assert mirrored(swings_of(times, places)) is False
    assert mirrored(swings_of(times, places.conj())) is True
    slow = swing(times, (-0.59, 0.77), precession=20.0)  # too fast to be one
    assert mirrored(swings_of(times, slow + 1e-4 * fresh.normal(size=1000))) is None


def test_what_has_no_swings_is_refused(fresh):
    times = np.arange(2400) / 120
    with pytest.raises(NoSwings, match="push sideways"):
        swings_of(times, np.zeros(2400) + 1e-3 * np.exp(2j * np.pi * 6 * times))
    with pytest.raises(TooFewReadings):
        swings_of(times[:50], np.ones(50))
    with pytest.raises(ShapesDiffer):
        swings_of(times, np.ones(50))
    with pytest.raises(TimesNotIncreasing):
        swings_of(times[::-1], np.ones(2400))


# --- finite amplitude ---


def test_small_swings_are_the_roots_of_the_quartic():
    slow = sorted(sorted(modes(field, TOP, HEIGHT, 30.0).real, key=abs)[:2])
    assert slow_swings(field, TOP, HEIGHT, 30.0, (1e-6, 1e-6)) == pytest.approx(slow, abs=1e-5)  # the height is rounded


@pytest.mark.parametrize("amplitude", [5e-4, 1e-3])
def test_the_shift_at_finite_amplitude_is_that_of_the_full_motion(amplitude):
    start = {"start.position_m": [amplitude, 0.0, 0.07298], "start.velocity_m_s": [0, 0, 0], "start.spin_hz": 25.0}
    scene = preset("undriven").changed(start | {"start.precession": "steady", "base.field": "paraxial-8"})
    motion = simulate(scene, 40.0, rate=120.0, tolerance=1e-6)
    places = motion.position[:-1, 0] + 1j * motion.position[:-1, 1]
    seen = swings_of(motion.time[:-1], places, window=40.0)[0]
    still = sum(slow_swings(field, TOP, HEIGHT, 25.0, (1e-6, 1e-6)))
    moving = sum(slow_swings(field, TOP, HEIGHT, 25.0, tuple(seen.amplitude[:2])))
    # the vertical swing, which the start sets off, too, is not in it: a tenth of the shift
    assert seen.split - still == pytest.approx(moving - still, rel=0.1, abs=2e-4)


def test_amplitudes_that_no_motion_has_are_refused():
    with pytest.raises(NoSwing, match="smaller swings"):
        slow_swings(field, TOP, HEIGHT, 25.0, (0.02, 0.02))


# --- geometric magnetism ---


SIZES = np.diag([0.0, 1e-4, 1e-4]) ** 2  # of the base, by a calliper


def known(mass):
    return Known(SymmetricTop(mass, 1.04e-6, 1.731314e-6, -0.714), 0.0, 0.0, RING, SIZES)


def in_full_motion(mass, seconds, position, velocity, noise):
    """Geometric magnetism of a top as its motion shows it, and as its field has it [Hz]."""
    rest = {"top.mass_kg": mass, "start.place": "equilibrium", "start.spin_hz": 40.0}
    height = simulate(preset("undriven").changed(rest), 0.01, rate=None).position[0, 2]
    start = {"start.place": "given", "start.position_m": [*position, height], "start.velocity_m_s": list(velocity)}
    motion = simulate(
        preset("undriven").changed(rest | start | {"drag.law": "disc"}), seconds, rate=50.0, tolerance=1e-5
    )
    places = motion.position[:-1, 0] + 1j * motion.position[:-1, 1] + noise
    swings = swings_of(motion.time[:-1], places)
    spin = np.interp([one.time for one in swings], motion.time, motion.spin_hz)
    b, slope = field(height)[:2, 0]
    truth = 1.731314e-6 * 30.0 / mass * (slope / (2 * b)) ** 2
    return geometric_magnetism(choose_lines(swings, spin, known(mass)), spin, known(mass)), truth


@pytest.mark.parametrize(
    ("mass", "position", "velocity"),
    [
        (0.02514, (-3.5e-4, 7.3e-4), (-2.9e-3, -2.8e-3, -1.2e-3)),
        (0.02522, (1.5e-4, 6.5e-4), (3e-4, 2.9e-3, -1.2e-3)),
        (0.02518, (4.6e-4, -6.2e-4), (2.9e-3, 1.1e-3, 1e-3)),
    ],
)
def test_a_vertical_swing_of_its_own_near_the_beat_moves_no_geometric_magnetism(fresh, mass, position, velocity):
    noise = 6e-5 * (fresh.normal(size=3000) + 1j * fresh.normal(size=3000))
    found, truth = in_full_motion(mass, 60.0, position, velocity, noise)
    assert found.measured.value == pytest.approx(truth, rel=0.015)  # 0.025 to 0.057 by the steady motion without it


@pytest.mark.slow
def test_tops_in_full_motion_have_the_split_that_is_predicted(fresh):
    pulls, u, together = [], [], []
    for mass in (0.02502, 0.02526, 0.02534):
        position, velocity = (fresh.uniform(3e-4, 8e-4), 0.0), fresh.uniform(-2e-3, 2e-3, 3)
        noise = 6e-5 * (fresh.normal(size=4000) + 1j * fresh.normal(size=4000))
        found, truth = in_full_motion(mass, 80.0, position, velocity, noise)
        pulls.append((found.measured.value - truth) / found.measured.u)
        u.append(found.measured.u / truth)
        together.append((found.joint.ratio.value - 1) / found.joint.ratio.u)
        assert found.against_null > 30
        # what floats lower by its swings and by its precession sways as there
        assert found.predicted.value == pytest.approx(truth, rel=4e-3)
    assert max(np.abs(pulls).max(), np.abs(together).max()) < 3
    assert np.median(u) < 0.003
    assert max(u) < 0.035  # of 25.26 g, near the meeting of beat and vertical swing


def lines(slow, u=3e-4):
    return Swings(0.0, np.array(slow), np.full(2, u), np.full(2, 1e-5), Vertical(1.2, 0.03), 1e-4, 0.0)


def three_lines(frequencies):
    return replace(lines(frequencies), u=np.full(3, 3e-4), amplitude=np.full(3, 1e-5))


@pytest.mark.parametrize("split", [-0.02, 0.0, 0.02])
def test_a_split_of_either_sign_is_told_with_its_u(split):
    found = geometric_magnetism([lines((split - 0.666, 0.666))] * 6, np.linspace(35, 25, 6), known(0.02526))
    assert found.measured.value == pytest.approx(split, rel=0.1, abs=1e-6)  # as the mean of 30 Hz over the spin
    assert 0 < found.measured.u < 1e-3
    assert (abs(found.against_null) > 0.1) == bool(split)  # without one nothing stands against the null
    assert abs(found.ratio.value) < 0.15
    assert found.joint.ratio.value == pytest.approx(found.ratio.value, rel=0.1, abs=1e-4)


@pytest.mark.parametrize("windows", [(0, 1, 2, 3), (0, 1), (2,)])
@pytest.mark.parametrize("which", [0, 1])
def test_a_swing_and_a_line_of_the_vertical_swing_are_distinguished_by_the_spin(which, windows):
    """In some windows the line of the vertical swing is the likelier one, as a fit has it."""
    b, slope = field(HEIGHT)[:2, 0]
    spins, seen = np.array([40.0, 35.0, 30.0, 25.0]), []
    for k, spin in enumerate(spins):
        slow = np.array(sorted(sorted(modes(field, TOP, HEIGHT, spin).real, key=abs)[:2]))
        right, turned = replace(lines(slow), vertical=Vertical(1.19, 3e-4)), slow.copy()
        turned[which] = slow[1 - which] + (1.19 if which else -1.19)
        wrong = replace(lines(turned), vertical=Vertical(float(slow[1] - slow[0]), 3e-4), misfit=-4.0)
        seen.append(
            replace(wrong, rivals=(right,)) if k in windows else replace(right, rivals=(replace(wrong, misfit=4.0),))
        )
    chosen = choose_lines(seen, spins, known(0.02526))
    found = geometric_magnetism(chosen, spins, known(0.02526))
    assert found.gradient.value == pytest.approx(abs(slope / (2 * b)), rel=1e-3)


def test_a_line_that_is_as_likely_is_in_u():
    window = replace(lines((-0.5945, 0.74)), rivals=(lines((-0.5925, 0.74)),))
    (chosen,) = choose_lines([window], np.array([30.0]), known(0.02526))
    part = geometric_magnetism([chosen], np.array([30.0]), known(0.02526)).parts["mistake"]
    assert part == pytest.approx(2e-3 * np.sqrt(0.5), rel=0.1)  # either with a probability of a half


def slow_lines(spin):
    """The slow swings of the top as lines."""
    return lines(sorted(sorted(modes(field, TOP, HEIGHT, spin).real, key=abs)[:2]))


def test_a_window_in_doubt_takes_nothing_from_the_others():
    """u is no larger with a window in which another line is as likely than without that window."""
    spins, sure = np.array([25.0, 30.0, 40.0]), [slow_lines(spin) for spin in (25.0, 30.0, 40.0)]
    backward, forward = sure[1].frequency[:2]
    doubtful = [sure[0], replace(sure[1], rivals=(lines((backward + 2e-3, forward)),)), sure[2]]
    three = geometric_magnetism(choose_lines(doubtful, spins, known(0.02526)), spins, known(0.02526))
    two = geometric_magnetism(choose_lines(sure[::2], spins[::2], known(0.02526)), spins[::2], known(0.02526))
    assert three.measured.u < 1.02 * two.measured.u
    assert abs(three.measured.value - two.measured.value) < two.measured.u


def test_the_roots_of_the_quartic_give_back_its_gradient():
    b, slope = field(HEIGHT)[:2, 0]
    spins = np.array([25.0, 30.0, 40.0])
    seen = [slow_lines(spin) for spin in spins]
    found = geometric_magnetism(seen, spins, known(0.02526))
    assert found.gradient.value == pytest.approx(abs(slope / (2 * b)), rel=1e-4)
    assert found.of_base.value == pytest.approx(abs(slope / (2 * b)), rel=1e-5)
    assert found.ratio.value == pytest.approx(1, abs=2e-4)
    assert found.joint.ratio.value == pytest.approx(1, abs=2e-4)
    assert found.joint.gradient.value == pytest.approx(abs(slope / (2 * b)), rel=1e-5)
    weighed = geometric_magnetism(seen, spins, replace(known(0.02526), mass_u=1e-5))
    assert weighed.joint.mass.u == pytest.approx(1e-5, rel=0.01)  # two lines a window say nothing about the mass


@pytest.mark.parametrize("axial", [1.70e-6, 1.731314e-6])
def test_all_lines_together_correct_what_is_known_but_not_exactly(axial):
    spins = np.array([25.0, 30.0, 40.0])
    seen = []
    for spin in spins:
        found = sorted(modes(field, TOP, HEIGHT, spin).real, key=abs)[:3]
        seen.append(three_lines([*sorted(found[:2]), found[2]]))
    body = replace(known(0.02526), top=replace(TOP, axial=axial), covariance=np.zeros((3, 3)), axial_u=4e-8)
    joint = geometric_magnetism(seen, spins, body).joint
    assert joint.axial.value == pytest.approx(1.731314e-6, abs=3 * joint.axial.u)
    assert joint.axial.u < 1e-8  # slow swings give the height, and precessions at three spins I₃
    assert joint.ratio.value == pytest.approx(1, abs=3 * joint.ratio.u)
    assert joint.chi_square < 4  # no noise, and a prior that is 0.8 u off


def test_the_shift_by_the_size_of_the_swings_is_in_u_by_its_part():
    swings = [
        replace(lines((-0.59, 0.77)), amplitude=np.full(2, 1e-3), vertical=Vertical(3.0, 0.03))
    ]  # far from the beat
    found = geometric_magnetism(swings, np.array([30.0]), known(0.02526))
    (shift,) = np.abs(found.shifts.sum(axis=1))
    assert shift > 5e-4
    further = 0.0084 * 2**2 * np.abs(found.shifts).sum()  # of both swings' squares in mm²
    assert found.parts["amplitude"] == pytest.approx(
        np.hypot(0.05 * shift, further), rel=0.1
    )  # Ω_g is the split but for some percent
    assert found.parts["lines"] == pytest.approx(found.u_shares[0])  # it is not in the part of the lines, too


@pytest.mark.parametrize("size_u", [0.0, 0.1])
def test_a_shift_near_the_vertical_swing_has_the_u_by_which_distance_and_size_move_it(size_u):
    def found(distance=0.0, size=1.0):
        sizes, vertical = np.array([3e-4, 6e-4]) * size, Vertical(1.6 + distance, 0.0)
        one = replace(lines((-0.59, 0.77)), amplitude=sizes, vertical=vertical, size_u=size_u)
        return geometric_magnetism([one], np.array([30.0]), known(0.02526))

    def half(low, high):
        return (high.measured.value - low.measured.value) / 2

    (shift,) = np.abs(found().shifts.sum(axis=1))
    near, large = half(found(-7.7e-3), found(7.7e-3)), half(found(size=np.exp(-size_u)), found(size=np.exp(size_u)))
    own = [0.05 * shift, 0.0084 * 0.45**2 * np.abs(found().shifts).sum()]
    assert found().parts["amplitude"] == pytest.approx(np.linalg.norm([*own, near, large]), rel=0.1)
    assert abs(near) > 0.4 * np.linalg.norm(own)


@pytest.mark.parametrize("vertical", [1.28, 1.36])  # one pair of lines nearer than it can be, and both
def test_where_lines_coalesce_u_is_as_large_as_what_is_unknown(vertical):
    def found(vertical):
        one = replace(lines((-0.59, 0.77)), amplitude=np.array([3e-4, 6e-4]), vertical=Vertical(vertical, 0.0))
        return geometric_magnetism([one], np.array([30.0]), known(0.02526)).measured

    spread = np.ptp([found(other).value for other in np.arange(1.27, 1.401, 0.01)])
    assert found(vertical).u > spread / 3  # of a rectangle as wide as the spread, u is 0.29 of it


@pytest.mark.slow
@pytest.mark.parametrize(("duration", "rate"), [(4.0, 120.0), (4.0, 240.0), (8.0, 240.0)])
def test_of_short_tracks_the_mistake_of_a_line_is_in_u(fresh, duration, rate):
    pulls, small = [], []
    for trial in range(8):
        spin = float(fresh.uniform(26, 38))
        start = {"start.spin_hz": spin, "start.position_m": [fresh.uniform(3e-4, 2e-3), 0.0, 0.0729]}
        start |= {"start.velocity_m_s": fresh.uniform(-4e-3, 4e-3, 3).tolist()}
        if trial < 2:  # as the scene has it: swings of 1.2 mm beside lines of 0.7 mm
            start = {}
        motion = simulate(preset("friction").changed(start), duration, rate=rate, tolerance=1e-5)
        places = motion.position[:-1, 0] + 1j * motion.position[:-1, 1]
        places = places + 3e-5 * (fresh.normal(size=places.size) + 1j * fresh.normal(size=places.size))
        swings = swings_of(motion.time[:-1], places)
        at = np.interp([one.time for one in swings], motion.time, motion.spin_hz)
        found = geometric_magnetism(choose_lines(swings, at, known(0.02526)), at, known(0.02526))
        pulls.append((found.measured.value - 0.1765) / found.measured.u)  # where it floats at rest
        small.append(found.measured.u < 0.1 * 0.1765)
    assert np.abs(pulls).max() < 3
    assert np.std(pulls) < 1.75  # 1, and 3 of its standard errors
    assert sum(small) > 2  # u is no larger than it has to be

"""One top: closed forms, constants of the motion, hard cases, and an error estimate that is true."""

import math

import numpy as np
import pytest

from levilab.simulator import SimulationError
from levilab.simulator.scene import preset
from levilab.simulator.single import simulate
from levilab.simulator.spin import DECAYS
from support.scenes import KINDS

UNDRIVEN, FRICTION, TILTED, DRIVEN = (preset(name) for name in ("undriven", "friction", "tilted", "driven"))
EPS = np.finfo(float).eps


def at(scene=UNDRIVEN, **values):
    """A scene with other values at the start."""
    return scene.changed({f"start.{key}": value for key, value in values.items()})


def spin_momentum(motion):
    return np.sum(motion.angular_momentum * motion.axis, axis=1)


def vertical_momentum(motion):
    x, y, _ = motion.position.T
    vx, vy, _ = motion.velocity.T
    return motion.angular_momentum[:, 2] + motion.scene.top.mass_kg * (x * vy - y * vx)


def spread(values):
    return np.abs(values - values[0]).max() / abs(values[0])


# --- where the answer is known ---

#: No field: a top thrown into the air, that turns as a free symmetric top.
THROWN = at(UNDRIVEN.changed({"base.strength_t_m": 0.0}), velocity_m_s=[0.2, 0.0, 0.5], tilt_rad=0.3)


def test_without_a_field_the_top_flies_on_a_parabola_and_precesses_freely():
    motion = simulate(THROWN.changed({"escape.radius_m": 1.0}), 0.1, rate=1000)
    t = motion.time
    assert motion.position[:, 2] == pytest.approx(0.071 + 0.5 * t - 9.82 / 2 * t**2, abs=1e-15)
    assert motion.position[:, 0] == pytest.approx(0.001 + 0.2 * t, abs=1e-15)
    # Landau & Lifshitz § 33: the axis turns about L at |L|/I₁
    L = motion.angular_momentum[0]
    n = motion.axis
    about = L / np.linalg.norm(L)
    along = n @ about
    assert spread(along) < 20 * EPS
    e1 = n[0] - along[0] * about
    e1 /= np.linalg.norm(e1)
    angle = np.unwrap(np.arctan2(n @ np.cross(about, e1), n @ e1))
    assert angle == pytest.approx(np.linalg.norm(L) / THROWN.top.inertia_transverse_kg_m2 * t, abs=1e-12)


def test_the_moments_of_an_escape_and_of_an_event_are_those_of_the_parabola():
    motion = simulate(THROWN, 1.0, events={"apex": lambda m: m.velocity[:, 2], "x": lambda m: m.position[:, 0] - 0.01})
    assert motion.fell.name == "radius"
    assert motion.fell.time == pytest.approx(0.019 / 0.2, abs=1e-14)
    assert motion.time[-1] == motion.fell.time
    assert [event.name for event in motion.events] == ["x", "apex"]
    assert [event.time for event in motion.events] == pytest.approx([0.009 / 0.2, 0.5 / 9.82], abs=1e-14)
    down = simulate(at(THROWN, velocity_m_s=[0.0, 0.0, 0.5]), 1.0)
    assert down.fell.name == "height"
    assert down.fell.time == pytest.approx((0.5 + math.sqrt(0.25 + 2 * 9.82 * 0.071)) / 9.82, abs=1e-14)


@pytest.mark.parametrize("law", ["stokes", "newton", "disc", "mixed"])
def test_the_spin_of_an_aligned_top_follows_its_law_whatever_the_motion(law):
    scene = FRICTION.changed({"drag.law": law})
    motion = simulate(scene, 30.0, rate=10)
    spin = DECAYS[law].after(2 * np.pi * 30, motion.time, *scene.drag.constants)
    # the torque's quadrature is of the order of the scheme in C·h ~ 1e-5: rounding of 1e5 stages is left
    assert 2 * np.pi * motion.spin_hz == pytest.approx(spin, rel=1e-11)


def test_the_spin_alone_is_not_integrated():
    motion = simulate(FRICTION.changed({"observed": "spin", "drag.law": "disc"}), 190.0, rate=0.1)
    accuracy = motion.accuracy
    assert (accuracy.scheme, accuracy.position, accuracy.axis) == ("closed form", 0.0, 0.0)
    assert (accuracy.steps, accuracy.reached) == (0, True)
    assert motion.time == pytest.approx(np.arange(20) * 10.0)
    exact = ((2 * np.pi * 30) ** -0.5 + 0.5 * 2.34e-4 * motion.time) ** -2 / (2 * np.pi)
    assert motion.spin_hz == pytest.approx(exact, rel=1e-14)


def test_loose_washers_and_core_share_their_momentum_when_nothing_else_acts():
    scene = preset("loose-washers").changed(
        {"drag.coefficient": 1e-30, "drive.amplitude_t": 1e-30, "start.place": "given", "top.moment_tilt": [0.0, 1.0]}
    )  # drag and drive are too weak to be felt, and there so that no kernel is compiled for this
    motion = simulate(scene, 5.0, tolerance=1e-10)
    assert spread(spin_momentum(motion)) < 1e-12
    assert motion.washer_spin_hz == pytest.approx(motion.spin_hz, rel=1e-10)  # they start together, and stay so


# --- constants of the motion ---


@pytest.mark.parametrize(
    "scene",
    [
        UNDRIVEN,
        UNDRIVEN.changed({"base.field": "exact"}),
        at(tilt_rad=0.1),
        TILTED,
        UNDRIVEN.changed({"base.tilt_rad": 0.01}),
    ],
    ids=["undriven", "exact field", "IC4", "tilted", "leaning base"],
)
def test_energy_is_kept_to_rounding(scene):
    motion = simulate(scene, 10.0, tolerance=1e-10)
    assert motion.accuracy.reached
    # the integrator's own error of the energy does not grow and is that of the tolerance, squared for an oscillator
    assert spread(motion.energies) < 1e-12


def test_an_upright_base_keeps_the_momentum_about_the_vertical_and_an_aligned_dipole_that_of_the_spin():
    motion = simulate(at(tilt_rad=0.1), 10.0, tolerance=1e-10)
    assert spread(spin_momentum(motion)) < 1e-12
    assert spread(vertical_momentum(motion)) < 1e-12
    tilted = simulate(TILTED, 10.0, tolerance=1e-10)
    assert spread(spin_momentum(tilted)) > 1e-6  # a tilted dipole does change its spin
    assert spread(vertical_momentum(tilted)) < 1e-12


def test_an_hour_keeps_energy_and_spin_to_the_rounding_of_a_random_walk():
    motion = simulate(UNDRIVEN, 3600.0, tolerance=1e-6, rate=1.0)
    assert motion.survived
    walk = EPS * math.sqrt(2 * motion.accuracy.steps * 14)  # half a unit in the last place, twice a stage
    assert spread(motion.energies) < 3 * walk  # 4e-12; measured 4e-13
    assert spread(spin_momentum(motion)) < 3 * walk
    halves = np.abs(motion.energies - motion.energies[0]).reshape(-1)[1:].reshape(2, -1).max(axis=1)
    assert halves[1] < 8 * halves[0] + EPS  # a steady drift would show in its growth with the time over many runs


# --- samples ---


def test_samples_come_at_the_rate_asked_for_and_the_last_is_the_end():
    motion = simulate(UNDRIVEN, 0.25, rate=30)
    assert motion.time == pytest.approx([*np.arange(8) / 30, 0.25], abs=0)
    assert simulate(UNDRIVEN, 0.25, rate=None).time.tolist() == [0.0, 0.25]


@pytest.mark.parametrize("rate", [None, 1.0, 333.3, 5000.0])
def test_the_end_does_not_depend_on_the_samples(rate):
    reference = simulate(UNDRIVEN, 1.0, tolerance=1e-12, rate=None)
    motion = simulate(UNDRIVEN, 1.0, rate=rate)
    assert np.linalg.norm(motion.position[-1] - reference.position[-1]) < motion.accuracy.position
    assert motion.accuracy.reached


def test_samples_and_kinks_of_the_drive_at_the_same_time_are_one():
    square = DRIVEN.changed({"drive.waveform": "square", "drive.phase_rad": 0.3})
    for scene in (square, square.changed({"drive.phase_rad": 0.0}), DRIVEN.changed({"drive.off_s": 0.5})):
        motion = simulate(scene, 1.0, rate=60)
        assert motion.time == pytest.approx(np.arange(61) / 60, abs=1e-12)


def test_an_event_in_the_very_step_of_the_fall_is_found():
    motion = simulate(at(spin_hz=0.0), 5.0, events={"nearly down": lambda m: m.position[:, 2] - 1e-5})
    assert [event.name for event in motion.events] == ["nearly down"]
    assert 0 < motion.fell.time - motion.events[0].time < 1e-4


def test_progress_runs_to_the_whole():
    shares = []
    simulate(UNDRIVEN, 20.0, step=1e-4, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


# --- hard cases ---


@pytest.mark.parametrize("tilt", [0.0, 1e-12])
def test_an_upright_start_is_no_singularity(tilt):
    motion = simulate(at(tilt_rad=tilt), 5.0, tolerance=1e-10)
    assert motion.accuracy.reached
    assert spread(motion.energies) < 1e-12
    other = simulate(at(tilt_rad=1e-6), 5.0, tolerance=1e-10)
    # tilts of 1e-6 and of nothing lie 1e-6 apart, and stay of that order: nothing special happens at the pole
    assert np.abs(motion.axis[-1] - other.axis[-1]).max() < 1e-5


@pytest.mark.parametrize("left", [1e-3, 1e-9])
def test_a_top_upside_down_is_attracted_and_falls_onto_the_base(left):
    motion = simulate(at(tilt_rad=math.pi - left, precession="none"), 5.0)
    assert 0.05 < motion.fell.time < 0.3
    assert motion.accuracy.reached
    assert spread(motion.energies) < 1e-9


def test_a_top_that_does_not_spin_turns_over_and_falls():
    motion = simulate(at(spin_hz=0.0), 5.0)
    assert motion.fell.name == "height"
    assert motion.accuracy.reached
    assert motion.tilt.max() > 1.0
    # it turns over within a few times √(I₁/|μ|B) = 8.8 ms, from a tilt of 0.01, and then falls some 10 cm
    assert 0.1 < motion.fell.time < 0.3
    slow = simulate(at(spin_hz=1.0), 5.0)
    assert slow.fell.time == pytest.approx(motion.fell.time, abs=2e-3)


def test_a_spin_of_1000_hz_is_followed_though_the_top_cannot_tilt_with_the_field():
    motion = simulate(at(spin_hz=1000.0), 5.0, tolerance=1e-10)
    assert motion.accuracy.reached
    assert motion.fell.name == "radius"  # above the upper limit it flies off sideways
    assert spread(motion.energies) < 1e-11
    assert motion.accuracy.step * 2 * np.pi * 1665 < 3  # its nutation, at 1665 Hz, is resolved


@pytest.mark.parametrize(("law", "constant"), [("stokes", 1e4), ("newton", 1e2), ("disc", 1e3)])
def test_drag_far_above_critical_stops_the_top_and_stays_stable(law, constant):
    motion = simulate(UNDRIVEN.changed({"drag.law": law, "drag.coefficient": constant}), 5.0, rate=1000)
    assert motion.fell.name == "height"
    still = simulate(at(spin_hz=0.0), 5.0)
    assert motion.fell.time == pytest.approx(still.fell.time, abs=0.02)  # like one that never turned
    assert np.all(np.isfinite(motion.states))
    assert np.all(np.diff(motion.spin_hz) < 1e-9)


def test_drag_far_above_critical_on_a_tilted_dipole_stays_stable_too():
    motion = simulate(TILTED.changed({"drag.law": "stokes", "drag.coefficient": 1e3}), 1.0, rate=1000)
    assert motion.fell.name == "height"
    assert np.all(np.isfinite(motion.states))


def test_a_drive_at_the_resonance_of_the_wobble_throws_the_top():
    # √(P/(I₃ − I₁))/2π = 22.1 Hz
    resonant = DRIVEN.changed({"drive.frequency_hz": 22.1, "start.spin_hz": 22.1})
    motion = simulate(resonant, 20.0)
    assert motion.accuracy.reached
    assert not motion.survived


def test_close_to_the_base_the_exact_field_is_followed():
    # let fall onto the base, upright and fast: the field's length is then that of the height, a few mm
    scene = at(
        UNDRIVEN.changed({"base.field": "exact", "top.mass_kg": 0.2, "escape.height_m": 1e-3, "escape.radius_m": 0.06}),
        position_m=[0.028, 0.0, 0.02],
        spin_hz=60.0,
    )
    motion = simulate(scene, 1.0)
    assert motion.accuracy.reached
    assert motion.fell is not None
    assert spread(motion.energies) < 1e-6


def test_a_chaotic_start_is_reported_instead_of_a_result_that_only_looks_exact():
    # at the edge of the upper limit neighbours part by a factor of ten a second, until the top is lost at 14.75 s
    chaotic = at(UNDRIVEN.changed({"top.mass_kg": 0.02527}), spin_hz=70.75)
    errors = []
    for duration in (10.0, 12.0, 14.0):
        coarse = simulate(chaotic, duration, step=1.3e-3, rate=None)
        fine = simulate(chaotic, duration, step=0.9e-3, rate=None)
        assert coarse.survived
        assert fine.survived
        assert np.linalg.norm(coarse.position[-1] - fine.position[-1]) < coarse.accuracy.position
        errors.append(coarse.accuracy.position)
    assert errors[2] > 100 * errors[1] > 1000 * errors[0]
    assert not simulate(chaotic, 30.0, step=1.3e-3, rate=None).accuracy.reached


@pytest.mark.parametrize("kind", KINDS)
def test_the_estimate_bounds_the_true_error_on_every_kind_of_scene(kind):
    # against a hundredth of the tolerance; starts that rise, drift, spin slowly enough to fall at once, and lean
    random = np.random.default_rng(7)
    bounded = []
    for _ in range(8):
        scene = KINDS[kind].changed(
            {
                "start.position_m": [float(random.uniform(-2e-3, 2e-3)), 0.0, float(random.uniform(0.070, 0.0745))],
                "start.tilt_rad": float(random.uniform(0, 0.05)),
                "start.spin_hz": float(random.choice([12.0, 26.0, 30.0, 40.0])),
            }
        )
        rough, fine = (simulate(scene, 0.7, tolerance=tolerance, rate=None) for tolerance in (1e-6, 1e-11))
        assert rough.survived == fine.survived
        for what in ("position", "axis"):
            true = np.linalg.norm(getattr(rough, what)[-1] - getattr(fine, what)[-1])
            bounded.append(true <= getattr(rough.accuracy, what) + getattr(fine.accuracy, what))
    assert np.mean(bounded) >= 0.9  # 95 % of 16, to within one


def test_a_fall_in_the_first_step_has_an_estimate_too():
    low = at(UNDRIVEN, position_m=[0.0, 0.0, 0.0505], velocity_m_s=[0.0, 0.0, -0.5])
    scene = low.changed({"escape.height_m": 0.05})
    rough, fine = simulate(scene, 1.0, step=2e-3, rate=None), simulate(scene, 1.0, step=5e-5, rate=None)
    assert rough.fell.time < 2e-3
    assert np.linalg.norm(rough.axis[-1] - fine.axis[-1]) <= rough.accuracy.axis
    assert np.linalg.norm(rough.position[-1] - fine.position[-1]) <= rough.accuracy.position


# --- what is refused ---


@pytest.mark.parametrize("name", ["duration", "tolerance", "rate", "step"])
@pytest.mark.parametrize("value", [math.nan, math.inf, 0.0])
def test_numbers_that_make_no_sense_are_refused_by_name(name, value):
    settings = {"duration": 1.0} | {name: value}
    with pytest.raises(SimulationError, match=f"{name} = {value}"):
        simulate(UNDRIVEN, **settings)


def test_a_start_that_is_no_number_is_refused():
    with pytest.raises(SimulationError, match="no number"):
        simulate(UNDRIVEN, 1.0, start=np.full(18, math.nan))


# --- the spin alone ---


def test_mixed_drag_of_one_part_is_that_part():
    spin = UNDRIVEN.changed({"observed": "spin"})
    for mixed, law, constant in (([0.0, 1.7e-5], "newton", 1.7e-5), ([3e-3, 0.0], "stokes", 3e-3)):
        both = simulate(spin.changed({"drag.law": "mixed", "drag.coefficient": mixed}), 100.0)
        one = simulate(spin.changed({"drag.law": law, "drag.coefficient": constant}), 100.0)
        assert both.spin_hz == pytest.approx(one.spin_hz, rel=1e-14)


def test_a_spin_that_would_have_been_infinite_on_the_way_back_is_refused():
    spin = UNDRIVEN.changed({"observed": "spin", "drag.law": "newton", "drag.coefficient": 1.727e-5})
    since = 1 / (1.727e-5 * 2 * np.pi * 30)  # 1/ω = 0
    assert simulate(spin, -0.99 * since, rate=None).spin_hz[-1] == pytest.approx(3000, rel=1e-6)
    with pytest.raises(SimulationError, match="infinite 307"):
        simulate(spin, -1.01 * since)


@pytest.mark.parametrize("given", [{"step": 0.1}, {"scheme": "strang"}, {"start": np.zeros(18)}, {"events": {}}])
def test_the_spin_alone_takes_nothing_that_is_for_an_integration(given):
    with pytest.raises(SimulationError, match=f"{next(iter(given))}: .*closed form"):
        simulate(UNDRIVEN.changed({"observed": "spin"}), 1.0, **given)


# --- more than can be ---


@pytest.mark.parametrize(
    ("changes", "duration", "named"),
    [
        ({"drive.waveform": "square", "drive.frequency_hz": 9e5}, 30.0, r"drive\.frequency_hz = 900000: .*corners"),
        ({"start.spin_hz": 9e5}, 1e6, "steps of .* would be needed"),
        ({}, 1e10, "duration"),
    ],
)
def test_what_would_take_days_or_all_memory_is_refused_by_name(changes, duration, named):
    with pytest.raises(SimulationError, match=named):
        simulate(UNDRIVEN.changed(changes), duration, rate=None)

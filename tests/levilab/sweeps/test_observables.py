"""What is observed at a point is what a single simulation says of it, whatever lies beside it."""

import math

import numpy as np
import pytest

from analysis.pull import Driven
from analysis.stability import wobble_resonance
from levilab.errors import UsageError
from levilab.motion.summary import as_document, summarise
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.scene import preset
from levilab.simulator.single import simulate
from levilab.sweeps import observables
from levilab.sweeps.observables import check_observables, observe
from levilab.sweeps.plan import Axis, Plan
from levilab.sweeps.quantities import GROUPS, NAMES, OBSERVABLES, columns_of

UNDRIVEN, DRIVEN = preset("undriven"), preset("driven")
SPINS = np.array([19.0, 22.0, 30.0])


def plan(scene, names, duration, *axes):
    made = Plan(scene, axes or (Axis("start.spin_hz", SPINS),), names, duration)
    # a drift turns the axis by 0.1 rad at most
    return Plan(made.scene, made.axes, names, duration, 1e-7, chunk=made.chunk, step_share=0.05)


def summary_of(scene, duration, rate):
    motion = simulate(scene, duration, tolerance=1e-7, rate=rate)
    return as_document(summarise(motion, duration, rate, 1.0))


def test_the_ends_are_those_of_single_simulations():
    names = ("survived", "lifetime_s", "fall_spin_hz", "end_spin_hz", "energy_error", "position_error_m")
    found = observe(plan(UNDRIVEN, names, 4.0), {"start.spin_hz": SPINS})
    assert [found[name].dtype.kind for name in names] == list("bfffff")
    for i, spin in enumerate(SPINS):
        single = summary_of(UNDRIVEN.changed({"start.spin_hz": float(spin)}), 4.0, 100.0)
        assert found["survived"][i] == single["survived"]
        lifetime, at_fall = found["lifetime_s"][i], found["fall_spin_hz"][i]
        if single["survived"]:
            assert math.isnan(lifetime)
            assert math.isnan(at_fall)
        else:  # both are within their tolerance of the truth, where the place says when the fall is
            assert lifetime == pytest.approx(single["end_s"], abs=1e-5)
            assert at_fall == pytest.approx(single["spin_end_hz"], abs=1e-5)
        assert found["end_spin_hz"][i] == pytest.approx(single["spin_end_hz"], abs=1e-5)
        assert found["energy_error"][i] < 1e-6  # a symplectic scheme keeps it within the size of its steps' error
        assert 0 < found["position_error_m"][i] < 1e-5


def test_observables_from_samples_are_those_that_simulate_prints():
    names = ("survived", "locked", "height_spread_m", "lines")
    drives = np.array([30.0, 33.0])
    asked = plan(DRIVEN, names, 10.0, Axis("drive.frequency_hz", drives))
    found = observe(asked, {"drive.frequency_hz": drives})
    assert found["locked"].tolist() == [True, False]
    for i, frequency in enumerate(drives):
        single = summary_of(DRIVEN.changed({"drive.frequency_hz": float(frequency)}), 10.0, 340.0)
        spread = single["height_max_m"] - single["height_min_m"]
        assert found["height_spread_m"][i] == pytest.approx(spread, rel=1e-3)  # other samples of the same motion
        assert found["locked"][i] == single["locked"]
        lines = {line["name"]: line for line in single["lines"]}
        for start, name in observables.LINES.items():
            frequency_hz, amplitude = found[f"{start}_line_hz"][i], found[f"{start}_line_rad"][i]
            if name in lines:
                assert frequency_hz == pytest.approx(lines[name]["frequency_hz"], abs=0.02)
                assert amplitude == pytest.approx(lines[name]["amplitude_rad"], rel=0.05)
            else:
                assert math.isnan(frequency_hz)
    assert found["drive_line_hz"] == pytest.approx(drives, abs=0.01)
    assert found["wobble_line_hz"][1] == pytest.approx(30.0, abs=0.1)


@pytest.mark.parametrize(
    ("scene", "names"),
    [
        (DRIVEN, ("locked", "nutation_line_hz", "wobble_line_rad")),
        (UNDRIVEN, ("survived", "fall_spin_hz", "energy_error", "height_spread_m")),
    ],
)
def test_a_point_has_the_same_bits_alone_and_among_others(scene, names):
    asked = plan(scene, names, 10.0 if "locked" in names else 1.0)
    values = {"start.spin_hz": SPINS[:, None], "top.mass_kg": np.array([0.0244, 0.0249])}
    together = observe(asked, values)
    for i, j in np.ndindex(3, 2):
        alone = observe(asked, {"start.spin_hz": SPINS[i : i + 1], "top.mass_kg": values["top.mass_kg"][j : j + 1]})
        for column in columns_of(names):
            assert together[column.name].shape == (3, 2)
            assert alone[column.name].tobytes() == together[column.name][i, j].tobytes()


def test_ends_alone_are_simulated_without_samples_or_errors(monkeypatch):
    given = {}
    many = observables.simulate_many

    def watched(*arguments, **named):
        given.update(named)
        return many(*arguments, **named)

    monkeypatch.setattr(observables, "simulate_many", watched)
    observe(plan(UNDRIVEN, ("survived", "lifetime_s", "fall_spin_hz"), 0.1), {"start.spin_hz": SPINS})
    assert given["errors"] is False
    assert given["rate"] is None
    assert given["cores"] == 1


def test_the_energy_has_no_error_where_drag_or_drive_change_it():
    for name in ("friction", "driven"):
        found = observe(plan(preset(name), ("energy_error",), 0.1), {"start.spin_hz": SPINS})
        assert np.all(np.isnan(found["energy_error"]))


def test_each_observable_has_a_unit_and_a_meaning():
    for name, one in OBSERVABLES.items():
        assert one.name == name
        assert one.meaning.endswith(".")
        assert one.dtype in {"bool", "float64"}
        assert one.unit == "1" or name.endswith(f"_{one.unit.lower()}")
    assert [column.name for column in columns_of(["survived", "lines", "survived"])] == ["survived", *GROUPS["lines"]]
    assert {"survived", "lines", "locked"} <= set(NAMES)


@pytest.mark.parametrize(
    ("scene", "name", "duration", "said"),
    [
        (UNDRIVEN, "lifetme_s", 10.0, "observe = lifetme_s: there is no such observable; did you mean lifetime_s"),
        (UNDRIVEN, "locked", 10.0, "locked needs a drive"),
        (DRIVEN, "locked", 9.0, "duration = 9: locked needs a duration of 10 s"),
        (preset("friction").changed({"observed": "spin"}), "survived", 10.0, "take observed = motion"),
    ],
)
def test_an_observable_that_no_point_can_have_is_an_error(scene, name, duration, said):
    unknown = Plan(scene, (Axis("start.spin_hz", SPINS),), (name,), 10.0)
    with pytest.raises(UsageError, match=said):
        check_observables(unknown if name == "lifetme_s" else plan(scene, (name,), duration))
    check_observables(plan(UNDRIVEN, ("locked",), 10.0, Axis("drive.amplitude_t", np.array([0.0, 4e-4]))))


def test_the_highest_spin_on_a_ramp_is_where_pull_equals_drag_and_ramp():
    """In full motion, against the closed form: where a top leans in step with its moment, it is pulled more."""
    scene = preset("ramp").changed({"drive.off_s": 1000.0})
    values = {"drive.amplitude_t": np.repeat([3e-4, 4e-4], 2), "drive.ramp_hz_per_s": np.tile([0.05, 0.1], 2)}
    made = Plan(scene, (), ("highest_spin_hz",), 1000.0, 1e-4, step_share=1.0)
    found = observe(made, values)["highest_spin_hz"]
    stability, top = stability_of(scene), scene.top
    resonance = wobble_resonance(stability.field, stability.top, stability.floating.height)
    across = top.moment_tilt[0] * abs(top.moment_a_m2) / (2 * top.inertia_axial_kg_m2)
    expected = [
        Driven(across * amplitude, scene.drag.constants[0], ramp, resonance).highest()
        for amplitude, ramp in zip(*values.values(), strict=True)
    ]
    assert found == pytest.approx(expected, abs=1.0)  # the swing about the drive takes the spin up to 0.7 Hz beside it
    assert np.ptp(expected) > 15


def test_the_highest_spin_of_a_top_that_falls_or_coasts_is_on_the_way():
    values = {"start.spin_hz": np.array([19.0, 30.0])}
    found = observe(plan(preset("friction"), ("highest_spin_hz",), 4.0), values)["highest_spin_hz"]
    assert found == pytest.approx([19.0, 30.0], rel=1e-9)

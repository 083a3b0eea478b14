"""The experiments of the practice bench agree with its scene, and what a person changes at it."""

import math

import pytest

from instruments.clock import VirtualClock
from levilab.acquisition.loop import acquire
from levilab.acquisition.request import AcquisitionOptions, request_at
from levilab.bench.config import Limits
from levilab.live.practice.experiments import PRACTICE, settings_for
from levilab.live.practice.seeds import keys_of_seed
from levilab.live.practice.what_if import USUAL, WHAT_IF, keys_of
from levilab.pipelines.catalogue import ANALYSES
from levilab.present.progress import Display
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.scene import preset
from levilab.world.bench import scene_world, virtual_wiring


@pytest.mark.parametrize("seed", [0, 7])
def test_the_mass_to_set_by_the_scan_floats_on_the_same_bench(tmp_path, seed):
    """A seed changes base and moment; the scan finds the base, and its settings have the moment."""
    scene = preset("practice")
    scene = scene.changed(keys_of_seed(scene, seed))
    options = AcquisitionOptions(mock=True, out=tmp_path, seed=seed, settings=settings_for(PRACTICE["field"], scene))
    wiring = virtual_wiring(scene_world(scene, VirtualClock, lambda _: None, seed=seed), Limits())
    run = acquire(request_at(wiring, scene, "field", options), Display())
    values = ANALYSES["field"].analyze([run.folder]).values
    window = stability_of(scene).lifted[-1]
    for name, mass in (
        ("lightest_mass", window.light),
        ("heaviest_mass", window.heavy),
        ("mass_to_set", (window.light + window.heavy) / 2),
    ):
        # u is 50 mg where the moment is known, as it is here but for its fourth digit
        assert values[name].value == pytest.approx(mass, abs=3 * 5e-5)
        assert values[name].u < 3e-4


@pytest.mark.parametrize(("law", "factor"), [("stokes", 1.0), ("disc", 2**0.5), ("newton", 2.0)])
def test_twice_the_air_drags_as_its_law_goes_with_the_density(law, factor):
    scene = preset("practice").changed({"drag.law": law, "drag.coefficient": 1e-4})
    assert keys_of(scene, {"pressure": 2.0})["drag.coefficient"] == pytest.approx(1e-4 * factor)


@pytest.mark.parametrize("tilt_deg", [0.0, 0.6, 1.5, WHAT_IF["moment_tilt_deg"].high])
def test_a_moment_is_tilted_by_what_its_slider_says(tilt_deg):
    across, along = keys_of(preset("practice"), {"moment_tilt_deg": tilt_deg})["top.moment_tilt"]
    assert math.degrees(math.atan2(across, along)) == pytest.approx(tilt_deg, abs=0.05)  # a tenth is shown


def test_all_as_usual_is_the_usual_top():
    scene = preset("practice")
    assert scene.changed(keys_of(scene, USUAL)).as_table() == scene.as_table()

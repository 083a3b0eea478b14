"""What a person changes at the bench for practice."""

import math

import pytest

from levilab.live.practice.what_if import USUAL, WHAT_IF, keys_of
from levilab.simulator.scene import preset


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

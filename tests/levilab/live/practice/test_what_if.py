"""What a person changes at the bench for practice."""

from __future__ import annotations

import pytest

from levilab.live.practice.what_if import keys_of
from levilab.simulator.scene import preset


@pytest.mark.parametrize(("law", "factor"), [("stokes", 1.0), ("disc", 2**0.5), ("newton", 2.0)])
def test_twice_the_air_drags_as_its_law_goes_with_the_density(law: str, factor: float) -> None:
    scene = preset("practice").changed({"drag.law": law, "drag.coefficient": 1e-4})
    assert keys_of(scene, {"pressure": 2.0})["drag.coefficient"] == pytest.approx(1e-4 * factor)

"""What people are shown of the laws, beside the laws themselves."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.spindown.drag import LAWS, spin
from analysis.spindown.tilt import PARAMETERS
from levilab.pipelines.spindown.laws import SHOWN_LAWS, SYMBOLS
from levilab.present.looks import LOOKS


def test_every_law_that_is_fitted_is_shown_and_every_constant_has_a_symbol() -> None:
    assert list(SHOWN_LAWS) == list(LAWS)
    assert set(SYMBOLS) == {name for law in LAWS.values() for name in law.parameters} | set(PARAMETERS)
    assert len({LOOKS[name].colour for name in SHOWN_LAWS}) == len(SHOWN_LAWS)


@pytest.mark.parametrize(("law", "constant"), [("stokes", 3.2e-3), ("newton", 1.7e-5), ("disc", 2.3e-4)])
def test_what_is_said_to_be_straight_is_straight(law: str, constant: float) -> None:
    straight = SHOWN_LAWS[law].straight
    assert straight is not None
    t = np.linspace(0, 200, 9)
    drawn = straight.transform(2 * np.pi * spin(law, t, 40.0, constant))
    assert np.diff(drawn, 2) == pytest.approx(0, abs=1e-12)  # rounding of numbers of order one

"""The tape of a held top beside its drive."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.errors import TooFewReadings
from analysis.locked import slip_of


def test_a_tape_that_turns_with_the_drive_is_not_warned_of() -> None:
    """One false alarm in 10 000 is expected of four standard uncertainties; 300 draws have none, of any swing."""
    random = np.random.default_rng(2)
    for _ in range(300):
        swing = 0.3 * np.sin(2 * np.pi * (0.3 * np.arange(20) + random.uniform()))
        counts = 30 + random.uniform(0, 1) * swing + 0.03 * random.standard_normal(20)
        assert not slip_of(counts.tolist(), 30.0).warning


def test_a_tape_that_lags_is_loose_washers_and_one_that_leads_is_not() -> None:
    noise = 0.05 * np.random.default_rng(3).standard_normal(20)
    slow = slip_of((30 - 0.17 + noise).tolist(), 30.0)
    assert slow.difference == pytest.approx(-0.17, abs=4 * slow.u)
    assert "LOOSE WASHERS, the tape slips by 0.1" in slow.warning
    fast = slip_of((30 + 0.17 + noise).tolist(), 30.0).warning
    assert "no tape overtakes the drive" in fast
    assert "LOOSE" not in fast


def test_the_drive_may_creep_meanwhile() -> None:
    drives = np.linspace(40, 42, 20)
    assert slip_of((drives - 0.2).tolist(), drives.tolist()).difference == pytest.approx(-0.2)
    with pytest.raises(TooFewReadings):
        slip_of([30.0], 30.0)

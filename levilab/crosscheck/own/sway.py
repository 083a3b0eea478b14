"""Tracks of one window with the lines and the noise of a result."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.sway import swings_in_window
from levilab.crosscheck.own.model import Own
from levilab.crosscheck.subject import Pull, Trial, TrialFailed

if TYPE_CHECKING:
    from levilab.pipelines.sway.analysis import SwayAnalysis

#: Processor time of a trial [s].
_COST_S = 0.16


def trials_of(found: SwayAnalysis) -> Own:
    """Return the trials of the window in the middle of the first track, its samples evenly in time."""
    swings = found.runs[0].swings
    one, times = swings[len(swings) // 2], found.sources[0].readings.time
    count = max(round(len(times) / len(swings)), 2)
    late = (np.arange(count) - (count - 1) / 2) * float(times[-1] - times[0]) / (len(times) - 1)

    def trial(random: np.random.Generator) -> Trial:
        phases = random.uniform(0, 2 * np.pi, one.frequency.size)
        waves = one.amplitude * np.exp(1j * (2 * np.pi * late[:, None] * one.frequency + phases))
        noise = one.noise * (random.standard_normal(count) + 1j * random.standard_normal(count))
        again = swings_in_window(one.time + late, waves.sum(axis=1) + noise)
        if again is None:
            raise TrialFailed("the swings do not stand out of the noise")
        names = ("backward swing", "forward swing")
        each = zip(names, again.frequency.tolist(), again.u.tolist(), one.frequency.tolist(), strict=False)
        return Trial([Pull(name, value, u, truth) for name, value, u, truth in each])

    return Own(
        about="the middle window of the first track: its swings with new phases, and new noise of the same size",
        trial=trial,
        cost_s=_COST_S,
        more=("The shift by the size of the swings is tried by `levilab crosscheck sway`, with tops in full motion.",),
    )

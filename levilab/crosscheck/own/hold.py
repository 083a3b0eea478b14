"""Held spins with the drag and the noise of a result."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.held import hold_of
from levilab.crosscheck.own.model import Own
from levilab.crosscheck.subject import Trial, TrialFailed, pull_of

if TYPE_CHECKING:
    from levilab.pipelines.hold.analysis import HoldAnalysis

#: Processor time of a trial [s].
_COST_S = 0.0005


def trials_of(found: HoldAnalysis) -> Own:
    """Return the trials of the first run: new noise of its counts at the full amplitude, and of its readings."""
    run, one = found.runs[0], found.sources[0].readings
    gain, drag = run.gain, run.drag
    if gain is None or drag is None or gain.value is None or drag.value is None or gain.value + drag.value <= 0:
        raise TrialFailed("the run has no drag")
    slope, held = gain.value, float(run.spin.value or 0.0)
    share = np.full(len(one), drag.value / (slope + drag.value))
    lines = [(t, held + slope * (t - t.mean())) for t, _ in one.gains]
    left = [y - np.polyval(np.polyfit(t, y, 1), t) for t, y in one.gains]
    noise = float(np.sqrt(sum(x @ x for x in left) / sum(len(x) - 2 for x in left)))

    def trial(random: np.random.Generator) -> Trial:
        gains = [(t, y + noise * random.standard_normal(len(t))) for t, y in lines]
        again = hold_of(one.time, held + one.u * random.standard_normal(len(one)), one.u, share, gains)
        return Trial([pull_of("drag", again.drag, drag.value or 0.0)])

    return Own(about="the first run: new noise of the counts and of the readings", trial=trial, cost_s=_COST_S)

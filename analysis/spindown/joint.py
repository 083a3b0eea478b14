"""One exponent of the drag for several spin-downs of one top."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.comparison import weighted_mean
from analysis.spindown.fit import SpinDown


@dataclass(frozen=True)
class JointExponent:
    """One exponent for all runs, near which their misfits together are a parabola.

    Attributes:
        value: n, where their sum is smallest.
        curvature: growth of the sum for each (n − value)².
        misfit: the smallest sum.
        shared_u: of n, by the tilt of the moment, which is the same in all runs.
        runs: their number.
    """

    value: float
    curvature: float
    misfit: float
    shared_u: float
    runs: int

    def misfit_of(self, separate: float) -> float:
        """Return the misfit of a law with one tilt for all runs, from the sum of misfits with a tilt for each run.

        Each run moves its tilt towards the law, and pays for it by the prior, N times for N runs, where one tilt pays
        once: with the curvature a and the shared u s the excess over the smallest misfit is 1 + a s²(1 − 1/N) times
        smaller (product of the runs' normal likelihoods times one prior, at its maximum).
        """
        shared = self.curvature * self.shared_u**2 * (1 - 1 / self.runs)
        return self.misfit + (separate - self.misfit) / (1 + shared)


#: The search ends where the next step is shorter than this, in u of the exponent.
_CLOSE = 0.3
_MOST_STEPS = 5


def joint_exponent(runs: Sequence[SpinDown]) -> JointExponent | None:
    """Return the exponent of one power law for all runs; None where a run has no exponent with u, or of one run.

    By parabolas through three exponents, a u apart, at which every run is fitted again.  The runs' own exponents and
    their u would not do: averaged over the noise, they tell less than the misfits do (Cochran's Q was 10 too small for
    20 runs).
    """
    fits = [fit for run in runs for fit in run.fits if fit.name == "power"]
    exponents = [fit.parameters["exponent"] for fit in fits]
    seen = [(each.value, each.u) for each in exponents if each.value is not None and each.u]
    if len(runs) < 2 or len(seen) < len(runs):
        return None
    values, u = np.array(seen).T
    centre, step, _ = weighted_mean(values, u)
    shared, *_ = weighted_mean(np.array([fit.shared_u.get("exponent", 0.0) for fit in fits]), u)
    for _ in range(_MOST_STEPS):
        below, here, above = (sum(run.misfit(n) for run in runs) for n in (centre - step, centre, centre + step))
        # the runs' u are no smaller than those of their misfits: a bend below a tenth of theirs is one of rounding
        bend = max((below + above) / 2 - here, 0.1)
        move = min(max((below - above) / (4 * bend), -3.0), 3.0)
        found = JointExponent(centre + move * step, bend / step**2, here - bend * move**2, shared, len(runs))
        if abs(move) < _CLOSE:
            break
        centre = found.value
    return found

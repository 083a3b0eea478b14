"""How well laws fit, and which of them the readings favour by the information criteria.

Source: Burnham & Anderson, Model Selection and Multimodel Inference (2002): AICc §2.4, weights §2.9, what a
difference means §2.6.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from analysis.arrays import Array
from analysis.spindown.posterior import STATED_FREEDOM

NO_FIT = 1e-3  # a χ² less probable than this: the law, or the stated uncertainty, is wrong
Criterion = Literal["aicc", "bic", "rms_residual"]


@dataclass(frozen=True)
class Statistics:
    """How well a law fits; None where a number is undefined.

    Attributes:
        n: number of readings.
        n_parameters: of the law; the noise, the tilt and the nutation are averaged over.
        rss: sum of the squared residuals [Hz²].
        rms_residual: root of their mean [Hz].
        chi_square: sum of (residual/u)²; None where u was not given.
        reduced_chi_square: chi_square per degree of freedom.
        aicc: Akaike's criterion, corrected for few readings.
        bic: Schwarz's criterion.
        misfit: −2 ln of the greatest likelihood, see `analysis.spindown.posterior`: what the criteria weigh against the
            number of parameters.
        difference: of the criterion from the best law's; None where the law has no such criterion.
        weight: Akaike weight among the laws fitted.
        durbin_watson: near 2 for noise.
        runs_test_p: small when the signs of the residuals are in no random order.
    """

    n: int
    n_parameters: int
    rss: float
    rms_residual: float
    chi_square: float | None
    reduced_chi_square: float | None
    aicc: float | None
    bic: float | None
    misfit: float
    difference: float | None
    weight: float | None
    durbin_watson: float | None
    runs_test_p: float | None

    @property
    def sigma_known(self) -> bool:
        """Whether the uncertainties of the readings were given."""
        return self.chi_square is not None

    @property
    def degrees_of_freedom(self) -> int:
        """Readings beyond the parameters."""
        return self.n - self.n_parameters

    @property
    def variance_factor(self) -> float:
        """The variance of the readings in units of the stated one, what was stated counting as 8 readings; else 1."""
        if self.chi_square is None:
            return 1.0
        return (STATED_FREEDOM + self.chi_square) / (STATED_FREEDOM + max(self.degrees_of_freedom, 0))


def statistics(
    *,
    n: int,
    n_parameters: int,
    rss: float,
    chi_square: float | None,
    misfit: float,
    durbin_watson: float | None,
    runs_test_p: float | None,
    runs: int = 1,
) -> Statistics:
    """Return the statistics of one fit, its weight not yet among them.

    AICc = misfit + 2K + 2K(K+1)/(n−K−1), BIC = misfit + K ln n; to the parameters K adds the size of the noise of each
    of the runs.
    """
    freedom, k = n - n_parameters, n_parameters + runs
    return Statistics(
        n=n,
        n_parameters=n_parameters,
        rss=rss,
        rms_residual=float(np.sqrt(rss / n)),
        chi_square=chi_square,
        reduced_chi_square=chi_square / freedom if chi_square is not None and freedom > 0 else None,
        aicc=misfit + 2 * k + 2 * k * (k + 1) / (n - k - 1) if n - k > 1 else None,
        bic=misfit + k * float(np.log(n)) if freedom > 0 else None,  # else it fits any readings
        misfit=misfit,
        difference=None,
        weight=None,
        durbin_watson=durbin_watson,
        runs_test_p=runs_test_p,
    )


def find_failed(fits: Mapping[str, Statistics], frequency: Array) -> frozenset[str]:
    """Return the laws whose fit is worse than a constant, and twice as bad as that of another law.

    Args:
        fits: statistics by the law's name.
        frequency: readings that were fitted, shape (n,) [Hz].
    """
    most = max(float(np.std(frequency)), 2 * min(fit.rms_residual for fit in fits.values()))
    return frozenset(name for name, fit in fits.items() if fit.rms_residual > most)


def weigh(fits: Mapping[str, Statistics], failed: Collection[str] = ()) -> tuple[dict[str, Statistics], Criterion]:
    """Return the statistics with differences and Akaike weights, best law first, and the criterion that decided.

    Laws whose fit failed have neither.
    AICc where any law has one, else BIC, else the rms residual; with the latter two there are no weights.
    """
    criteria: tuple[Criterion, ...] = ("aicc", "bic", "rms_residual")
    fitted = {name: fit for name, fit in fits.items() if name not in failed}
    chosen = next(c for c in criteria if any(getattr(fit, c) is not None for fit in fitted.values()))
    values = {name: value for name, fit in fitted.items() if (value := getattr(fit, chosen)) is not None}
    least = min(values.values())
    total = sum(float(np.exp((least - value) / 2)) for value in values.values())
    weighed = {}
    for name, value in sorted(values.items(), key=lambda item: item[1]):
        weight = float(np.exp((least - value) / 2)) / total if chosen == "aicc" else None
        weighed[name] = replace(fits[name], difference=value - least, weight=weight)
    return weighed | {name: fit for name, fit in fits.items() if name not in values}, chosen

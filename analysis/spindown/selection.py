"""How well laws fit, and which of them the readings favour by the information criteria.

Source: Burnham & Anderson, Model Selection and Multimodel Inference (2002): AICc §2.4, weights §2.9, what a
difference means §2.6, inflated variance (QAICc) §2.5.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

NO_FIT = 1e-3  # a χ² less probable than this: the law, or the stated uncertainty, is wrong


@dataclass(frozen=True)
class Statistics:
    """How well a law fits; None where a number is undefined.

    Attributes:
        n: number of readings.
        n_parameters: fitted, the noise not counted.
        rss: sum of the squared residuals [Hz²].
        rms_residual: root of their mean [Hz].
        chi_square: sum of (residual/u)²; None where u was not given.
        reduced_chi_square: chi_square per degree of freedom.
        aicc: Akaike's criterion, corrected for few readings.
        bic: Schwarz's criterion.
        misfit: χ², or n ln(RSS/n) where u was not given: what the criteria weigh against the number of parameters.
        difference: of the criterion from the best law's, as it decides; None where the law has no such criterion.
        weight: Akaike weight among the laws fitted.
        durbin_watson: near 2 for noise.
        runs_test_p: small when the signs of the residuals are in no random order.
        n_effective: how many independent readings are worth as much, where the noise of neighbours is correlated.
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
    n_effective: float | None = None

    @property
    def sigma_known(self) -> bool:
        """Whether the uncertainties of the readings were given."""
        return self.chi_square is not None

    @property
    def degrees_of_freedom(self) -> int:
        """Readings beyond the parameters."""
        return self.n - self.n_parameters

    @property
    def durbin_watson_u(self) -> float:
        """By how much chance alone scatters the Durbin–Watson statistic about 2 (large n)."""
        return 2 / float(np.sqrt(self.n))

    @property
    def has_shape(self) -> bool:
        """Whether the residuals are in no random order."""
        runs = self.runs_test_p is not None and self.runs_test_p < 0.01
        return runs or (self.durbin_watson is not None and abs(self.durbin_watson - 2) > 3 * self.durbin_watson_u)

    @property
    def inflation(self) -> float:
        """By how much the variance exceeds the stated one: reduced χ² where chance does not explain it, else 1."""
        if self.chi_square is None or self.reduced_chi_square is None:
            return 1.0
        from scipy.special import gammaincc

        improbable = gammaincc(self.degrees_of_freedom / 2, self.chi_square / 2) < NO_FIT
        return self.reduced_chi_square if improbable and self.reduced_chi_square > 1 else 1.0


def statistics(
    *,
    n: int,
    n_parameters: int,
    rss: float,
    least_rss: float,
    chi_square: float | None,
    durbin_watson: float | None,
    runs_test_p: float | None,
) -> Statistics:
    """The statistics of one fit, its weight not yet among them.

    With known uncertainties AICc = χ² + 2p + 2p(p+1)/(n−p−1); else AICc = n ln(RSS/n) + 2K + 2K(K+1)/(n−K−1),
    K = p + 1, as the noise is fitted too. `least_rss` [Hz²] is what rounding alone leaves: RSS is taken no smaller.
    """
    freedom = n - n_parameters
    if chi_square is None:
        misfit, k = n * float(np.log(max(rss, least_rss) / n)), n_parameters + 1
    else:
        misfit, k = chi_square, n_parameters
    penalty = _penalty(n, k)
    return Statistics(
        n=n,
        n_parameters=n_parameters,
        rss=rss,
        rms_residual=float(np.sqrt(rss / n)),
        chi_square=chi_square,
        reduced_chi_square=chi_square / freedom if chi_square is not None and freedom > 0 else None,
        aicc=None if penalty is None else misfit + penalty,
        bic=misfit + k * float(np.log(n)) if freedom > 0 or chi_square is not None else None,
        misfit=misfit,
        difference=None,
        weight=None,
        durbin_watson=durbin_watson,
        runs_test_p=runs_test_p,
    )


def _penalty(n: int, k: int) -> float | None:
    """AICc's price of k parameters; None where n readings are too few for it."""
    return 2 * k + 2 * k * (k + 1) / (n - k - 1) if n - k > 1 else None


def variance_factor(fits: Mapping[str, Statistics]) -> float:
    """In what units χ² counts: 1, or the best law's reduced χ² if no law fits within the stated uncertainties.

    These are wrong then, and must not exclude laws by mistake (ĉ of QAICc).
    """
    return min(fit.inflation for fit in fits.values())


def deviance(fit: Statistics, factor: float) -> float:
    """What is left of the misfit when χ² counts in those units, and correlated readings as fewer."""
    share = 1.0 if fit.n_effective is None else fit.n_effective / fit.n
    return share * (fit.misfit / factor if fit.sigma_known else fit.misfit)


def _criteria(fit: Statistics, factor: float) -> dict[str, float | None]:
    estimated = 1 if not fit.sigma_known or factor > 1 else 0  # the noise, or ĉ, is a parameter too
    k = fit.n_parameters + estimated
    penalty = _penalty(fit.n, k)
    return {
        "aicc": None if penalty is None else deviance(fit, factor) + penalty,
        "bic": None if fit.bic is None else deviance(fit, factor) + k * float(np.log(fit.n)),
        "rms_residual": fit.rms_residual,
    }


def weigh(fits: Mapping[str, Statistics]) -> tuple[dict[str, Statistics], str]:
    """The same statistics with differences and Akaike weights, best law first, and the criterion that decided.

    AICc where any law has one, else BIC, else the rms residual; with the latter two there are no weights.
    """
    factor = variance_factor(fits)
    criteria = {name: _criteria(fit, factor) for name, fit in fits.items()}
    chosen = next(c for c in ("aicc", "bic", "rms_residual") if any(row[c] is not None for row in criteria.values()))
    values = {name: value for name, row in criteria.items() if (value := row[chosen]) is not None}
    least = min(values.values())
    total = sum(float(np.exp((least - value) / 2)) for value in values.values())
    weighed = {}
    for name, value in sorted(values.items(), key=lambda item: item[1]):
        weight = float(np.exp((least - value) / 2)) / total if chosen == "aicc" else None
        weighed[name] = replace(fits[name], difference=value - least, weight=weight)
    return weighed | {name: fit for name, fit in fits.items() if name not in values}, chosen

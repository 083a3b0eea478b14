"""Which of several laws do the readings favour? Information criteria, and a verdict in words.

Source: Burnham & Anderson, Model Selection and Multimodel Inference (2002): AICc §2.4, weights §2.9, what a
difference means §2.6, inflated variance (QAICc) §2.5.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

EXCLUDED, TIED = 10.0, 4.0  # differences of AICc, Burnham & Anderson §2.6
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
    def inflation(self) -> float:
        """By how much the variance exceeds the stated one: reduced χ² where chance does not explain it, else 1."""
        if self.chi_square is None or self.reduced_chi_square is None:
            return 1.0
        from scipy.special import gammaincc

        improbable = gammaincc(self.degrees_of_freedom / 2, self.chi_square / 2) < NO_FIT
        return self.reduced_chi_square if improbable and self.reduced_chi_square > 1 else 1.0


@dataclass(frozen=True)
class Verdict:
    """What the readings say about the laws.

    Attributes:
        best: name of the law with the smallest criterion.
        excluded: names of laws the readings exclude, each with the reason.
        indistinguishable: names of the laws that fit as well as the best one, which comes first.
        weak: names of laws disfavoured but not excluded.
        text: the same in one to four sentences.
    """

    best: str
    excluded: tuple[tuple[str, str], ...]
    indistinguishable: tuple[str, ...]
    weak: tuple[str, ...]
    text: str


SPECIAL_CASES = {"mixed": ("stokes", "newton"), "power": ("stokes", "newton", "disc")}
_SIMPLE = ("stokes", "newton", "disc")


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
    correction = 2 * k * (k + 1) / (n - k - 1) if n - k > 1 else None
    return Statistics(
        n=n,
        n_parameters=n_parameters,
        rss=rss,
        rms_residual=float(np.sqrt(rss / n)),
        chi_square=chi_square,
        reduced_chi_square=chi_square / freedom if chi_square is not None and freedom > 0 else None,
        aicc=None if correction is None else misfit + 2 * k + correction,
        bic=misfit + k * float(np.log(n)) if freedom > 0 or chi_square is not None else None,
        weight=None,
        durbin_watson=durbin_watson,
        runs_test_p=runs_test_p,
    )


def _differences(fits: Mapping[str, Statistics]) -> tuple[dict[str, float], str]:
    """By how much each law's criterion exceeds the smallest, and which criterion it is.

    AICc where it exists, else BIC, else the rms residual. If no law fits within the stated uncertainties these are
    wrong, and χ² counts in units of the best law's reduced χ² (QAICc), lest it exclude laws by mistake.
    """
    inflation = min(fit.inflation for fit in fits.values())

    def corrected(fit: Statistics, value: float) -> float:
        return value if fit.chi_square is None else value - fit.chi_square * (1 - 1 / inflation)

    for criterion in ("aicc", "bic", "rms_residual"):
        values = {
            name: corrected(fit, getattr(fit, criterion))
            for name, fit in fits.items()
            if getattr(fit, criterion) is not None
        }
        if values:
            break
    least = min(values.values())
    return {name: value - least for name, value in sorted(values.items(), key=lambda item: item[1])}, criterion


def weigh(fits: Mapping[str, Statistics]) -> dict[str, Statistics]:
    """The same statistics with Akaike weights: exp(−ΔAICc/2), normalised over the laws that have an AICc."""
    differences, criterion = _differences(fits)
    if criterion != "aicc":
        return dict(fits)
    likelihoods = {name: float(np.exp(-difference / 2)) for name, difference in differences.items()}
    total = sum(likelihoods.values())
    return {
        name: replace(fit, weight=likelihoods[name] / total) if name in likelihoods else fit
        for name, fit in fits.items()
    }


def verdict(fits: Mapping[str, Statistics], *, fall: float, exponent_u: float | None) -> Verdict:
    """What the readings say about the laws.

    Args:
        fits: statistics by the law's name.
        fall: part of the spin lost between the first and the last reading, 0 to 1.
        exponent_u: standard uncertainty of the free exponent, where it was fitted and has one.
    """
    differences, criterion = _differences(fits)
    best = next(iter(differences))
    if criterion == "aicc" or (criterion == "bic" and fits[best].sigma_known):
        tied = tuple(name for name, d in differences.items() if d <= TIED)
        weak = tuple(name for name, d in differences.items() if TIED < d <= EXCLUDED)
    else:  # so few readings, of unknown uncertainty, that nothing tells a bad fit from a good one
        tied, weak = tuple(differences), ()
    excluded = tuple(
        (name, _reason(fits[name], fits[best], differences[name], criterion))
        for name in differences
        if name not in tied and name not in weak
    )
    sentences = [_about_best(tied)]
    if excluded:
        sentences.append(f"They exclude {_list([f'{name} ({reason})' for name, reason in excluded])}.")
    if weak:
        described = [f"{name} (Δ{_LABEL[criterion]} {differences[name]:.1f})" for name in weak]
        sentences.append(
            f"They speak against {_list(described)}, but do not exclude {'it' if len(weak) == 1 else 'them'}."
        )
    doubtful = exponent_u is not None and exponent_u > 0.5 and not excluded  # the simple laws' exponents differ by ½
    if doubtful or sum(name in _SIMPLE for name in (*tied, *weak)) > 1:
        sentences.append(
            f"For readings of this precision a fall of the spin by {100 * fall:.2g} % is too little to tell by: let it "
            "fall further, or measure it better."
        )
    return Verdict(best, excluded, tied, weak, " ".join(sentences))


_LABEL = {"aicc": "AICc", "bic": "BIC", "rms_residual": "rms"}


def _list(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _about_best(tied: Sequence[str]) -> str:
    best, *others = tied
    if not others:
        return f"The {best} law describes the readings best."
    text = f"The {best} law describes the readings best, but they do not tell {_list(others)} from it"
    general = [name for name in tied if any(special in tied for special in SPECIAL_CASES.get(name, ()))]
    if not general:
        return f"{text}."
    special = [name for name in tied if any(name in SPECIAL_CASES[g] for g in general)]
    contain = f"{_list(general)} {'contain' if len(general) > 1 else 'contains'} {_list(special)}"
    cases = "special cases" if len(special) > 1 else "a special case"
    return f"{text} ({contain} as {cases}, so that tie is to be expected)."


def _reason(fit: Statistics, best: Statistics, difference: float, criterion: str) -> str:
    reason = (
        f"Δ{_LABEL[criterion]} {difference:.0f}, rms residual {fit.rms_residual:.2g} Hz "
        f"against {best.rms_residual:.2g} Hz"
    )
    if fit.runs_test_p is not None and fit.runs_test_p < 0.01:
        p = f"p = {fit.runs_test_p:.1g}" if fit.runs_test_p > 1e-9 else "p < 1e-9"
        reason += f", residuals in no random order: {p}"
    return reason

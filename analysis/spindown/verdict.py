"""The verdict of the readings about the laws, in words.

A law is excluded by a fit that is worse, never by the number of its constants: a law that fits as well with more of
them is only more than is needed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, log10

from analysis.numbers import digits
from analysis.residuals import Correlation
from analysis.spindown.drag import LAWS
from analysis.spindown.selection import Statistics, deviance, variance_factor
from analysis.uncertainty import Estimate

EXCLUDED, TIED = 10.0, 4.0  # differences of AICc, Burnham & Anderson (2002) §2.6
# Residuals that noise with a correlation of `analysis.residuals.NOISE` makes less often than this have a shape; where
# the scatter exceeds the stated uncertainties, this much is enough against independent readings.
SHAPE, SHAPE_BEYOND_U = 0.005, 0.01
SPECIAL_CASES = {law.name: tuple(one.name for one in LAWS.values() if law.contains(one)) for law in LAWS.values()}
#: u of an exponent, or of an angle [rad].
TOO_SMALL = 5e-10
_SIMPLE = tuple(law.name for law in LAWS.values() if law.exponent is not None)


@dataclass(frozen=True)
class Verdict:
    """The verdict; every law is in one of the four lists.

    Attributes:
        best: name of the law with the smallest criterion.
        decided: whether the readings single out one of the simple laws, or a general one before all of them: no law
            with fewer constants fits as well.
        indistinguishable: names of the laws that fit as well as the best one, which comes first.
        needless: names of laws that fit as well, but with more constants than it takes.
        weak: names of laws disfavoured but not excluded.
        excluded: names of laws the readings exclude, each with the reason.
        text: the same in a few sentences.
        describes: whether any law describes the readings: what the best one leaves over may be noise.
    """

    best: str
    decided: bool
    indistinguishable: tuple[str, ...]
    needless: tuple[str, ...]
    weak: tuple[str, ...]
    excluded: tuple[tuple[str, str], ...]
    text: str
    describes: bool = True


def verdict(
    fits: Mapping[str, Statistics],
    criterion: str,
    *,
    fall: float,
    exponent: Estimate | None,
    correlation: Correlation | None = None,
    tilt: Estimate | None = None,
    broken: str = "",
) -> Verdict:
    """What the readings say about the laws.

    Args:
        fits: statistics by the law's name, weighed, best law first.
        criterion: by which.
        fall: part of the spin lost between the first and the last reading, 0 to 1.
        exponent: of the power law, where it was fitted.
        correlation: of what the best law leaves over.
        tilt: of the moment against the axis [rad], where the count shows it.
        broken: what no drag and no noise does with the readings, as a clause; empty: nothing of the kind.
    """
    best = next(iter(fits))
    telling = criterion == "aicc" or (criterion == "bic" and fits[best].sigma_known)
    kinds = {name: _kind(fits, name, best) if telling else "tied" for name in fits}
    listed = {kind: tuple(name for name in fits if kinds[name] == kind) for kind in ("tied", "needless", "weak")}
    excluded = tuple((name, _reason(name, best, fits)) for name in fits if kinds[name] == "excluded")
    open_ = [name for name in (*listed["tied"], *listed["weak"]) if name in _SIMPLE]
    described = not broken and _describes(fits[best], correlation)
    alike = sorted(listed["tied"], key=lambda name: fits[name].n_parameters)
    simpler = fits[alike[0]].n_parameters < fits[best].n_parameters
    decided = telling and len(open_) <= 1 and described and not simpler
    if not described:
        first = _no_law(best, fits[best], correlation, broken)
    elif decided:
        first = _about_best(listed["tied"], exponent)
    else:
        first = _alike(alike, exponent) if len(open_) == 1 else _undecided(fits[best].n, fall, open_)
    sentences = [
        first,
        _sentence("The readings exclude", [f"{name} ({reason})" for name, reason in excluded], ""),
        _sentence(
            "They speak against",
            [f"{n} (ΔAICc {fits[n].difference:.1f})" for n in listed["weak"]],
            ", without excluding it",
        ),
        _about_needless(listed["needless"], best, exponent) if decided else "",
        _about_tilt(tilt),
    ]
    text = " ".join(filter(None, sentences))
    return Verdict(best, decided, listed["tied"], listed["needless"], listed["weak"], excluded, text, described)


def _describes(best: Statistics, correlation: Correlation | None) -> bool:
    """Whether what the best law leaves over may be noise, correlated perhaps."""
    if correlation is None:
        return True
    return correlation.p_shape >= SHAPE and not (best.inflation > 1 and correlation.p < SHAPE_BEYOND_U)


def _no_law(best: str, fit: Statistics, correlation: Correlation | None, broken: str) -> str:
    alike = f", neighbours correlated by {correlation.value:.2f}" if correlation else ""
    beyond = f", {digits(fit.inflation**0.5)} times the stated uncertainties" if fit.inflation > 1 else ""
    left = f"what the best one, {best}, leaves over ({digits(fit.rms_residual)} Hz rms{beyond})"
    why = f"{broken}; {left} is no noise" if broken else f"{left} has a shape{alike}"
    return (
        f"No law describes these readings: {why}. Its constants and their uncertainties are those of a curve through "
        "the readings, not of a drag."
    )


def _about_tilt(tilt: Estimate | None) -> str:
    if tilt is None or tilt.value is None or not tilt.u:
        return ""
    return f"The counter sees the wobble of the top: its moment is tilted against its axis by {_value(tilt)} rad."


def _kind(fits: Mapping[str, Statistics], name: str, best: str) -> str:
    """tied, needless, weak or excluded."""
    fit, factor = fits[name], variance_factor(fits)
    if fit.difference is None:  # more constants than the readings can bear
        return "needless"
    if fit.difference <= TIED:
        return "tied"
    general = best in SPECIAL_CASES.get(name, ())
    more = fit.n_parameters > fits[best].n_parameters
    if general or (more and deviance(fit, factor) - deviance(fits[best], factor) <= TIED):
        return "needless"
    return "weak" if fit.difference <= EXCLUDED else "excluded"


def _reason(name: str, best: str, fits: Mapping[str, Statistics]) -> str:
    fit = fits[name]
    shape = ", and its residuals have a shape" if fit.has_shape else ""
    own, least = _told_apart(fit.rms_residual, fits[best].rms_residual)
    left = f"it leaves {own} Hz rms, {best} {least} Hz"
    return f"ΔAICc {fit.difference:.0f}: {left}{shape}"


def _told_apart(one: float, other: float) -> tuple[str, str]:
    """Two numbers with as many digits as it takes to tell them apart.

    >>> _told_apart(0.0204, 0.0197), _told_apart(0.2, 0.027)
    (('0.0204', '0.0197'), ('0.2', '0.027'))
    """
    for count in range(2, 8):
        texts = digits(one, count), digits(other, count)
        if texts[0] != texts[1]:
            break
    return texts


def _about_best(tied: Sequence[str], exponent: Estimate | None) -> str:
    best, *others = tied
    if best == "power":
        best = f"power law, {_in_words(exponent)},"
        return (
            f"The {best} fits best."
            if not others
            else f"The {best} fits best; {_list(others)} cannot be distinguished from it."
        )
    if not others:
        return f"The {best} law fits best."
    named = [f"power, {_in_words(exponent)}," if name == "power" else name for name in others]
    contains = [name for name in others if best in SPECIAL_CASES.get(name, ())]
    expected = " which contains it," if contains == others == ["power"] else ""
    return f"The {best} law fits best; {_list(named)}{expected} cannot be distinguished from it.".replace(",,", ",")


def _alike(names: Sequence[str], exponent: Estimate | None) -> str:
    """Of laws that fit as well as each other, the one with the fewest constants first."""
    named = [f"power, {_in_words(exponent)}," if name == "power" else name for name in names]
    laws = f"The laws {_list(named)} cannot be told apart".replace(",,", ",")
    return (
        f"{laws}: they fit as well as each other, {names[0]} with the fewest constants. More runs, or a longer fall of "
        "the spin, can tell."
    )


def _undecided(n: int, fall: float, names: Sequence[str]) -> str:
    laws = _list(names) if len(names) > 1 else "the laws"
    return (
        f"These {n} readings cannot distinguish {laws}: over a fall of the spin by {digits(100 * fall)} % they differ "
        "too little for readings of this number and precision. Let the top fall further, or read it more often."
    )


def _about_needless(needless: Sequence[str], best: str, exponent: Estimate | None) -> str:
    if not needless:
        return ""
    named = [f"power, {_in_words(exponent)}," if name == "power" else name for name in needless]
    fits = "fit" if len(named) > 1 else "fits"
    return f"{_list(named)} {fits} as well as {best}, with more constants than it takes.".replace(", ,", ",")


def _in_words(exponent: Estimate | None) -> str:
    """An exponent as n = 1.507 ± 0.006."""
    if exponent is None or exponent.value is None or not exponent.u:
        return "of whatever exponent"
    return f"n = {_value(exponent)}"


def _value(estimate: Estimate) -> str:
    """As 1.507 ± 0.006; without u where that is smaller than any measurement makes it."""
    assert estimate.value is not None
    assert estimate.u
    if estimate.u < TOO_SMALL:
        return f"{round(estimate.value, 9) + 0.0:.9g}"
    digits = min(max(0, -floor(log10(estimate.u)) + (estimate.u < 3 * 10 ** floor(log10(estimate.u)))), 9)
    return f"{estimate.value:.{digits}f} ± {estimate.u:.{digits}f}"


def _sentence(start: str, names: Sequence[str], end: str) -> str:
    return f"{start} {_list(names)}{end}." if names else ""


def _list(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"

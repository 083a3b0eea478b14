"""The verdict of the readings about the laws.

A law is excluded by a fit that is worse, never by the number of its constants: a law that fits as well with more of
them is only more than is needed.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from analysis.residuals import Change
from analysis.spindown.drag import LAWS
from analysis.spindown.selection import Criterion, Statistics

EXCLUDED, TIED = 10.0, 4.0  # differences of AICc, Burnham & Anderson (2002) §2.6
#: Probability of a change in noise below which no law describes the readings; of several runs, in any of them.
CHANGED = 0.001


@dataclass(frozen=True)
class Verdict:
    """The verdict; every law is in one of the four lists.

    Attributes:
        best: name of the law that results are shown by: of those that fit as well as the one with the smallest
            criterion, that with the fewest constants.
        decided: whether the readings single out one of the simple laws, or a general one before all of them: no law
            with fewer constants fits as well.
        indistinguishable: names of the laws that fit as well as the best one, with the fewest constants first.
        needless: names of laws that fit as well, but need more constants.
        weak: names of laws disfavoured but not excluded.
        excluded: names of laws the readings exclude.
        change: the most improbable change of the readings about the best law [Hz]; None: none can be told.
        changed: numbers, from 0 on, of the runs that no law describes.
        describes: whether any law describes the readings: of several runs, more than half of them.
    """

    best: str
    decided: bool
    indistinguishable: tuple[str, ...]
    needless: tuple[str, ...]
    weak: tuple[str, ...]
    excluded: tuple[str, ...]
    change: Change | None = None
    changed: tuple[int, ...] = ()
    describes: bool = True


def is_change(p: float, runs: int) -> bool:
    """Return whether a change of probability p is more than noise makes in any of some runs (Bonferroni)."""
    return p * runs < CHANGED


def verdict(
    fits: Mapping[str, Statistics],
    criterion: Criterion,
    *,
    change: Change | None = None,
    changes: tuple[float, ...] = (),
    failed: Collection[str] = (),
) -> Verdict:
    """Return what the readings say about the laws.

    Args:
        fits: statistics by the law's name, weighed, best law first.
        criterion: by which.
        change: the most improbable one about the law with the smallest criterion, of one run.
        changes: probabilities of the most improbable change in each of several runs.
        failed: names of laws whose fit failed: they are excluded.
    """
    first = next(iter(fits))
    telling = criterion == "aicc" or (criterion == "bic" and fits[first].sigma_known)
    kinds = {name: _kind(fits, name, first) if telling else "tied" for name in fits} | dict.fromkeys(failed, "excluded")
    listed = {k: tuple(n for n in fits if kinds[n] == k) for k in ("tied", "needless", "weak", "excluded")}
    listed["tied"] = tuple(sorted(listed["tied"], key=lambda name: fits[name].n_parameters))
    probabilities = changes or ((change.p,) if change else ())
    changed = tuple(k for k, p in enumerate(probabilities) if is_change(p, len(probabilities)))
    describes = 2 * len(changed) <= len(probabilities) - (len(probabilities) == 1)
    simple = [name for name in (*listed["tied"], *listed["weak"]) if is_simple(name)]
    best = listed["tied"][0]
    return Verdict(
        best,
        telling and len(simple) <= 1 and describes and best == first,
        indistinguishable=listed["tied"],
        needless=listed["needless"],
        weak=listed["weak"],
        excluded=listed["excluded"],
        change=change,
        changed=changed,
        describes=describes,
    )


def is_simple(name: str) -> bool:
    """Return whether a law contains no other one."""
    return not any(LAWS[name].contains(other) for other in LAWS.values())


def _kind(fits: Mapping[str, Statistics], name: str, best: str) -> str:
    """Return tied, needless, weak or excluded."""
    fit = fits[name]
    if fit.difference is None:  # more constants than the readings can bear
        return "needless"
    if fit.difference <= TIED:
        return "tied"
    worse = fit.difference
    if fit.n_parameters > fits[best].n_parameters:  # what more constants cost in the criterion excludes no law
        worse = min(worse, fit.misfit - fits[best].misfit)
    if LAWS[name].contains(LAWS[best]) or worse <= TIED:
        return "needless"
    return "weak" if worse <= EXCLUDED else "excluded"

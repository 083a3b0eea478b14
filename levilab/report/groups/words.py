"""What the groups of a class say together, as sentences."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from analysis.numbers import digits
from analysis.uncertainty import Estimate
from levilab.present.numbers import plain, with_uncertainty
from levilab.present.units import unit

if TYPE_CHECKING:
    from levilab.report.groups.beside import Class, Compared

#: Below it chance does not make groups differ so much.
DIFFER = 0.01
#: Degrees of freedom from which on a scatter is known well enough, to a third.
_FEW = 5
#: Share of groups within 2 u of their truth, where u is right.
_WITHIN_2_U = 0.954


def finding(of: Class) -> str:
    """Return the mean of the class and whether its groups agree, in one sentence."""
    if not of.quantities:
        return f"{len(of.groups)} groups: no quantity has a value with u"
    first = of.quantities[0]
    return f"{_mean(first)}, mean of {_count(first)}: {_agreement(first)}"


def verdict(of: Class) -> str:
    """Return what the class found, quantity by quantity, and how well it met the truth."""
    texts = [f"{_mean(one)} is the mean of {_count(one)}; {_chi_square(one)}." for one in of.quantities]
    return "  ".join([*texts, *([_truth(of)] if of.knows_truth else [])]) or finding(of)


def _mean(of: Compared) -> str:
    together = of.together
    if together is None:
        return of.symbol
    factor = unit(of.unit).shown.factor
    return f"{of.symbol} = {with_uncertainty(Estimate(together.mean * factor, together.u * factor, of.shown_unit))}"


def _count(of: Compared) -> str:
    n = sum(one is not None for one in of.estimates)
    return f"{n} group{'s' * (n > 1)}"


def _agreement(of: Compared) -> str:
    together = of.together
    if together is None or together.scatter is None:
        return "there is nothing to compare it with"
    return "the groups differ by more than their u" if together.p < DIFFER else "the groups agree within their u"


def _chi_square(of: Compared) -> str:
    together = of.together
    if together is None or together.scatter is None:
        return "there is no other group to compare it with"
    p = "p < 10⁻⁶" if together.p < 1e-6 else f"p = {plain(together.p, 2)}"
    scatter = f"{digits(100 * together.scatter / abs(together.mean), 2)} %" if together.mean else "—"
    how = f"χ² = {plain(together.chi_square)} for {together.freedom} degrees of freedom ({p})"
    if together.p < DIFFER:
        return (
            f"{how}: the groups differ by more than their u, by {scatter} (standard deviation), as different tops do; "
            f"that is in u of the mean and in each distance from it{_known_to(together.freedom)}"
        )
    return f"{how}: the groups agree within their u; their standard deviation is {scatter}"


def _known_to(freedom: int) -> str:
    """Return how well few groups give their scatter, with the interval that holds the mean in 68 % of all classes."""
    from scipy.special import stdtrit

    if freedom >= _FEW:
        return ""
    known, factor = 100 / math.sqrt(2 * freedom), float(stdtrit(freedom, 0.5 + 0.6827 / 2))
    return f"; {freedom + 1} groups give their scatter to {known:.0f} % only: a 68 % interval is {digits(factor, 2)} u"


def _truth(of: Class) -> str:
    distances = [one for quantity in of.quantities for one in quantity.from_truth if one is not None]
    near = sum(abs(one) <= 2 for one in distances)
    return (
        f"On the virtual bench the truth is known: {near} of {len(distances)} values lie within 2 u of it, "
        f"{100 * _WITHIN_2_U:.0f} % are expected."
    )

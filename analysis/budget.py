"""Uncertainty budgets: what the standard uncertainty of a result is made of, row by row.

A row is an input quantity with its standard uncertainty, and how much of it arrives at the result: |c|·u, where c is
the sensitivity, the change of the result with the input (JCGM 100:2008 (GUM) §5.1.2).  Rows are uncorrelated, so their
squares add up.  What u of a result does not contain is a row, too, and said to be none of its parts: a time base, for
instance, is common to all readings and to all runs, and no repetition shows it.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import hypot, sqrt
from typing import Literal

from analysis.arrays import Array

#: Relative: the rows add up to u, but for rounding and the digits in which results are kept.
ROUNDING = 1e-6
#: A result's u grows by less than this with the rows that are not in it: they are negligible.
NEGLIGIBLE = 0.01


@dataclass(frozen=True)
class Component:
    """A row of a budget.

    Attributes:
        name: the same in all versions, a word or two with underscores.
        source: description of the uncertain input.
        kind: "A", from a scatter that was seen, or "B", from anything else (GUM §2.3).
        u: standard uncertainty of the input quantity, in `unit`; None where it is not known.
        unit: of the input quantity.
        sensitivity: change of the result with the input, in the result's unit per `unit`.
        included: whether u of the result has it.
        note: where the number comes from, or what to know of it.
        remedy: what would make it smaller, as the end of a sentence; empty where nothing would.
    """

    name: str
    source: str
    kind: Literal["A", "B"]
    u: float | None
    unit: str
    sensitivity: float
    included: bool = True
    note: str = ""
    remedy: str = ""

    @property
    def contribution(self) -> float | None:
        """The contribution to u of the result, in the result's unit."""
        return None if self.u is None else abs(self.sensitivity) * self.u


@dataclass(frozen=True)
class Budget:
    """What u of a result is made of.

    Attributes:
        quantity: name of the result, as results have it.
        value, u, unit: of the result.
        components: the rows.
        model: of which model it is a parameter; empty where there is one model alone.
        group: number of the group of inputs that the result is of, from 0; None: of all inputs.

    >>> noise = Component("scatter", "scatter of the readings", "A", 0.3, "Hz", 0.1)
    >>> clock = Component("time_base", "the counter's clock", "B", 4e-4, "1", 100.0, included=False)
    >>> budget = Budget("frequency", 100.0, 0.03, "Hz", (noise, clock))
    >>> budget.closes, round(budget.u_with_all, 3), budget.share(noise)
    (True, 0.05, 1.0)
    """

    quantity: str
    value: float
    u: float
    unit: str
    components: tuple[Component, ...]
    model: str = ""
    group: int | None = None

    @property
    def included(self) -> tuple[Component, ...]:
        """The rows that u is made of, the largest first."""
        return self._sort(one for one in self.components if one.included)

    @property
    def left_out(self) -> tuple[Component, ...]:
        """The rows that u does not contain, those of unknown size last."""
        return self._sort(one for one in self.components if not one.included)

    @property
    def combined(self) -> float:
        """Root of the sum of the squares of the rows that u is made of."""
        return hypot(*(one.contribution or 0.0 for one in self.included))

    @property
    def closes(self) -> bool:
        """Whether the rows add up to u."""
        return abs(self.combined - self.u) <= ROUNDING * self.u

    @property
    def u_with_all(self) -> float:
        """Standard uncertainty with those rows of known size that u does not contain."""
        return hypot(self.u, *(one.contribution or 0.0 for one in self.left_out))

    @property
    def misses_nothing(self) -> bool:
        """Whether what is known and not in u changes it by nothing to speak of."""
        return self.u_with_all <= (1 + NEGLIGIBLE) * self.u

    @property
    def largest(self) -> Component | None:
        """The row that dominates u; None where u is 0."""
        return self.included[0] if self.included and self.u > 0 else None

    def share(self, row: Component) -> float | None:
        """Return the part of a row in u²; for a row outside u, its part of the sum of both squares."""
        part = row.contribution
        if part is None or (not part and not self.u):
            return None
        whole = self.u if row.included else hypot(self.u, part)
        return (part / whole) ** 2 if whole else None

    def _sort(self, rows: Iterable[Component]) -> tuple[Component, ...]:
        def size(one: Component) -> float:
            return -1.0 if one.contribution is None else one.contribution

        return tuple(sorted(rows, key=size, reverse=True))


def rest(whole: float, *parts: float) -> float:
    """Return a standard uncertainty without uncorrelated parts of it; 0 where they exceed it.

    >>> rest(5.0, 3.0)
    4.0
    """
    return sqrt(max(whole**2 - sum(part**2 for part in parts), 0.0))


#: Numbers printed with more decimals than this are as good as not rounded.
MOST_DECIMALS = 9


def printed_step(values: Iterable[float]) -> float | None:
    """Return the last decimal to which numbers were rounded when they were printed; None where they were not.

    The step is found from the numbers themselves, so it may be too large where few of them happen to end in zeros: of
    ten numbers one time in 10¹⁰.

    >>> printed_step([39.93, 38.50, 37.09]), printed_step([1 / 3, 2 / 7]), printed_step([40.0, 38.0])
    (0.01, None, 1.0)
    """
    numbers = list(values)
    for decimals in range(MOST_DECIMALS):
        if all(abs(round(number, decimals) - number) <= 1e-12 * max(abs(number), 1.0) for number in numbers):
            return float(10.0**-decimals)
    return None


def u_of_step(step: float) -> float:
    """Return the standard uncertainty of a number rounded to a step: that of an even distribution (GUM F.2.2.1)."""
    return step / sqrt(12)


def u_of_limit(limit: float) -> float:
    """Return the standard uncertainty of an even distribution within ±limit, as a data sheet gives it (GUM 4.3.7)."""
    return limit / sqrt(3)


def gate_bias(before: Array, middle: Array, after: Array) -> Array:
    """Return the bias of means over a gate against the values in its middle, to second order ν″T²/24 (Simpson's rule).

    The next term is ν⁗T⁴/1920: of a spin that decays by 0.3 %/s and a gate of 10 s, 10⁻⁵ of this one.

    Args:
        before: the values at the gate's beginning, shape (n,).
        middle: in its middle.
        after: at its end.
    """
    return (before + after - 2 * middle) / 6

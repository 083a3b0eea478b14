"""A quantity that can be calculated with, and tables of quantities that say where a missing name is found."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence, ValuesView
from dataclasses import dataclass, field
from functools import partial
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from analysis.uncertainty import Estimate
from levilab.errors import UsageError
from levilab.formats.typed import ratio
from levilab.notebook.names import Helpful, NoSuchAttribute, bare, border, meant
from levilab.present.numbers import in_one_line, without_unit

V = TypeVar("V")
#: Name in another library (uncertainties, lmfit, pint) → attribute.
ALSO: Mapping[str, str] = MappingProxyType({
    "nominal_value": "n", "magnitude": "n", "units": "unit",
    **dict.fromkeys(("std_dev", "stderr", "error", "uncertainty", "std", "sigma"), "s"),
})  # fmt: skip
#: Name in lmfit → where it stands.
_INSTEAD = {
    "correl": "correl of its model, as result.correl['c32'], or result.fit_report()",
    "init_value": "value: the fit finds its own start",
    "vary": "result.var_names, the parameters that were fitted",
}
#: Functions of numpy that are taken of a quantity, as a number without a unit.
_FUNCTIONS = frozenset({"sqrt", "exp", "log", "log10", "sin", "cos", "tan"})
#: A u that a format has rounded to zero.
_LOST_U = re.compile(r"(?:\+/-|±|\\pm|\d\()\s*0*\.?0+(?![\d.])")


def _comparison(compare: Callable[[float, float], bool]) -> Any:
    """Return the method of a quantity that compares its value with a number in the same unit."""

    @bare
    def method(self: Quantity, other: Any) -> bool:
        self._check_unit(other, "comparison")
        return compare(float(self), float(other.nominal_value if hasattr(other, "nominal_value") else other))

    return method


def _multiple(operate: Callable[[Any, Any], Any]) -> Any:
    """Return the method of a quantity that is one, too, with a plain number."""

    def method(self: Quantity, other: Any) -> Any:
        if isinstance(other, np.ndarray):
            return NotImplemented  # numpy does it element by element
        number = operate(self.to_ufloat(), _plain(other))
        return number if _may_have_unit(other) else _of(number, self.unit)

    return method


def _number(operate: Callable[[Any, Any], Any]) -> Any:
    """Return the method of a quantity that is a number of `uncertainties`."""
    return lambda self, other: operate(self.to_ufloat(), _plain(other))


@dataclass(frozen=True, repr=False)
class Quantity(Estimate):
    """A quantity with its standard uncertainty: `value`, `u` (None where not determined), `unit`, and `interval`.

    It prints as value(u); `float` takes its value, a format such as `.3g` or `.1uS` is one of `uncertainties`, with
    more digits where u would be 0.  Sums of quantities in one unit, and multiples, are quantities; products and powers
    are numbers of `uncertainties` without a unit.  In sums and comparisons a number counts in the quantity's unit, and
    a quantity must have the same one.  Quantities of one fit stay correlated: a quantity less itself is 0 without an
    uncertainty.  `interval` are the ends of a 68 % interval: as the analysis found it, else the value less and plus u.

    >>> c = Quantity(0.003262, 2.3e-5, "1/s")
    >>> c, 2 * c, c - c
    (0.003262(23) 1/s, 0.00652(5) 1/s, 0 1/s)
    >>> print(f"{c:.1uS}", f"{c:.1e}", c * c)
    0.00326(2) 1/s (3.26+/-0.02)e-03 1/s (1.064+/-0.015)e-05
    >>> print(np.sqrt(c), 2**c, round(c, 4))
    0.05711+/-0.00020 1.002264+/-0.000016 0.0033
    >>> float(c), c.n, c.s
    (0.003262, 0.003262, 2.3e-05)
    """

    number: Any = field(default=None, compare=False)

    def __post_init__(self) -> None:
        if self.interval is None and self.value is not None and self.u is not None:
            object.__setattr__(self, "interval", (self.value - self.u, self.value + self.u))

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *ALSO})

    def __repr__(self) -> str:
        return in_one_line(self)

    def __float__(self) -> float:
        return float("nan") if self.value is None else self.value

    def __format__(self, spec: str) -> str:
        if not spec:
            return repr(self)
        number = format(self.to_ufloat() if self.u else float(self), spec if self.u else _of_float(spec))
        if self.u and _LOST_U.search(number):
            number = format(self.to_ufloat(), re.sub(r"\.\d+", ".1u", spec))
        return number if self.unit == "1" else f"{number} {self.unit}"

    def _repr_latex_(self) -> str:
        """Return it as a formula, which a notebook shows."""
        if self.value is None:
            return r"\text{not determined}"
        number = without_unit(self)
        if self.u:
            number = format(self.to_ufloat(), "eSL" if "×" in number else "SL")  # as tables have it
        text = "" if self.unit == "1" else rf"\,\mathrm{{{_latex_unit(self.unit)}}}"
        return f"${number}{text}$"

    @property
    def n(self) -> float:
        """The value, as `uncertainties` names it; NaN where it is not determined."""
        return float(self)

    @property
    def s(self) -> float:
        """The standard uncertainty, as `uncertainties` names it; NaN where it is not determined."""
        return math.nan if self.u is None else self.u

    def to_ufloat(self) -> Any:
        """Return it as a number of the library `uncertainties`, without its unit; u is NaN where not determined."""
        from uncertainties import ufloat

        if self.number is None:
            object.__setattr__(self, "number", ufloat(float(self), self.s))  # one number for all that is made of it
        return self.number

    @bare
    def to(self, unit: str) -> Quantity:
        """Return it in another unit, as "rpm" or "rad/s" of a frequency, "mm" of a length.  Raises UsageError.

        >>> Quantity(30.0, 0.01, "Hz").to("rpm"), Quantity(0.002, None, "1/s").to("1/min")
        (1800.0(6) rpm, 0.12 1/min)
        """
        factor = ratio(self.unit, unit)
        if factor is None:
            raise UsageError("unit", f"a unit of the same quantity as {self.unit} is expected", value=unit)
        value, u = (None if one is None else one * factor for one in (self.value, self.u))
        ends = self.interval and (self.interval[0] * factor, self.interval[1] * factor)
        return Quantity(value, u, unit, ends, self.to_ufloat() * factor)

    # --- arithmetic ---

    def _check_unit(self, other: object, what: str) -> None:
        """Raise UsageError for a quantity in another unit."""
        if isinstance(other, Estimate) and other.unit != self.unit:
            raise UsageError(what, f"{self!r} and {other!r} have unlike units: take `to`, or `to_ufloat()`")

    def _sum(self, other: object, sign: int) -> Any:
        """Return this plus or minus a number in the same unit."""
        self._check_unit(other, "sum")
        if isinstance(other, np.ndarray):
            return NotImplemented  # numpy does it element by element
        return _of(self.to_ufloat() + sign * _plain(other), self.unit)

    @bare
    def __add__(self, other: object) -> Any:
        return self._sum(other, 1)

    @bare
    def __sub__(self, other: object) -> Any:
        return self._sum(other, -1)

    def __rsub__(self, other: object) -> Any:
        return -self + other

    def __neg__(self) -> Any:
        return _of(-self.to_ufloat(), self.unit)

    def __pos__(self) -> Any:
        return self

    def __abs__(self) -> Any:
        return -self if float(self) < 0 else self

    def __round__(self, digits: int | None = None) -> float:
        return round(float(self), digits)

    def __getattr__(self, name: str) -> Any:
        """Return value or u by another library's name, or a method such as sqrt, which numpy.sqrt calls."""
        if name in ALSO:
            return getattr(self, ALSO[name])
        if name not in _FUNCTIONS:
            known = [*(one for one in dir(self) if not one.startswith("_")), *ALSO]
            advice = f"take {_INSTEAD[name]}" if name in _INSTEAD else meant(name, known)
            with border:
                raise NoSuchAttribute(f"a Quantity has no {name!r}: {advice}")
        from uncertainties import umath

        return partial(getattr(umath, name), self.to_ufloat())

    __mul__, __truediv__ = map(_multiple, (operator.mul, operator.truediv))
    __rtruediv__, __pow__, __rpow__ = map(_number, (lambda a, b: b / a, operator.pow, lambda a, b: b**a))
    __radd__, __rmul__ = __add__, __mul__

    __lt__, __le__, __gt__, __ge__ = map(_comparison, (operator.lt, operator.le, operator.gt, operator.ge))


def _latex_unit(unit: str) -> str:
    r"""Return a unit as LaTeX has it in a formula.

    >>> _latex_unit("(rad/s)^-1/2/s"), _latex_unit("kg m^2")
    ('(rad/s)^{-1/2}/s', 'kg\\,m^{2}')
    """
    return re.sub(r"\^([-−]?\d+(/\d+)?|\([^)]*\))", r"^{\1}", unit).replace(" ", r"\,")


def _of_float(spec: str) -> str:
    """Return the format of a number without u: `uncertainties` has letters of its own, and its u counts the digits."""
    return "" if "u" in spec else spec.rstrip("SLP")


def _may_have_unit(number: object) -> bool:
    """Return whether it is no plain number: a product with it has another unit."""
    return isinstance(number, Estimate) or hasattr(number, "nominal_value")


def _plain(of: Any) -> Any:
    """Return a quantity as a number of `uncertainties`, any other number as it is."""
    return of.to_ufloat() if isinstance(of, Quantity) else of


def _of(number: Any, unit: str) -> Any:
    """Return a quantity of a number of `uncertainties`; an array of such numbers as it is."""
    if not hasattr(number, "nominal_value"):
        return number
    value, u = float(number.nominal_value), float(number.std_dev)
    determined = not math.isnan(value)
    return Quantity(value if determined else None, None if math.isnan(u) else u, unit, None, number)


def correlate(quantities: Sequence[Quantity], covariance: ArrayLike | None) -> list[Quantity]:
    """Return the quantities of one fit with its correlations; as they are where it has no covariance.

    Args:
        quantities: with u.
        covariance: shape (p, p), in their order and units.
    """
    from uncertainties import correlated_values_norm

    if covariance is None or any(one.value is None or not one.u for one in quantities):
        return list(quantities)
    table = np.array(covariance, dtype=float)
    scale = np.sqrt(np.diagonal(table))
    if not (np.isfinite(table).all() and (scale > 0).all()):
        return list(quantities)
    numbers = correlated_values_norm([(one.n, one.s) for one in quantities], table / np.outer(scale, scale))
    return [
        Quantity(one.value, one.u, one.unit, one.interval, number)
        for one, number in zip(quantities, numbers, strict=True)
    ]


class NoSuchName(UsageError, KeyError):
    """A name that a result lacks."""

    def __str__(self) -> str:
        return str(self.args[0])  # not as KeyError, in quotes


class Named(Helpful, dict[str, V]):
    """Values by their names, attributes too; a missing name raises an error that says where it stands instead.

    Attributes:
        what: which names these are, for messages.
        elsewhere: name → where it is found.
        symbols: name → symbol in tables, by which a value is found, too, where no other one has it.
    """

    symbols: Mapping[str, str] = MappingProxyType({})

    def __init__(self, values: Mapping[str, V], what: str, elsewhere: Mapping[Any, str] | None = None) -> None:
        super().__init__(values)
        self.what: str = what
        self.elsewhere: dict[Any, str] = dict(elsewhere or {})

    def __call__(self) -> ValuesView[V]:
        """Return the values, for who takes `result.values` for a dictionary's."""
        return self.values()

    @property
    def _contents(self) -> Mapping[str, V]:
        return self

    def _elsewhere(self, name: str) -> str:
        return f"result.{self.elsewhere[name]}" if name in self.elsewhere else ""

    def __missing__(self, name: str) -> V:
        named = [one for one in self if self.symbols.get(one) == name]
        if len(named) == 1:
            return self[named[0]]
        where = self._elsewhere(name)
        advice = f"take {where}" if where else meant(str(name), self) if len(self) else "there are none"
        with border:
            raise NoSuchName(str(name), f"not among {self.what}: {advice}")

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (dict(self), self.what, self.elsewhere), {"symbols": dict(self.symbols)}

"""Numbers and names as people read them: value(u), rounded by the rule of the Particle Data Group."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

from analysis.numbers import digits, with_minus
from levilab.present.units import unit
from levilab.texts.text import Text, fields_of, verbatim

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from analysis.uncertainty import Estimate

#: Names that a sentence lists at most.
MOST_NAMES = 4

#: A column where a smaller uncertainty stands has numbers of very different size.
MOST_DECIMALS = 1e-6


def with_uncertainty(estimate: Estimate) -> str:
    """Return value and standard uncertainty in its last digits, with the unit.

    >>> from analysis.uncertainty import Estimate
    >>> with_uncertainty(Estimate(0.00318175, 3.06e-5, "1/s"))
    '3.182(31)×10⁻³ s⁻¹'
    >>> with_uncertainty(Estimate(40.0123, None, "Hz"))
    '40.01 Hz, u not determined'
    >>> with_uncertainty(Estimate(1.047e-5, None, "1/rad"))
    '1.047×10⁻⁵ rad⁻¹, u not determined'
    """
    text = f"{without_unit(estimate)} {unit(estimate.unit).text}".strip()
    known = estimate.u is not None or estimate.value is None
    return Text("{number:n}" if known else "{number:n}, u not determined", number=text)


def in_one_line(estimate: Estimate) -> str:
    """Return value, standard uncertainty in its last digits and unit, in characters that every program prints.

    >>> from analysis.uncertainty import Estimate
    >>> in_one_line(Estimate(0.003262, 2.3e-5, "1/s")), in_one_line(Estimate(1.7151e-5, 1.7e-7, "1/rad"))
    ('0.003262(23) 1/s', '1.715(17)e-05 1/rad')
    >>> in_one_line(Estimate(0.25, None, "1")), in_one_line(Estimate(None, None, "Hz"))
    ('0.25', 'not determined')
    """
    from uncertainties import ufloat

    if estimate.value is None:
        return "not determined"
    few = f"{estimate.value:.4g}" if abs(estimate.value) < 1e4 else f"{estimate.value:.6g}"  # no more is claimed
    number = f"{ufloat(estimate.value, estimate.u):S}" if estimate.u else few
    return number if estimate.unit == "1" else f"{number} {estimate.unit}"


def without_unit(estimate: Estimate) -> str:
    """Return value and u alone, for a column whose head has the unit; a dash where there is none."""
    return "—" if estimate.value is None else Text("{number:n}", number=_number(estimate.value, estimate.u))


def column(estimates: Iterable[Estimate | None]) -> list[str]:
    """Return values with u for one column, all with a power of ten or none; a dash for None.

    >>> from analysis.uncertainty import Estimate
    >>> column([Estimate(0.008, 0.007, "Hz"), Estimate(0.013, 0.008, "Hz"), None])
    ['0.008(7)', '0.013(8)', '—']
    >>> column([Estimate(9.9e-3, 1e-4, "1/s"), Estimate(1.02e-2, 1e-4, "1/s")])
    ['0.00990(10)', '0.01020(10)']
    """
    cells = list(estimates)
    known = [(abs(one.value), one.u) for one in cells if one and one.value is not None and one.u]
    largest = max((max(value, u) for value, u in known), default=0.0)
    ordinary = 1e-2 <= largest < 1e5
    if ordinary and min(u for _, u in known) < MOST_DECIMALS:
        return [without_unit(one) if one else "—" for one in cells]
    return [
        "—" if one is None or one.value is None else Text("{number:n}", _number(one.value, one.u, ordinary=ordinary))
        for one in cells
    ]


def _number(value: float, u: float | None, *, ordinary: bool | None = None) -> str:
    """Round by the rule of the Particle Data Group, with a power of ten instead of leading zeros.

    ordinary: True without a power of ten, False with one; None: the number decides.

    >>> _number(-0.0012, 0.05), _number(-0.012, 0.05)
    ('0.00(5)', '−0.01(5)')
    """
    from uncertainties import ufloat

    if not u:
        return digits(value, 4)
    if ordinary is None:
        ordinary = 1e-2 <= abs(value) < 1e5 or abs(value) < u < 1e5
    text = f"{ufloat(value, u):SP}" if ordinary else f"{ufloat(value, u):eSP}"
    return with_minus(re.sub(r"^-(?=0(\.0*)?\()", "", text))


def enumeration(names: Sequence[str]) -> str:
    """Return the names one after the other, in a sentence.

    >>> enumeration(["disc"]), enumeration(["disc", "stokes", "newton"])
    ('disc', 'disc, stokes and newton')
    """
    return names[0] if len(names) == 1 else Text("{first} and {last}", first=tuple(names[:-1]), last=names[-1])


def pulses_too_many(pulses: int) -> str:
    """Return a miscount as text.

    >>> pulses_too_many(1), pulses_too_many(-2)
    ('1 pulse too many', '2 pulses too few')
    """
    if abs(pulses) == 1:
        return Text("{size} pulse too many" if pulses > 0 else "{size} pulse too few", size=1)
    return Text("{size} pulses too many" if pulses > 0 else "{size} pulses too few", size=abs(pulses))


def filled(template: str, values: Iterable[float], **named: str) -> Text:
    """Return a sentence whose fields are the values, in the order in which they stand there.

    ``:n`` writes a number with two digits, a probability p with one.

    Args:
        template: of the sentence.
        values: of its fields; there may be more of them.
        named: fields that are none of the values, where they stand in it.

    >>> filled("{law} scatters {times:n} times as much (p = {p:n}) in {n:.0f} runs", (1.234, 0.0123, 5.0), law="linear")
    'linear scatters 1.2 times as much (p = 0.01) in 5 runs'
    """
    rest, found = iter(values), dict[str, Any]()
    for name, how in dict(fields_of(template)).items():
        value: Any = named[name] if name in named else next(rest)
        found[name] = digits(value, 1 if name == "p" else 2) if how == "n" else value
    return Text(template, **found)


def list_in_words(names: Sequence[str]) -> str:
    """Return the names, or the first of them.

    >>> list_in_words(["a", "b", "c", "d", "e", "f"])
    'a, b, c, d and 2 more'
    """
    more, first = len(names) - MOST_NAMES, ", ".join(names[:MOST_NAMES])
    return Text("{names:s} and {more} more" if more > 0 else "{names:s}", names=first, more=more)


def with_decimals(value: float, decimals: int) -> str:
    """Return a number with this number of digits after the point; a zero has no sign.

    >>> with_decimals(-0.254, 2), with_decimals(-0.001, 2)
    ('−0.25', '0.00')
    """
    return with_minus(f"{round(float(value), decimals) + 0.0:.{decimals}f}")


def with_sign(value: float, decimals: int) -> str:
    """Return a number with its sign, and none where it rounds to zero.

    >>> with_sign(0.471, 2), with_sign(-0.002, 2), with_sign(-1.614, 2)
    ('+0.47', '0.00', '−1.61')
    """
    text = f"{value:+.{decimals}f}"
    return with_minus(text) if float(text) else text[1:]


def decimals_of(u: float | None) -> int:
    """Return the digits behind the point of a number by its u and the rule of the Particle Data Group; 5 without u.

    >>> decimals_of(0.03), decimals_of(0.00102), decimals_of(35.0), decimals_of(0.0962), decimals_of(None)
    (3, 4, 0, 2, 5)
    """
    if not u or not math.isfinite(u):
        return 5
    hundreds = float(f"{u:.2e}".partition("e")[0]) * 100
    power = math.floor(math.log10(u))
    return max(1 - power if hundreds <= 354 else -power, 0)


def off(value: float, u: float | None) -> str:
    """Return how far a reading is off, with the digits of its uncertainty and a sign.

    >>> off(0.02149, 0.03), off(-1e-9, 0.03)
    ('+0.021', '0.000')
    """
    return with_sign(value, decimals_of(u))


def reading(value: float, u: float | None, residual: float | None) -> tuple[str, str, str]:
    """Return a reading, its uncertainty and what a fit leaves over, for three columns; a dash for what is not known.

    >>> reading(39.93661, 0.03, -0.012), reading(39.9, None, None)
    (('39.937', '0.030', '−0.012'), ('39.90000', '—', '—'))
    >>> reading(-0.0001, 0.03, None)
    ('0.000', '0.030', '—')
    """
    places = decimals_of(u)
    left = "—" if residual is None else with_sign(residual, places)
    return with_decimals(value, places), "—" if u is None else f"{u:.{places}f}", left


def short_name(name: str) -> str:
    """Return a run's name without the time that it begins with.

    >>> short_name("20261120T101500Z-spin-7f3a")
    'spin-7f3a'
    """
    return verbatim(re.sub(r"^\d{8}T\d{6}Z-", "", name))


def plain(value: float | None, count: int = 3) -> str:
    """Return a statistic to `count` digits, with zeros at the end; a larger number in whole ones; a dash for none.

    >>> plain(0.0312345), plain(0.21), plain(4478.2), plain(2.34e-14, 2), plain(None)
    ('0.0312', '0.210', '4478', '2.3×10⁻¹⁴', '—')
    """
    if value is None:
        return "—"
    if 1e-4 <= abs(value) < 10**count:
        return with_minus(f"{value:#.{count}g}".rstrip("."))
    return with_minus(f"{value:.0f}") if 10**count <= abs(value) < 1e6 else digits(value, count)


def share(weight: float | None) -> str:
    """Return the weight of a law as text; below 10⁻⁶ only that.

    >>> share(0.974), share(3e-17)
    ('0.97', '< 10⁻⁶')
    """
    return "< 10⁻⁶" if weight is not None and weight < 1e-6 else plain(weight, 2)

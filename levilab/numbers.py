"""Numbers as people read them: value(u), rounded by the rule of the Particle Data Group."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from analysis.uncertainty import Estimate

#: The constants in the field's letters.
SYMBOLS = {
    "start_frequency": "ν₀",
    "c1": "C₁",
    "c2": "C₂",
    "c32": "C₃/₂",
    "c": "c",
    "exponent": "n",
}

#: Units as people write them, where the files' plain text is harder to read.
UNITS = {
    "1": "",
    "1/s": "s⁻¹",
    "1/rad": "rad⁻¹",
    "(rad/s)^-1/2/s": "(rad/s)^(−½) s⁻¹",
    "(rad/s)^(1-exponent)/s": "(rad/s)^(1−n) s⁻¹",
}


def with_uncertainty(estimate: Estimate) -> str:
    """Value and standard uncertainty in its last digits, with the unit.

    >>> from analysis.uncertainty import Estimate
    >>> with_uncertainty(Estimate(0.00318175, 3.06e-5, "1/s"))
    '3.182(31)×10⁻³ s⁻¹'
    >>> with_uncertainty(Estimate(40.0123, None, "Hz"))
    '40.0123 Hz'
    """
    if estimate.value is None:
        return "—"
    return f"{_number(estimate.value, estimate.u)} {UNITS.get(estimate.unit, estimate.unit)}".strip()


def _number(value: float, u: float | None) -> str:
    """By the rule of the Particle Data Group, with a power of ten for what would begin with zeros."""
    from uncertainties import ufloat

    if not u:
        return f"{value:.6g}"
    ordinary = 1e-2 <= abs(value) < 1e5 or abs(value) < u < 1e5
    return f"{ufloat(value, u):SP}" if ordinary else f"{ufloat(value, u):eSP}"


def plain(value: float | None, digits: int = 3) -> str:
    """A statistic in a few digits; a dash where there is none.

    >>> plain(0.0312345), plain(None)
    ('0.0312', '—')
    """
    return "—" if value is None else f"{value:.{digits}g}"


def share(weight: float | None) -> str:
    """The weight of a law among all; what is practically nothing is said to be so.

    >>> share(0.974), share(3e-17)
    ('0.97', '< 10⁻⁶')
    """
    return "< 10⁻⁶" if weight is not None and weight < 1e-6 else plain(weight, 2)

"""The numbers that Lake Shore gaussmeters are sent and answer with."""

from __future__ import annotations

import math
from dataclasses import dataclass

from instruments.virtual.core.parameters import number
from instruments.virtual.core.parser import ScpiError


@dataclass(frozen=True)
class Number:
    """One of the numbers behind a header.  whole: printed as n, else as ±nnn.nnnE±nn."""

    name: str
    low: float
    high: float
    default: float
    whole: bool = True

    def read(self, text: str) -> float:
        """The parameter.  Raises ScpiError."""
        value = number(text, low=self.low, high=self.high, default=self.default)
        if self.whole and value != int(value):
            raise ScpiError(-224, text[:20])
        return value

    def spell(self, value: float) -> str:
        """The number as the instrument prints it."""
        return f"{int(value)}" if self.whole else field_text(value)


def field_text(value: float) -> str:
    """A number as these instruments print it, ±nnn.nnnE±nn.

    >>> field_text(12.3456), field_text(-3.5e-5), field_text(0.0)
    ('+123.456E-01', '-350.000E-07', '+000.000E+00')
    """
    if not value:
        return "+000.000E+00"
    exponent = math.floor(math.log10(abs(value))) - 2
    if round(abs(value) / 10.0**exponent, 3) >= 1000:
        exponent += 1
    return f"{value / 10.0**exponent:+08.3f}E{exponent:+03d}"

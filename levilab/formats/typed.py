"""Masses and temperatures as a person types them: 24.98 g, 60 mg, 0.06, 21 °C, 294 K."""

from __future__ import annotations

import re

from levilab.settings import hint_about

#: Unit → factor and offset to kg and °C; the first is that of a bare number.
_MASSES = {"g": (1e-3, 0.0), "mg": (1e-6, 0.0), "kg": (1.0, 0.0)}
_TEMPERATURES = {
    "°C": (1.0, 0.0), "C": (1.0, 0.0), "K": (1.0, -273.15), "°F": (5 / 9, -160 / 9), "F": (5 / 9, -160 / 9),
}  # fmt: skip
_TYPED = re.compile(r"([+-]?\d+\.?\d*|[+-]?\.\d+)\s*([^\d\s]*)")
#: Magnets that people hold in their hands, and the lightest washer and the heaviest top [kg].
_COLDEST, _WARMEST, _LIGHTEST, _HEAVIEST = -30.0, 60.0, 1e-6, 1.0


def read_mass(text: str) -> float:
    """Return a mass [kg] that is typed in g, or with its unit.  Raises ValueError, whose text says what is expected.

    >>> read_mass("24.98 g"), read_mass("60mg"), round(read_mass("0.06"), 9)
    (0.02498, 6e-05, 6e-05)
    """
    return round(_read(text, _MASSES, _LIGHTEST, _HEAVIEST, "a mass such as 24.98 g"), 9)


def read_temperature(text: str) -> float:
    """Return a temperature [°C] that is typed in °C, or with its unit.  Raises ValueError.

    >>> read_temperature("21.5 C"), read_temperature("70 °F"), read_temperature("294.15 K")
    (21.5, 21.11, 21.0)
    """
    return round(_read(text, _TEMPERATURES, _COLDEST, _WARMEST, "a temperature of a room such as 21.5 °C"), 2)


def read_masses(text: str) -> tuple[float, ...]:
    """Return masses [kg] with commas or + between them; a unit at the end is that of all without one.

    Raises ValueError.

    >>> read_masses("0.06, 0.1 g"), read_masses("60 + 100 mg"), read_masses("none")
    ((6e-05, 0.0001), (6e-05, 0.0001), ())
    """
    if text.strip().casefold() in {"", "none", "0"}:
        return ()
    pieces = [piece.strip() for piece in re.split(r"[,;+]", text)]
    # 0,06 are no washers of 0 g and 6 g
    if any(re.fullmatch(r"0+|0\d+", piece) for piece in pieces):
        raise ValueError("a decimal point is expected, and a comma between two masses")
    if any(re.search(r"[\d.]\s+[\d.]", piece) for piece in pieces):
        raise ValueError("a comma is expected between two masses, as 0.06, 0.1 g")
    last = _TYPED.fullmatch(pieces[-1])
    unit = last[2] if last else ""
    return tuple(read_mass(f"{piece} {unit}" if piece[-1:].isdigit() else piece) for piece in pieces)


def _read(text: str, units: dict[str, tuple[float, float]], low: float, high: float, expected: str) -> float:
    found = _TYPED.fullmatch(text.strip().replace("−", "-"))
    scale = units.get(found[2] or next(iter(units))) if found else None
    if found is None or scale is None:
        raise ValueError(f"{expected} is expected{hint_about(text) if ',' in text else ''}")
    value = float(found[1]) * scale[0] + scale[1]
    if not low <= value <= high:
        raise ValueError(f"{expected} is expected")
    return value

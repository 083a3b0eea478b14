"""Numbers as a person types them, with or without a unit: 24.98 g, 10s, 30 Hz, 2min, 21 °C."""

import math
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from pydantic import ValidationInfo
from pydantic_core import PydanticCustomError

from levilab.formats.ranges import problem_of
from levilab.formats.titles import UNITS, factor_of, plain_unit
from levilab.settings import hint_about
from levilab.texts.text import Text, either, verbatim


def check_range(value: Any, info: ValidationInfo) -> Any:
    """Refuse a value outside of the range of its field's quantity; settings call it as `field_validator("*")`."""
    if isinstance(value, float) and (problem := problem_of(info.field_name or "", value)):
        raise PydanticCustomError("range", "{problem}", {"problem": problem})
    return value


#: Units in which people type a quantity, with their factors to the first one, that of results and of keys.
TYPED: tuple[Mapping[str, float], ...] = (
    *UNITS.values(),
    {"kg": 1.0, "g": 1e-3, "mg": 1e-6, "gram": 1e-3, "grams": 1e-3, "gramm": 1e-3},
    {"rad": 1.0, "mrad": 1e-3, "°": math.pi / 180, "deg": math.pi / 180, "grad": math.pi / 180},
    {"Vpp": 1.0, "mVpp": 1e-3},
    {"K": 1.0, "mK": 1e-3},
    {"Hz/s": 1.0, "mHz/s": 1e-3},
    {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3},
    {"m/s2": 1.0},
    {"Tm": 1.0, "mTm": 1e-3, "mTcm": 1e-5},
    {"Am2": 1.0, "mAm2": 1e-3},
    {"kgm2": 1.0, "gcm2": 1e-7},
)
#: Ending of a key → the unit of its value.
OF_KEYS: Mapping[str, str] = MappingProxyType({
    "s": "s", "hz": "Hz", "v": "V", "m": "m", "t": "T", "kg": "kg", "rad": "rad", "vpp": "Vpp", "k": "K",
    "hz_per_s": "Hz/s", "m_s": "m/s", "m_s2": "m/s^2", "t_m": "T m", "a_m2": "A m^2", "kg_m2": "kg m^2",
})  # fmt: skip
_TEMPERATURES = {
    "°C": (1.0, 0.0), "C": (1.0, 0.0), "K": (1.0, -273.15), "°F": (5 / 9, -160 / 9), "F": (5 / 9, -160 / 9),
}  # fmt: skip
#: Units that a refusal names.
_SHOWN = 8
_NUMBER = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)\s*([^\d\s,.;:].*)?", re.IGNORECASE)


def read_number(text: str, unit: str) -> float:
    """Return a number in a unit; it may be typed with another unit of the same quantity.

    Raises:
        ValueError: it is no number, or has a unit of something else.  The text says what is expected.

    >>> read_number("25g", "kg"), read_number("2 min", "s"), read_number("75", "mm"), read_number("1800rpm", "Hz")
    (0.025, 120.0, 75.0, 30.0)
    """
    found = _NUMBER.fullmatch(text.strip().replace("−", "-"))
    if not found:
        return _float(text, unit)
    own = plain_unit(unit)
    units = next((one for one in TYPED if own in one), {own: 1.0})
    typed = _factor(found[2] or unit, units)
    if typed is None:
        raise ValueError(Text("'{seen:s}': {expected}", seen=text.strip(), expected=_words_for(unit, units)))
    number, factor = float(found[1]), typed / units[own]
    # with the 15 digits that a float has: 25.4 g are 0.0254 kg, and not 0.025399999999999999
    return number if factor == 1 else float(f"{number * factor:.15g}")


def ratio(unit: str, other: str) -> float | None:
    """Return how many of another unit one of a unit is, None where they are of unlike quantities.

    >>> ratio("Hz", "rpm"), ratio("T m", "mT cm"), ratio("kg", "m")
    (60.0, 100000.0, None)
    """
    own, rates = plain_unit(unit), {"1/s": 1.0, "1/min": 1 / 60, "1/h": 1 / 3600}  # a decay is no frequency
    units = rates if own == "1/s" else next((one for one in TYPED if own in one), {own: 1.0})
    factor = _factor(other, units)
    return None if factor is None else float(f"{units[own] / factor:.15g}")


def _factor(unit: str, units: Mapping[str, float]) -> float | None:
    """Return the factor of a unit in a table of them, None for any other, also for mega, which is no m."""
    is_mega = unit.startswith("M") and plain_unit(unit) not in units
    return None if is_mega else factor_of(unit, units)


def _words_for(unit: str, units: Mapping[str, float]) -> str:
    """Say that a number in a unit or some other ones for the same quantity is expected, each size once."""
    sizes = {units[plain_unit(unit)]: unit} if unit else {}
    for name, factor in units.items():
        sizes.setdefault(factor, name)
    shown = list(sizes.values())[:_SHOWN]
    if not shown[-1]:
        return "a plain number is expected"
    return Text("a number in {units} is expected", units=either(map(verbatim, shown)))


def _float(text: str, unit: str) -> float:
    try:
        return float(text)  # inf and nan, which are refused where they make no sense
    except ValueError:
        more = hint_about(text) or (Text(", which may have its unit, as 5 {unit:s}", unit=unit) if unit else "")
        raise ValueError(Text("'{seen:s}': a number is expected{more}", seen=text, more=more)) from None


def unit_of_key(key: str) -> str:
    """Return the unit with which a key ends, empty where it ends with none.

    >>> unit_of_key("top.mass_kg"), unit_of_key("start.position_m.2"), unit_of_key("drag.law")
    ('kg', 'm', '')
    """
    parts = re.sub(r"(\.\d+)+$", "", key).split("_")
    endings = ("_".join(parts[at:]) for at in range(1, len(parts)))  # the longest counts
    return next((OF_KEYS[one] for one in endings if one in OF_KEYS), "")


def read_mass(text: str, key: str = "mass_kg") -> float:
    """Return a mass [kg] that is typed in g, or with its unit; `key` has its range.  Raises ValueError, which says it.

    >>> read_mass("24.98 g"), read_mass("60mg"), round(read_mass("0.06"), 9)
    (0.02498, 6e-05, 6e-05)
    """
    try:
        grams = read_number(text, "g")
    except ValueError:
        hint = hint_about(text) if "," in text else ""
        raise ValueError(Text("a mass such as 24.98 g is expected{hint}", hint=hint)) from None
    return round(_in_range(key, grams * 1e-3, 1e-3, asks=text.strip()[-1:].isdecimal()), 9)


def read_temperature(text: str) -> float:
    """Return a temperature [°C] that is typed in °C, or with its unit.  Raises ValueError.

    >>> read_temperature("21.5 C"), read_temperature("70 °F"), read_temperature("294.15 K")
    (21.5, 21.11, 21.0)
    """
    found = _NUMBER.fullmatch(text.strip().replace("−", "-"))
    scale = _TEMPERATURES.get(found[2] or "°C") if found else None
    if found is None or scale is None:
        hint = hint_about(text) if "," in text else ""
        raise ValueError(Text("a temperature of a room such as 21.5 °C is expected{hint}", hint=hint))
    return round(_in_range("temperature_c", float(found[1]) * scale[0] + scale[1], asks=not found[2]), 2)


def read_masses(text: str, key: str = "mass_kg") -> tuple[float, ...]:
    """Return masses [kg] with commas or + between them; a unit at the end alone is that of all.

    `key` has the range of each.  Raises ValueError.

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
    last = _NUMBER.fullmatch(pieces[-1])
    unit = (last[2] or "") if last else ""
    bare = [piece[-1:] in "0123456789." for piece in pieces]
    if any(bare) and not all(bare[:-1] if unit else bare):  # 60 mg + 0.1 may be 0.1 mg or 0.1 g
        raise ValueError("a unit behind each mass is expected, as 60 mg + 0.1 g, or one at the end for all")
    return tuple(
        read_mass(f"{piece} {unit}" if is_bare else piece, key) for piece, is_bare in zip(pieces, bare, strict=True)
    )


def _in_range(key: str, value: float, factor: float = 1.0, *, asks: bool) -> float:
    if problem := problem_of(key, value, factor, asks=asks):
        raise ValueError(problem)
    return value

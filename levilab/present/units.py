"""Units: one row a unit, from which results, names of columns and keys, tables, figures and messages take it."""

import re
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple


class Scale(NamedTuple):
    """A unit of this laboratory: its name, and how many of it make one in SI."""

    unit: str
    factor: float


@dataclass(frozen=True)
class Unit:
    """A unit.

    Attributes:
        si: its text in results.
        ending: of names of columns and keys in this unit, behind a low line; empty: they have none.
        text: as people write it.
        shown: in which people of this laboratory read quantities of the whole bench: heights, fields, masses.
        fine: in which they read dimensions of parts, displacements and uncertainties.
        decimals: of a reading in the terminal; None: six digits.
    """

    si: str
    ending: str
    text: str
    shown: Scale
    fine: Scale
    decimals: int | None = None


def _row(  # noqa: PLR0917 - the fields of a row
    si: str,
    ending: str,
    text: str = "",
    shown: tuple[str, float] | None = None,
    fine: tuple[str, float] | None = None,
    decimals: int | None = None,
) -> Unit:
    """Return a row; text is by default that in results, shown by default the unit itself, fine by default shown."""
    text = text or si
    of_bench = Scale(*shown) if shown else Scale(text, 1.0)
    return Unit(si, ending, text, of_bench, Scale(*fine) if fine else of_bench, decimals)


_NUMBER = Unit("1", "", "", Scale("", 1.0), Scale("", 1.0))
UNITS = (
    _NUMBER,
    _row("s", "s", decimals=2),
    _row("Hz", "hz", decimals=4),
    _row("Hz/s", "hz_per_s"),
    _row("Hz/s^2", "hz_per_s2", "Hz/s²"),
    _row("1/s", "per_s", "s⁻¹"),
    _row("1/m", "per_m", "m⁻¹"),
    _row("1/rad", "per_rad", "rad⁻¹"),
    _row("(rad/s)^-1/2/s", "per_sqrt_rad_s", "(rad/s)^−½/s"),
    _row("(rad/s)^(1-exponent)/s", "si", "(rad/s)^(1−n)/s"),
    _row("turns", "turns"),
    _row("dB", "db"),
    # a height is read in cm, a thickness or a radius in mm, as on a calliper
    _row("m", "m", shown=("cm", 1e2), fine=("mm", 1e3), decimals=5),
    _row("m/s", "m_s", shown=("cm/s", 1e2)),
    _row("m/s^2", "m_s2", "m/s²"),
    _row("m/kg", "m_per_kg", shown=("mm/g", 1.0)),
    _row("kg", "kg", shown=("g", 1e3)),
    _row("kg m^2", "kg_m2", "kg m²", shown=("g cm²", 1e7)),
    _row("N m s", "n_m_s"),
    # small tilts in maps are in mrad; of the moment in rad, as its uncertainty is compared with the printed one
    _row("rad", "rad", shown=("mrad", 1e3), fine=("rad", 1.0)),
    _row("°", "deg"),
    _row("T", "t", shown=("mT", 1e3), fine=("µT", 1e6), decimals=7),
    _row("T m", "t_m", shown=("mT cm", 1e5)),
    _row("A m^2", "a_m2", "A m²"),
    _row("V", "v", decimals=4),
    _row("Vpp", "vpp"),
    _row("A", "a"),
    _row("ohm", "ohm", "Ω"),
    _row("K", "k"),
    _row("1/K", "per_k", "K⁻¹", shown=("%/K", 1e2)),
    _row("kg/K", "kg_per_k", shown=("g/K", 1e3)),
)
_BY_SI = {one.si: one for one in UNITS}
_BY_ENDING = {one.ending: one for one in UNITS if one.ending}
#: Constants of a drag law of one power n have the unit (rad/s)^(1−n)/s.
_OF_DRAG = re.compile(r"\(rad/s\)\^[-−](\d+)/(\d+)/s")
#: Texts of units that are shown; no other text behind a number is a unit.
KNOWN = frozenset({
    *filter(None, (text for one in UNITS for text in (one.text, one.shown.unit, one.fine.unit))), "%", "°", "ms", "µs",
    "°C", "min", "h", "kHz", "MHz", "mHz", "µHz", "mHz/s", "µm", "mg", "µT", "mV", "µV", "kΩ", "MΩ", "J",
})  # fmt: skip


@cache
def unit(si: str) -> Unit:
    """Return the row of a unit of results; a unit without a row stands for itself.

    >>> unit("Hz/s^2").text, unit("T m").shown
    ('Hz/s²', Scale(unit='mT cm', factor=100000.0))
    >>> unit("(rad/s)^-4/5/s").text, unit("(rad/s)^-4/5/s").ending
    ('(rad/s)^−4/5/s', 'per_rad_s_4_5_per_s')
    """
    if si in _BY_SI:
        return _BY_SI[si]
    if power := _OF_DRAG.fullmatch(si):
        above, below = power.groups()
        return _row(si, f"per_rad_s_{above}_{below}_per_s", f"(rad/s)^−{above}/{below}/s")
    return _row(si, re.sub(r"\W+", "_", si.casefold()).strip("_"))


def name_with_unit(name: str, si: str) -> str:
    """Return a quantity's name with its unit at the end.

    >>> name_with_unit("newton_c2_u", "1/rad"), name_with_unit("slope", "1")
    ('newton_c2_u_per_rad', 'slope')
    """
    return f"{name}_{unit(si).ending}".removesuffix("_")


def split(name: str) -> tuple[str, Unit | None]:
    """Return the name of a column or a key without its unit, and the unit; None where it ends in none.

    >>> [(quantity, one.si) for quantity, one in map(split, ("top.moment_a_m2", "creep_hz_per_s", "start.spin_hz"))]
    [('top.moment', 'A m^2'), ('creep', 'Hz/s'), ('start.spin', 'Hz')]
    >>> split("shows"), split("s")
    (('shows', None), ('s', None))
    """
    at = name.find("_")
    while at >= 0:  # the longest ending counts
        if at and (found := _BY_ENDING.get(name[at + 1 :])):
            return name[:at], found
        at = name.find("_", at + 1)
    return name, None


def u_of(column: str) -> str:
    """Return the name of the column with a column's standard uncertainty.

    >>> u_of("spin_frequency_hz")
    'spin_frequency_u_hz'
    """
    quantity, unit = split(column)
    return f"{quantity}_u_{unit.ending if unit else ''}"


def shown_unit(column: str) -> Scale:
    """Return the unit in which a column is shown, and how many of it are one of the column's.

    >>> [tuple(shown_unit(column)) for column in ("height_m", "spin_frequency_hz", "record")]
    [('cm', 100.0), ('Hz', 1.0), ('', 1.0)]
    """
    return (split(column)[1] or _NUMBER).shown


def is_unit(text: str) -> bool:
    """Return whether a text is a unit that people are shown, or such units with "per" between them or before one.

    >>> [is_unit(text) for text in ("mT cm", "Hz per s", "per Hz", "%")]
    [True, True, True, True]
    >>> [is_unit(text) for text in ("s ago", "Hz (u not known)", "of 120", "Hz per", "")]
    [False, False, False, False, False]
    """
    above, _, below = f" {text}".rpartition(" per ")
    return _is_known(below.strip()) and (not above.strip() or _is_known(above.strip()))


def _is_known(text: str) -> bool:
    return text in KNOWN or bool(_OF_DRAG.fullmatch(text))

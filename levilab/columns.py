"""Column headers as people write them: names and units in two tables, and the columns a header holds."""

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import pi
from pathlib import Path

from levilab.errors import DataError

PER_MINUTE = 1 / 60
PER_RADIAN = 1 / (2 * pi)

# Factors to SI; spelled as `plain_unit` leaves them (no blanks, no ^ or ·, superscripts made plain).
UNITS: Mapping[str, Mapping[str, float]] = {
    "time": {
        "s": 1, "sec": 1, "second": 1, "seconds": 1, "sek": 1, "sekunden": 1, "ms": 1e-3, "μs": 1e-6, "us": 1e-6,
        "ns": 1e-9, "min": 60, "minutes": 60, "h": 3600,
    },
    "frequency": {
        "Hz": 1, "kHz": 1e3, "MHz": 1e6, "mHz": 1e-3, "μHz": 1e-6, "1/s": 1, "s-1": 1, "rps": 1, "U/s": 1,
        "rpm": PER_MINUTE, "1/min": PER_MINUTE, "min-1": PER_MINUTE, "/min": PER_MINUTE, "U/min": PER_MINUTE,
        "rad/s": PER_RADIAN, "rads-1": PER_RADIAN, "rad_s": PER_RADIAN, "rad_per_s": PER_RADIAN,
        "°/s": 1 / 360, "deg/s": 1 / 360, "deg_s": 1 / 360,
    },
    "voltage": {"V": 1, "mV": 1e-3, "μV": 1e-6, "uV": 1e-6, "kV": 1e3},
    "length": {"m": 1, "cm": 1e-2, "mm": 1e-3, "μm": 1e-6, "um": 1e-6},
    "flux density": {"T": 1, "mT": 1e-3, "μT": 1e-6, "uT": 1e-6, "nT": 1e-9, "G": 1e-4, "gauss": 1e-4, "mG": 1e-7},
}  # fmt: skip

# Canonical column: its dimension, and the names it goes by, in lower case, blanks and hyphens as "_".
QUANTITIES: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "time_s": ("time", (
        "time", "t", "zeit", "elapsed", "elapsed_time", "timestamp", "seconds", "sekunden", "milliseconds", "minutes",
        "ms")),
    "spin_frequency_hz": ("frequency", (
        "spin_frequency", "f", "freq", "frequency", "frequenz", "nu", "ν", "nu3", "ν3", "f3", "ν_3", "nu_3", "f_3",
        "spin", "spin_freq", "f_spin", "rotation_frequency", "rotation", "drehfrequenz", "hz", "rpm", "rad/s",
        "omega", "ω", "omega3", "ω3", "omega_3", "ω_3", "angular_velocity", "angular_frequency",
        "winkelgeschwindigkeit")),
    "precession_frequency_hz": ("frequency", (
        "precession_frequency", "precession", "f_precession", "f_p", "fp", "νp", "ν_p", "nu_p", "präzession",
        "präzessionsfrequenz")),
    "drive_frequency_hz": ("frequency", ("drive_frequency", "f_drive", "drive", "f_d", "antriebsfrequenz")),
    "drive_amplitude_v": ("voltage", ("drive_amplitude", "amplitude", "drive_voltage", "amplitude_drive")),
    "height_m": ("length", ("height", "z", "h", "höhe", "hoehe")),
    "flux_density_t": ("flux density", ("flux_density", "b", "bz", "b_z", "field", "flussdichte")),
}  # fmt: skip

# Names that say their unit themselves; every other bare name is taken as SI.
IMPLIED_UNITS = {
    "rpm": "rpm",
    "ms": "ms",
    "milliseconds": "ms",
    "minutes": "min",
    "rad/s": "rad/s",
} | dict.fromkeys(
    (
        "omega",
        "ω",
        "omega3",
        "ω3",
        "omega_3",
        "ω_3",
        "angular_velocity",
        "angular_frequency",
        "winkelgeschwindigkeit",
    ),
    "rad/s",
)
# A bare "u" belongs to the spin frequency; the others need their quantity's name in it (u_z, z_err …).
BARE_UNCERTAINTIES = (
    "u", "sigma", "σ", "uncertainty", "unsicherheit", "error", "err", "fehler", "df", "δf", "sd", "std", "stddev", "se",
    "stderr", "standard_error", "standard_uncertainty",
)  # fmt: skip
COMPANION_FORMS = (
    "u_{}",
    "u({})",
    "{}_u",
    "{}_err",
    "{}_error",
    "{}_uncertainty",
    "{}_sigma",
    "sigma_{}",
    "σ_{}",
)
SHORTHANDS = {"t": "time_s", "f": "spin_frequency_hz", "u": "spin_frequency_u_hz"}


class TableError(DataError):
    """A table that cannot be used.  `path` is the file, `line` its 1-based line, where there is one."""

    def __init__(self, path: Path, message: str, *, line: int | None = None) -> None:
        self.path, self.line = path, line
        place = f"{shown(str(path), 200)}, line {line}" if line is not None else shown(str(path), 200)
        super().__init__(f"{place}: {message}")


@dataclass(frozen=True)
class Column:
    """A column that is used: canonical `name`, 0-based `index` and `label` in the file, `factor` to SI."""

    name: str
    index: int
    label: str
    factor: float


@dataclass(frozen=True)
class Title:
    """What one header field says: a canonical column (None: unknown to us) and a unit (None: none given)."""

    column: str | None
    unit: str | None


def shown(text: str, most: int = 40) -> str:
    """`text` for a message of one line: no control characters, at most `most` characters."""
    plain = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
    return plain if len(plain) <= most else plain[: most - 1] + "…"


def listed(names: Iterable[str]) -> str:
    """Names in quotation marks, with commas, the first dozen of them."""
    names = list(names)
    return ", ".join(f"'{shown(n)}'" for n in names[:12]) + (", …" if len(names) > 12 else "")  # noqa: PLR2004


def companion(column: str) -> str:
    """The column of a column's standard uncertainty.

    >>> companion("spin_frequency_hz")
    'spin_frequency_u_hz'
    """
    name, _, unit = column.rpartition("_")
    return f"{name}_u_{unit}"


COMPANIONS: Mapping[str, str] = {companion(column): column for column in QUANTITIES}
CANONICAL = (*QUANTITIES, *COMPANIONS)


def _all_names() -> dict[str, str]:
    names = {name: column for column, (_, aliases) in QUANTITIES.items() for name in aliases}
    for name, column in list(names.items()):
        for form in COMPANION_FORMS:
            names.setdefault(form.format(name), companion(column))
    return names | dict.fromkeys(BARE_UNCERTAINTIES, "spin_frequency_u_hz")


NAMES: Mapping[str, str] = _all_names()


def dimension(column: str) -> str:
    """Dimension of a canonical column, or of the quantity whose uncertainty it is."""
    return QUANTITIES[COMPANIONS.get(column, column)][0]


def plain_unit(text: str) -> str:
    """A unit as the table spells it: µ as μ, ⁻¹ as -1, without blanks, dots, carets and brackets."""
    return re.sub(r"[\s^·*()\[\]]", "", unicodedata.normalize("NFKC", text).replace("−", "-"))


def unit_factor(text: str, kind: str) -> float | None:
    """Factor to SI of a unit of the dimension `kind`, or None if it is none.

    Case counts only where it must: "khz" is kHz, but "mhz" could be two units and is none.
    """
    units, unit = UNITS[kind], plain_unit(text)
    if unit in units:
        return units[unit]
    factors = {factor for name, factor in units.items() if name.casefold() == unit.casefold()}
    return factors.pop() if len(factors) == 1 else None


def is_unit(text: str) -> bool:
    """Whether a field is the unit of anything we know, as in a row of units beneath a header."""
    return any(unit_factor(text, kind) is not None for kind in UNITS)


def _plain_name(text: str) -> str:
    return re.sub(r"[\s\-]+", "_", unicodedata.normalize("NFKC", text).strip().casefold())


_UNIT_FORMS = tuple(
    re.compile(form)
    for form in (
        r"(?P<name>.+?)\s*/?\s*[\[(](?P<unit>[^\[\]()]*)[\])]",  # f [Hz], f (Hz), f / (1/min)
        r"(?P<name>.+?)\s*/\s*(?P<unit>.+)",  # f/Hz
        r"(?P<name>.+?)\s+in\s+(?P<unit>.+)",  # f in Hz
        r"(?P<name>[^,]+),\s*(?P<unit>.+)",  # f, Hz
    )
)


def read_title(text: str) -> Title:
    """Read one header field.

    >>> read_title("f / kHz")
    Title(column='spin_frequency_hz', unit='kHz')
    >>> read_title("zeit_ms")
    Title(column='time_s', unit='ms')
    """
    text = text.strip()
    name = _plain_name(text)
    if name in NAMES:
        return Title(NAMES[name], IMPLIED_UNITS.get(name))
    forms = (form.fullmatch(text) for form in _UNIT_FORMS)
    found = [(_plain_name(m["name"]), m["unit"]) for m in forms if m]
    for label, unit in found:
        if label in NAMES:
            return Title(NAMES[label], unit)
    for place in (m.start() for m in re.finditer("_", text)):
        column = NAMES.get(_plain_name(text[:place]))
        if column and unit_factor(text[place + 1 :], dimension(column)) is not None:
            return Title(column, text[place + 1 :])
    return Title(None, found[0][1] if found else None)


def known_titles(header: Sequence[str]) -> int:
    """How many of the fields name a column that we know."""
    return sum(read_title(text).column is not None for text in header)


def choose_columns(
    path: Path, header: Sequence[str], units: Sequence[str], wanted: Mapping[str, str]
) -> tuple[tuple[Column, ...], tuple[str, ...]]:
    """The columns of a file that hold something we know, and warnings about those that nearly do.

    Args:
        path: the file, for messages.
        header: the column titles, stripped.
        units: the row of units beneath, or nothing.
        wanted: {canonical name, or t, f, u: title or 1-based number}; goes before what the titles say.

    Raises:
        TableError: a wanted column does not exist, a quantity has two columns, or units contradict each other.
    """
    titles = [read_title(text) for text in header]
    chosen = _wanted_columns(path, header, wanted)
    offered: dict[str, list[int]] = {}
    warnings = []
    for index, title in enumerate(titles):
        if title.column is None or title.column in chosen or index in chosen.values():
            continue
        if title.unit is not None and unit_factor(title.unit, dimension(title.column)) is None:
            warnings.append(_unknown_unit(path, header[index], title))
        else:
            offered.setdefault(title.column, []).append(index)
    chosen |= {name: _only_one(path, header, name, indices) for name, indices in offered.items()}
    written = {name: _written_unit(path, name, index, header, units) for name, index in chosen.items()}
    columns = []
    for name, index in chosen.items():
        # An uncertainty without a unit has that of its quantity: "rpm,u" gives both in 1/min.
        unit = written[name] or written.get(COMPANIONS.get(name, ""))
        factor = unit_factor(unit, dimension(name)) if unit else 1
        columns.append(Column(name, index, header[index], factor or 1))
    return tuple(sorted(columns, key=lambda c: CANONICAL.index(c.name))), tuple(warnings)


def _wanted_columns(path: Path, header: Sequence[str], wanted: Mapping[str, str]) -> dict[str, int]:
    chosen: dict[str, int] = {}
    for key, title in wanted.items():
        name = SHORTHANDS.get(key, key)
        if name not in CANONICAL:
            raise TableError(path, f"--columns cannot set '{shown(key)}'; it sets t, f, u or {', '.join(CANONICAL)}")
        index = _find(header, title.strip())
        if index is None:
            raise TableError(
                path,
                f"has no column '{shown(title)}'; it has {listed(header)}: correct --columns {key}=NAME or NUMBER",
            )
        if index in chosen.values():
            raise TableError(path, f"--columns names column '{shown(title)}' twice; each column holds one quantity")
        chosen[name] = index
    return chosen


def _find(header: Sequence[str], title: str) -> int | None:
    """Index of a title: as it stands, in any case, or without its unit; else a 1-based number."""
    folded = [text.casefold() for text in header]
    bare = [_UNIT_FORMS[0].sub(lambda m: m["name"], text) for text in folded]
    for titles, wanted in ((list(header), title), (folded, title.casefold()), (bare, title.casefold())):
        if titles.count(wanted) == 1:
            return titles.index(wanted)
    number = int(title) if re.fullmatch(r"[0-9]{1,6}", title) else 0
    return number - 1 if 1 <= number <= len(header) else None


def _only_one(path: Path, header: Sequence[str], name: str, indices: list[int]) -> int:
    """The column for a quantity: the canonical title, else the only one that could be."""
    exact = [index for index in indices if header[index] == name]
    if len(exact or indices) == 1:
        return (exact or indices)[0]
    key = next((short for short, long in SHORTHANDS.items() if long == name), name)
    numbers = " or ".join(f"{key}={index + 1}" for index in indices)
    raise TableError(
        path,
        f"columns {listed(header[i] for i in indices)} could each be {name}; say which: --columns {numbers}",
    )


def _written_unit(path: Path, name: str, index: int, header: Sequence[str], units: Sequence[str]) -> str | None:
    """The unit that the title or the row of units gives a column, if it is one of the quantity's."""
    title = read_title(header[index])
    kind = dimension(name)
    in_title = title.unit if title.unit and unit_factor(title.unit, kind) is not None else None
    beneath = units[index] if index < len(units) and unit_factor(units[index], kind) is not None else None
    implied = _plain_name(header[index]) in IMPLIED_UNITS
    if in_title and beneath and not implied and unit_factor(in_title, kind) != unit_factor(beneath, kind):
        raise TableError(
            path,
            f"column '{shown(header[index])}' has the unit '{shown(beneath)}' in the row beneath; correct one of them",
        )
    return beneath or in_title


def _unknown_unit(path: Path, label: str, title: Title) -> str:
    kind = dimension(title.column or "")
    return (
        f"{shown(str(path), 200)}: column '{shown(label)}' is not used: '{shown(title.unit or '')}' is no unit of "
        f"{kind} known here ({', '.join(list(UNITS[kind])[:8])} …)"
    )

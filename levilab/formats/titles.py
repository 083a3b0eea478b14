"""Column titles as people write them: names and units as two tables, and the reading of one title."""

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import filterfalse
from math import pi

from levilab.texts.text import Text

PER_MINUTE = 1 / 60
PER_RADIAN = 1 / (2 * pi)

# Factors to SI; spelled as `plain_unit` leaves them (no blanks, no ^ or ·, superscripts made plain).
UNITS: Mapping[str, Mapping[str, float]] = {
    "time": {
        **dict.fromkeys((
            "s", "sec", "second", "seconds", "sek", "sekunde", "sekunden", "seconde", "secondes", "segundo", "segundos",
            "sekund", "sekunder",
        ), 1),
        "ms": 1e-3, "msec": 1e-3, "milliseconds": 1e-3, "millisekunden": 1e-3, "μs": 1e-6, "us": 1e-6, "ns": 1e-9,
        **dict.fromkeys(("min", "minute", "minutes", "minuten", "minuto", "minutos", "minut", "minuter"), 60),
        "h": 3600,
        **dict.fromkeys(("d", "day", "days", "tag", "tage", "jours", "días", "dagar"), 86400),  # of a spreadsheet
        **dict.fromkeys(("mm:ss", "m:ss", "min:s", "min:sec", "hh:mm:ss", "h:mm:ss", "h:min:s"), 1),
        **dict.fromkeys(("hh:mm", "h:mm", "h:min"), 1),  # of a clock, whose times are read to seconds
    },
    "frequency": {
        "Hz": 1, "hertz": 1, "kHz": 1e3, "MHz": 1e6, "mHz": 1e-3, "μHz": 1e-6, "1/s": 1, "rps": 1, "U/s": 1,
        "rpm": PER_MINUTE, "1/min": PER_MINUTE, "U/min": PER_MINUTE, "UPM": PER_MINUTE, "hercios": 1,
        "rad/s": PER_RADIAN, "rad_s": PER_RADIAN, "rad_per_s": PER_RADIAN,
        "°/s": 1 / 360, "deg/s": 1 / 360, "deg_s": 1 / 360, "grad/s": 1 / 360,
        **dict.fromkeys(("krpm", "1000rpm", "1000/min", "1000U/min", "103/min"), 1000 * PER_MINUTE),  # and 10³ min⁻¹
    },
    "voltage": {"V": 1, "mV": 1e-3, "μV": 1e-6, "uV": 1e-6, "kV": 1e3},
    "length": {"m": 1, "cm": 1e-2, "mm": 1e-3, "μm": 1e-6, "um": 1e-6},
    "flux density": {"T": 1, "mT": 1e-3, "μT": 1e-6, "uT": 1e-6, "nT": 1e-9, "G": 1e-4, "gauss": 1e-4, "mG": 1e-7},
}  # fmt: skip

#: Names of an angular frequency: their 1/s is rad/s, as textbooks write it, and no Hz.
ANGULAR = (
    "omega", "ω", "omega3", "ω3", "omega_3", "ω_3", "angular_velocity", "angular_frequency", "angular_speed",
    "angular_rate", "winkelgeschwindigkeit", "winkelfrequenz", "kreisfrequenz", "vitesse_angulaire",
    "velocidad_angular", "vinkelhastighet", "vinkelfrekvens", "pulsation",
)  # fmt: skip
# Names that could as well be in 1/s as in 1/min: known only with a unit.
NEED_UNITS = (
    "drehzahl", "speed", "rotation_speed", "rotational_speed", "vitesse", "vitesse_de_rotation", "varvtal",
    "velocidad", "velocidad_de_giro", "velocidad_de_rotacion", "n",
)  # fmt: skip
#: Unit of a column that counts turns since the start, which only grow, and its other names.
TOTAL = "turns"
_TOTALS = (TOTAL, "counts", "pulses", "revolutions", "rotations", "umdrehungen", "impulse")
#: Units of other quantities, which no column of ours has.
FOREIGN = ("°C", "C", "°F", "F", "K", "lx", "hPa", "Pa", "dB", "kg", "g", "A", "mA", "W", "%")
#: Units in which the title says whether turns or radians are counted.
_PER_SECOND = ("1/s", "/s")

#: Names of a component of the magnetic field.
_COMPONENTS = ("flux_density_{}", "magnetic_field_{}", "mag_{}", "mag{}", "b_{}", "b{}")
#: The same in any language: magnetisches Feld x, champ magnétique y, densidad de flujo magnético z.
_ALONG_AXIS = re.compile(r"(?=\w*magn)\w*(?:fi?eld|falt|ch?amp|flu|flo|indu|met[er])\w*_([xyz])")

# Canonical column: its dimension, and the names it goes by, in lower case, without accents, blanks and hyphens as "_".
QUANTITIES: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "time_s": ("time", (
        "time", "t", "zeit", "elapsed", "elapsed_time", "timestamp", "seconds", "sekunden", "milliseconds", "minutes",
        "ms", "millis", "micros", "x_value", "clock", "uhrzeit", "temps", "tiempo", "tempo", "tid", "laufzeit",
        "messzeit", "gesamtzeit", "zeitpunkt", "zeitstempel", "ts", "datetime", "epoch", "heure",
        "datum/uhrzeit", "date/time", "hora", "time_of_day", "tageszeit", "tidpunkt", "secondes", "segundos",
        "sekunder")),
    "spin_frequency_hz": ("frequency", (
        "spin_frequency", "f", "freq", "frequency", "frequenz", "nu", "ν", "nu3", "ν3", "f3", "ν_3", "nu_3", "f_3",
        "spin", "spin_freq", "f_spin", "rotation_frequency", "rotation", "drehfrequenz", "hz", "hertz", "rpm", "rad/s",
        *ANGULAR, *NEED_UNITS, "frequence", "frekvens", "frecuencia", "umdrehungsfrequenz", "umlauffrequenz",
        "1/t", "rotationsfrequenz", "rotationsfrekvens", "frequence_de_rotation", "frecuencia_de_giro",
        "frecuencia_de_rotacion", "spin_rate", "rotation_rate")),
    "precession_frequency_hz": ("frequency", (
        "precession_frequency", "precession", "f_precession", "f_p", "fp", "νp", "ν_p", "nu_p", "prazession",
        "prazessionsfrequenz", "precession_freq", "frequence_de_precession", "frecuencia_de_precesion", "precesion")),
    "drive_frequency_hz": ("frequency", (
        "drive_frequency", "f_drive", "drive", "f_d", "fd", "νd", "ν_d", "nu_d", "antrieb", "antriebsfrequenz",
        "erregerfrequenz", "drive_freq", "driving_frequency", "frequence_d'excitation", "frecuencia_de_excitacion",
        "drivfrekvens")),
    "drive_amplitude_v": ("voltage", ("drive_amplitude", "amplitude", "drive_voltage", "amplitude_drive")),
    "height_m": ("length", ("height", "z", "h", "hohe", "hoehe")),
    "x_m": ("length", ("x", "x_position", "position_x")),
    "y_m": ("length", ("y", "y_position", "position_y")),
    "flux_density_t": ("flux density", ("flux_density", "b", "bz", "b_z", "field", "flussdichte")),
    # along the axes of a phone; b_z alone is that of a Hall probe on the axis
    **{
        f"flux_density_{axis}_t": ("flux density", tuple(form.format(axis) for form in _COMPONENTS))
        for axis in "xyz"
    },
    "flux_density_abs_t": ("flux density", (
        "absolute_field", "absolute_magnetic_field", "absolutes_feld", "absolutes_magnetfeld", "absolutfeld",
        "magnetic_field_magnitude", "|b|", "b_abs", "babs", "btotal", "b_total")),
}  # fmt: skip

# Names that say their unit themselves; every other bare name is taken as SI.
IMPLIED_UNITS = dict.fromkeys((*ANGULAR, "rad/s"), "rad/s") | {
    "rpm": "rpm", "ms": "ms", "milliseconds": "ms", "millis": "ms", "micros": "us", "minutes": "min",
    "hertz": "Hz", "hz": "Hz",
}  # fmt: skip
# The time of a turn, and turns in a time, are read where the title says their unit: T [ms], turns in 10 s.
PERIODS = (
    "period", "periode", "periodendauer", "rotation_period", "spin_period", "umlaufzeit", "umlaufdauer",
    "umdrehungszeit", "umdrehungsdauer", "drehperiode", "periode_de_rotation", "periodo", "periodo_de_rotacion",
    "periodtid", "omloppstid",
)  # fmt: skip
TURNS = (
    "turns", "rotations", "revolutions", "revs", "rev", "umdrehungen", "umdr.", "umdr", "umlaufe", "rotationen",
    "tours", "varv", "vueltas", "pulses", "pulse", "impulse", "counts",
)  # fmt: skip
#: The time of N turns: 10 Umdrehungen, 10 T, time for 10 turns.
_TIME_OF_TURNS = re.compile(
    r"(?:(?:\w+_)?(?:for|of|fur|von|pour|de|av|para)_)?(?P<number>[1-9]\d{0,3})_?(?:"
    + "|".join(map(re.escape, (*TURNS, "perioden", "periods", "periodes", "periodos", "perioder", "t")))
    + ")"
)
#: A symbol after its name says nothing more, as in Zeit t, Drehzahl n.
SYMBOLS = ("t", "f", "n", "nu", "ν", "omega", "ω", "z", "h", "b")
# Titles that begin so hold something from which a frequency is yet to be worked out.
_INVERSE, OVER_TIME = (
    "say its unit in the title, as in period [ms]",
    "say in which time in the title, as in turns in 10 s",
)
NEARLY_FREQUENCIES = dict.fromkeys(("period", "umlauf"), _INVERSE) | dict.fromkeys(
    ("turns", "umdreh", "umdr", "rotations", "revolutions", "tours"), OVER_TIME
)
# Alone they belong to the spin frequency, else to the quantity whose name stands before or behind (u_z, z_err …).
UNCERTAINTIES = (
    "u", "sigma", "σ", "±", "+/_", "uncertainty", "unsicherheit", "messunsicherheit", "incertitude", "incertidumbre",
    "osakerhet", "error", "err", "fehler", "messfehler", "stderr", "standard_error", "standard_uncertainty",
)  # fmt: skip
# These stand alone: beside a mean they are of one reading.
_SCATTERS = (
    "sd", "std", "stddev", "stdev", "std_dev", "std._dev.", "stabw", "standardabweichung", "se", "sem", "std_error",
    "df",
)  # fmt: skip
COMPANION_FORMS = (
    "u({})",
    "δ{}",
    "δ_{}",
    *(form for word in UNCERTAINTIES for form in (f"{word}_{{}}", f"{{}}_{word}")),
)


#: A title that means the time of day.
_OF_DAY = re.compile(r"(?i)(?<!stopp)uhr|(?<!stop)clock|time.of.day|tageszeit|heure|hora\b|date|datum|fecha|klocka")


def are_hours(title: str, unit: str) -> bool | None:
    """Return whether times as 14:05 are hours and minutes by the unit or the title; None where neither says.

    >>> are_hours("Uhrzeit", ""), are_hours("t", "min"), are_hours("Zeit", "hh:mm"), are_hours("Zeit", "s")
    (True, False, True, None)
    """
    if unit in {"", "s"}:
        return True if _OF_DAY.search(title) else None
    return plain_unit(unit) in {"hh:mm", "h:mm", "h:min", "h"}


@dataclass(frozen=True)
class Title:
    """What one header field says: a canonical column (None: unknown to us) and a unit (None: none given).

    Attributes:
        inverse: the field holds the time of a turn, of which the column is the inverse.
        angular: the name is that of an angular frequency, or of its uncertainty.
        turns: how many turns that time is of.
    """

    column: str | None
    unit: str | None
    inverse: bool = False
    angular: bool = False
    turns: int = 1

    def counts_radians(self, unit: str | None) -> bool:
        """Return whether a unit that says only "per second" means radians per second here."""
        return self.angular and unit is not None and plain_unit(unit) in _PER_SECOND


def companion(column: str) -> str:
    """Return the column of a column's standard uncertainty.

    >>> companion("spin_frequency_hz")
    'spin_frequency_u_hz'
    """
    name, _, unit = column.rpartition("_")
    return f"{name}_u_{unit}"


#: Titles that a message shows beside the canonical one.
EXAMPLES: Mapping[str, str] = {
    "time_s": "t",
    "spin_frequency_hz": "f [Hz], rpm",
    "precession_frequency_hz": "f_p [Hz]",
    "drive_frequency_hz": "f_d [Hz]",
    "height_m": "z [mm]",
    "flux_density_t": "B [mT]",
}
COMPANIONS: Mapping[str, str] = {companion(column): column for column in QUANTITIES}
CANONICAL = (*QUANTITIES, *COMPANIONS)
#: Components of a field along a phone's axes.
COMPONENTS = tuple(f"flux_density_{axis}_t" for axis in "xyz")
#: The field's magnitude, where no component is recorded.
MAGNITUDE = "flux_density_abs_t"
#: Those that a message lists.
LISTED = tuple(name for name in CANONICAL if COMPANIONS.get(name, name) not in {*COMPONENTS, MAGNITUDE, "x_m", "y_m"})


def _all_names() -> dict[str, str]:
    names: dict[str, str] = {}
    for column, (_, aliases) in QUANTITIES.items():
        for name in aliases:
            names.setdefault(name, column)
    for name, column in list(names.items()):
        for form in COMPANION_FORMS:
            names.setdefault(form.format(name), companion(column))
    return names | dict.fromkeys((*UNCERTAINTIES, *_SCATTERS), "spin_frequency_u_hz")


NAMES: Mapping[str, str] = _all_names()
_ANGULAR_NAMES = frozenset(form.format(name) for name in ANGULAR for form in ("{}", *COMPANION_FORMS))


def dimension(column: str) -> str:
    """Return the dimension of a canonical column, or of the quantity whose uncertainty it is."""
    return QUANTITIES[COMPANIONS.get(column, column)][0]


#: Units of a phone's other sensors, and of those along its three axes.
OTHER_SENSORS: Mapping[str, str] = {"lx": "the light sensor", "hPa": "the barometer", "dB": "the microphone's level"}
MOTION_SENSORS: Mapping[str, str] = {"m/s2": "the accelerometer", "rad/s": "the gyroscope"}


#: Columns of the phone app Sensor Logger, the same of all sensors; what they are of its magnetometer, and of others.
SENSOR_LOGGER = ("time", "seconds_elapsed", "z", "y", "x")
LOGGED_FIELD = ("", "t [s]", "Bz [μT]", "By [μT]", "Bx [μT]")
LOGGED = ("", "t [s]", "z axis", "y axis", "x axis")


def motion_sensor(titles: Sequence[str]) -> tuple[str, str] | None:
    """Return the first title of a phone's sensor of its own motion, and the sensor; None without its three axes.

    >>> motion_sensor([f"Acceleration {axis} (m/s^2)" for axis in "xyz"])
    ('Acceleration x (m/s^2)', 'the accelerometer')
    """
    units = [plain_unit(read_title(title).unit or "") for title in titles]
    found = ((title, MOTION_SENSORS[unit]) for title, unit in zip(titles, units, strict=True) if unit in MOTION_SENSORS)
    return next(found, None) if any(units.count(unit) >= 3 for unit in MOTION_SENSORS) else None


_FOLDED_UNITS = frozenset(name.casefold() for units in UNITS.values() for name in units)


def plain_unit(text: str) -> str:
    """Return a unit as the table spells it: µ as μ, min⁻¹ as /min, without blanks, dots, carets and brackets."""
    plain = re.sub(r"[\s^·*()\[\]]", "", unicodedata.normalize("NFKC", text).replace("−", "-"))
    return re.sub(r"\.?(s|min)-1$", r"/\1", plain).removesuffix(".")


def factor_of(text: str, units: Mapping[str, float]) -> float | None:
    """Return the factor of a unit in a table of them, or None for any other text.

    Case counts only where it must: "khz" is kHz, but "mhz" could be two units and is none.
    """
    unit = plain_unit(text)
    if unit in units:
        return units[unit]
    factors = {factor for name, factor in units.items() if name.casefold() == unit.casefold()}
    return factors.pop() if len(factors) == 1 else None


def unit_factor(text: str, kind: str) -> float | None:
    """Return the factor to SI of a unit of the dimension `kind`, or None for any other text; see `factor_of`."""
    factor = factor_of(text, UNITS[kind])
    if factor is None and kind == "frequency" and (turns := _TURNS_IN.fullmatch(plain_unit(text))):
        second = unit_factor(turns["unit"], "time")
        length = float(turns["number"].replace(",", ".") if turns["number"] else 1)
        return 1 / (length * second) if second and length else None
    if factor is None and kind == "time" and (steps := _STEPS_OF.fullmatch(plain_unit(text))):
        second, length = factor_of(steps["unit"], UNITS[kind]), float(steps["number"].replace(",", "."))
        return length * second if second and length else None
    return factor


def is_unit(text: str) -> bool:
    """Return whether a field is the unit of anything we know, as in a row of units beneath a header."""
    unit = plain_unit(text)
    if unit.casefold() not in _FOLDED_UNITS and not _TURNS_IN.fullmatch(unit):
        return False  # nearly every field: one look instead of one for each unit
    return any(unit_factor(text, kind) is not None for kind in UNITS)


def plain_name(text: str) -> str:
    """Return a name as the tables spell it; of a name and its symbol, "Zeit t", the one that says more."""
    letters = filterfalse(unicodedata.combining, unicodedata.normalize("NFKD", text.strip().casefold()))
    name = re.sub(r"[\s\-]+", "_", "".join(letters))
    if along := _ALONG_AXIS.fullmatch(name):
        return f"magnetic_field_{along[1]}"
    word, _, symbol = name.rpartition("_")
    if name in NAMES or symbol not in SYMBOLS:
        return name
    if word in PERIODS and symbol == "t":
        return word
    if NAMES.get(word) != NAMES[symbol]:
        return name
    return symbol if symbol in ANGULAR else word


_A_TURN = r"1|U|umdr\.?|umdrehungen|turns?|rev|revolutions?|rotations?|tr|tours?|r|varv|vueltas?"
_TURNS_IN = re.compile(
    rf"(?:(?:{_A_TURN})?/|(?:{_A_TURN})(?:in|per|pro|en)(?=\d))(?P<number>\d+([.,]\d+)?)?(?P<unit>[a-zμ]+)",
    re.IGNORECASE,
)
#: Times that count steps of a length, as of readings each 2 s: "2 s".
_STEPS_OF = re.compile(r"(?P<number>\d+(?:[.,]\d+)?)(?P<unit>[a-zμ]+)", re.IGNORECASE)
_UNIT_FORMS = tuple(
    re.compile(form)
    for form in (
        r"(?P<name>.+?)\s*/?\s*[\[(](?P<unit>[^\[\]()]*)[\])]",  # f [Hz], f (Hz), f / (1/min)
        r"(?P<name>.+?)\s*/\s*(?P<unit>.+)",  # f/Hz
        r"(?P<name>.+?)\s+(in|en|i|per|pro|par|por)\s+(?P<unit>.+)",  # f in Hz, turns per minute
        r"(?P<name>[^,]+),\s*(?P<unit>.+)",  # f, Hz
    )
)

_UNIT_WITHIN = re.compile(r"(?P<name>[^\[(]+?)\s*[\[(](?P<unit>[^\[\]()]+)[\])]\s.+")  # f [Hz] mean

#: A unit behind a name and a blank: Laufzeit s, Drehzahl 1/min; no symbol of a quantity.
_BARE_UNIT = re.compile(r"(?P<name>.+)\s(?P<unit>s|sec|sek|ms|min|[kmμ]?Hz|rpm|(?:1|U|tr|r|rev|°|rad)/(?:s|min))")
#: A title that is longer names nothing that is known here: the forms above look at each pair of its places.
LONGEST_TITLE = 200


def without_runs_of_blanks(text: str) -> str:
    """Return a title with a blank where there are many: a program that lays out columns writes thousands."""
    return " ".join(text.split())


def _name_and_unit(text: str) -> list[tuple[str, str]]:
    forms = [match for form in _UNIT_FORMS if (match := form.fullmatch(text))]
    found = [(m["name"], m["unit"]) for m in forms if m["unit"].count("(") == m["unit"].count(")")]  # ln(f/Hz) is none
    within, behind = _UNIT_WITHIN.fullmatch(text), _BARE_UNIT.fullmatch(text)
    return [*found, *((m["name"], m["unit"]) for m in (within, behind) if m and is_unit(m["unit"]))]


def read_title(text: str) -> Title:
    """Read one header field.

    >>> read_title("zeit_ms")
    Title(column='time_s', unit='ms', inverse=False, angular=False, turns=1)
    >>> read_title("f / kHz").unit, read_title("turns in 10 s").unit
    ('kHz', '/10 s')
    >>> read_title("period [ms]").inverse, read_title("ω in 1/s").angular
    (True, True)
    >>> read_title("10 Umdrehungen in s").turns, read_title("Laufzeit s").unit, read_title("sec").unit
    (10, 's', 'sec')
    """
    text = without_runs_of_blanks(text)
    if len(text) > LONGEST_TITLE:
        return Title(None, None)
    name = plain_name(text)
    if bare := _title_without_unit(name):
        return bare
    found = _name_and_unit(text)
    for label, unit in found:
        if title := _title_of_name(label, unit):
            return title
    for place in (m.start() for m in re.finditer("_", text)):
        title = _title_of_name(text[:place], text[place + 1 :])
        if title and (title.inverse or unit_factor(text[place + 1 :], dimension(title.column or "")) is not None):
            return title
    # a title may be a unit alone, as sec or 1/min; m, h, T and G are symbols of quantities, too
    units = [*[text] * (len(text) > 1 or text == "s"), *(unit for _, unit in found)]
    return Title(None, next((unit for unit in units if is_unit(unit)), found[0][1] if found else None))


def _title_without_unit(name: str) -> Title | None:
    """Return the title that a name alone is; None for an unknown one, and for one that needs a unit."""
    if turns := _turns_timed(name):
        return Title("spin_frequency_hz", None, inverse=True, turns=turns)
    if name in NAMES and name not in NEED_UNITS:
        return Title(NAMES[name], IMPLIED_UNITS.get(name), angular=name in _ANGULAR_NAMES)
    return None


def _turns_timed(name: str) -> int:
    """Return how many turns a column of this name holds the time of, 0 if none."""
    found = _TIME_OF_TURNS.fullmatch(name)
    return int(found["number"]) if found else int(name in PERIODS)


def _title_of_name(label: str, unit: str) -> Title | None:
    """Return the title that a name gives together with a possible unit; None for an unknown name."""
    name = plain_name(label)
    name = name if name in NAMES else plain_name(label.partition(",")[0])  # angular velocity, channel A
    if (turns := _turns_timed(name)) and unit_factor(unit, "time"):
        return Title("spin_frequency_hz", unit, inverse=True, turns=turns)
    if (name in TURNS or label == "U") and (factor := unit_factor(f"/{unit}", "frequency")):
        return Title("spin_frequency_hz", {1.0: "1/s", PER_MINUTE: "1/min"}.get(factor, f"/{unit}"))
    return Title(NAMES[name], unit, angular=name in _ANGULAR_NAMES) if name in NAMES else None


def known_titles(header: Sequence[str]) -> int:
    """Return the number of fields that name a column that we know."""
    return sum(read_title(text).column is not None for text in header)


def nearly_a_frequency(text: str) -> str | None:
    """Return how a frequency follows from a column's quantity, None if it does not.

    >>> nearly_a_frequency("Drehzahl")
    'say its unit in the title, or `columns` = "f=Drehzahl [Hz]" or "f=Drehzahl [rpm]", whichever it is in'
    """
    name = plain_name(text)
    if name in NEED_UNITS:
        said = 'say its unit in the title, or `columns` = "f={title:s} [Hz]" or "f={title:s} [rpm]", whichever it is in'
        return Text(said, text.strip())
    return next((how for word, how in NEARLY_FREQUENCIES.items() if name.startswith(word)), None)


def as_a_period(text: str) -> Title | None:
    """Return the title of a T in a unit of time as that of a period, which it is beside a time.

    It may have an index; a number above 9 is one of turns.

    >>> as_a_period("T_A1 [ms]").turns, as_a_period("T_50 in s").turns, as_a_period("T")
    (1, 50, None)
    """
    index = r"(?:_?[A-Z]?\d(?!\d)|_?(?P<turns>[1-9]\d{1,3}))?"
    form = re.fullmatch(rf"T{index}\s*(?:[/_,]|in\b)?\s*[\[(]?(?P<unit>[^\[\]()]+)[\])]?", text.strip())
    unit = form and form["unit"].strip()
    if not form or not unit or not unit_factor(unit, "time"):
        return None
    return Title("spin_frequency_hz", unit, inverse=True, turns=int(form["turns"] or 1))


def foreign_unit(text: str, kind: str) -> str | None:
    """Return the unit in a title, if it is one of another dimension.

    >>> foreign_unit("period_ms", "frequency")
    'ms'
    """
    text = without_runs_of_blanks(text)
    if len(text) > LONGEST_TITLE:
        return None
    if plain_name(text) in NAMES:  # u_t has no unit, though there is one called t
        return None
    form = re.fullmatch(r".*?[\[(]([^\[\]()]*)[\])]", text)
    unit = form[1] if form else text.rpartition("_")[2] if "_" in text else ""
    foreign = is_unit(unit) and unit_factor(unit, kind) is None
    return unit if unit and (foreign or plain_unit(unit) in FOREIGN) else None


def is_total(unit: str) -> bool:
    """Return whether a unit says that turns are counted since the start."""
    return plain_unit(unit).casefold() in _TOTALS


def implied_unit(text: str) -> str | None:
    """Return the unit that a name says itself: rpm, omega."""
    return IMPLIED_UNITS.get(plain_name(text))

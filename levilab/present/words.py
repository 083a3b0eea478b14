"""An instrument's settings, from run.json, in the words of a lab book; names of which each is there once."""

from collections.abc import Mapping
from itertools import chain, count
from typing import Any

from analysis.numbers import digits
from levilab.present.units import split
from levilab.texts.text import Text

#: Instruments say infinite as 9.9e37 (SCPI-99 volume 1, §7.2.1.4).
INFINITE = 9e37
#: What makes up a generator's drive; the other settings are named one by one.
_DRIVE = ("frequency_hz", "amplitude_vpp", "waveform")
#: Numbers that are written in the finest unit of this laboratory.
_LEAST, _MOST = 0.1, 1000.0
#: Prefixes of units that have no scale of their own in this laboratory, and below 0.1 of its finest.
_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


def free_name(name: str, taken: set[str], between: str = "_") -> str:
    """Return the name, with a number behind it where it is taken; it is taken from then on.

    >>> taken = {"CH1_v"}
    >>> free_name("CH1_v", taken), free_name("CH1_v", taken), free_name("CH2_v", taken)
    ('CH1_v_2', 'CH1_v_3', 'CH2_v')
    """
    names = chain([name], (f"{name}{between}{number}" for number in count(2)))
    free = next(one for one in names if one not in taken)
    taken.add(free)
    return free


def settings_in_words(settings: Mapping[str, Any]) -> str:
    """Return all settings in one line; a generator's drive first.

    >>> settings_in_words({"automatic_level": False, "gate_s": 1.0, "impedance_ohm": 1e6})
    'automatic level off, gate 1 s, impedance 1 MΩ'
    >>> settings_in_words({"output": False, "frequency_hz": 40.0, "amplitude_vpp": 10.0, "waveform": "SIN"})
    'output off; last drive 40 Hz, 10 Vpp, SIN'
    """
    drive = [value_in_words(key, settings[key]) for key in _DRIVE if key in settings]
    if "output" not in settings or not drive:
        return Text("{settings}", settings=tuple(setting_in_words(key, value) for key, value in settings.items()))
    others = tuple(setting_in_words(key, value) for key, value in settings.items() if key not in {"output", *_DRIVE})
    named = "drive {settings}" if settings["output"] else "last drive {settings}"
    parts = [setting_in_words("output", settings["output"]), Text(named, settings=tuple(drive))]
    said = Text("{output}; {drive}", output=parts[0], drive=parts[1])
    return Text("{drive}; {others}", drive=said, others=others) if others else said


def setting_in_words(key: str, value: Any) -> str:
    """Return a setting and its value.

    >>> setting_in_words("load_ohm", 9.9e37)
    'load high impedance'
    >>> setting_in_words("creep_hz_per_s", 0.1), setting_in_words("shows", ["tape", "laser"])
    ('creep 0.1 Hz/s', 'shows tape, laser')
    """
    return Text("{setting} {value:n}", setting=split(key)[0].replace("_", " "), value=value_in_words(key, value))


def value_in_words(key: str, value: Any) -> str:
    """Return a setting's value with the unit that its key ends in; other units stand as they are typed.

    >>> value_in_words("trigger_level_v", 0.6), value_in_words("slope", "POS"), value_in_words("interval_s", 0.005)
    ('0.6 V', 'POS', '5 ms')
    >>> value_in_words("range_t", 0.035), value_in_words("base_inner_radius_m", 0.03)
    ('35 mT', '30 mm')
    """
    if isinstance(value, bool):
        return "on" if value else "off"
    if not isinstance(value, int | float):
        several = value if isinstance(value, list | tuple) else ("not known" if value is None else str(value),)
        return ", ".join(one if isinstance(one, str) else value_in_words(key, one) for one in several)
    unit = split(key)[1]
    text = unit.text if unit else ""
    if abs(value) >= INFINITE:
        return "high impedance" if text == "Ω" else "infinite"
    for scale in (unit.fine, unit.shown) if unit and unit.fine.factor > 1 else ():
        size = abs(value) * scale.factor
        if size < _MOST and (size >= _LEAST or text == "kg"):  # its prefixes are those of the gram
            return _with_unit(value * scale.factor, scale.unit)
    if not text or 0.01 <= abs(value) < 1000 or value == 0:
        return _with_unit(value, text)
    factor, prefix = next(((f, p) for f, p in _PREFIXES if abs(value) >= f), _PREFIXES[-1])
    return _with_unit(value / factor, f"{prefix}{text}")


def _with_unit(value: float, unit: str) -> str:
    """Return up to six digits and a unit, whose name in the language of the reader may be another."""
    return Text("{number:n} {unit}", number=digits(value, 6), unit=unit) if unit else digits(value, 6)

"""A virtual SDG1032X.

Sources: SDG Programming Guide PG02-E04A as public drivers quote it; an emulator that its authors compared with an
SDG1032X (state after ``*RST``, forms of the answers, amplitudes that are clipped, the load that halves what is shown);
what the authors of a public driver measured on an SDG2042X (the answer to ``C1:BSWV?`` after a reset; six digits of a
number, ten of a frequency; volts r.m.s. of a sine are 0.3535 of its peak to peak, of a ramp 1/3.464; the fraction of a
load is cut off).  Inferred: which field gives way where amplitude and offset together go beyond 10 V (the one that is
set), that a message has no path memory and changes nothing where one of its fields is unknown, limits of the ramp.
The fields of a burst and their order are those of public records of ``C1:BTWV?``, the latency among them; inferred: a
burst that is off takes no other field (guide), one that waits for an edge has EDGE in the place of TRMD (as a public
record of SWWV has it); PLRT of a gate as a public record of the guide's §3.7
has it.  Modulation and sweep are always off, arbitrary waveforms are missing.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from instruments.clock import Clock
from instruments.virtual.core.device import VirtualInstrument
from instruments.virtual.core.parameters import boolean, choice, number, optional_parameter, parameter
from instruments.virtual.core.parser import ScpiError, Value
from instruments.virtual.core.rows import Ask, Both, Own, Row, Switch, Word, short_header
from instruments.virtual.generator.channel import INFINITE, OPEN_V, SOURCE_OHM, Burst, Output, Triggered

#: WVTP → the waveform as the other generators call it, its highest frequency [Hz], peak to peak over r.m.s.
_WAVEFORMS = {
    "SINE": ("SIN", 30e6, 1 / 0.3535),
    "SQUARE": ("SQU", 30e6, 2.0),
    "RAMP": ("RAMP", 500e3, 3.464),
    "PULSE": ("PULS", 12.5e6, 2.0),
    "NOISE": ("NOIS", 30e6, 6.6),
    "DC": ("DC", 30e6, 2.0),
}
_LEAST_VPP, _GREATEST_LOAD = 2e-3, 1e5
#: Words of OUTP: for a load that is none, and for its polarity.
_OPEN, _POLARITIES = "HZ", ("NOR", "INVT")


@dataclass(frozen=True)
class Field:
    """A field of BSWV that is a number.

    key: its name on the wire; name: the setting; default; unit; shown: whether it is printed at the load; only: the
    waveforms that have it, all by default.  Fields without a setting of their own are sent only: their names begin
    with an underscore.
    """

    key: str
    name: str
    default: float
    unit: str = ""
    shown: bool = False
    only: tuple[str, ...] = ()


_FIELDS = {
    field.key: field
    for field in (
        Field("FRQ", "frequency", 1000.0, "HZ"),
        Field("PERI", "frequency", 1000.0, "S"),
        Field("AMP", "amplitude", 4.0, "V", shown=True),
        Field("OFST", "offset", 0.0, "V", shown=True),
        Field("HLEV", "_high", 2.0, "V", shown=True),
        Field("LLEV", "_low", -2.0, "V", shown=True),
        Field("AMPVRMS", "_rms", 1.414, "V", shown=True),
        Field("AMPDBM", "_dbm", 0.0),
        Field("MAX_OUTPUT_AMP", "greatest_amplitude", 20.0, "V"),
        Field("PHSE", "phase", 0.0),
        Field("DUTY", "duty", 50.0, only=("SQUARE", "PULSE")),
        Field("SYM", "symmetry", 50.0, only=("RAMP",)),
    )
}
#: The fields of BTWV: name on the wire → setting, value after ``*RST``, its limits or words, unit.
_BURST: dict[str, tuple[str, float | str, tuple[float, float] | tuple[str, ...], str]] = {
    "PRD": ("burst_period", 0.01, (1e-6, 1000.0), "S"),
    "STPS": ("burst_phase", 0.0, (0.0, 360.0), ""),
    "TRSR": ("trigger_source", "INT", ("EXT", "INT", "MAN"), ""),
    "TRMD": ("trigger_out", "OFF", ("RISE", "FALL", "OFF"), ""),
    "EDGE": ("trigger_edge", "RISE", ("RISE", "FALL"), ""),
    "TIME": ("burst_cycles", 1.0, (1.0, 1e6), ""),
    "DLAY": ("trigger_delay", 0.0, (0.0, 100.0), "S"),
    "GATE_NCYC": ("burst_mode", "NCYC", ("GATE", "NCYC"), ""),
    "PLRT": ("gate_polarity", "POS", ("POS", "NEG"), ""),
}
#: Fields that are not answered with the other mode: a gate has no count, no delay, no edge.
_OF_NCYC, _OF_GATE = frozenset({"TRMD", "EDGE", "TIME", "DLAY"}), frozenset({"PLRT"})
#: From an edge at the trigger input to the burst, which no delay is shorter than, and its scatter, 1σ (assumed) [s].
_LATENCY, _JITTER = 2.4e-7, 5e-9
#: The settings of a channel, with their values after ``*RST``.
_DEFAULTS: dict[str, Value] = {
    **{field.name: field.default for field in _FIELDS.values() if not field.name.startswith("_")},
    **{name: value for name, value, _, _ in _BURST.values()},
    "burst": False,
    "waveform": "SINE",
    "output": False,
    "load": INFINITE,
    "polarity": "NOR",
}
_CHANNEL: tuple[Row, ...] = (
    Both("C{n}:(BSWV|BASIC_WAVE)", lambda s, n, p: s.set_wave(n, p), lambda s, n, p: s.wave(n, p)),
    Both("C{n}:(OUTP|OUTPUT)", lambda s, n, p: s.set_output(n, p), lambda s, n, p: s.output(n, p)),
    *(
        Own(f"C{{n}}:({short}|{long})", lambda _s, _n, p: _only_off(p), lambda s, n, w=short: s.off(f"C{n}:{w}"))
        for short, long in (("MDWV", "MODULATEWAVE"), ("SWWV", "SWEEPWAVE"))
    ),
    Own("C{n}:(BTWV|BURSTWAVE)", lambda s, n, p: s.set_burst(n, p), lambda s, n: s.burst(n)),
    Switch("C{n}:SYNC", "{n}:sync", words=("OFF", "ON")),
    Own("C{n}:(INVT|INVERT)", lambda s, n, p: s.invert(n, p), lambda s, n: s.ask_invert(n)),
    Ask("C{n}:(ARWV|ARBWAVE)", lambda s, n: s.reply(f"C{n}:ARWV", "INDEX,2,NAME,StairUp")),
)
#: The first of the arbitrary waveforms that it is made with, by their places (guide, ARWV): none is put out here.
_BUILT_IN = (*("Sine", "Noise", "StairUp", "StairDn", "Stairud", "Ppulse", "Npulse", "Trapezia", "Upramp", "Dnramp"),)


def _only_off(parameters: list[str]) -> None:
    """STATE,OFF: modulation and sweep are missing here.  Raises ScpiError for all else."""
    if [word.upper() for word in parameters] != ["STATE", "OFF"]:
        raise ScpiError(-224)


def _key(n: int, name: str) -> str:
    """Return the name of a channel's setting."""
    return f"{n}:{name}"


def _pairs(parameters: list[str]) -> list[tuple[str, str]]:
    """Return names and the text behind each.  Raises ScpiError."""
    if not parameters or len(parameters) % 2:
        raise ScpiError(-109)
    return [(name.upper(), value) for name, value in zip(parameters[::2], parameters[1::2], strict=True)]


def _parameter(
    text: str, default: float | str, allowed: tuple[float, float] | tuple[str, ...], unit: str
) -> float | str:
    """Return a parameter of a burst: one of the words, or a number, at most at its limits.  Raises ScpiError."""
    if isinstance(default, str):
        return choice(text, tuple(str(word) for word in allowed))
    low, high = (float(limit) for limit in allowed)
    return min(max(number(text, low=-1e99, high=1e99, default=default, unit=unit), low), high)


class VirtualSDG1000X(VirtualInstrument):
    """An SDG1032X: two channels, 30 MHz.  The coil hangs on channel 1.

    listener: called with the time [s] and the new Output of channel 1 at each change.
    """

    identity = "Siglent Technologies,SDG1032X,VIRTUAL,1.01.01.33R1B6"
    path_memory = False
    numbered = (1, 2)
    CHANNEL_ROWS: ClassVar = _CHANNEL
    ROWS: ClassVar[tuple[Row, ...]] = (
        Switch("(BUZZ|BUZZER)", "buzzer", default=True, words=("OFF", "ON")),
        Word("(CHDR|COMM_HEADER)", "header", "*SHORT LONG OFF"),
        Both("(STL|STORELIST)", answer=lambda s, p: s.stored(p)),
    )
    DEFAULTS: ClassVar = {_key(n, name): value for n in numbered for name, value in _DEFAULTS.items()}

    def __init__(
        self, clock: Clock, *, listener: Callable[[float, Output], None] | None = None, identity: str | None = None
    ) -> None:
        super().__init__(clock, identity=identity)
        self._listener = listener

    def spell(self, value: float) -> str:
        """Return a number with six digits, without zeros at the end: 1000, 0.001."""
        return f"{value:.6g}"

    def reply(self, header: str, text: str, unit: str = "") -> str:
        """See the base: with the header, unless CHDR is OFF.  The long form is not modelled."""
        return text if self.settings["header"] == "OFF" else f"{short_header(header)} {text}"

    def off(self, header: str) -> str:
        """Answer that a mode is off."""
        return self.reply(header, "STATE,OFF")

    def stored(self, parameters: list[str]) -> str:
        """STL? [BUILDIN|USER]: places and names of the arbitrary waveforms; a user has none.  Raises ScpiError."""
        asked = optional_parameter(parameters).upper() or "BUILDIN"
        named = _BUILT_IN if choice(asked, ("BUILDIN", "USER")) == "BUILDIN" else ()
        return self.reply("STL", ", ".join(f"M{place}, {name}" for place, name in enumerate(named)))

    def on_change(self, name: str) -> None:
        """Pass the voltage at the terminals of channel 1 to the listener."""
        if self._listener and name.startswith("1:"):
            self._listener(self.clock.now(), self.signal())

    def reset(self) -> None:
        """Go to the state after ``*RST``: all outputs off; the form of answers stays, as with this maker's scopes."""
        self.settings |= self.commands.defaults | {"header": self.settings["header"]}
        self.on_change("1:output")

    def _number(self, n: int, name: str) -> float:
        return float(self.settings[_key(n, name)])

    def _load_factor(self, n: int) -> float:
        """Return the part of the open-circuit voltage that is at the load."""
        load = self._number(n, "load")
        return 1.0 if load >= INFINITE else load / (load + SOURCE_OHM)

    # --- BSWV ---

    def set_wave(self, n: int, parameters: list[str]) -> None:
        """BSWV: the fields that are named; a number beyond its limits becomes the limit.  Raises ScpiError."""
        with self.all_or_none():
            for key, text in _pairs(parameters):
                if key == "WVTP":
                    self.settings[_key(n, "waveform")] = choice(text, tuple(_WAVEFORMS))
                    self._set_number(n, _FIELDS["FRQ"], self._number(n, "frequency"))
                elif key in _FIELDS:
                    field = _FIELDS[key]
                    sent = number(text, low=-1e99, high=1e99, default=field.default, unit=field.unit)
                    self._set_number(n, field, sent / self._load_factor(n) if field.shown else sent)
                else:
                    raise ScpiError(-224, key[:20])
        self.on_change(_key(n, "waveform"))

    def _set_number(self, n: int, field: Field, value: float) -> None:
        amplitude, offset = self._number(n, "amplitude"), self._number(n, "offset")
        kind = _WAVEFORMS[str(self.settings[_key(n, "waveform")])]
        other = {"HLEV": offset - amplitude / 2, "LLEV": offset + amplitude / 2}.get(field.key)
        if other is not None:  # the other level stays
            self._set_number(n, _FIELDS["OFST"], 0.0)
            self._set_number(n, _FIELDS["AMP"], abs(value - other))
            self._set_number(n, _FIELDS["OFST"], (value + other) / 2)
            return
        if field.key == "PERI":
            value = 1 / max(value, 1e-12)
        elif field.key == "AMPVRMS":
            field, value = _FIELDS["AMP"], value * kind[2]
        elif field.key == "AMPDBM":
            field, value = _FIELDS["AMP"], self._volts_of_dbm(n, value) * kind[2]
        low, high = self._limits(n, field.name)
        self.settings[_key(n, field.name)] = min(max(value, low), high)
        if field.key == "MAX_OUTPUT_AMP":
            self._set_number(n, _FIELDS["AMP"], amplitude)

    def _volts_of_dbm(self, n: int, dbm: float) -> float:
        """Return the open-circuit voltage, r.m.s., for this power at the load [V].  Raises ScpiError without a load."""
        load = self._number(n, "load")
        if load >= INFINITE:
            raise ScpiError(-221)
        return math.sqrt(1e-3 * load) * 10 ** (min(max(dbm, -1e3), 1e3) / 20) / self._load_factor(n)

    def _limits(self, n: int, name: str) -> tuple[float, float]:
        if name == "frequency":
            return 1e-6, _WAVEFORMS[str(self.settings[_key(n, "waveform")])][1]
        if name == "amplitude":
            room = min(2 * (OPEN_V - abs(self._number(n, "offset"))), self._number(n, "greatest_amplitude"))
            return _LEAST_VPP, max(_LEAST_VPP, room)
        if name == "greatest_amplitude":
            return _LEAST_VPP, 2 * OPEN_V
        if name == "offset":
            reach = OPEN_V - self._number(n, "amplitude") / 2
            return -reach, reach
        return (0.0, 360.0) if name == "phase" else (0.0, 100.0)

    def wave(self, n: int, parameters: list[str]) -> str:
        """BSWV?: all fields of the waveform; it has no parameter, no list of channels either.  Raises ScpiError."""
        if parameters:
            raise ScpiError(-108)
        kind = str(self.settings[_key(n, "waveform")])
        factor, frequency = self._load_factor(n), self._number(n, "frequency")
        amplitude, offset = factor * self._number(n, "amplitude"), factor * self._number(n, "offset")
        fields = {
            "WVTP": kind,
            "FRQ": f"{frequency:.10g}HZ",
            "PERI": self.spell(1 / frequency) + "S",
            "AMP": self.spell(amplitude) + "V",
            "AMPVRMS": self.spell(amplitude / _WAVEFORMS[kind][2]) + "Vrms",
            "OFST": self.spell(offset) + "V",
            "HLEV": self.spell(offset + amplitude / 2) + "V",
            "LLEV": self.spell(offset - amplitude / 2) + "V",
            "PHSE": self.spell(self._number(n, "phase")),
        }
        own = (field for field in _FIELDS.values() if kind in field.only)
        fields |= {field.key: self.spell(self._number(n, field.name)) for field in own}
        return self.reply(f"C{n}:BSWV", ",".join(f"{key},{value}" for key, value in fields.items()))

    # --- BTWV ---

    def set_burst(self, n: int, parameters: list[str]) -> None:
        """BTWV: its state, and its fields where it is on.  Raises ScpiError."""
        with self.all_or_none():
            for key, text in _pairs(parameters):
                if key == "STATE":
                    self.settings[_key(n, "burst")] = boolean(text)
                elif key not in _BURST or not self.settings[_key(n, "burst")]:
                    raise ScpiError(-224, key[:20])
                else:
                    name, default, allowed, unit = _BURST[key]
                    self.settings[_key(n, name)] = _parameter(text, default, allowed, unit)
        self.on_change(_key(n, "burst"))

    def burst(self, n: int) -> str:
        """BTWV?: the fields of its mode, and those of the waveform behind them; STATE alone where it is off."""
        if not self.settings[_key(n, "burst")]:
            return self.off(f"C{n}:BTWV")
        values = {key: self.settings[_key(n, name)] for key, (name, *_) in _BURST.items()}
        values["DLAY"] = self._delay(n)
        del values["TRMD" if values["TRSR"] == "EXT" else "EDGE"]
        hidden = _OF_NCYC if values["GATE_NCYC"] == "GATE" else _OF_GATE
        fields = (
            f"{key},{self.spell(value) + _BURST[key][3] if isinstance(value, float) else value}"
            for key, value in values.items()
            if key not in hidden
        )
        wave = self.wave(n, []).partition("WVTP,")[2]
        return self.reply(f"C{n}:BTWV", f"STATE,ON,{','.join(fields)},CARR,WVTP,{wave}")

    def _delay(self, n: int) -> float:
        """Return the time from an edge at the trigger input to the burst [s]."""
        return max(self._number(n, "trigger_delay"), _LATENCY)

    # --- OUTP ---

    def set_output(self, n: int, parameters: list[str]) -> None:
        """OUTP ON,LOAD,HZ,PLRT,NOR: the state, where it is named, and the fields that are.  Raises ScpiError."""
        if not parameters:
            raise ScpiError(-109)
        states = {"ON": True, "OFF": False}
        named = parameters
        wanted: dict[str, bool | float | str] = {}
        if parameters[0].upper() in states:
            wanted["output"], named = states[parameters[0].upper()], parameters[1:]
        for key, text in _pairs(named) if named else ():
            if key == "LOAD":
                open_circuit = text.upper() == _OPEN
                ohm = INFINITE if open_circuit else number(text, low=0, high=1e99, default=50, unit="OHM")
                wanted["load"] = ohm if open_circuit else float(int(min(max(ohm, 50.0), _GREATEST_LOAD)))
            elif key == "PLRT":
                wanted["polarity"] = choice(text, _POLARITIES)
            else:
                raise ScpiError(-224, key[:20])
        self.settings |= {_key(n, name): value for name, value in wanted.items()}
        self.on_change(_key(n, "output"))

    def output(self, n: int, parameters: list[str]) -> str:
        """OUTP?: state, load, polarity; as with BSWV?.  Raises ScpiError."""
        if parameters:
            raise ScpiError(-108)
        load = self._number(n, "load")
        state = "ON" if self.settings[_key(n, "output")] else "OFF"
        shown = _OPEN if load >= INFINITE else self.spell(load)
        polarity = self.settings[_key(n, "polarity")]
        return self.reply(f"C{n}:OUTP", f"{state},LOAD,{shown},PLRT,{polarity}")

    def invert(self, n: int, parameters: list[str]) -> None:
        """INVT ON or OFF: the polarity, as PLRT of OUTP sets it.  Raises ScpiError."""
        self.settings[_key(n, "polarity")] = _POLARITIES[boolean(parameter(parameters))]
        self.on_change(_key(n, "output"))

    def ask_invert(self, n: int) -> str:
        """INVT?: whether the output is inverted."""
        return self.reply(f"C{n}:INVT", "ON" if self.settings[_key(n, "polarity")] == "INVT" else "OFF")

    # --- the terminals ---

    def signal(self, n: int = 1) -> Output:
        """Return the signal at the open terminals of a channel."""
        on, short = bool(self.settings[_key(n, "output")]), _WAVEFORMS[str(self.settings[_key(n, "waveform")])][0]
        amplitude = self._number(n, "amplitude") / 2 if on and short != "DC" else 0.0
        bursts = bool(self.settings[_key(n, "burst")]) and short != "DC"
        source, gated = self.settings[_key(n, "trigger_source")], self.settings[_key(n, "burst_mode")] == "GATE"
        closed = self.settings[_key(n, "gate_polarity")] == "POS" if gated else source != "INT"
        cycles, waits = self._number(n, "burst_cycles"), bursts and closed
        rising, delay = gated or self.settings[_key(n, "trigger_edge")] == "RISE", _LATENCY if gated else self._delay(n)
        armed = amplitude and waits and source == "EXT"
        return Output(
            waveform=short,
            frequency=self._number(n, "frequency"),
            amplitude=0.0 if waits else amplitude,
            offset=self._number(n, "offset") if on else 0.0,
            phase=self._number(n, "burst_phase" if bursts else "phase"),
            duty=self._number(n, "duty") / 100,
            symmetry=self._number(n, "symmetry") / 100 if short == "RAMP" else 1.0,
            inverted=self.settings[_key(n, "polarity")] == "INVT",
            burst=Burst(cycles, None if waits else self._number(n, "burst_period")) if bursts else None,
            triggered=Triggered(amplitude, 1.0 if gated else cycles, rising, delay, _JITTER) if armed else None,
        )

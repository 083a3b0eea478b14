"""A virtual SDS1104X-E.

Sources: what users of an SDS1204X-E measured on it and wrote down (headers in answers, ``INR?``, ``WF? DESC`` and
``DAT2`` with two line feeds behind them, the places in WAVEDESC, 25 codes a division); Siglent's Digital Oscilloscopes
Programming Guide as that page and public drivers quote it (CHDR, MSIZ, WFSU, PAVA, TRSE).  Inferred: the limits of
offsets and levels, that a message has no path memory (as LeCroy's, whose dialect this is), that no question reads an
error queue.  The measured SDS1204X-E ignored MSIZ; the guide's instrument, which this one is, obeys when stopped.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from typing import Any, ClassVar

from instruments.virtual.core.parameters import choice, parameter
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.rows import Ask, Both, Do, Number, Own, Row, Switch, Word, short_header
from instruments.virtual.oscilloscope.record import Record
from instruments.virtual.oscilloscope.scope import VirtualOscilloscope, at_input, levels, one_two_five

_COLUMNS = 14
#: The fastest rate [1/s] and the points of the memory, where one channel of a pair is on; half of both with two.
_FASTEST = 1e9
_DEPTHS = {"14K": 14_000, "140K": 140_000, "1.4M": 1_400_000, "14M": 14_000_000}
_HALVES = {"7K": 7_000, "70K": 70_000, "700K": 700_000, "7M": 7_000_000}
#: Bytes of the descriptor.
_DESCRIPTOR = 346
#: Bits of INR?: a new record; the trigger is ready.
_NEW_RECORD, _READY = 1, 8192

#: Measurements of PAVA?: their names here, and units.
_MEASUREMENTS = {
    "PKPK": ("VPP", "V"),
    "MAX": ("VMAX", "V"),
    "MIN": ("VMIN", "V"),
    "AMPL": ("VAMPLITUDE", "V"),
    "TOP": ("VTOP", "V"),
    "BASE": ("VBASE", "V"),
    "MEAN": ("VAVERAGE", "V"),
    "RMS": ("VRMS", "V"),
    "PER": ("PERIOD", "S"),
    "FREQ": ("FREQUENCY", "Hz"),
    "PWID": ("PWIDTH", "S"),
    "NWID": ("NWIDTH", "S"),
    "RISE": ("RISETIME", "S"),
    "FALL": ("FALLTIME", "S"),
}


def _reach(scope: VirtualSDS1000XE, n: int) -> tuple[float, float]:
    probe = scope.probe(n)
    reach = (100.0 if scope.value(f"chan{n}_scale") / probe >= 0.102 else 2.0) * probe
    return -reach, reach


#: In CHDR SHORT, as it leaves the factory, an answer has its header and its unit: C1:VDIV 5.00E-01V.
_CHANNEL: tuple[Row, ...] = (
    Number("C{n}:(ATTN|ATTENUATION)", "chan{n}_probe", 10.0, (0.1, 1e4), spell=lambda v: f"{v:g}"),
    Number("C{n}:(VDIV|VOLT_DIV)", "chan{n}_scale", 1.0, at_input(5e-4, 10), "V", clips=True),
    Number("C{n}:(OFST|OFFSET)", "chan{n}_offset", 0.0, _reach, "V", clips=True),
    Number("C{n}:(TRLV|TRIG_LEVEL)", "chan{n}_level", 0.0, levels(4.5), "V", clips=True),
    Word("C{n}:(TRSL|TRIG_SLOPE)", "chan{n}_slope", "NEG *POS WINDOW"),
    Word("C{n}:(TRCP|TRIG_COUPLING)", "chan{n}_trigger_coupling", "AC *DC HFREJ LFREJ"),
    Word("C{n}:(CPL|COUPLING)", "chan{n}_coupling", "A1M *D1M GND"),
    Word("C{n}:UNIT", "chan{n}_unit", "*V A"),
    Switch("C{n}:(TRA|TRACE)", "chan{n}_display", lambda n: n == 1, words=("OFF", "ON")),
    Switch("C{n}:(INVS|INVERTSET)", "chan{n}_invert", words=("OFF", "ON")),
    Switch("C{n}:(BWL|BANDWIDTH_LIMIT)", "chan{n}_bandwidth", words=("OFF", "ON")),
    Both("C{n}:(WF|WAVEFORM)", answer=lambda s, n, p: s.waveform(n, p)),
    Both("C{n}:(PAVA|PARAMETER_VALUE)", answer=lambda s, n, p: s.parameter_value(n, p)),
)
_REST: tuple[Row, ...] = (
    Word("(CHDR|COMM_HEADER)", "header", "*SHORT LONG OFF"),
    Do("ARM", lambda s: s.arm()),
    Do("STOP", lambda s: s.stop_key()),
    Do("(FRTR|FORCE_TRIGGER)", lambda s: s.force()),
    Do("(ASET|AUTO_SETUP)", lambda s: s.autoscale()),
    Word("(TRMD|TRIG_MODE)", "trigger_sweep", "*AUTO NORM SINGLE STOP"),
    Both("(TRSE|TRIG_SELECT)", lambda s, p: s.select_trigger(p), lambda s, _p: s.trigger_selection()),
    Number("(TDIV|TIME_DIV)", "time_scale", 1e-6, (1e-9, 100.0), "S", rounded=one_two_five),
    Number("(TRDL|TRIG_DELAY)", "time_offset", 0.0, lambda s: s.delays(), "S", clips=True),
    Word("(ACQW|ACQUIRE_WAY)", "acquisition", "*SAMPLING PEAK_DETECT AVERAGE HIGH_RES"),
    Both("(MSIZ|MEMORY_SIZE)", lambda s, p: s.set_depth(p), lambda s, _p: s.depth(), keeps=("depth", "14M")),
    Both("(WFSU|WAVEFORM_SETUP)", lambda s, p: s.set_waveform(p), lambda s, _p: s.waveform_setup()),
    Ask("(SARA|SAMPLE_RATE)", lambda s: s.reply("SARA", s.spell(s.full_scale()[0]), "Sa/s")),
    Both("(SANU|SAMPLE_NUM)", answer=lambda s, p: s.sample_number(p)),
    Ask("(SAST|SAMPLE_STATUS)", lambda s: s.reply("SAST", s.state())),
    Ask("INR", lambda s: s.reply("INR", str(s.internal_state()))),
    Own("(SCDP|SCREEN_DUMP)", lambda s, _p: s.picture(), lambda s: s.picture()),
    Switch("(BUZZ|BUZZER)", "buzzer", default=True, words=("OFF", "ON")),
)


class VirtualSDS1000XE(VirtualOscilloscope):
    """An SDS1104X-E: four channels, 14 million points, 100 MHz."""

    identity = "Siglent Technologies,SDS1104X-E,VIRTUAL,8.2.6.1.37R9"
    columns, lowest, digits, keeps_old = _COLUMNS, 0, 9, True
    path_memory = False
    ROWS: ClassVar = _REST
    CHANNEL_ROWS: ClassVar = _CHANNEL
    DEFAULTS: ClassVar = {"trigger_source": "C1"}

    channel_word = "C"
    #: WFSU: every which point is sent, how many at most (0: all), from which on.
    _setup: Mapping[str, int] = {"SP": 0, "NP": 0, "FP": 0}

    def reset(self) -> None:
        """Go to the state after ``*RST``; the form of answers stays."""
        header = self.settings["header"]
        super().reset()
        self.settings["header"] = header
        self._setup = type(self)._setup

    def spell(self, value: float) -> str:
        """Return a number with three digits, as a real one answers: 5.00E-01."""
        return f"{value:.2E}"

    def reply(self, header: str, text: str, unit: str = "") -> str:
        """Return an answer with header and unit, as long as CHDR is not OFF."""
        if self.settings["header"] == "OFF":
            return text
        words = header.partition("|")
        long = self.settings["header"] == "LONG" and words[2]
        shown = short_header(header)
        shown = shown.partition(":")[0] + ":" * (":" in shown) + words[2].rstrip(")") if long else shown
        return f"{shown} {text}{unit}"

    # --- the trigger ---

    def level_name(self, channel: int) -> str:
        """Return the name of the level; each channel has its own."""
        return f"chan{channel}_level"

    def slope_name(self, channel: int) -> str:
        """Return the name of the slope; each channel has its own."""
        return f"chan{channel}_slope"

    def select_trigger(self, parameters: list[str]) -> None:
        """TRSE EDGE,SR,C1,HT,OFF: the type, then names and their values.  Raises ScpiError."""
        if len(parameters) % 2 == 0:
            raise ScpiError(-109)
        choice(parameters[0], ("EDGE",))
        pairs = dict(zip((name.upper() for name in parameters[1::2]), parameters[2::2], strict=True))
        if not pairs.keys() <= {"SR", "HT", "HV", "HV2"}:
            raise ScpiError(-224)
        if "HT" in pairs:
            choice(pairs["HT"], ("OFF", "TI"))
        if "SR" in pairs:
            words = (*self.channel_words().split(), "EX", "EX5", "LINE")
            self.settings["trigger_source"] = choice(pairs["SR"], words)
            self.on_change("trigger_source")

    def trigger_selection(self) -> str:
        """TRSE?: type, source, hold-off."""
        return self.reply("TRSE", f"EDGE,SR,{self.settings['trigger_source']},HT,OFF")

    def on_number_change(self, name: str, before: float) -> None:
        """Start or stop the acquisition with TRMD, as the keys do."""
        super().on_number_change(name, before)
        if name == "trigger_sweep":
            if self.settings[name] == "STOP":
                self.stop()
            else:
                self.acquisition.arm(self.now, once=self.settings[name] == "SINGLE")

    def arm(self) -> None:
        """ARM: as the mode is; from STOP, once."""
        if self.settings["trigger_sweep"] in {"STOP", "SINGLE"}:
            self.settings["trigger_sweep"] = "SINGLE"
            self.single()
        else:
            self.run()

    def stop_key(self) -> None:
        """STOP: the mode says so."""
        self.stop()
        self.settings["trigger_sweep"] = "STOP"

    def running(self) -> bool:
        """See the base; a single record ends the mode SINGLE."""
        running = super().running()
        if not running and self.settings["trigger_sweep"] == "SINGLE":
            self.settings["trigger_sweep"] = "STOP"
        return running

    def internal_state(self) -> int:
        """INR?: its bits; reading it empties it."""
        acquisition = self.acquisition
        running = self.running()
        event, acquisition.was_triggered = acquisition.was_triggered, False
        return _NEW_RECORD * event + _READY * (running and self.now >= acquisition.filled)

    def state(self) -> str:
        """SAST?: Stop, Arm, Ready, Trig'd or Auto."""
        if not self.running():
            return "Stop"
        if self.now < self.acquisition.filled:
            return "Arm"
        record = self.acquisition.first(self.now)
        if record is None:
            return "Ready"
        return "Auto" if record.forced else "Trig'd"

    # --- time base and memory ---

    def delays(self) -> tuple[float, float]:
        """Return the limits of TRDL [s]."""
        return -max(5.0, 7 * self.value("time_scale")), 7 * self.value("time_scale")

    def _is_halved(self) -> bool:
        """Return whether a pair of channels, 1 and 2 or 3 and 4, shares its converter and memory."""
        shown = self.visible_channels()
        return {1, 2} <= set(shown) or {3, 4} <= set(shown)

    def set_depth(self, parameters: list[str]) -> None:
        """MSIZ 14K: obeyed when stopped.  Raises ScpiError."""
        words = [*_DEPTHS, *_HALVES]
        word = choice(parameter(parameters).upper(), tuple(words))
        if self.running():
            raise ScpiError(-221)
        self.settings["depth"] = list(_DEPTHS)[words.index(word) % len(_DEPTHS)]

    def depth(self) -> str:
        """MSIZ?: of one channel, or of each of two that share the memory."""
        word = str(self.settings["depth"])
        return self.reply("MSIZ", list(_HALVES)[list(_DEPTHS).index(word)] if self._is_halved() else word)

    def full_scale(self) -> tuple[float, int]:
        """Return rate and points of a record that fills the screen and nothing else."""
        share = 2 if self._is_halved() else 1
        length = _COLUMNS * self.value("time_scale")
        rate = min(_FASTEST / share, _DEPTHS[str(self.settings["depth"])] / share / length)
        return rate, max(2, round(rate * length))

    def screen(self) -> tuple[float, float]:
        """Return fourteen divisions around the delay, which counts the other way round."""
        length = _COLUMNS * self.value("time_scale")
        return -self.value("time_offset") - length / 2, length

    # --- reading the record ---

    def set_waveform(self, parameters: list[str]) -> None:
        """WFSU SP,4,NP,1000,FP,0: every fourth point, 1000 of them, from the first on.  Raises ScpiError."""
        if not parameters or len(parameters) % 2:
            raise ScpiError(-109)
        given = dict(zip((name.upper() for name in parameters[::2]), parameters[1::2], strict=True))
        for name, text in given.items():
            digits = text.strip()
            if name not in self._setup or not (digits.isascii() and digits.isdigit() and len(digits) < 9):
                raise ScpiError(-224, text[:20])
        self._setup = {**self._setup, **{name: int(text) for name, text in given.items()}}

    def waveform_setup(self) -> str:
        """WFSU?: as it is set."""
        return self.reply("WFSU", ",".join(f"{name},{value}" for name, value in self._setup.items()))

    def _places(self, record: Record) -> range:
        """Return the points of a record that are sent."""
        step, most, first = max(1, self._setup["SP"]), self._setup["NP"], min(self._setup["FP"], record.points)
        places = range(first, record.points, step)
        return places[:most] if most else places

    def waveform(self, n: int, parameters: list[str]) -> str:
        """WF? DESC, DAT2 or ALL.  Raises ScpiError."""
        part = choice(parameter(parameters), ("DESC", "DAT2", "ALL"))
        record = self.record()
        data = b"" if part == "DAT2" else self._descriptor(record, n)
        if part != "DESC":
            data += self._codes(record, n)
        # two line feeds end it (measured), where an answer has one
        return self.reply(f"C{n}:WF", f"{part},{self.block(data)}\n")

    def _codes(self, record: Record, n: int) -> bytes:
        places = self._places(record)
        if not places:
            return b""
        sample = 1 / record.rate
        if places.step == 1:
            codes = record.codes(n, places.start, len(places), of=record.points, start=record.origin, step=sample)
        else:  # the points that are sent, and not those between them
            start = record.origin + places.start * sample
            codes = record.codes(n, 0, len(places), of=len(places), start=start, step=places.step * sample)
        # code 0 is the middle of the screen on the wire, where it is a signed byte
        return bytes((codes ^ 0x80).tobytes())

    def _descriptor(self, record: Record, n: int) -> bytes:
        """Return WAVEDESC, as far as its places are known."""
        scale = record.inputs[n]
        descriptor = bytearray(_DESCRIPTOR)

        def put(form: str, place: int, *values: Any) -> None:
            struct.pack_into("<" + form, descriptor, place, *values)

        put("16s16s", 0, b"WAVEDESC", b"WAVEACE")
        put("hhi", 32, 0, 1, _DESCRIPTOR)  # bytes, the lower one first
        put("i", 60, record.points)
        put("16s", 76, b"Siglent SDS")
        put("i", 116, len(self._places(record)))
        put("iiii", 124, record.points - 1, self._setup["FP"], self._setup["SP"], 1)
        # volts per division, and the offset that is taken from code·gain/25
        offset = (scale.zero - self.middle) * scale.volts_per_code
        put("ff", 156, scale.volts_per_code * self.codes_per_division, offset)
        put("fd", 176, 1 / record.rate, -(record.origin + record.points / record.rate / 2))
        return bytes(descriptor)

    def sample_number(self, parameters: list[str]) -> str:
        """SANU? C1: points of the record, as 14Mpts."""
        self.channel_of(parameter(parameters))
        points = self.full_scale()[1]
        scale, prefix = (1e6, "M") if points >= 1e6 else (1e3, "k") if points >= 1e3 else (1, "")
        return self.reply("SANU", f"{points / scale:g}{prefix}", "pts")

    def parameter_value(self, n: int, parameters: list[str]) -> str:
        """PAVA? PKPK: name and value, stars where the trace does not show it."""
        word = choice(parameter(parameters), tuple(_MEASUREMENTS))
        name, unit = _MEASUREMENTS[word]
        value = self.measure(name, n)
        shown = "****" if value >= self.no_measurement or math.isnan(value) else self.spell(value)
        return self.reply(f"C{n}:PAVA", f"{word},{shown}", unit)

    def picture(self) -> str:
        """SCDP: a bitmap, in no block."""
        return self.screenshot().decode("latin-1")

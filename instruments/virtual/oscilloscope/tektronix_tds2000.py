"""A virtual TDS2024B, or another oscilloscope of the TDS1000, TDS2000 and TBS1000 series.

Sources: see the driver; the order of WFMPre?, its numbers and the codes of a division from a preamble that a user read
from a TDS2024C.  Assumed: a scale may have any value, as with the knob's fine adjustment; the limits of positions and
levels; the state after ``*RST``.  ``SYST:ERR?`` is answered, too, which the real one does not know.
"""

import math
import re
from dataclasses import dataclass
from typing import Any, ClassVar

from instruments.virtual.core.device import COMMON
from instruments.virtual.core.parameters import choice, parameter
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.rows import Ask, Both, Number, Own, Row, Switch, Word, short_header, whole
from instruments.virtual.oscilloscope.acquisition import LOOK_AHEAD
from instruments.virtual.oscilloscope.record import Record
from instruments.virtual.oscilloscope.scope import VirtualOscilloscope, at_input, levels

_POINTS, _COLUMNS, _CODES = 2500, 10, 25
_PROBES = (1.0, 10.0, 20.0, 50.0, 100.0, 500.0, 1000.0)
#: Types of a measurement: their names here, and units.
_MEASUREMENTS = {
    "FREQuency": ("FREQUENCY", "Hz"),
    "PERIod": ("PERIOD", "s"),
    "MEAN": ("VAVERAGE", "V"),
    "PK2pk": ("VPP", "V"),
    "CRMs": ("PVRMS", "V"),
    "MINImum": ("VMIN", "V"),
    "MAXImum": ("VMAX", "V"),
    "RISe": ("RISETIME", "s"),
    "FALL": ("FALLTIME", "s"),
    "PWIdth": ("PWIDTH", "s"),
    "NWIdth": ("NWIDTH", "s"),
}
_NO_EVENTS = '0,"No events to report - queue empty"'


def _one_two_and_a_half_five(value: float) -> float:
    """Return the number of the series 1, 2.5, 5, 10 … nearest to a positive one."""
    decade = math.floor(math.log10(value))
    return min((float(f"{m}e{decade}") for m in (1, 2.5, 5, 10)), key=lambda s: abs(s - value))


@dataclass(frozen=True)
class LongWord(Word):
    """A word that is answered in its long form, in capitals, unless VERBose is off."""

    def format_value(self, device: Any, value: str) -> str:
        """See the base."""
        words = (self.words(device) if callable(self.words) else self.words).replace("*", "").split()
        long = next(word.upper() for word in words if re.sub("[a-z]", "", word) == value)
        return long if device.settings["verbose"] else value


#: Fields of the preamble, and their places in it.
_PARTS = {"BYT_Nr": 0, "BIT_Nr": 1, "ENCdg": 2, "BN_Fmt": 3, "BYT_Or": 4, "NR_Pt": 5, "WFId": 6, "PT_Fmt": 7}
_PARTS |= {"XINcr": 8, "PT_Off": 9, "XZEro": 10, "XUNit": 11, "YMUlt": 12, "YZEro": 13, "YOFf": 14, "YUNit": 15}

_COMMON: tuple[Row, ...] = (
    *(row for row in COMMON if row.header != "*ESR"),
    Ask("*ESR", lambda s: s.take_register()),
    Ask("ALLEv", lambda s: s.take_events()),
)
_CHANNEL: tuple[Row, ...] = (
    Number("CH{n}:PRObe", "chan{n}_probe", 10.0, (1, 1000), values=_PROBES),
    Number("CH{n}:SCAle", "chan{n}_scale", 1.0, at_input(2e-3, 5), "V"),
    Number("CH{n}:VOLts", "chan{n}_scale", 1.0, at_input(2e-3, 5), "V", alias=True),
    Number("CH{n}:POSition", "chan{n}_position", 0.0, (-25, 25)),
    LongWord("CH{n}:COUP[L][ing]", "chan{n}_coupling", "AC *DC GND"),
    Switch("CH{n}:INVert", "chan{n}_invert", words=("OFF", "ON")),
    Switch("CH{n}:BANdwidth", "chan{n}_bandwidth", words=("OFF", "ON")),
    Switch("SELect:CH{n}", "chan{n}_display", lambda n: n == 1),
    *(
        Ask(f"WFMPre:CH{{n}}:{word}", lambda s, n, k=k, w=word: s.part(k, f"CH{n}:{w}", n))
        for word, k in _PARTS.items()
    ),
)
_ROWS: tuple[Row, ...] = (
    Switch("HEADer", "header", default=True),
    Switch("VERBose", "verbose", default=True),
    LongWord("LOCk", "lock", "*NONE ALL"),
    # acquisition and time
    Own("ACQuire:STATE", lambda s, p: s.set_state(p), lambda s: s.reply("ACQuire:STATE", str(int(s.running())))),
    LongWord("ACQuire:STOPAfter", "stop_after", "*RUNSTop SEQuence"),
    LongWord("ACQuire:MODe", "acquisition", "*SAMple PEAKdetect AVErage"),
    Number("ACQuire:NUMAVg", "averages", 16.0, (4, 128), values=(4, 16, 64, 128), spell=lambda v: f"{v:.0f}"),
    Ask("BUSY", lambda s: s.reply("BUSY", str(int(s.acquisition.once and s.running())))),
    Number("HORizontal[:MAIn]:SCAle", "time_scale", 5e-4, (5e-9, 50.0), "S", rounded=_one_two_and_a_half_five),
    Number(
        *("HORizontal[:MAIn]:SECdiv", "time_scale", 5e-4, (5e-9, 50.0), "S"),
        rounded=_one_two_and_a_half_five,
        alias=True,
    ),
    Number("HORizontal[:MAIn]:POSition", "time_offset", 0.0, (-500.0, 500.0), "S"),
    LongWord("HORizontal:VIEW", "time_view", "*MAIn WINDOW ZONE"),
    Ask("HORizontal:RECOrdlength", lambda s: s.reply("HORizontal:RECOrdlength", str(_POINTS))),
    Both("AUTOSet", lambda s, _p: s.autoscale()),
    # trigger
    Both("TRIGger", lambda s, p: s.act_on_trigger(p)),
    Ask("TRIGger:STATE", lambda s: s.reply("TRIGger:STATE", s.state())),
    LongWord("TRIGger:MAIn:TYPe", "trigger_type", "*EDGE PULse VIDeo"),
    LongWord("TRIGger:MAIn:MODe", "trigger_sweep", "*AUTO NORMal"),
    LongWord("TRIGger:MAIn:EDGE:SOUrce", "trigger_source", lambda s: s.channel_words() + " EXT EXT5 LINE", "CH1"),
    LongWord("TRIGger:MAIn:EDGE:SLOpe", "trigger_slope", "*RISe FALL"),
    LongWord("TRIGger:MAIn:EDGE:COUPling", "trigger_coupling", "*DC AC NOISErej HFRej LFRej"),
    Number("TRIGger:MAIn:LEVel", "trigger_level", 0.0, levels(8), "V"),
    Number("TRIGger:MAIn:HOLDOff:VALue", "holdoff", 5e-7, (5e-7, 10.0), "S"),
    # data
    Both("DATa", lambda s, p: s.set_data(p)),
    LongWord("DATa:SOUrce", "wav_source", VirtualOscilloscope.channel_words, "CH1"),
    LongWord("DATa:ENCdg", "wav_encoding", "ASCIi RIBinary *RPBinary SRIbinary SRPbinary"),
    whole("DATa:WIDth", "wav_width", 1.0, (1, 2)),
    whole("DATa:STARt", "wav_start", 1.0, (1, _POINTS)),
    whole("DATa:STOP", "wav_stop", float(_POINTS), (1, _POINTS)),
    Ask("WFMPre", lambda s: s.reply("WFMPre", ";".join(s.preamble()))),
    *(Ask(f"WFMPre:{word}", lambda s, k=k, w=word: s.part(k, w)) for word, k in _PARTS.items()),
    Ask("CURVe", lambda s: s.reply("CURVe", s.curve())),
    # measurements
    LongWord("MEASUrement:IMMed:SOUrce", "wav_measured", lambda s: s.channel_words() + " MATH", "CH1"),
    LongWord("MEASUrement:IMMed:TYPe", "wav_measurement", " ".join(_MEASUREMENTS)),
    Ask("MEASUrement:IMMed:UNIts", lambda s: s.reply("MEASUrement:IMMed:UNIts", f'"{s.measurement()[1]}"')),
    Ask("MEASUrement:IMMed:VALue", lambda s: s.reply("MEASUrement:IMMed:VALue", s.measured_value())),
)


class VirtualTDS2000(VirtualOscilloscope):
    """A TDS2024B: four channels, 2500 points, 200 MHz."""

    identity = "TEKTRONIX,TDS 2024B,VIRTUAL,CF:91.1CT FV:v22.11"
    columns, lowest, digits, keeps_old = _COLUMNS, 0, 0, True
    channel_word = "CH"
    COMMON: ClassVar = _COMMON
    CHANNEL_ROWS: ClassVar = _CHANNEL
    ROWS: ClassVar = _ROWS
    _events: tuple[str, ...] = ()

    def spell(self, value: float) -> str:
        """Return a number as a real one prints it: 1.0E0, 2.5E-3."""
        mantissa, _, exponent = f"{value:.6e}".partition("e")
        return f"{mantissa.rstrip('0')}{'0' * mantissa.rstrip('0').endswith('.')}E{int(exponent)}"

    def reply(self, header: str, text: str, unit: str = "") -> str:
        """Return an answer, behind its header as long as HEADer is on."""
        if not self.settings["header"]:
            return text
        long = re.sub(r"\[:\w*\]|[\[\]]", "", header).upper()
        return f":{long if self.settings['verbose'] else short_header(header)} {text}"

    def reset(self) -> None:
        """Go to the state after ``*RST``; the form of answers stays."""
        kept = {name: self.settings[name] for name in ("header", "verbose")}
        super().reset()
        self.settings |= kept

    # --- events ---

    def take_register(self) -> str:
        """*ESR?: the register; with it the events can be asked for."""
        self._events = tuple(entry.lstrip("+-") for entry in self.parser.errors)
        self.parser.errors.clear()
        return str(self.status.take_events())

    def take_events(self) -> str:
        """ALLEv?: code and text of all events before the last *ESR?."""
        events, self._events = self._events, ()
        return self.reply("ALLEv", ",".join(events) or _NO_EVENTS)

    def clear_status(self) -> None:
        """See the base."""
        super().clear_status()
        self._events = ()

    # --- settings ---

    def scaling(self, channel: int) -> tuple[float, int]:
        """See the base; the trace is moved by divisions."""
        position = self.value(f"chan{channel}_position")
        return self.division(channel) / _CODES, self.middle + round(_CODES * position)

    def centre(self, channel: int) -> float:
        """See the base."""
        return -self.value(f"chan{channel}_position") * self.division(channel)

    def fit(self, channel: int, middle: float, division: float) -> None:
        """See the base."""
        self.settings |= {f"chan{channel}_scale": division, f"chan{channel}_position": -middle / division}

    def _follow_probe(self, channel: str, ratio: float) -> None:
        self.settings[f"{channel}_scale"] = ratio * self.value(f"{channel}_scale")
        if self.source_channel() == int(channel.removeprefix("chan")):
            self.settings["trigger_level"] = ratio * self.value("trigger_level")

    def on_number_change(self, name: str, before: float) -> None:
        """See the base; how the acquisition ends is a setting."""
        if name in {"header", "verbose", "lock"}:
            return
        super().on_number_change(name, before)
        if name == "stop_after" and self.running():
            self._arm()

    def full_scale(self) -> tuple[float, int]:
        """See the base: a record fills the screen."""
        return _POINTS / (_COLUMNS * self.value("time_scale")), _POINTS

    def screen(self) -> tuple[float, float]:
        """See the base: ten divisions around the position."""
        scale = self.value("time_scale")
        return self.value("time_offset") - _COLUMNS / 2 * scale, _COLUMNS * scale

    # --- acquiring ---

    def _arm(self) -> None:
        self.acquisition.arm(self.now, once=self.settings["stop_after"] == "SEQ")

    def set_state(self, parameters: list[str]) -> None:
        """ACQuire:STATE: RUN or STOP, ON or OFF.  Raises ScpiError."""
        text = parameter(parameters)
        word = text.upper()
        if word == "RUN" or (word != "STOP" and self.read_boolean(text)):
            self._arm()
        else:
            self.stop()

    def act_on_trigger(self, parameters: list[str]) -> None:
        """TRIGger FORCe.  Raises ScpiError."""
        choice(parameter(parameters), ("FORCe",))
        self.force()

    def state(self) -> str:
        """TRIGger:STATE?: ARMED, READY, TRIGGER, AUTO or SAVE."""
        if not self.running():
            return "SAVE"
        if self.now < self.acquisition.filled:
            return "ARMED"
        record = self.acquisition.first(self.now)
        if record is None or record.forced:
            return "AUTO" if self.settings["trigger_sweep"] == "AUTO" else "READY"
        return "TRIGGER"

    def completion(self) -> str:
        """*OPC?: answered when a single record is complete."""
        if self.acquisition.once and self.running():
            record = self.acquisition.first(self.now + LOOK_AHEAD)
            self.busy_until(record.done if record else math.inf)
        return "1"

    # --- reading ---

    def set_data(self, parameters: list[str]) -> None:
        """Execute DATa INIT: format and window as after a reset.  Raises ScpiError."""
        choice(parameter(parameters), ("INIT",))
        rows = [row for row in self.commands.rows if row.header.startswith("DATa:")]
        self.settings |= {name: value for row in rows for name, value in row.defaults().items()}

    def _shown(self, channel: int) -> Record:
        if channel not in self.visible_channels():
            raise ScpiError(-221, f"waveform CH{channel} is off")  # event 2244
        return self.record()

    def _form(self) -> tuple[str, bool, str]:
        """Return encoding, whether codes are signed, and the order of bytes."""
        word = str(self.settings["wav_encoding"])
        signed = word in {"RIB", "SRI", "ASCI"}
        return ("ASC" if word == "ASCI" else "BIN"), signed, ("LSB" if word.startswith("SR") else "MSB")

    def preamble(self, channel: int | None = None) -> list[str]:
        """Return the fields of WFMPre?.  Raises ScpiError."""
        channel = channel or self.channel_of(str(self.settings["wav_source"]))
        record = self._shown(channel)
        encoding, signed, order = self._form()
        width = int(self.value("wav_width"))
        scale = record.inputs[channel]
        step = 256 ** (width - 1)
        volts, middle = scale.volts_per_code / step, 0 if signed else self.middle
        coupling, time = self.settings[f"chan{channel}_coupling"], self.value("time_scale")
        division = self.spell(scale.volts_per_code * _CODES)
        scales = f"{division} V/div, {self.spell(time)} s/div"
        name = f"Ch{channel}, {coupling} coupling, {scales}, {_POINTS} points, Sample mode"
        return [
            *(str(width), str(8 * width), encoding, "RI" if signed else "RP", order, str(_POINTS), f'"{name}"', "Y"),
            *(self.spell(1 / record.rate), "0", self.spell(record.origin), '"s"'),
            *(self.spell(volts), "0.0E0", self.spell(float((scale.zero - self.middle + middle) * step)), '"Volts"'),
        ]

    def part(self, place: int, name: str, channel: int | None = None) -> str:
        """Return one field of the preamble, of a channel by name or of the source.  Raises ScpiError."""
        return self.reply(f"WFMPre:{name}", self.preamble(channel)[place])

    def curve(self) -> str:
        """CURVe?: the points from DATa:STARt to STOP.  Raises ScpiError."""
        channel = self.channel_of(str(self.settings["wav_source"]))
        record = self._shown(channel)
        first, last = sorted((round(self.value("wav_start")), round(self.value("wav_stop"))))
        codes = record.codes(
            channel, first - 1, last - first + 1, of=_POINTS, start=record.origin, step=1 / record.rate
        )
        encoding, signed, order = self._form()
        width = int(self.value("wav_width"))
        numbers = (codes.astype("i4") - (self.middle if signed else 0)) * 256 ** (width - 1)
        if encoding == "ASC":
            return ",".join(map(str, numbers))
        kind = f"{'<' if order == 'LSB' else '>'}{'i' if signed else 'u'}{width}"
        return self.block(numbers.astype(kind).tobytes())

    def measurement(self) -> tuple[str, str]:
        """Return name and unit of the immediate measurement."""
        short = str(self.settings["wav_measurement"])
        return next(row for word, row in _MEASUREMENTS.items() if re.sub("[a-z]", "", word) == short)

    def measured_value(self) -> str:
        """MEASUrement:IMMed:VALue?: 9.9E37 where the trace does not show it.  Raises ScpiError."""
        return self.spell(self.measure(self.measurement()[0], self.channel_of(str(self.settings["wav_measured"]))))

"""A virtual DSOX1102G, of the 1000 and 2000 X-Series.

Sources: the Programmer's Guides of the InfiniiVision X-Series (as quoted publicly: 2000 X-Series page 644, notes on
version 07.66 for the 6000 X-Series), and PyMeasure's suite for a real DSOX1102G.  From there: the state after
``*RST`` (40 V full scale, probe 10:1, 1 ms), 62 500 points of 16 ns then, ``yincrement`` of 0.0007851759 at 40 V, that
is 199 codes for the eight divisions; codes 0, 1 and 255 for no sample, clipped below and above; the bits of the
operation register; a single acquisition and a digitize begin with an empty memory.
"""

import math
from typing import Any, ClassVar

import numpy as np

from instruments.clock import Clock
from instruments.virtual.core.parameters import choice, number, parameter
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.rows import Ask, Both, Do, Number, Own, Row, Switch, Text, Word, whole
from instruments.virtual.oscilloscope.record import Record
from instruments.virtual.oscilloscope.scope import SETUP, VirtualOscilloscope, at_input, levels

#: The fastest rate [1/s].
_FASTEST = 2e9
#: Bits of the operation status register.
_RUN, _WAIT_TRIGGER = 8, 32
#: Points of a record for the screen.
_FOR_SCREEN = 62_500

#: The measurements as this maker spells them, and their names in `measure`: the same in capitals, but for four.
_MEASUREMENTS = {
    word: word.upper()
    for word in (
        *(
            "FREQuency",
            "PERiod",
            "VPP",
            "VMAX",
            "VMIN",
            "VAMPlitude",
            "VTOP",
            "VBASe",
            "VAVerage",
            "VRMS",
            "SDEViation",
        ),
        *("RISetime", "FALLtime", "PWIDth", "NWIDth", "NDUTy", "OVERshoot", "PREShoot", "AREa"),
        *("PPULses", "NPULses", "PEDGes", "NEDGes"),
    )
} | {"DUTYcycle": "PDUTY", "XMAX": "TVMAX", "XMIN": "TVMIN", "COUNter": "FREQUENCY"}
#: Measurements whose answers are percentages.
_PERCENT = {"PDUTY", "NDUTY", "OVERSHOOT", "PRESHOOT"}
#: Words before the source: the interval of the measurement.
_INTERVALS = ("CYCLe", "DISPlay", "AC", "DC")
#: Sources that a waveform may have beside the channels; this model has nothing in them.
_EMPTY_SOURCES = ("FUNCtion", "MATH", "FFT", "WMEMory1", "WMEMory2", "EXTernal", "ABUS")


_CHANNEL: tuple[Row, ...] = (
    Number("CHANnel{n}:PROBe[:ATTenuation]", "chan{n}_probe", 10.0, (0.1, 1e4)),
    Number("CHANnel{n}:SCALe", "chan{n}_scale", 5.0, at_input(5e-4, 10), "V"),
    Number("CHANnel{n}:RANGe", "chan{n}_scale", 5.0, at_input(4e-3, 80), "V", factor=8, alias=True),
    Number("CHANnel{n}:OFFSet", "chan{n}_offset", 0.0, (-1e5, 1e5), "V"),
    Number("CHANnel{n}:PROBe:SKEW", "chan{n}_skew", 0.0, (-1e-7, 1e-7), "S"),
    Word("CHANnel{n}:PROBe:STYPe", "chan{n}_probe_kind", "DIFFerential *SINGle"),
    Ask("CHANnel{n}:PROBe:ID", lambda _s, _n: "NONE"),
    Word("CHANnel{n}:COUPling", "chan{n}_coupling", "AC *DC"),
    Word("CHANnel{n}:IMPedance", "chan{n}_impedance", "ONEMeg"),
    Word("CHANnel{n}:UNITs", "chan{n}_unit", "VOLT AMPere"),
    Switch("CHANnel{n}:DISPlay", "chan{n}_display", lambda n: n == 1),
    Switch("CHANnel{n}:BWLimit", "chan{n}_bandwidth"),
    Switch("CHANnel{n}:INVert", "chan{n}_invert"),
    Switch("CHANnel{n}:VERNier", "chan{n}_vernier"),
    Text("CHANnel{n}:LABel", "chan{n}_label", "{n}", longest=10),
    Ask("CHANnel{n}", lambda s, n: s.whole_channel(n)),
)
_CONTROL: tuple[Row, ...] = (
    Do("RUN", lambda s: s.run()),
    Do("STOP", lambda s: s.stop()),
    Do("SINGle", lambda s: s.single()),
    Both("DIGitize", lambda s, p: s.digitize_sources(p)),
    Both("AUToscale", lambda s, _p: s.autoscale()),
    Do("TRIGger:FORCe", lambda s: s.force()),
    Ask("AER", lambda s: s.arm_event()),
    Ask("OPERegister:CONDition", lambda s: f"{s.condition():+d}"),
    Ask("OPERation:CONDition", lambda s: f"{s.condition():+d}"),
    Ask("OPERegister[:EVENt]", lambda s: f"{s.condition():+d}"),
    Ask("*OPT"),
)
_TIME: tuple[Row, ...] = (
    Word("TIMebase:MODE", "time_mode", "MAIN WINDow XY ROLL"),
    Number("TIMebase[:MAIN]:SCALe", "time_scale", 1e-4, (5e-9, 50.0), "S"),
    Number("TIMebase[:MAIN]:RANGe", "time_scale", 1e-4, (50e-9, 500.0), "S", factor=10, alias=True),
    Number("TIMebase:POSition", "time_offset", 0.0, (-500.0, 500.0), "S", spell="{:+.12E}".format),
    Number("TIMebase:DELay", "time_offset", 0.0, (-500.0, 500.0), "S", alias=True),
    Word("TIMebase:REFerence", "time_reference", "LEFT *CENTer RIGHt"),
    Switch("TIMebase:VERNier", "time_vernier"),
    Number("TIMebase:WINDow:SCALe", "zoom_scale", 5e-5, (5e-9, 50.0), "S"),
    Number("TIMebase:WINDow:POSition", "zoom_offset", 0.0, (-500.0, 500.0), "S"),
    Ask("TIMebase", lambda s: s.whole_time()),
    Word("ACQuire:TYPE", "acquisition", "NORMal AVERage HRESolution PEAK"),
    Word("ACQuire:MODE", "acquisition_mode", "RTIMe SEGMented ETIMe"),
    whole("ACQuire:COUNt", "averages", 8.0, (2, 65536), sign="+"),
    whole("ACQuire:COMPlete", "complete", 100.0, (100, 100), sign="+"),
    whole("ACQuire:SEGMented:COUNt", "segments", 2.0, (2, 50), sign="+"),
    Ask("ACQuire:POINts[:ANALog]", lambda s: f"{s.full_scale()[1]:+d}"),
    Both("ACQuire:SRATe[:ANALog]", answer=lambda s, _p: s.spell(s.full_scale()[0])),
)
_TRIGGER: tuple[Row, ...] = (
    Word("TRIGger:MODE", "trigger_mode", "EDGE GLITch PATTern TV SHOLd TRANsition SBUS1"),
    Word("TRIGger[:EDGE]:SOURce", "trigger_source", lambda s: s.channel_words() + " EXTernal LINE WGEN", "CHAN1"),
    Word("TRIGger[:EDGE]:SLOPe", "trigger_slope", "NEGative *POSitive EITHer ALTernate"),
    Number("TRIGger[:EDGE]:LEVel", "trigger_level", 0.0, levels(6), "V"),
    Word("TRIGger:SWEep", "trigger_sweep", "AUTO NORMal"),
    Word("TRIGger[:EDGE]:COUPling", "trigger_coupling", "AC *DC LFReject"),
    Word("TRIGger[:EDGE]:REJect", "trigger_rejection", "OFF LFReject HFReject"),
    Number("TRIGger:HOLDoff", "holdoff", 60e-9, (60e-9, 10.0), "S"),
    Switch("TRIGger:NREJect", "noise_rejection"),
    Switch("TRIGger:HFReject", "high_rejection"),
)
#: Fields of the preamble that can be asked for by themselves, and their places in it.
_PARTS = {"TYPE": 1, "COUNt": 3, "XINCrement": 4, "XORigin": 5, "XREFerence": 6}
_PARTS |= {"YINCrement": 7, "YORigin": 8, "YREFerence": 9}
_WAVEFORM: tuple[Row, ...] = (
    Word("WAVeform:SOURce", "wav_source", lambda s: " ".join((s.channel_words(), *_EMPTY_SOURCES)), "CHAN1"),
    Word("WAVeform:FORMat", "wav_format", "WORD *BYTE ASCii"),
    Word("WAVeform:BYTeorder", "wav_order", "LSBFirst *MSBFirst"),
    Switch("WAVeform:UNSigned", "wav_unsigned", default=True),
    Word("WAVeform:VIEW", "wav_view", "MAIN"),
    Word("WAVeform:POINts:MODE", "wav_mode", "NORMal MAXimum RAW"),
    Own("WAVeform:POINts", lambda s, p: s.set_points(p), lambda s: f"{s.sequence()[2]:+d}"),
    Ask("WAVeform:PREamble", lambda s: ",".join(s.preamble())),
    *(Ask(f"WAVeform:{word}", lambda s, k=k: s.preamble()[k]) for word, k in _PARTS.items()),
    Ask("WAVeform:DATA", lambda s: s.data()),
)
_REST: tuple[Row, ...] = (
    Own("MEASure:SOURce", lambda s, p: s.set_source(p), lambda s: str(s.settings["measure_source"])),
    Word("MEASure:SHOW", "measure_shown", "1 ON"),
    *(
        Both(f"MEASure:{word}", lambda s, p: s.install(p), lambda s, p, m=name: s.measurement(m, p))
        for word, name in _MEASUREMENTS.items()
    ),
    Both("DISPlay:DATA", answer=lambda s, p: s.picture(p)),
    # what only changes the picture
    *(Both(header, lambda _s, _p: None) for header in ("DISPlay:CLEar", "SYSTem:DSP", "SYSTem:LOCK")),
    Switch("HARDcopy:INKSaver", "ink_saver", default=True),
    Switch("DISPlay:LABel", "labels"),
    Word("MEASure:STATistics", "statistics", "ON CURRent MEAN"),
    SETUP,
    Do("SYSTem:PRESet", lambda s: s.reset()),
)


class VirtualDSOX1000(VirtualOscilloscope):
    """A DSOX1102G: two channels, a million points, 100 MHz.  memory: points of another model's; model: see the base."""

    identity = "KEYSIGHT TECHNOLOGIES,DSO-X 1102G,VIRTUAL,01.20.2019061038"
    queue_size = 30
    columns, lowest, digits = 10, 1, 8
    codes_per_division = 199 / 8
    transfer = 5e6
    CHANNEL_ROWS: ClassVar = _CHANNEL
    DEFAULTS: ClassVar = {"wav_points": float(_FOR_SCREEN), "measure_source": "CHAN1"}
    ROWS: ClassVar = (*_CONTROL, *_TIME, *_TRIGGER, *_WAVEFORM, *_REST)

    def __init__(self, clock: Clock, *, channels: int = 2, memory: int = 1_000_000, **model: Any) -> None:
        self._memory = memory
        super().__init__(clock, channels=channels, **model)

    def spell(self, value: float) -> str:
        """Return a number with seven digits, as in the preamble of a real one."""
        return f"{value:+.6E}"

    # --- acquiring ---

    def on_number_change(self, name: str, before: float) -> None:
        """Set an offset that is beyond the limits of the range to the nearest one within."""
        if name.startswith("chan") and name.endswith("_offset"):
            n = int(name[4])
            reach = (2.0 if self.value(f"chan{n}_scale") / self.probe(n) < 0.2 else 50.0) * self.probe(n)
            self.settings[name] = min(max(self.value(name), -reach), reach)
        super().on_number_change(name, before)

    def digitize_sources(self, parameters: list[str]) -> None:
        """Raise ScpiError in roll and XY mode, where there is no record."""
        if self.settings["time_mode"] in {"ROLL", "XY"}:
            raise ScpiError(-221)
        words = (*self.channel_words().split(), *_EMPTY_SOURCES)
        for source in parameters[:5]:
            word = choice(source, words)
            if word.startswith("CHAN"):
                self.settings[f"chan{word[4:]}_display"] = True
        self.digitize()

    def trigger(self) -> None:
        """``*TRG`` is the same as ``:DIGitize`` without a source."""
        self.digitize_sources([])

    def arm_event(self) -> str:
        """AER?: whether it was armed since this was asked."""
        acquisition = self.acquisition
        ready = self.running() and self.now >= acquisition.filled
        event = acquisition.was_armed and (ready or acquisition.armed is None)
        acquisition.was_armed = acquisition.was_armed and not event
        return f"{int(event):+d}"

    def condition(self) -> int:
        """Return the operation register: bit 3 while it runs, bit 5 while it waits for a trigger."""
        if not self.running():
            return 0
        waits = self.now >= self.acquisition.filled and self.acquisition.first(self.now) is None
        return _RUN + _WAIT_TRIGGER * waits

    # --- settings as a whole ---

    def whole_channel(self, n: int) -> str:
        """Return the answer to ``:CHAN1?`` after ``*RST``: ``:CHAN1:RANG +40.0E+00;OFFS +0.00000E+00;…``."""
        s, name = self.settings, f"chan{n}_"
        return (
            f":CHAN{n}:RANG {8 * self.value(name + 'scale'):+.5E};OFFS {self.value(name + 'offset'):+.5E};"
            f"COUP {s[name + 'coupling']};IMP {s[name + 'impedance']};DISP {int(s[name + 'display'])};"
            f"BWL {int(s[name + 'bandwidth'])};INV {int(s[name + 'invert'])};"
            f'LAB "{s[name + "label"]}";UNIT {s[name + "unit"]};PROB {self.value(name + "probe"):+.5E};'
            f"PROB:SKEW {self.value(name + 'skew'):+.2E};STYP {s[name + 'probe_kind']}"
        )

    def whole_time(self) -> str:
        """Return the answer to ``:TIM?``."""
        s = self.settings
        ten, position = 10 * self.value("time_scale"), self.value("time_offset")
        return f":TIM:MODE {s['time_mode']};REF {s['time_reference']};MAIN:RANG {ten:+.5E};POS {position:+.6E}"

    # --- scaling ---

    def full_scale(self) -> tuple[float, int]:
        """Return rate and points of a record that fills the screen and nothing else."""
        length = 10 * self.value("time_scale")
        rate = min(_FASTEST / (1 if len(self.visible_channels()) <= 1 else 2), self._memory / length)
        return rate, max(2, round(rate * length))

    def screen(self) -> tuple[float, float]:
        """Return ten divisions, the reference one from the left, in the middle, or one from the right."""
        scale = self.value("time_scale")
        before = {"LEFT": 1, "CENT": 5, "RIGH": 9}[str(self.settings["time_reference"])]
        return self.value("time_offset") - before * scale, 10 * scale

    def centre(self, channel: int) -> float:
        """See the base."""
        return self.value(f"chan{channel}_offset")

    def fit(self, channel: int, middle: float, division: float) -> None:
        """Return the voltage in the middle of the screen: the offset."""
        self.settings |= {f"chan{channel}_scale": division, f"chan{channel}_offset": middle}

    # --- reading the record ---

    def set_points(self, parameters: list[str]) -> None:
        """Return a number, rounded to the next the scope can give when it is asked for; MAXimum takes all."""
        self.settings["wav_points"] = number(parameter(parameters), low=1, high=8e6, default=_FOR_SCREEN)

    def sequence(self) -> tuple[Record, float, int]:
        """Return the record, the distance of the points that can be read [s], how many.  Raises ScpiError."""
        if self.settings["time_mode"] in {"ROLL", "XY"}:
            raise ScpiError(-221)
        record = self.record()
        raw = self.settings["wav_mode"] == "RAW" or (self.settings["wav_mode"] == "MAX" and not self.running())
        most = record.points if raw else min(_FOR_SCREEN, record.points)
        wanted = self.value("wav_points")
        every = math.ceil(record.points / min(max(wanted, 1), most))
        return record, every / record.rate, max(1, record.points // every)

    def preamble(self) -> list[str]:
        """WAVeform:PREamble?: its ten fields.  Raises ScpiError."""
        record, step, points = self.sequence()
        form = str(self.settings["wav_format"])
        kind = {"BYTE": 0, "WORD": 1, "ASC": 4}[form]
        mode = {"NORM": 0, "PEAK": 1, "AVER": 2, "HRES": 3}[str(self.settings["acquisition"])]
        averages = round(self.value("averages")) if mode == 2 else 1
        per_code, reference = (1, self.middle) if form == "BYTE" else (256, 256 * self.middle)
        shown = record.inputs.get(self._channel_or_none())
        volts = shown.volts_per_code / per_code if shown else 1.0
        offset = (self.middle - shown.zero) * shown.volts_per_code if shown else 0.0
        signed = not self.settings["wav_unsigned"] and form != "ASC"
        return [
            *(f"{value:+d}" for value in (kind, mode, points, averages)),
            f"{step:+.8E}",
            f"{record.origin:+.8E}",
            "+0",
            self.spell(volts),
            self.spell(offset),
            f"{0 if signed else reference:+d}",
        ]

    def _channel_or_none(self) -> int:
        source = str(self.settings["wav_source"])
        return int(source[4:]) if source.startswith("CHAN") else 0

    def data(self) -> str:
        """WAVeform:DATA?: the points, as a block.  Raises ScpiError."""
        record, step, points = self.sequence()
        channel = self._channel_or_none()
        codes = (
            record.codes(channel, 0, points, of=points, start=record.origin, step=step)
            if channel
            else np.zeros(points, np.uint8)
        )
        form = str(self.settings["wav_format"])
        if form == "ASC":
            volts = record.inputs[channel].shown(codes) if channel else np.full(points, 9.9e37)  # no sample
            return self.block(",".join(f"{v:+.5E}" for v in volts).encode())
        signed = 0 if self.settings["wav_unsigned"] else self.middle
        shifted = codes.astype(np.int32) - signed
        if form == "WORD":
            order = "<" if self.settings["wav_order"] == "LSBF" else ">"
            return self.block((256 * shifted).astype(f"{order}i4").astype(f"{order}u2").tobytes())
        return self.block(shifted.astype(np.uint8).tobytes())

    # --- measurements and pictures ---

    def set_source(self, parameters: list[str]) -> None:
        """Set one source, or two, of which only the first is measured."""
        if not 1 <= len(parameters) <= 2:
            raise ScpiError(-109 if not parameters else -108)
        self.settings["measure_source"] = f"CHAN{self.channel_of(parameters[0])}"

    def _where(self, parameters: list[str]) -> int:
        """Return the channel that is named last, after words that say over what is measured.  Raises ScpiError."""
        for word in parameters[:-1]:
            choice(word, _INTERVALS)
        if not parameters or parameters[-1].upper() in {"CYCL", "CYCLE", "DISP", "DISPLAY", "AC", "DC"}:
            return self.channel_of(str(self.settings["measure_source"]))
        return self.channel_of(parameters[-1])

    def install(self, parameters: list[str]) -> None:
        """MEASure:FREQuency and its like: a measurement for the screen; its source must exist.  Raises ScpiError."""
        self._where(parameters)

    def measurement(self, name: str, parameters: list[str]) -> str:
        """MEASure:FREQuency? and its like.  Raises ScpiError."""
        value = self.measure(name, self._where(parameters))
        return self.spell(100 * value if name in _PERCENT and value < self.no_measurement else value)

    def picture(self, parameters: list[str]) -> str:
        """Return the picture, for ``[<format>[,<palette>]]``.  Raises ScpiError."""
        if len(parameters) > 2:
            raise ScpiError(-108)
        form, palette = (*parameters, *("BMP", "COLor")[len(parameters) :])
        form = {"BMP": "BMP24", "BMP8": "BMP8", "PNG": "PNG"}[choice(form, ("BMP", "BMP8bit", "PNG"))]
        colour = choice(palette, ("COLor", "GRAYscale", "MONochrome")) == "COL"
        return self.block(self.screenshot(form, colour=colour, inverted=bool(self.settings["ink_saver"])))

"""A virtual DSOX1102G, of the 1000 and 2000 X-Series.

Sources: the Programmer's Guides of the InfiniiVision X-Series (as quoted publicly: 2000 X-Series page 644, notes on
version 07.66 for the 6000 X-Series), and PyMeasure's suite for a real DSOX1102G.  From there: the state after
``*RST`` (40 V full scale, probe 10:1, 1 ms), 62 500 points of 16 ns then, ``yincrement`` of 0.0007851759 at 40 V, that
is 199 codes for the eight divisions; codes 0, 1 and 255 for no sample, clipped below and above; the bits of the
operation register; a single acquisition and a digitize begin with an empty memory.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import block_content, choice, number, one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.oscilloscope.scope import PRESETS, VirtualOscilloscope
from instruments.virtual.oscilloscope.screenshot import bmp8, bmp24, draw, grey, png

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from instruments.clock import Clock
    from instruments.virtual.oscilloscope.record import Record, Signal

#: The fastest rate [1/s].
_FASTEST = 2e9
_CODES_ON_SCREEN = 199
#: Bits of the operation status register.
_RUN, _WAIT_TRIGGER, _OVERLOAD = 8, 32, 2048
#: The code in the middle of the screen, and how many points a record for the screen has.
_MIDDLE, _FOR_SCREEN = 128, 62_500

_MEASUREMENTS = {
    "FREQuency": "FREQUENCY",
    "PERiod": "PERIOD",
    "VPP": "VPP",
    "VMAX": "VMAX",
    "VMIN": "VMIN",
    "VAMPlitude": "VAMPLITUDE",
    "VTOP": "VTOP",
    "VBASe": "VBASE",
    "VAVerage": "VAVERAGE",
    "VRMS": "VRMS",
    "SDEViation": "SDEVIATION",
    "RISetime": "RISETIME",
    "FALLtime": "FALLTIME",
    "PWIDth": "PWIDTH",
    "NWIDth": "NWIDTH",
    "DUTYcycle": "PDUTY",
    "NDUTy": "NDUTY",
    "OVERshoot": "OVERSHOOT",
    "PREShoot": "PRESHOOT",
    "XMAX": "TVMAX",
    "XMIN": "TVMIN",
    "AREa": "AREA",
    "PPULses": "PPULSES",
    "NPULses": "NPULSES",
    "PEDGes": "PEDGES",
    "NEDGes": "NEDGES",
    "COUNter": "FREQUENCY",
}
#: Told as percentages.
_PERCENT = {"PDUTY", "NDUTY", "OVERSHOOT", "PRESHOOT"}
#: Words before the source that say over what is measured.
_INTERVALS = ("CYCLe", "DISPlay", "AC", "DC")
#: Sources that a waveform may have beside the channels; this model has nothing in them.
_EMPTY_SOURCES = ("FUNCtion", "MATH", "FFT", "WMEMory1", "WMEMory2", "EXTernal", "ABUS")


class VirtualDSOX1000(VirtualOscilloscope):
    """A DSOX1102G: two channels, a million points, 100 MHz.  memory: points of another model's."""

    identity = "KEYSIGHT TECHNOLOGIES,DSO-X 1102G,VIRTUAL,01.20.2019061038"
    queue_size = 30
    columns, lowest, digits = 10, 1, 8
    transfer = 5e6

    def __init__(
        self,
        clock: Clock,
        *,
        signals: Mapping[int, Signal],
        channels: int = 2,
        memory: int = 1_000_000,
        identity: str | None = None,
    ) -> None:
        self._memory = memory
        super().__init__(clock, signals=signals, channels=channels, identity=identity)

    def spell(self, value: float) -> str:
        """Seven digits, as in the preamble of a real one."""
        return f"{value:+.6E}"

    def table(self) -> tuple[Command, ...]:
        """Its commands."""
        channels = tuple(row for n in self.channels for row in self._channel(n))
        return (*self._control(), *channels, *self._time(), *self._trigger(), *self._waveform(), *self._rest())

    # --- acquiring ---

    def _control(self) -> tuple[Command, ...]:
        registers = ("OPERegister:CONDition", "OPERation:CONDition", "OPERegister[:EVENt]")
        return (
            Command("RUN", set=does(self.run)),
            Command("STOP", set=does(self.stop)),
            Command("SINGle", set=does(self.single)),
            Command("DIGitize", set=self._digitize),
            Command("AUToscale", set=lambda _: self.autoscale()),
            Command("TRIGger:FORCe", set=does(self.force)),
            Command("CDISplay", set=does(lambda: None)),
            Command("TER", get=answers(self._trigger_event)),
            Command("AER", get=answers(self._arm_event)),
            Command(
                "ADER", get=answers(lambda: f"{int(not self.running() and self.acquisition.latest is not None):+d}")
            ),
            *(Command(header, get=answers(lambda: f"{self._condition():+d}")) for header in registers),
            Command("RSTate", get=answers(self._state)),
            Command("*LRN", get=answers(lambda: ":SYST:SET " + self.block(self.setup()))),
            Command("*OPT", get=answers(lambda: "0")),
            *(row.bind(self) for row in PRESETS),
        )

    def _digitize(self, parameters: list[str]) -> None:
        """Raises ScpiError in roll and XY mode, where there is no record."""
        if self.settings["time_mode"] in {"ROLL", "XY"}:
            raise ScpiError(-221)
        words = (*(f"CHANnel{n}" for n in self.channels), *_EMPTY_SOURCES)
        for source in parameters[:5]:
            word = choice(source, words)
            if word.startswith("CHAN"):
                self.settings[f"chan{word[4:]}_display"] = True
        self.digitize()

    def trigger(self) -> None:
        """``*TRG`` is the same as ``:DIGitize`` without a source."""
        self._digitize([])

    def _trigger_event(self) -> str:
        acquisition = self.acquisition
        acquisition.follow(self.now)
        event, acquisition.was_triggered = acquisition.was_triggered, False
        return f"{int(event):+d}"

    def _arm_event(self) -> str:
        acquisition = self.acquisition
        ready = self.running() and self.now >= acquisition.filled
        event = acquisition.was_armed and (ready or acquisition.armed is None)
        acquisition.was_armed = acquisition.was_armed and not event
        return f"{int(event):+d}"

    def _complete_event(self) -> str:
        return f"{int(not self.running() and self.acquisition.latest is not None):+d}"

    def _condition(self) -> int:
        if not self.running():
            return 0
        waits = self.now >= self.acquisition.filled and self.acquisition.first(self.now) is None
        return _RUN + _WAIT_TRIGGER * waits

    def _state(self) -> str:
        if not self.running():
            return "STOP"
        return "SING" if self.acquisition.once else "RUN"

    # --- settings ---

    def _channel(self, n: int) -> tuple[Command, ...]:
        head, name = f"CHANnel{n}:", f"chan{n}_"

        def probe() -> float:
            return self.value(name + "probe")

        def rounded(value: float) -> float:
            """An offset beyond what the range allows is set to the nearest that it does."""
            reach = (2.0 if self.value(name + "scale") / probe() < 0.2 else 50.0) * probe()
            return min(max(value, -reach), reach)

        return (
            self.quantity(head + "PROBe[:ATTenuation]", name + "probe", 10.0, limits=lambda: (0.1, 1e4)),
            self.quantity(head + "SCALe", name + "scale", 5.0, unit="V", limits=lambda: (5e-4 * probe(), 10 * probe())),
            self.full_range(
                head + "RANGe",
                name + "scale",
                divisions=8,
                limits=lambda: (4e-3 * probe(), 80 * probe(), 40.0),
                unit="V",
            ),
            self.quantity(head + "OFFSet", name + "offset", 0.0, unit="V", limits=lambda: (-1e5, 1e5), rounded=rounded),
            self.quantity(head + "PROBe:SKEW", name + "skew", 0.0, unit="S", limits=lambda: (-1e-7, 1e-7)),
            self.word(head + "PROBe:STYPe", name + "probe_kind", ("DIFFerential", "SINGle"), "SING"),
            Command(head + "PROBe:ID", get=answers(lambda: "NONE")),
            self.word(head + "COUPling", name + "coupling", ("AC", "DC"), "DC"),
            self.word(head + "IMPedance", name + "impedance", ("ONEMeg",), "ONEM"),
            self.word(head + "UNITs", name + "unit", ("VOLT", "AMPere"), "VOLT"),
            self.switch(head + "DISPlay", name + "display", default=n == 1),
            self.switch(head + "BWLimit", name + "bandwidth"),
            self.switch(head + "INVert", name + "invert"),
            self.switch(head + "VERNier", name + "vernier"),
            self.text(head + "LABel", name + "label", str(n), longest=10),
            Command(f"CHANnel{n}", get=answers(lambda: self._whole_channel(n))),
        )

    def _whole_channel(self, n: int) -> str:
        """As ``:CHAN1?`` answers after ``*RST``: ``:CHAN1:RANG +40.0E+00;OFFS +0.00000E+00;…``."""
        s, name = self.settings, f"chan{n}_"
        return (
            f":CHAN{n}:RANG {8 * self.value(name + 'scale'):+.5E};OFFS {self.value(name + 'offset'):+.5E};"
            f"COUP {s[name + 'coupling']};IMP {s[name + 'impedance']};DISP {int(s[name + 'display'])};"
            f"BWL {int(s[name + 'bandwidth'])};INV {int(s[name + 'invert'])};"
            f'LAB "{s[name + "label"]}";UNIT {s[name + "unit"]};PROB {self.value(name + "probe"):+.5E};'
            f"PROB:SKEW {self.value(name + 'skew'):+.2E};STYP {s[name + 'probe_kind']}"
        )

    def _time(self) -> tuple[Command, ...]:
        def whole() -> str:
            s = self.settings
            ten = 10 * self.value("time_scale")
            return f":TIM:MODE {s['time_mode']};REF {s['time_reference']};MAIN:RANG {ten:+.5E};POS {self._position()}"

        return (
            self.word("TIMebase:MODE", "time_mode", ("MAIN", "WINDow", "XY", "ROLL"), "MAIN"),
            self.quantity("TIMebase[:MAIN]:SCALe", "time_scale", 1e-4, unit="S", limits=lambda: (5e-9, 50.0)),
            self.full_range(
                "TIMebase[:MAIN]:RANGe", "time_scale", divisions=10, limits=lambda: (50e-9, 500.0, 1e-3), unit="S"
            ),
            self.quantity(
                "TIMebase:POSition",
                "time_offset",
                0.0,
                unit="S",
                limits=lambda: (-500.0, 500.0),
                spell=lambda value: f"{value:+.12E}",
            ),
            self.quantity("TIMebase:DELay", "time_offset", 0.0, unit="S", limits=lambda: (-500.0, 500.0)),
            self.word("TIMebase:REFerence", "time_reference", ("LEFT", "CENTer", "RIGHt"), "CENT"),
            self.switch("TIMebase:VERNier", "time_vernier"),
            self.quantity("TIMebase:WINDow:SCALe", "zoom_scale", 5e-5, unit="S", limits=lambda: (5e-9, 50.0)),
            self.quantity("TIMebase:WINDow:POSition", "zoom_offset", 0.0, unit="S", limits=lambda: (-500.0, 500.0)),
            Command("TIMebase", get=answers(whole)),
            self.word("ACQuire:TYPE", "acquisition", ("NORMal", "AVERage", "HRESolution", "PEAK"), "NORM"),
            self.word("ACQuire:MODE", "acquisition_mode", ("RTIMe", "SEGMented", "ETIMe"), "RTIM"),
            self.whole("ACQuire:COUNt", "averages", 8.0, low=2, high=65536, sign="+"),
            self.whole("ACQuire:COMPlete", "complete", 100.0, low=100, high=100, sign="+"),
            self.whole("ACQuire:SEGMented:COUNt", "segments", 2.0, low=2, high=50, sign="+"),
            Command("ACQuire:POINts[:ANALog]", get=answers(lambda: f"{self.full_scale()[1]:+d}")),
            Command("ACQuire:SRATe[:ANALog]", get=lambda _: self.spell(self.full_scale()[0])),
        )

    def _position(self) -> str:
        return f"{self.value('time_offset'):+.6E}"

    def _trigger(self) -> tuple[Command, ...]:
        sources = (*(f"CHANnel{n}" for n in self.channels), "EXTernal", "LINE", "WGEN")
        modes = ("EDGE", "GLITch", "PATTern", "TV", "SHOLd", "TRANsition", "SBUS1")

        def levels() -> tuple[float, float]:
            """Three quarters of the full scale from the middle of the screen."""
            source = str(self.settings["trigger_source"])
            channel = int(source[4:]) if source.startswith("CHAN") else 1
            reach, middle = 6 * self.division(channel), self.value(f"chan{channel}_offset")
            return middle - reach, middle + reach

        return (
            self.word("TRIGger:MODE", "trigger_mode", modes, "EDGE"),
            self.word("TRIGger[:EDGE]:SOURce", "trigger_source", sources, "CHAN1"),
            self.word("TRIGger[:EDGE]:SLOPe", "trigger_slope", ("NEGative", "POSitive", "EITHer", "ALTernate"), "POS"),
            self.quantity("TRIGger[:EDGE]:LEVel", "trigger_level", 0.0, unit="V", limits=levels),
            Command("TRIGger:LEVel:ASETup", set=does(self.half_level)),
            self.word("TRIGger:SWEep", "trigger_sweep", ("AUTO", "NORMal"), "AUTO"),
            self.word("TRIGger[:EDGE]:COUPling", "trigger_coupling", ("AC", "DC", "LFReject"), "DC"),
            self.word("TRIGger[:EDGE]:REJect", "trigger_rejection", ("OFF", "LFReject", "HFReject"), "OFF"),
            self.quantity("TRIGger:HOLDoff", "holdoff", 60e-9, unit="S", limits=lambda: (60e-9, 10.0)),
            self.switch("TRIGger:NREJect", "noise_rejection"),
            self.switch("TRIGger:HFReject", "high_rejection"),
            Command("TRIGger", get=answers(self._whole_trigger)),
        )

    def _whole_trigger(self) -> str:
        s = self.settings
        return (
            f":TRIG:MODE {s['trigger_mode']};SWE {s['trigger_sweep']};NREJ {int(s['noise_rejection'])};"
            f"HFR {int(s['high_rejection'])};HOLD {self.value('holdoff'):+.3E};"
            f":TRIG:EDGE:SOUR {s['trigger_source']};LEV {self.value('trigger_level'):+.5E};"
            f"SLOP {s['trigger_slope']};REJ {s['trigger_rejection']};COUP {s['trigger_coupling']}"
        )

    # --- scaling ---

    def full_scale(self) -> tuple[float, int]:
        """The record fills the screen and nothing else."""
        length = 10 * self.value("time_scale")
        rate = min(_FASTEST / (1 if len(self.shown()) <= 1 else 2), self._memory / length)
        return rate, max(2, round(rate * length))

    def screen(self) -> tuple[float, float]:
        """Ten divisions, the reference one from the left, in the middle, or one from the right."""
        scale = self.value("time_scale")
        before = {"LEFT": 1, "CENT": 5, "RIGH": 9}[str(self.settings["time_reference"])]
        return self.value("time_offset") - before * scale, 10 * scale

    def scaling(self, channel: int) -> tuple[float, int]:
        """199 codes for eight divisions.  The offset, in the middle, is set to whole codes."""
        volts_per_code = 8 * self.division(channel) / _CODES_ON_SCREEN
        return volts_per_code, _MIDDLE - round(self.value(f"chan{channel}_offset") / volts_per_code)

    def window(self, channel: int) -> tuple[float, float]:
        """Eight divisions around the middle."""
        return float(_MIDDLE), float(_CODES_ON_SCREEN)

    def fit(self, channel: int, middle: float, division: float) -> None:
        """The offset is the voltage in the middle."""
        self.settings |= {f"chan{channel}_scale": division, f"chan{channel}_offset": middle}

    # --- reading the record ---

    def _waveform(self) -> tuple[Command, ...]:
        """The rows for reading the record."""
        sources = (*(f"CHANnel{n}" for n in self.channels), *_EMPTY_SOURCES)
        parts = ("FORMat", "TYPE", "POINts", "COUNt", "XINC", "XOR", "XREF", "YINC", "YOR", "YREF")
        words = {"XINC": "XINCrement", "XOR": "XORigin", "XREF": "XREFerence", "YINC": "YINCrement", "YOR": "YORigin"}
        words |= {"YREF": "YREFerence", "TYPE": "TYPE", "COUNt": "COUNt"}
        self._defaults["wav_points"] = float(_FOR_SCREEN)
        return (
            self.word("WAVeform:SOURce", "wav_source", sources, "CHAN1"),
            self.word("WAVeform:FORMat", "wav_format", ("WORD", "BYTE", "ASCii"), "BYTE"),
            self.word("WAVeform:BYTeorder", "wav_order", ("LSBFirst", "MSBFirst"), "MSBF"),
            self.switch("WAVeform:UNSigned", "wav_unsigned", default=True),
            self.word("WAVeform:VIEW", "wav_view", ("MAIN",), "MAIN"),
            self.word("WAVeform:POINts:MODE", "wav_mode", ("NORMal", "MAXimum", "RAW"), "NORM"),
            Command("WAVeform:POINts", self._set_points, answers(lambda: f"{self._sequence()[2]:+d}")),
            Command("WAVeform:PREamble", get=answers(lambda: ",".join(self._preamble()))),
            *(
                Command(f"WAVeform:{words[part]}", get=answers(self._part(k)))
                for k, part in enumerate(parts)
                if part in words
            ),
            Command("WAVeform:DATA", get=answers(self._data)),
        )

    def _part(self, k: int) -> Callable[[], str]:
        return lambda: self._preamble()[k]

    def _set_points(self, parameters: list[str]) -> None:
        """A number, rounded to the next the scope can give when it is asked for; MAXimum takes all."""
        self.settings["wav_points"] = number(one(parameters), low=1, high=8e6, default=_FOR_SCREEN)

    def _sequence(self) -> tuple[Record, float, int]:
        """The record, the distance of the points that can be read [s], how many.  Raises ScpiError."""
        if self.settings["time_mode"] in {"ROLL", "XY"}:
            raise ScpiError(-221)
        record = self.record()
        raw = self.settings["wav_mode"] == "RAW" or (self.settings["wav_mode"] == "MAX" and not self.running())
        most = record.points if raw else min(_FOR_SCREEN, record.points)
        wanted = self.value("wav_points")
        every = math.ceil(record.points / min(max(wanted, 1), most))
        return record, every / record.rate, max(1, record.points // every)

    def _source(self) -> int:
        """Raises ScpiError for a source with nothing in it."""
        source = str(self.settings["wav_source"])
        if not source.startswith("CHAN"):
            raise ScpiError(-230)
        return int(source[4:])

    def _preamble(self) -> list[str]:
        record, step, points = self._sequence()
        form = str(self.settings["wav_format"])
        kind = {"BYTE": 0, "WORD": 1, "ASC": 4}[form]
        mode = {"NORM": 0, "PEAK": 1, "AVER": 2, "HRES": 3}[str(self.settings["acquisition"])]
        averages = round(self.value("averages")) if mode == 2 else 1
        per_code, reference = (1, _MIDDLE) if form == "BYTE" else (256, 256 * _MIDDLE)
        shown = record.inputs.get(self._channel_or_none())
        volts = shown.volts_per_code / per_code if shown else 1.0
        offset = (_MIDDLE - shown.zero) * shown.volts_per_code if shown else 0.0
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

    def _data(self) -> str:
        record, step, points = self._sequence()
        channel = self._channel_or_none()
        codes = (
            record.codes(channel, 0, points, of=points, start=record.origin, step=step)
            if channel
            else np.zeros(points, np.uint8)
        )
        form = str(self.settings["wav_format"])
        if form == "ASC":
            return self.block(self._as_text(record, channel, codes.astype(float)))
        signed = 0 if self.settings["wav_unsigned"] else _MIDDLE
        shifted = codes.astype(np.int32) - signed
        if form == "WORD":
            order = "<" if self.settings["wav_order"] == "LSBF" else ">"
            return self.block((256 * shifted).astype(f"{order}i4").astype(f"{order}u2").tobytes())
        return self.block(shifted.astype(np.uint8).tobytes())

    @staticmethod
    def _as_text(record: Record, channel: int, codes: np.ndarray[tuple[int], np.dtype[np.float64]]) -> bytes:
        if not channel:  # no sample
            return ",".join(["+9.90000E+37"] * codes.size).encode()
        scale = record.inputs[channel]
        return ",".join(f"{v:+.5E}" for v in (codes - scale.zero) * scale.volts_per_code).encode()

    # --- measurements, pictures, setups ---

    def _rest(self) -> tuple[Command, ...]:
        """The rows for measurements, pictures and setups."""

        def ignored(_: list[str]) -> None:
            """What only changes the picture."""

        self._defaults["measure_source"] = "CHAN1"
        self._results: list[tuple[str, int]] = []
        return (
            Command("MEASure:SOURce", set=self._set_source, get=answers(lambda: str(self.settings["measure_source"]))),
            self.word("MEASure:SHOW", "measure_shown", ("1", "ON"), "1"),
            Command("MEASure:CLEar", set=does(self._clear_results)),
            Command("MEASure:RESults", get=answers(self._all_results)),
            *(
                Command(f"MEASure:{word}", set=self._install(name), get=self._ask(name))
                for word, name in _MEASUREMENTS.items()
            ),
            Command("DISPlay:DATA", get=self._picture),
            *(Command(header, set=ignored) for header in ("DISPlay:CLEar", "SYSTem:DSP", "SYSTem:LOCK")),
            self.switch("HARDcopy:INKSaver", "ink_saver", default=True),
            self.switch("DISPlay:LABel", "labels"),
            self.word("MEASure:STATistics", "statistics", ("ON", "CURRent", "MEAN"), "ON"),
            Command(
                "SYSTem:SETup",
                set=lambda p: self.restore(block_content(one(p)).decode("latin-1")),
                get=answers(self._setup),
            ),
            Command("SYSTem:PRESet", set=does(self.reset)),
        )

    def _setup(self) -> str:
        return self.block(self.setup())

    def _set_source(self, parameters: list[str]) -> None:
        """One source, or two, of which only the first is measured."""
        if not 1 <= len(parameters) <= 2:
            raise ScpiError(-109 if not parameters else -108)
        self.settings["measure_source"] = f"CHAN{self.channel_of(parameters[0])}"

    def _where(self, parameters: list[str]) -> int:
        """The channel that is named last, after words that say over what is measured.  Raises ScpiError."""
        for word in parameters[:-1]:
            choice(word, _INTERVALS)
        if not parameters or parameters[-1].upper() in {"CYCL", "CYCLE", "DISP", "DISPLAY", "AC", "DC"}:
            return self.channel_of(str(self.settings["measure_source"]))
        return self.channel_of(parameters[-1])

    def _install(self, name: str) -> Callable[[list[str]], None]:
        def set_(parameters: list[str]) -> None:
            self._results = [*self._results, (name, self._where(parameters))][-8:]

        return set_

    def _clear_results(self) -> None:
        self._results = []

    def _ask(self, name: str) -> Callable[[list[str]], str]:
        return lambda parameters: self._value(name, self._where(parameters))

    def _value(self, name: str, channel: int) -> str:
        value = self.measured(name, channel)
        return self.spell(100 * value if name in _PERCENT and value < self.no_measurement else value)

    def _all_results(self) -> str:
        return ",".join(self._value(name, channel) for name, channel in self._results) or "NONE"

    def _picture(self, parameters: list[str]) -> str:
        """``[<format>[,<palette>]]``.  Raises ScpiError."""
        if len(parameters) > 2:
            raise ScpiError(-108)
        form, palette = (*parameters, *("BMP", "COLor")[len(parameters) :])
        writers = {"BMP": bmp24, "BMP8": bmp8, "PNG": png}
        write = writers[choice(form, ("BMP", "BMP8bit", "PNG"))]
        picture = draw(self.heights(), columns=self.columns)
        grey_wanted = choice(palette, ("COLor", "GRAYscale", "MONochrome")) != "COL"
        picture = grey(picture) if grey_wanted else picture
        return self.block(write(255 - picture if self.settings["ink_saver"] else picture))

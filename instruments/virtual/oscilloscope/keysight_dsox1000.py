"""A virtual DSOX1102G, of the 1000 and 2000 X-Series.

Sources: the Programmer's Guides of the InfiniiVision X-Series (as quoted publicly: 2000 X-Series page 644, notes on
version 07.66 for the 6000 X-Series), and PyMeasure's suite for a real DSOX1102G.  From there: the state after
``*RST`` (40 V full scale, probe 10:1, 1 ms), 62 500 points of 16 ns then, ``yincrement`` of 0.0007851759 at 40 V, that
is 199 codes for the eight divisions; codes 0, 1 and 255 for no sample, clipped below and above; the bits of the
operation register; a single acquisition and a digitize begin with an empty memory.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import choice
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.oscilloscope.keysight_dsox1000_reading import EMPTY_SOURCES, MIDDLE, KeysightReading

if TYPE_CHECKING:
    from collections.abc import Mapping

    from instruments.virtual.core.device import Clock
    from instruments.virtual.oscilloscope.record import Signal

#: Points of the memory; the fastest rate [1/s].
_MEMORY, _FASTEST = 1_000_000, 2e9
_CODES_ON_SCREEN = 199
#: Bits of the operation status register.
_RUN, _WAIT_TRIGGER, _OVERLOAD = 8, 32, 2048


class VirtualDSOX1000(KeysightReading):
    """A DSOX1102G: two channels, a million points, 100 MHz."""

    identity = "KEYSIGHT TECHNOLOGIES,DSO-X 1102G,VIRTUAL,01.20.2019061038"
    queue_size = 30
    columns, lowest = 10, 1
    transfer = 5e6

    def __init__(
        self, clock: Clock, *, signals: Mapping[int, Signal], channels: int = 2, identity: str | None = None
    ) -> None:
        self._armed_event = False
        super().__init__(clock, signals=signals, channels=channels, identity=identity)

    def spell(self, value: float) -> str:
        """Seven digits, as in the preamble of a real one."""
        return f"{value:+.6E}"

    def table(self) -> tuple[Command, ...]:
        """Its commands."""
        channels = tuple(row for n in self.channels for row in self._channel(n))
        return (*self._control(), *channels, *self._time(), *self._trigger(), *self.waveform(), *self.rest())

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
            Command("ADER", get=answers(lambda: f"{int(not self.running() and self._record is not None):+d}")),
            *(Command(header, get=answers(lambda: f"{self._condition():+d}")) for header in registers),
            Command("RSTate", get=answers(self._state)),
            Command("*LRN", get=answers(lambda: ":SYST:SET " + self.block(self.setup(), digits=8))),
            Command("*OPT", get=answers(lambda: "0")),
            *self.presets(),
        )

    def _arm(self, *, once: bool) -> None:
        self._armed_event = True
        super()._arm(once=once)

    def _digitize(self, parameters: list[str]) -> None:
        """Raises ScpiError in roll and XY mode, where there is no record."""
        if self.settings["time_mode"] in {"ROLL", "XY"}:
            raise ScpiError(-221)
        words = (*(f"CHANnel{n}" for n in self.channels), *EMPTY_SOURCES)
        for source in parameters[:5]:
            word = choice(source, words)
            if word.startswith("CHAN"):
                self.settings[f"chan{word[4:]}_display"] = True
        self.digitize()

    def trigger(self) -> None:
        """``*TRG`` is the same as ``:DIGitize`` without a source."""
        self._digitize([])

    def _trigger_event(self) -> str:
        self.follow()
        event, self.triggered = self.triggered, False
        return f"{int(event):+d}"

    def _arm_event(self) -> str:
        ready = self.running() and self.now >= self.filled
        event = self._armed_event and (ready or self._armed is None)
        self._armed_event = self._armed_event and not event
        return f"{int(event):+d}"

    def _condition(self) -> int:
        if not self.running():
            return 0
        waits = self.now >= self.filled and self._first_record(self.now) is None
        return _RUN + _WAIT_TRIGGER * waits

    def _state(self) -> str:
        if not self.running():
            return "STOP"
        return "SING" if self._once else "RUN"

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
        rate = min(_FASTEST / (1 if len(self.shown()) <= 1 else 2), _MEMORY / length)
        return rate, max(2, round(rate * length))

    def screen(self) -> tuple[float, float]:
        """Ten divisions, the reference one from the left, in the middle, or one from the right."""
        scale = self.value("time_scale")
        before = {"LEFT": 1, "CENT": 5, "RIGH": 9}[str(self.settings["time_reference"])]
        return self.value("time_offset") - before * scale, 10 * scale

    def scaling(self, channel: int) -> tuple[float, int]:
        """199 codes for eight divisions.  The offset, in the middle, is set to whole codes."""
        volts_per_code = 8 * self.division(channel) / _CODES_ON_SCREEN
        return volts_per_code, MIDDLE - round(self.value(f"chan{channel}_offset") / volts_per_code)

    def window(self, channel: int) -> tuple[float, float]:
        """Eight divisions around the middle."""
        return float(MIDDLE), float(_CODES_ON_SCREEN)

    def fit(self, channel: int, middle: float, division: float) -> None:
        """The offset is the voltage in the middle."""
        self.settings |= {f"chan{channel}_scale": division, f"chan{channel}_offset": middle}

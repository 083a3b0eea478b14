"""Virtual function generators: what they put out is told to whoever listens.  The 33500B series stands here."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from instruments.virtual.arbitrary import Refused, attribute, plain_name, samples
from instruments.virtual.device import Clock, VirtualInstrument, answers, does
from instruments.virtual.generator_channel import INFINITE, MODES, Burst, Channel, Family, Output, Waveform, quantity_of
from instruments.virtual.scpi import Command, ScpiError, at_most_one, choice, limit, nr3, one

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Burst", "Output", "Virtual33500B", "VirtualGenerator"]

_HZ, _S, _V, _DEG, _PERCENT = ("", "HZ"), ("", "S"), ("", "V"), ("", "DEG"), ("", "PCT")
_LEVEL = "VOLTage[:LEVel][:IMMediate]"
_INNER = ("SINusoid", "SQUare", "TRIangle", "RAMP", "NRAMp", "NOISe", "PRBS", "ARB", "USER")

#: header, name, low, high, default, units.  Nothing else depends on these, as far as the model goes.
Plain = tuple[str, str, float, float, float, tuple[str, ...]]
_PLAIN: tuple[Plain, ...] = (
    ("BURSt:PHASe", "burst_phase", -360, 360, 0, _DEG),
    ("MARKer:FREQuency", "marker_frequency", 1e-6, 30e6, 500, _HZ),
    ("FREQuency:STARt", "sweep_start", 1e-6, 30e6, 100, _HZ),
    ("FREQuency:STOP", "sweep_stop", 1e-6, 30e6, 1000, _HZ),
    ("SWEep:HTIMe", "sweep_hold", 0, 3600, 0, _S),
    ("SWEep:RTIMe", "sweep_return", 0, 3600, 0, _S),
    ("AM[:DEPTh]", "am_depth", 0, 120, 100, _PERCENT),
    ("FM[:DEViation]", "fm_deviation", 1e-6, 15e6, 100, _HZ),
    ("PM[:DEViation]", "pm_deviation", 0, 360, 180, _DEG),
    ("PWM[:DEViation]", "pwm_deviation", 0, 1e6, 1e-5, _S),
    ("FSKey:FREQuency", "fsk_frequency", 1e-6, 30e6, 100, _HZ),
    ("FSKey:INTernal:RATE", "fsk_rate", 1e-6, 1e6, 10, _HZ),
    ("AM:INTernal:FREQuency", "am_frequency", 1e-6, 30e6, 100, _HZ),
    ("FM:INTernal:FREQuency", "fm_frequency", 1e-6, 30e6, 10, _HZ),
    ("PM:INTernal:FREQuency", "pm_frequency", 1e-6, 30e6, 10, _HZ),
    ("PWM:INTernal:FREQuency", "pwm_frequency", 1e-6, 30e6, 10, _HZ),
)
_PLAIN_33500: tuple[Plain, ...] = (
    ("FUNCtion:NOISe:BANDwidth", "noise_bandwidth", 1e-3, 30e6, 1e5, _HZ),
    ("FUNCtion:PRBS:TRANsition[:BOTH]", "prbs_edge", 8.4e-9, 1e-6, 8.4e-9, _S),
    ("MARKer:CYCle", "marker_cycle", 2, 100e6, 2, ("",)),
    ("BPSK[:PHASe]", "bpsk_phase", 0, 360, 180, _DEG),
    ("BPSK:INTernal:RATE", "bpsk_rate", 1e-3, 1e6, 10, _HZ),
    ("LIST:DWELl", "list_dwell", 1e-6, 3600, 1, _S),
    ("MARKer:POINt", "marker_point", 4, 1e6, 10, ("",)),
    ("PHASe:ARBitrary", "arb_phase", -360, 360, 0, _DEG),
    ("PHASe:MODulation", "modulation_phase", -360, 360, 0, _DEG),
    ("PWM:DEViation:DCYCle", "pwm_duty", 0, 100, 1, _PERCENT),
    ("SUM:AMPLitude", "sum_amplitude", 0, 100, 0.1, _PERCENT),
    ("SUM:INTernal:FREQuency", "sum_frequency", 1e-6, 30e6, 100, _HZ),
)
#: header, name, words, default.
Choice = tuple[str, str, tuple[str, ...], str]
_CHOICES: tuple[Choice, ...] = (
    ("FUNCtion:PULSe:HOLD", "pulse_hold", ("WIDTh", "DCYCle"), "WIDT"),
    ("BURSt:MODE", "burst_mode", ("TRIGgered", "GATed"), "TRIG"),
    ("BURSt:GATE:POLarity", "gate_polarity", ("NORMal", "INVerted"), "NORM"),
    ("FREQuency:MODE", "frequency_mode", ("CW", "LIST", "SWEep", "FIXed"), "CW"),
    ("SWEep:SPACing", "sweep_spacing", ("LINear", "LOGarithmic"), "LIN"),
    *(
        (f"{mode}:SOURce", f"{mode.lower()}_source", ("INTernal", "EXTernal"), "INT")
        for mode in ("AM", "FM", "PM", "PWM")
    ),
    ("FSKey:SOURce", "fsk_source", ("INTernal", "EXTernal"), "INT"),
    *((f"{mode}:INTernal:FUNCtion", f"{mode.lower()}_function", _INNER, "SIN") for mode in ("AM", "FM", "PM", "PWM")),
)
_CHOICES_33500: tuple[Choice, ...] = (
    ("FUNCtion:ARBitrary:FILTer", "arb_filter", ("NORMal", "STEP", "OFF"), "STEP"),
    ("FUNCtion:ARBitrary:ADVance", "arb_advance", ("TRIGger", "SRATe"), "SRAT"),
    ("FUNCtion:PRBS:DATA", "prbs_data", ("PN7", "PN9", "PN11", "PN15", "PN20", "PN23"), "PN7"),
    ("BPSK:SOURce", "bpsk_source", ("INTernal", "EXTernal"), "INT"),
    ("SUM:SOURce", "sum_source", ("INTernal", "EXTernal", "CH1", "CH2"), "INT"),
    ("SUM:INTernal:FUNCtion", "sum_function", _INNER, "SIN"),
)
_SWITCHES = ("BURSt", "SWEep", "AM", "FM", "PM", "PWM", "FSKey")


class VirtualGenerator(VirtualInstrument):
    """Bytes in, a signal out; the commands that both families have.

    listener: called with the time [s] and the new Output of channel 1 at each change, and beforehand with the end of
    a burst that is under way: a later change takes the place of what was told for after it.
    """

    family: ClassVar[Family]
    outputs: ClassVar[int] = 1
    trigger_sources: ClassVar[tuple[str, ...]] = ("IMMediate", "EXTernal", "BUS")
    modes: ClassVar[tuple[str, ...]] = _SWITCHES

    def __init__(self, clock: Clock, *, listener: Callable[[float, Output], None] | None = None) -> None:
        self._listener = listener
        self.channels: tuple[Channel, ...] = ()
        self.text = ""
        super().__init__(clock)

    # --- what happens ---

    def changed(self, name: str) -> None:
        """Make the other settings fit, and tell the listener what stands at the terminals now."""
        prefix, _, plain = name.rpartition(":")
        channel = self.channels[int(prefix or 1) - 1]
        channel.settle(plain)
        if channel.index == 1:
            self._tell()

    def _tell(self) -> None:
        if not self._listener:
            return
        now = self.clock.now()
        self._listener(now, self.signal())
        for instant in self.channels[0].under_way:
            if now < instant < math.inf:
                self._listener(instant, self.channels[0].signal(instant))

    @staticmethod
    def printed(value: float) -> str:
        """A number as it is answered."""
        return nr3(value)

    def signal(self, channel: int = 1) -> Output:
        """What stands at the terminals of a channel."""
        return self.channels[channel - 1].signal(self.clock.now())

    def reset(self) -> None:
        """The state after ``*RST``: all outputs off."""
        for channel in self.channels:
            channel.stop()
        self.settings |= self._defaults
        for channel in self.channels:
            self.changed(channel.prefix + "output")

    def trigger(self) -> None:
        """``*TRG``: starts what waits for it."""
        waiting = [channel for channel in self.channels if channel.waits and channel["trigger_source"] == "BUS"]
        if not waiting:
            raise Refused(-211, "Trigger ignored")
        for channel in waiting:
            channel.trigger()
        self._tell()

    def _abort(self) -> None:
        for channel in self.channels:
            channel.stop()
        self._ready = min(self._ready, self.clock.now() + self.pace)
        self._tell()

    def _wait(self) -> None:
        """``*WAI``, ``*OPC?``: the next answer comes when no triggered burst or sweep is under way any more."""
        self.busy_until(max(channel.under_way[1] for channel in self.channels))

    def _waited(self) -> str:
        self._wait()
        return "1"

    # --- rows of the table ---

    def quantity(
        self,
        channel: Channel,
        pattern: str,
        name: str,
        limits: Callable[[], tuple[float, float]],
        default: float,
        *,
        units: tuple[str, ...] = ("",),
        endless: bool = False,
        get: Callable[[], float] | None = None,
        put: Callable[[float], None] | None = None,
    ) -> Command:
        """A row for a number that is clipped at its limits.

        endless: it may be infinite; get, put: where the number is not kept as it is sent.  The first row that names a
        setting gives its default.
        """
        key = channel.prefix + name
        self._defaults.setdefault(key, default)

        def set_(parameters: list[str]) -> None:
            text = one(parameters)
            low, high = limits()
            infinite = endless and text.upper() in {"INF", "INFINITY"}
            if endless and not infinite and not text[:1].isalpha():
                infinite = quantity_of(text, units)[0] >= INFINITE
            value = INFINITE if infinite else channel.read(text, low, high, default, units)
            if put is None:
                channel[name] = value
            else:
                put(value)
            self.changed(key)

        def ask(parameters: list[str]) -> str:
            asked = at_most_one(parameters)
            if asked:
                low, high = limits()
                return self.printed(limit(asked, low=low, high=high, default=default))
            return self.printed(channel.number(name) if get is None else get())

        return Command(pattern, set_, ask)

    def table(self) -> tuple[Command, ...]:
        """The commands of all channels, and those of the whole instrument."""
        self.channels = tuple(
            Channel(self.family, self.settings, index=k + 1, report=self.parser.report, now=self.clock.now)
            for k in range(self.outputs)
        )
        rows = [row for channel in self.channels for row in self._channel_rows(channel)]
        return (*rows, *self._shared())

    def _common(self) -> tuple[Command, ...]:
        """As every instrument, but completion waits for a triggered burst."""
        own = (
            Command("*OPC", set=does(self._note_completion), get=answers(self._waited)),
            Command("*WAI", set=does(self._wait)),
            Command("*OPT", get=answers(lambda: '"0,0"')),
        )
        return own + super()._common()

    @staticmethod
    def headers(channel: Channel) -> tuple[str, str, str]:
        """How this channel's headers begin: of the source, the output, the trigger."""
        if channel.index == 1:
            return "[SOURce[1]:]", "OUTPut[1]", "TRIGger[1]"
        return f"SOURce{channel.index}:", f"OUTPut{channel.index}", f"TRIGger{channel.index}"

    def _channel_rows(self, channel: Channel) -> tuple[Command, ...]:
        return (
            *self._plain_rows(channel, _PLAIN, _CHOICES),
            *self._signal_rows(channel),
            *self._voltage_rows(channel),
            *self._pulse_rows(channel),
            *self._burst_rows(channel),
            *self._output_rows(channel),
            *self._apply_rows(channel),
            *self.arbitrary_rows(channel),
        )

    def arbitrary_rows(self, channel: Channel) -> tuple[Command, ...]:
        """What a family has for its arbitrary waveforms, and what else it alone has."""
        return ()

    def _signal_rows(self, channel: Channel) -> tuple[Command, ...]:
        source, prefix = self.headers(channel)[0], channel.prefix
        words = tuple(waveform.word for waveform in self.family.waveforms)

        def set_frequency(value: float) -> None:
            channel.frequency = value

        def set_period(value: float) -> None:
            channel["frequency"] = 1 / value

        shortest = 1 / self.family.waveform("PULS").top
        period = partial(self.quantity, channel, name="frequency", default=1e-3, units=_S)
        return (
            self.word(source + "FUNCtion[:SHAPe]", prefix + "waveform", words, "SIN"),
            self.quantity(
                channel,
                source + "FREQuency[:CW|:FIXed]",
                "frequency",
                channel.frequency_limits,
                1e3,
                units=_HZ,
                get=lambda: channel.frequency,
                put=set_frequency,
            ),
            period(
                pattern=source + "[FUNCtion:]PULSe:PERiod",
                limits=lambda: (shortest, self.family.longest_period),
                get=lambda: 1 / channel.number("frequency"),
                put=set_period,
            ),
            period(
                pattern=source + "FUNCtion:SQUare:PERiod",
                limits=lambda: (1 / self.family.waveform("SQU").top, 1e6),
                get=lambda: 1 / channel.number("frequency"),
                put=set_period,
            ),
            self._angle(channel, source + "PHASe[:ADJust]"),
            Command(source + "PHASe:REFerence", set=does(lambda: None)),
            self.quantity(
                channel,
                source + "FUNCtion:SQUare:DCYCle",
                "duty",
                lambda: self.family.square(channel.number("frequency")),
                50.0,
                units=_PERCENT,
            ),
            self.quantity(
                channel, source + "FUNCtion:RAMP:SYMMetry", "symmetry", lambda: (0, 100), 100.0, units=_PERCENT
            ),
        )

    def _angle(self, channel: Channel, pattern: str) -> Command:
        """A row for the phase, in the unit that UNIT:ANGLe says, or the one that is sent."""

        def scale() -> float:
            return math.degrees(1) if self.settings["angle_unit"] == "RAD" else 1.0

        def put(value: float) -> None:
            channel["phase"] = value * scale()

        return self.quantity(
            channel,
            pattern,
            "phase",
            lambda: (-360 / scale(), 360 / scale()),
            0.0,
            units=("", "DEG", "RAD"),
            get=lambda: channel.number("phase") / scale(),
            put=put,
        )

    def _voltage_rows(self, channel: Channel) -> tuple[Command, ...]:
        source, prefix = self.headers(channel)[0], channel.prefix
        self._defaults |= {prefix + "amplitude_vpp": 0.1, prefix + "voltage_unit": "VPP"}

        def set_unit(parameters: list[str]) -> None:
            unit = choice(one(parameters), ("VPP", "VRMS", "DBM"))
            if unit == "DBM" and channel.number("load") >= INFINITE:
                channel.conflict("amplitude units changed to Vpp due to high-Z load")
                unit = "VPP"
            channel["voltage_unit"] = unit
            self.changed(prefix + "voltage_unit")

        def set_amplitude(parameters: list[str]) -> None:
            channel["amplitude_vpp"] = self._amplitude(channel, one(parameters))
            self.changed(prefix + "amplitude_vpp")

        def level(which: str) -> Command:
            return self.quantity(
                channel,
                f"{source}{_LEVEL}:{which.upper()}",
                "amplitude_vpp",
                lambda: channel.level_limits(which),
                0.05 if which == "high" else -0.05,
                units=_V,
                get=lambda: channel.level(which),
                put=lambda value: channel.set_level(which, value),
            )

        return (
            Command(f"{source}{_LEVEL}[:AMPLitude]", set_amplitude, partial(self._ask_amplitude, channel)),
            Command(source + "VOLTage:UNIT", set_unit, answers(lambda: str(channel["voltage_unit"]))),
            self.quantity(channel, f"{source}{_LEVEL}:OFFSet", "offset", channel.offset_limits, 0.0, units=_V),
            level("high"),
            level("low"),
            self.switch(source + "VOLTage:LIMit:STATe", prefix + "limits_on"),
            self.quantity(channel, source + "VOLTage:LIMit:HIGH", "limit_high", lambda: (-10, 10), 5.0, units=_V),
            self.quantity(channel, source + "VOLTage:LIMit:LOW", "limit_low", lambda: (-10, 10), -5.0, units=_V),
            self.switch(source + "VOLTage:RANGe:AUTO", prefix + "automatic_range", default=True),
        )

    @staticmethod
    def _amplitude(channel: Channel, text: str) -> float:
        """An amplitude as it is sent, with a unit or in the one that is set, as peak to peak [V], within its limits."""
        least, most = channel.amplitude_limits()
        unit = str(channel["voltage_unit"])
        if text[:1].isalpha():
            return channel.read(text, least, most, 0.1)
        plain = "VPP" if unit == "DBM" else unit
        units = {"": unit, "VPP": "VPP", "VRMS": "VRMS", "DBM": "DBM", "V": plain}
        value, suffix = quantity_of(text, tuple(units))
        meant = units[suffix]
        if meant == "DBM" and channel.number("load") >= INFINITE:
            raise ScpiError(-221, "amplitude units changed to Vpp due to high-Z load")
        vpp = channel.meant(value, meant)
        # a limit that was asked for in another unit is no more than itself
        return vpp if math.isclose(vpp, most, rel_tol=1e-9) else channel.clip(vpp, least, most)

    def _ask_amplitude(self, channel: Channel, parameters: list[str]) -> str:
        asked = at_most_one(parameters)
        vpp = channel.number("amplitude_vpp")
        if asked:
            low, high = channel.amplitude_limits()
            vpp = limit(asked, low=low, high=high, default=0.1)
        return self.printed(channel.shown(vpp, str(channel["voltage_unit"])))

    def _pulse_rows(self, channel: Channel) -> tuple[Command, ...]:
        source, family = self.headers(channel)[0], self.family
        edge = family.shortest_edge, family.longest_edge

        def duty_limits() -> tuple[float, float]:
            low, high = channel.pulse_limits()
            return 100 * low * channel.number("frequency"), 100 * high * channel.number("frequency")

        def set_duty(value: float) -> None:
            channel["pulse_duty"] = value
            channel["pulse_width"] = value / 100 / channel.number("frequency")

        def set_edges(value: float) -> None:
            channel["pulse_leading"] = channel["pulse_trailing"] = value

        pulse = source + "[FUNCtion:]PULSe:"
        return (
            self.quantity(
                channel,
                pulse + "WIDTh",
                "pulse_width",
                channel.pulse_limits,
                1e-4,
                units=_S,
                get=lambda: channel.number("pulse_width"),
                put=channel.set_width,
            ),
            self.quantity(
                channel,
                pulse + "DCYCle",
                "pulse_duty",
                duty_limits,
                10.0,
                units=_PERCENT,
                get=lambda: channel.number("pulse_duty"),
                put=set_duty,
            ),
            self.quantity(
                channel, pulse + "TRANsition:LEADing", "pulse_leading", lambda: edge, family.first_edge, units=_S
            ),
            self.quantity(
                channel, pulse + "TRANsition:TRAiling", "pulse_trailing", lambda: edge, family.first_edge, units=_S
            ),
            self.quantity(
                channel,
                pulse + "TRANsition[:BOTH]",
                "pulse_leading",
                lambda: edge,
                family.first_edge,
                units=_S,
                get=lambda: channel.number("pulse_leading"),
                put=set_edges,
            ),
        )

    def _burst_rows(self, channel: Channel) -> tuple[Command, ...]:
        source, trigger = self.headers(channel)[0], self.headers(channel)[2]
        prefix, family = channel.prefix, self.family

        def start() -> None:
            channel.trigger()
            self._tell()

        cycles = partial(self.quantity, channel, limits=lambda: (1, family.most_cycles), default=1.0, endless=True)
        return (
            cycles(
                source + "BURSt:NCYCles",
                "burst_cycles",
                put=lambda value: channel.__setitem__("burst_cycles", float(round(value))),
                get=lambda: channel.number("burst_cycles"),
            ),
            self.quantity(
                channel,
                source + "BURSt:INTernal:PERiod",
                "burst_period",
                lambda: (1e-6, family.longest_burst),
                1e-2,
                units=_S,
            ),
            self.quantity(
                channel, source + "SWEep:TIME", "sweep_time", lambda: (1e-3, family.longest_sweep), 1.0, units=_S
            ),
            *self._span_rows(channel, source),
            self.word(f"{trigger}:SOURce", prefix + "trigger_source", self.trigger_sources, "IMM"),
            self.word(f"{trigger}:SLOPe", prefix + "trigger_slope", ("POSitive", "NEGative"), "POS"),
            self.quantity(
                channel, f"{trigger}:DELay", "trigger_delay", lambda: (0, family.longest_delay), 0.0, units=_S
            ),
            Command(f"{trigger}[:IMMediate]", set=does(start)),
        )

    def _span_rows(self, channel: Channel, source: str) -> tuple[Command, ...]:
        """Centre and span of a sweep: its start and stop in other words."""

        def ends() -> tuple[float, float]:
            return channel.number("sweep_start"), channel.number("sweep_stop")

        def set_centre(value: float) -> None:
            half = min((ends()[1] - ends()[0]) / 2, value - 1e-6)
            channel["sweep_start"], channel["sweep_stop"] = value - half, value + half

        def set_span(value: float) -> None:
            centre = sum(ends()) / 2
            channel["sweep_start"], channel["sweep_stop"] = max(centre - value / 2, 1e-6), centre + value / 2

        row = partial(self.quantity, channel, units=_HZ)
        return (
            row(
                source + "FREQuency:CENTer",
                "sweep_start",
                lambda: (1e-6, 30e6),
                550.0,
                get=lambda: sum(ends()) / 2,
                put=set_centre,
            ),
            row(
                source + "FREQuency:SPAN",
                "sweep_start",
                lambda: (-30e6, 30e6),
                900.0,
                get=lambda: ends()[1] - ends()[0],
                put=set_span,
            ),
        )

    def _output_rows(self, channel: Channel) -> tuple[Command, ...]:
        output, prefix = self.headers(channel)[1], channel.prefix
        return (
            self.switch(f"{output}[:STATe]", prefix + "output"),
            self.quantity(
                channel,
                f"{output}:LOAD",
                "load",
                lambda: (1, 1e4),
                50.0,
                units=("", "OHM"),
                endless=True,
                get=lambda: channel.number("load"),
                put=channel.set_load,
            ),
            self.word(f"{output}:POLarity", prefix + "polarity", ("NORMal", "INVerted"), "NORM"),
        )

    def _plain_rows(
        self, channel: Channel, numbers: tuple[Plain, ...], choices: tuple[Choice, ...]
    ) -> tuple[Command, ...]:
        source, prefix = self.headers(channel)[0], channel.prefix
        return (
            *(
                self.quantity(channel, source + header, name, partial(_fixed, low, high), default, units=units)
                for header, name, low, high, default, units in numbers
            ),
            *(self.word(source + header, prefix + name, words, default) for header, name, words, default in choices),
            *(
                self.switch(f"{source}{mode}:STATe", prefix + _short(mode))
                for mode in (self.modes if numbers is _PLAIN else ())
            ),
        )

    def _apply_rows(self, channel: Channel) -> tuple[Command, ...]:
        source = self.headers(channel)[0]
        return (
            Command(source + "APPLy", get=answers(lambda: self._applied(channel))),
            *(
                Command(f"{source}APPLy:{waveform.word}", set=partial(self._apply, channel, waveform))
                for waveform in self.family.waveforms
            ),
        )

    def _apply(self, channel: Channel, waveform: Waveform, parameters: list[str]) -> None:
        """APPLy: a waveform with frequency, amplitude and offset, nothing else, and the output on."""
        if len(parameters) > 3:
            raise ScpiError(-108)
        wanted = dict(zip(("frequency", "amplitude", "offset"), parameters, strict=False))
        for mode in MODES:
            if channel.prefix + mode in self.settings:
                channel[mode] = False
        channel["trigger_source"], channel["waveform"] = "IMM", waveform.short
        frequency = channel.read(wanted.get("frequency", "DEF"), *channel.frequency_limits(), 1e3, _HZ)
        if waveform.short == "PRBS":
            channel["prbs_rate"] = frequency
        else:
            channel.frequency = frequency
        channel["amplitude_vpp"] = self._amplitude(channel, wanted.get("amplitude", "DEF"))
        channel["offset"] = channel.read(wanted.get("offset", "DEF"), *channel.offset_limits(), 0.0, _V)
        channel["output"] = True
        self.changed(channel.prefix + "output")

    def _applied(self, channel: Channel) -> str:
        shown = channel.shown(channel.number("amplitude_vpp"), str(channel["voltage_unit"]))
        numbers = (self.printed(value) for value in (channel.frequency, shown, channel.number("offset")))
        return f'"{channel["waveform"]} {",".join(numbers)}"'

    def _shared(self) -> tuple[Command, ...]:
        """The commands of the whole instrument."""

        def set_text(parameters: list[str]) -> None:
            self.text = one(parameters)[1:-1][:64]

        return (
            Command("ABORt", set=does(self._abort)),
            Command("DISPlay:TEXT[:DATA]", set_text, answers(lambda: f'"{self.text}"')),
            Command("DISPlay:TEXT:CLEar", set=does(lambda: setattr(self, "text", ""))),
            self.switch("DISPlay[:WINDow][:STATe]", "display", default=True),
            self.switch("OUTPut[1|2]:SYNC[:STATe]", "sync", default=True),
            self.switch("OUTPut:TRIGger[:STATe]", "trigger_out"),
            self.word("OUTPut:TRIGger:SLOPe", "trigger_out_slope", ("POSitive", "NEGative"), "POS"),
            self.word("UNIT:ANGLe", "angle_unit", ("DEGree", "RADian", "SECond"), "DEG"),
            self.word("FORMat:BORDer", "byte_order", ("NORMal", "SWAPped"), "NORM"),
            self.switch("SYSTem:BEEPer:STATe", "beeper", default=True),
            self.word("SYSTem:COMMunicate:RLSTate", "remote", ("LOCal", "REMote", "RWLock"), "LOC"),
            Command("STATus:PRESet", set=does(lambda: None)),
            *(
                Command(f"STATus:{register}[:EVENt|:CONDition]", get=answers(lambda: "+0"))
                for register in ("QUEStionable", "OPERation")
            ),
        )

    # --- arbitrary waveforms ---

    def store(self, channel: Channel, name: str, data: list[str], *, dac: bool, full_scale: float) -> None:
        """Keep a waveform that was sent, as numbers or as a block.  Raises ScpiError."""
        order = "<" if self.settings["byte_order"] == "SWAP" else ">"
        least, most = self.family.points
        room = min(most, channel.memory.free)
        kind = order + ("i2" if dac else "f4")
        channel.memory.held[name] = samples(data, full_scale=full_scale, block=kind, least=least, most=room)

    @staticmethod
    def attributes(channel: Channel, header: str) -> tuple[Command, ...]:
        """DATA:ATTRibute: what there is to know of a waveform, by default the one that is selected."""

        def ask(which: str, parameters: list[str]) -> str:
            asked = at_most_one(parameters)
            name = plain_name(asked) if asked else str(channel["arb"])
            values = channel.memory.held.get(name, channel.library.get(name, channel.samples if not asked else None))
            if values is None:
                raise Refused(785, "Specified arb waveform does not exist")
            told = attribute(values, which)
            return f"{told:+.0f}" if which == "POIN" else nr3(told)

        words = ("AVERage", "CFACtor", "POINts", "PTPeak")
        return tuple(
            Command(f"{header}:ATTRibute:{word}", get=partial(ask, "".join(c for c in word if not c.islower())))
            for word in words
        )


def _fixed(low: float, high: float) -> tuple[float, float]:
    """Limits that depend on nothing."""
    return low, high


def _short(mode: str) -> str:
    """The name of a mode's setting: FSKey → fsk."""
    return {"BURSt": "burst", "SWEep": "sweep", "FSKey": "fsk"}.get(mode, mode.lower())


def _square_33500(frequency: float) -> tuple[float, float]:
    """0.01 to 99.99 %, and no pulse shorter than 16 ns."""
    least = max(0.01, 100 * 16e-9 * frequency)
    return least, 100 - least


_FOLDER = "INT:\\BUILTIN\\"
_FIRST_ARB = _FOLDER + "EXP_RISE.ARB"


class Virtual33500B(VirtualGenerator):
    """A 33522B: two channels, 30 MHz, 250 MSa/s.  The coil hangs on channel 1.

    Source: Keysight 33500 Series Operating and Service Guide.
    """

    identity = "Agilent Technologies,33522B,VIRTUAL,4.00-levilab"
    outputs = 2
    trigger_sources = ("IMMediate", "EXTernal", "TIMer", "BUS")
    modes = (*_SWITCHES, "BPSK", "SUM")
    family = Family(
        waveforms=(
            Waveform("SINusoid", 30e6, crest=2 * math.sqrt(2)),
            Waveform("SQUare", 30e6),
            Waveform("TRIangle", 200e3, crest=2 * math.sqrt(3)),
            Waveform("RAMP", 200e3, crest=2 * math.sqrt(3)),
            Waveform("PULSe", 30e6),
            Waveform("PRBS", 50e6, bottom=1e-3, sweeps=False),
            Waveform("NOISe", 30e6, crest=6.6, sweeps=False),  # crest factor 3.3 is the model's, not the manual's
            Waveform("ARB", 250e6, sweeps=False),
            Waveform("DC", 30e6, bursts=False, sweeps=False),
        ),
        square=_square_33500,
        arb="ARB",
        least_vpp=1e-3,
        shortest_pulse=16e-9,
        shortest_edge=8.4e-9,
        longest_edge=1e-6,
        first_edge=10e-9,
        longest_period=1e6,
        most_cycles=100e6,
        longest_burst=8000.0,
        burst_rest=1e-6,
        longest_delay=1000.0,
        longest_sweep=250e3,
        points=(8, 1_000_000),
        room=1_000_000,
    )

    def arbitrary_rows(self, channel: Channel) -> tuple[Command, ...]:
        """Arbitrary waveforms, each channel's own, and what else only this family has."""
        source, output, trigger = self.headers(channel)
        prefix, arb = channel.prefix, source + "FUNCtion:ARBitrary"
        self._defaults[prefix + "arb"] = _FIRST_ARB
        channel.memory.held[_FIRST_ARB] = channel.library["EXP_RISE"]

        def rate_limits() -> tuple[float, float]:
            return 1e-6, 62.5e6 if channel["arb_filter"] == "OFF" else 250e6

        def per_sample(value: float) -> None:
            channel["arb_rate"] = value * channel.points

        rate = partial(self.quantity, channel, name="arb_rate")
        return (
            Command(arb, partial(self._select, channel), answers(lambda: f'"{channel["arb"]}"')),
            rate(pattern=arb + ":SRATe", limits=rate_limits, default=40e3, units=("", "SA/S")),
            rate(
                pattern=arb + ":FREQuency",
                limits=lambda: (1e-6, 250e6 / channel.points),
                default=160.0,
                units=_HZ,
                get=lambda: channel.number("arb_rate") / channel.points,
                put=per_sample,
            ),
            rate(
                pattern=arb + ":PERiod",
                limits=lambda: (channel.points / 250e6, 1e6),
                default=6.25e-3,
                units=_S,
                get=lambda: channel.points / channel.number("arb_rate"),
                put=lambda value: per_sample(1 / value),
            ),
            Command(arb + ":POINts", get=answers(lambda: f"{channel.points:+d}")),
            self.quantity(
                channel,
                arb + ":PTPeak",
                "amplitude_vpp",
                channel.amplitude_limits,
                0.1,
                units=_V,
                get=lambda: channel.number("amplitude_vpp"),
                put=lambda value: channel.__setitem__("amplitude_vpp", value),
            ),
            self.quantity(channel, source + "FUNCtion:PRBS:BRATe", "prbs_rate", lambda: (1e-3, 50e6), 1e3, units=_HZ),
            *self._plain_rows(channel, _PLAIN_33500, _CHOICES_33500),
            *self._memory_rows(channel, source + "DATA"),
            Command("[SOURce[1|2]:]PHASe:SYNChronize", set=does(lambda: None)),
            Command(f"INITiate[{channel.index}][:IMMediate][:ALL]", set=does(lambda: None)),
            self.switch(f"INITiate{_suffix(channel)}:CONTinuous", prefix + "continuous", default=True),
            self.switch(source + "AM:DSSC", prefix + "am_dssc"),
            self._list_row(channel, source + "LIST:FREQuency"),
            self.word(f"{output}:MODE", prefix + "output_mode", ("NORMal", "GATed"), "NORM"),
            self.word(f"{output}:SYNC:MODE", prefix + "sync_mode", ("NORMal", "CARRier", "MARKer"), "NORM"),
            self.word(f"{output}:SYNC:POLarity", prefix + "sync_polarity", ("NORMal", "INVerted"), "NORM"),
            self.quantity(channel, f"{trigger}:COUNt", "trigger_count", lambda: (1, 1e6), 1.0),
            self.quantity(channel, f"{trigger}:TIMer", "trigger_timer", lambda: (1e-6, 8000), 1.0, units=_S),
            self.quantity(channel, f"{trigger}:LEVel", "trigger_level", lambda: (0.9, 3.8), 3.3, units=_V),
        )

    def _list_row(self, channel: Channel, pattern: str) -> Command:
        """The frequencies of a list sweep, which this model only keeps."""
        key = channel.prefix + "list"
        self._defaults[key] = "1e2,1e3,5.5e2"

        def keep(parameters: list[str]) -> None:
            if not 1 <= len(parameters) <= 128:
                raise ScpiError(-109 if not parameters else -108)
            low, high = channel.frequency_limits()
            self.settings[key] = ",".join(str(channel.read(text, low, high, 1e3, _HZ)) for text in parameters)

        def tell() -> str:
            numbers = (f"{float(text):+.8E}" for text in str(self.settings[key]).split(","))
            # three digits of exponent, as the instrument prints its lists
            return ",".join(f"{number[:-2]}0{number[-2:]}" for number in numbers)

        return Command(pattern, keep, answers(tell))

    def _shared(self) -> tuple[Command, ...]:
        return (
            *super()._shared(),
            self.word("OUTPut[1|2]:SYNC:SOURce", "sync_source", ("CH1", "CH2"), "CH1"),
            self.word("OUTPut:TRIGger:SOURce", "trigger_out_source", ("CH1", "CH2"), "CH1"),
            self.word("ROSCillator:SOURce", "clock_source", ("INTernal", "EXTernal"), "INT"),
            self.word("ROSCillator:SOURce:AUTO", "clock_automatic", ("ON", "OFF"), "ON"),
            self.word("UNIT:ARBitrary:ANGLe", "arb_angle_unit", ("DEGree", "RADian", "SECond", "SAMPle"), "DEG"),
        )

    def _memory_rows(self, channel: Channel, data: str) -> tuple[Command, ...]:
        def keep(parameters: list[str], *, dac: bool) -> None:
            if len(parameters) < 2:
                raise ScpiError(-109)
            name = plain_name(parameters[0])
            if name in channel.memory.held:
                raise Refused(786, "Specified arb waveform already exists")
            self.store(channel, name, parameters[1:], dac=dac, full_scale=32767.0 if dac else 1.0)

        def clear() -> None:
            channel["arb"] = _FIRST_ARB
            channel.memory.held = {_FIRST_ARB: channel.library["EXP_RISE"]}
            self.changed(channel.prefix + "arb")

        def load(parameters: list[str]) -> None:
            name = plain_name(one(parameters))
            values = channel.library.get(name.removeprefix(_FOLDER).removesuffix(".ARB"))
            if values is None or not name.startswith(_FOLDER):
                raise Refused(-256, "File name not found")
            channel.memory.held[name] = values

        memory = channel.memory
        return (
            Command(data + ":ARBitrary[1]", partial(keep, dac=False)),
            Command(data + ":ARBitrary[1]:DAC", partial(keep, dac=True)),
            Command(data + ":VOLatile:CATalog", get=answers(memory.names)),
            Command(data + ":VOLatile:FREE", get=answers(lambda: f"{memory.free:+d}")),
            Command(data + ":VOLatile:CLEar", set=does(clear)),
            *self.attributes(channel, data),
            Command(f"MMEMory:LOAD:DATA{_suffix(channel)}", load),
        )

    def _select(self, channel: Channel, parameters: list[str]) -> None:
        name = plain_name(one(parameters))
        if name not in channel.memory.held:
            raise Refused(785, "Specified arb waveform does not exist")
        channel["arb"] = name
        self.changed(channel.prefix + "arb")


def _suffix(channel: Channel) -> str:
    return "[1]" if channel.index == 1 else str(channel.index)

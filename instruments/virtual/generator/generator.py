"""Virtual function generators: a listener gets what they put out.  Both families share this."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from instruments.virtual.core.device import VirtualInstrument, answers, does
from instruments.virtual.core.parameters import at_most_one, choice, limit, nr3, one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.generator.arbitrary import Refused, attribute, plain_name, samples
from instruments.virtual.generator.channel import INFINITE, Channel, Output, quantity_of
from instruments.virtual.generator.couplings import MODES, settle
from instruments.virtual.generator.family import HZ, PERCENT, S, V

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.clock import Clock
    from instruments.virtual.generator.family import Family, Waveform

_LEVEL = "VOLTage[:LEVel][:IMMediate]"


class VirtualGenerator(VirtualInstrument):
    """Bytes in, a signal out; the commands that both families have.

    listener: called with the time [s] and the new Output of channel 1 at each change, and beforehand with the end of
    a burst that is under way: a later change replaces what was announced for the time after it.
    """

    family: ClassVar[Family]
    outputs: ClassVar[int] = 1
    trigger_sources: ClassVar[tuple[str, ...]] = ("IMMediate", "EXTernal", "BUS")

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
        settle(channel, plain)
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

    # --- the rows of a channel ---

    @staticmethod
    def printed(value: float) -> str:
        """A number as it is answered."""
        return nr3(value)

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

    @staticmethod
    def headers(channel: Channel) -> tuple[str, str, str]:
        """How this channel's headers begin: of the source, the output, the trigger."""
        if channel.index == 1:
            return "[SOURce[1]:]", "OUTPut[1]", "TRIGger[1]"
        return f"SOURce{channel.index}:", f"OUTPut{channel.index}", f"TRIGger{channel.index}"

    def _channel_rows(self, channel: Channel) -> tuple[Command, ...]:
        return (
            *self._plain_rows(channel),
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

    def _plain_rows(self, channel: Channel) -> tuple[Command, ...]:
        """The settings on which nothing else depends, as far as the model goes."""
        source, prefix, family = self.headers(channel)[0], channel.prefix, self.family

        return (
            *(
                self.quantity(channel, source + header, name, partial(_fixed, low, high), default, units=units)
                for header, name, low, high, default, units in family.plain
            ),
            *(
                self.word(source + header, prefix + name, words, default)
                for header, name, words, default in family.choices
            ),
            *(self.switch(f"{source}{mode}:STATe", prefix + _setting_of(mode)) for mode in family.modes),
        )

    def _signal_rows(self, channel: Channel) -> tuple[Command, ...]:
        """Waveform, frequency, phase, duty cycle, symmetry."""
        source, prefix = self.headers(channel)[0], channel.prefix
        words = tuple(waveform.word for waveform in self.family.waveforms)

        def set_frequency(value: float) -> None:
            channel.frequency = value

        def set_period(value: float) -> None:
            channel["frequency"] = 1 / value

        shortest = 1 / self.family.waveform("PULS").top
        period = partial(self.quantity, channel, name="frequency", default=1e-3, units=S)
        return (
            self.word(source + "FUNCtion[:SHAPe]", prefix + "waveform", words, "SIN"),
            self.quantity(
                channel,
                source + "FREQuency[:CW|:FIXed]",
                "frequency",
                channel.frequency_limits,
                1e3,
                units=HZ,
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
                units=PERCENT,
            ),
            self.quantity(
                channel, source + "FUNCtion:RAMP:SYMMetry", "symmetry", lambda: (0, 100), 100.0, units=PERCENT
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
        """Amplitude and offset, or high and low, and their unit."""
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
                units=V,
                get=lambda: channel.level(which),
                put=lambda value: channel.set_level(which, value),
            )

        return (
            Command(f"{source}{_LEVEL}[:AMPLitude]", set_amplitude, partial(self._ask_amplitude, channel)),
            Command(source + "VOLTage:UNIT", set_unit, answers(lambda: str(channel["voltage_unit"]))),
            self.quantity(channel, f"{source}{_LEVEL}:OFFSet", "offset", channel.offset_limits, 0.0, units=V),
            level("high"),
            level("low"),
            self.switch(source + "VOLTage:LIMit:STATe", prefix + "limits_on"),
            self.quantity(channel, source + "VOLTage:LIMit:HIGH", "limit_high", lambda: (-10, 10), 5.0, units=V),
            self.quantity(channel, source + "VOLTage:LIMit:LOW", "limit_low", lambda: (-10, 10), -5.0, units=V),
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
        """Width, duty cycle and edges of pulses."""
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
                units=S,
                get=lambda: channel.number("pulse_width"),
                put=channel.set_width,
            ),
            self.quantity(
                channel,
                pulse + "DCYCle",
                "pulse_duty",
                duty_limits,
                10.0,
                units=PERCENT,
                get=lambda: channel.number("pulse_duty"),
                put=set_duty,
            ),
            self.quantity(
                channel, pulse + "TRANsition:LEADing", "pulse_leading", lambda: edge, family.first_edge, units=S
            ),
            self.quantity(
                channel, pulse + "TRANsition:TRAiling", "pulse_trailing", lambda: edge, family.first_edge, units=S
            ),
            self.quantity(
                channel,
                pulse + "TRANsition[:BOTH]",
                "pulse_leading",
                lambda: edge,
                family.first_edge,
                units=S,
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
                units=S,
            ),
            self.quantity(
                channel, source + "SWEep:TIME", "sweep_time", lambda: (1e-3, family.longest_sweep), 1.0, units=S
            ),
            *self._span_rows(channel, source),
            self.word(f"{trigger}:SOURce", prefix + "trigger_source", self.trigger_sources, "IMM"),
            self.word(f"{trigger}:SLOPe", prefix + "trigger_slope", ("POSitive", "NEGative"), "POS"),
            self.quantity(
                channel, f"{trigger}:DELay", "trigger_delay", lambda: (0, family.longest_delay), 0.0, units=S
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

        row = partial(self.quantity, channel, units=HZ)
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
        frequency = channel.read(wanted.get("frequency", "DEF"), *channel.frequency_limits(), 1e3, HZ)
        if waveform.short == "PRBS":
            channel["prbs_rate"] = frequency
        else:
            channel.frequency = frequency
        channel["amplitude_vpp"] = self._amplitude(channel, wanted.get("amplitude", "DEF"))
        channel["offset"] = channel.read(wanted.get("offset", "DEF"), *channel.offset_limits(), 0.0, V)
        channel["output"] = True
        self.changed(channel.prefix + "output")

    def _applied(self, channel: Channel) -> str:
        shown = channel.shown(channel.number("amplitude_vpp"), str(channel["voltage_unit"]))
        numbers = (self.printed(value) for value in (channel.frequency, shown, channel.number("offset")))
        return f'"{channel["waveform"]} {",".join(numbers)}"'

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
        """DATA:ATTRibute: the properties of a waveform, by default the one that is selected."""

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


def _setting_of(mode: str) -> str:
    """The name of a mode's setting: FSKey → fsk."""
    return {"BURSt": "burst", "SWEep": "sweep", "FSKey": "fsk"}.get(mode, mode.lower())

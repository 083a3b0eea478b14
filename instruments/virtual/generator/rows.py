"""Rows of a virtual generator's table: numbers with their limits, waveform, frequency, voltages, pulses."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from instruments.virtual.core.device import VirtualInstrument, answers, does
from instruments.virtual.core.parameters import at_most_one, choice, limit, nr3, one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.generator.settings import INFINITE, quantity_of
from instruments.virtual.generator.tables import HZ, PERCENT, PLAIN, S, V, fixed, short

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.generator.channel import Channel
    from instruments.virtual.generator.family import Family
    from instruments.virtual.generator.tables import Choice, Plain

_LEVEL = "VOLTage[:LEVel][:IMMediate]"


class GeneratorRows(VirtualInstrument):
    """What both families have for the signal of a channel.  family: its limits; modes: of which only one can be on."""

    family: ClassVar[Family]
    modes: ClassVar[tuple[str, ...]]

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

    def signal_rows(self, channel: Channel) -> tuple[Command, ...]:
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

    def voltage_rows(self, channel: Channel) -> tuple[Command, ...]:
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
            channel["amplitude_vpp"] = self.amplitude(channel, one(parameters))
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
    def amplitude(channel: Channel, text: str) -> float:
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

    def pulse_rows(self, channel: Channel) -> tuple[Command, ...]:
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

    def plain_rows(
        self, channel: Channel, numbers: tuple[Plain, ...], choices: tuple[Choice, ...]
    ) -> tuple[Command, ...]:
        """What nothing else depends on, as far as the model goes."""
        source, prefix = self.headers(channel)[0], channel.prefix
        return (
            *(
                self.quantity(channel, source + header, name, partial(fixed, low, high), default, units=units)
                for header, name, low, high, default, units in numbers
            ),
            *(self.word(source + header, prefix + name, words, default) for header, name, words, default in choices),
            *(
                self.switch(f"{source}{mode}:STATe", prefix + short(mode))
                for mode in (self.modes if numbers is PLAIN else ())
            ),
        )

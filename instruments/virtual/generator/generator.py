"""Virtual function generators: what both families share.  A listener gets their output."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from instruments.clock import Clock
from instruments.virtual.core.device import VirtualInstrument
from instruments.virtual.core.parameters import choice, limit, optional_parameter, parameter, read_quoted
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.generator.channel import INFINITE, Channel, Family, Output, quantity_of
from instruments.virtual.generator.couplings import MODES, resolve

#: How many characters of a text the display shows.
_LONGEST_TEXT = 64


class VirtualGenerator(VirtualInstrument):
    """A generator: bytes in, a signal out.

    Args:
        clock: of the bench.
        listener: called at each change with its time [s] and the new Output of channel 1.  The end of a triggered burst
            is announced when the burst begins; a later change replaces what was announced for the time after it.
        family: of another model than that of the class.
        model: identity, numbered, lacks; see the base.
    """

    family: Family
    numbered: Sequence[int] = (1,)

    def __init__(
        self,
        clock: Clock,
        *,
        listener: Callable[[float, Output], None] | None = None,
        family: Family | None = None,
        **model: Any,
    ) -> None:
        super().__init__(clock, **model)
        self._listener, self.family = listener, family or self.family
        self._text = ""
        self.channels = tuple(
            Channel(self.family, self.settings, index=n, report=self.parser.report, now=clock.now)
            for n in self.numbered
        )

    def channel(self, n: int) -> Channel:
        """Return the channel of this number."""
        return self.channels[n - 1]

    # --- what happens ---

    def on_change(self, name: str) -> None:
        """Make the other settings fit, and pass what stands at the terminals now to the listener."""
        number, _, plain = name.rpartition(":")
        channel = self.channel(int(number or 1))
        resolve(channel, plain)
        if channel.index == 1:
            self._notify()

    def _notify(self) -> None:
        if not self._listener:
            return
        now = self.clock.now()
        self._listener(now, self.signal())
        for instant in self.channels[0].under_way:
            if now < instant < math.inf:
                self._listener(instant, self.channels[0].signal(instant))

    def signal(self, channel: int = 1) -> Output:
        """Return the signal at the terminals of a channel."""
        return self.channel(channel).signal(self.clock.now())

    def reset(self) -> None:
        """Go to the state after ``*RST``: all outputs off."""
        for channel in self.channels:
            channel.stop()
        self.settings |= self.commands.defaults
        for channel in self.channels:
            self.on_change(channel.prefix + "output")

    def trigger(self) -> None:
        """``*TRG``: starts what waits for it."""
        waiting = [channel for channel in self.channels if channel.waits and channel["trigger_source"] == "BUS"]
        if not waiting:
            raise ScpiError(-211)
        for channel in waiting:
            channel.trigger()
        self._notify()

    def start(self, n: int) -> None:
        """TRIGger: a trigger for one channel."""
        self.channel(n).trigger()
        self._notify()

    def abort(self) -> None:
        """ABORt: what is under way ends."""
        for channel in self.channels:
            channel.stop()
        self._ready = min(self._ready, self.clock.now() + self.pace)
        self._notify()

    def wait(self) -> None:
        """``*WAI``: the next answer comes when no triggered burst or sweep is under way any more."""
        self.busy_until(max(channel.under_way[1] for channel in self.channels))

    def completion(self) -> str:
        """``*OPC?``: answered when no triggered burst or sweep is under way any more."""
        self.wait()
        return "1"

    # --- the display ---

    def set_text(self, parameters: list[str]) -> None:
        """DISPlay:TEXT: a string in quotes.  Raises ScpiError."""
        self._text = read_quoted(parameters)[:_LONGEST_TEXT]

    def text(self) -> str:
        """DISPlay:TEXT?: in quotes."""
        return '"{}"'.format(self._text.replace('"', '""'))

    def clear_text(self) -> None:
        """DISPlay:TEXT:CLEar: none."""
        self._text = ""

    # --- voltages ---

    def set_voltage_unit(self, n: int, parameters: list[str]) -> None:
        """VOLTage:UNIT: there is no dBm without a load.  Raises ScpiError."""
        channel = self.channel(n)
        unit = choice(parameter(parameters), ("VPP", "VRMS", "DBM"))
        if unit == "DBM" and channel.number("load") >= INFINITE:
            channel.conflict("amplitude units changed to Vpp due to high-Z load")
            unit = "VPP"
        channel["voltage_unit"] = unit
        self.on_change(channel.prefix + "voltage_unit")

    def set_amplitude(self, n: int, parameters: list[str]) -> None:
        """VOLTage: with a unit or in the one that is set.  Raises ScpiError."""
        channel = self.channel(n)
        channel["amplitude_vpp"] = self._amplitude(channel, parameter(parameters))
        self.on_change(channel.prefix + "amplitude_vpp")

    @staticmethod
    def _amplitude(channel: Channel, text: str) -> float:
        """Return the peak-to-peak voltage of an amplitude that was sent, in its unit or the one that is set [V]."""
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
        vpp = channel.to_vpp(value, meant)
        # a limit that was asked for in another unit is no more than itself
        return vpp if math.isclose(vpp, most, rel_tol=1e-9) else channel.clip(vpp, least, most)

    def amplitude(self, n: int, parameters: list[str]) -> str:
        """VOLTage?: or a limit of it, in the unit that is set.  Raises ScpiError."""
        channel = self.channel(n)
        vpp = channel.number("amplitude_vpp")
        if asked := optional_parameter(parameters):
            low, high = channel.amplitude_limits()
            vpp = limit(asked, low=low, high=high, default=0.1)
        return self.spell(channel.from_vpp(vpp, str(channel["voltage_unit"])))

    # --- a signal in one command ---

    def apply(self, n: int, waveform: str, parameters: list[str]) -> None:
        """APPLy: a waveform with frequency, amplitude and offset, nothing else, and the output on.  Raises ScpiError.

        waveform: its short name.
        """
        if len(parameters) > 3:
            raise ScpiError(-108)
        channel = self.channel(n)
        wanted = dict(zip(("frequency", "amplitude", "offset"), parameters, strict=False))
        with self.all_or_none():
            for mode in MODES:
                channel[mode] = False
            source = self.commands.defaults[f"{channel.prefix}trigger_source"]
            channel["trigger_source"], channel["waveform"] = source, waveform
            frequency = channel.read(wanted.get("frequency", "DEF"), *channel.frequency_limits(), 1e3, "HZ")
            if waveform == "PRBS":
                channel["prbs_rate"] = frequency
            else:
                channel.set_frequency(frequency)
            channel["amplitude_vpp"] = self._amplitude(channel, wanted.get("amplitude", "DEF"))
            channel["offset"] = channel.read(wanted.get("offset", "DEF"), *channel.offset_limits(), 0.0, "V")
        channel["output"] = True
        self.on_change(channel.prefix + "output")

    def ask_apply(self, n: int) -> str:
        """APPLy?: waveform, frequency, amplitude, offset."""
        channel = self.channel(n)
        shown = channel.from_vpp(channel.number("amplitude_vpp"), str(channel["voltage_unit"]))
        numbers = (self.spell(value) for value in (channel.frequency, shown, channel.number("offset")))
        return f'"{channel["waveform"]} {",".join(numbers)}"'

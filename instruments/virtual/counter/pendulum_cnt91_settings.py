"""The settings of a virtual CNT-91: inputs, arming, and what stands by itself.  Sources: see its class."""

from __future__ import annotations

from typing import TYPE_CHECKING

from instruments.ieee488 import INFINITY
from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import at_most_one, choice, limit, none, number, one
from instruments.virtual.core.parser import Command
from instruments.virtual.counter.counter import VirtualCounter
from instruments.virtual.counter.edges import Input

if TYPE_CHECKING:
    from collections.abc import Callable

#: Schmitt trigger at a fixed level [V] (CNT-90 series data sheet: sensitivity 15 mV r.m.s.); ten times that behind
#: the attenuator.
_HYSTERESIS = 0.04
#: Automatic level: the signal must repeat this often [Hz] (user manual of the series, 3: 100 Hz unless changed in its
#: menu), and for frequency the trigger fires at 70 % and is armed at 30 % of peak to peak (handbook, 8-49).
_SLOWEST, _UPPER, _LOWER = 100.0, 0.7, 0.3


def number_text(value: float) -> str:
    """A number as this instrument prints it: fourteen digits.

    >>> number_text(2e-8), number_text(9.91e37)
    ('+2.0000000000000E-08', '+9.9100000000000E+37')
    """
    return f"{value:+.13E}"


class SettingsCNT91(VirtualCounter):
    """Rows for settings, and how the inputs look at their signals with them."""

    # --- tables ---

    def _input(self, channel: int, suffix: str) -> tuple[Command, ...]:
        head, name = f"INPut{suffix}:", str(channel)
        return (
            self.word(head + "COUPling", "coupling" + name, ("AC", "DC"), "AC"),
            self._number(head + "IMPedance", "impedance" + name, low=50, high=1e6, default=1e6, unit="OHM"),
            self.integer(head + "ATTenuation", "attenuation" + name, low=1, high=10, default=1),
            self.toggle(head + "FILTer[:LPASs][:STATe]", "filter" + name),
            self.toggle(head + "FILTer:DIGital", "digital_filter" + name),
            self._number(head + "FILTer:DIGital:FREQuency", "cutoff" + name, low=1, high=5e7, default=1e5, unit="HZ"),
            self.word(head + "SLOPe", "slope" + name, ("POSitive", "NEGative"), "POS"),
            self.automatic(head + "LEVel:AUTO", channel),
            self.level(head + "LEVel", channel, lambda: 5.0 * self._attenuation(channel), number_text),
            self._number(head + "LEVel:RELative", "relative" + name, low=0, high=100, default=70),
        )

    def _arming(self) -> tuple[Command, ...]:
        start = "ARM[:SEQuence[1]][:STARt][:LAYer[1]]:"
        sources = ("IMMediate", "BUS", "EXT1", "EXT2", "EXT4")
        return (
            self._count(start + "COUNt", "armings"),
            self.word(start + "SOURce", "arming", sources, "IMM"),
            self.word(start + "SLOPe", "arming_slope", ("POSitive", "NEGative"), "POS"),
            self._number(start + "DELay", "arming_delay", low=0, high=2, default=0, unit="S"),
            self.word("ARM[:SEQuence[1]][:STARt]:LAYer2:SOURce", "bus_arming", ("IMMediate", "BUS"), "IMM"),
            Command("ARM[:SEQuence[1]][:STARt]:LAYer2[:IMMediate]", set=does(self.trigger)),
            self.word("ARM:STOP:SOURce", "stop_arming", (*sources, "TIMer"), "IMM"),
            self._count("TRIGger[:STARt]:COUNt", "triggers"),
            self.word("TRIGger[:STARt]:SOURce", "trigger_source", ("IMMediate", "TIMer"), "IMM"),
            self._number("TRIGger[:STARt]:TIMer", "trigger_timer", low=2e-6, high=500, default=0.02, unit="S"),
        )

    def _system(self) -> tuple[Command, ...]:
        return (
            self.toggle("SYSTem:TOUT[:STATe]", "timeout_on"),
            self._number("SYSTem:TOUT:TIME", "timeout", low=0.01, high=1000, default=0.1, unit="S"),
            self.toggle("SYSTem:SDETect", "signal_detection"),
            self.toggle("SYSTem:TALKonly", "talk_only"),
            Command("SYSTem:PRESet", set=does(self.reset)),
            Command("STATus:OPERation:CONDition", get=answers(lambda: str(0 if self.idle(self._ready) else 16))),
            Command("STATus:OPERation[:EVENt]", get=answers(lambda: "0")),
            Command("STATus:QUEStionable[:EVENt]", get=answers(lambda: "0")),
            Command("STATus:QUEStionable:CONDition", get=answers(lambda: "0")),
            Command("STATus:PRESet", set=none),
            self.toggle("DISPlay:ENABle", "display", default=True),
            self.toggle("CALibration:INTerpolator:AUTO", "calibrating", default=True),
            Command("AUTO", set=self._auto_set),
            Command("*OPT", get=answers(lambda: "0")),
        )

    def _number(self, pattern: str, name: str, *, low: float, high: float, default: float, unit: str = "") -> Command:
        """A row for a number, printed as this instrument does."""
        self._defaults[name] = default

        def ask(parameters: list[str]) -> str:
            asked = at_most_one(parameters)
            return number_text(limit(asked, low=low, high=high, default=default) if asked else self._value(name))

        read: Callable[[str], float] = lambda text: number(text, low=low, high=high, default=default, unit=unit)  # noqa: E731
        return Command(pattern, self._setter(name, read), ask)

    def _count(self, pattern: str, name: str) -> Command:
        """A row for a count that may be endless."""
        row = self.integer(pattern, name, low=1, high=2**31 - 1, default=1)
        plain = row.set

        def set_(parameters: list[str]) -> None:
            if [word.upper() for word in parameters] in (["INF"], ["INFINITY"]):
                self.settings[name] = INFINITY
                self.changed(name)
            elif plain:
                plain(parameters)

        return Command(pattern, set_, row.get)

    @staticmethod
    def spell_integer(value: float) -> str:
        """No plus sign, and infinity as a number."""
        return number_text(value) if value >= INFINITY else str(round(value))

    def _value(self, name: str) -> float:
        return float(self.settings[name])

    # --- inputs ---

    def _auto_set(self, parameters: list[str]) -> None:
        """AUTO ONCE, the AUTOSET key: levels are found by the counter."""
        choice(one(parameters), ("ONCE", "PRESet"))
        self.settings |= {"automatic1": True, "automatic2": True}

    def _attenuation(self, channel: int) -> float:
        return self._value(f"attenuation{channel}")

    def entry(self, channel: int, *, falling: bool) -> Input:
        """See the base.  Back to back, and for times, an automatic level is one level with a narrow hysteresis."""
        wide = self._function in {"FREQ", "PER"}
        return Input(
            level=None if self.settings[f"automatic{channel}"] else self._value(f"level{channel}"),
            hysteresis=_HYSTERESIS * self._attenuation(channel),
            window=1 / _SLOWEST,
            upper=_UPPER if wide else 0.5,
            lower=_LOWER if wide else 0.5,
            alternating=self.settings[f"coupling{channel}"] == "AC",
            falling=falling,
        )

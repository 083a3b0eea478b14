"""The base of the virtual oscilloscopes: their setup, and the answers about their record.

Acquiring is a matter of its own, see acquisition.py; the record is in record.py.
"""

import math
import re
from collections.abc import Callable, Mapping
from functools import partial
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock
from instruments.virtual.core.device import VirtualInstrument
from instruments.virtual.core.parameters import block_content, block_text, choice, parameter
from instruments.virtual.core.parser import ScpiError, Value
from instruments.virtual.core.rows import Both, short_header
from instruments.virtual.core.signal import Signal, crossings, no_signal
from instruments.virtual.oscilloscope.acquisition import LOOK_AHEAD, Acquisition, Plan
from instruments.virtual.oscilloscope.measure import Measured, measure
from instruments.virtual.oscilloscope.record import COARSEST, Edge, Input, Record
from instruments.virtual.oscilloscope.screenshot import draw, grey, picture_file

#: Below the level by this part of a division the trigger is armed again.
_HYSTERESIS = 0.3
_CHANNEL = re.compile(r"C(?:H(?:AN)?)?([1-8])")
#: How the words of the trigger slope are meant.
_SLOPES: dict[str, tuple[float, ...]] = {
    "POS": (1.0,),
    "NEG": (-1.0,),
    "RIS": (1.0,),
    "FALL": (-1.0,),
    "RFAL": (1.0, -1.0),
    "EITH": (1.0, -1.0),
    "ALT": (1.0, -1.0),
    "WINDOW": (1.0, -1.0),
}


class VirtualOscilloscope(VirtualInstrument):
    """A digital oscilloscope of eight bits; a subclass gives the commands and how codes and records are scaled.

    signals: the voltage at each input, by channel; an input without one is open, 0 V.

    Each setting that has a row is part of the setup, which can be kept and restored.
    """

    lenient = True
    #: Divisions of the screen from left to right.
    columns: ClassVar[int]
    #: What a code cannot go beyond.
    lowest: ClassVar[int]
    highest: ClassVar[int] = 255
    #: Codes of a division, and the one in the middle of the screen.
    codes_per_division: ClassVar[float] = 25.0
    middle: ClassVar[int] = 128
    #: Whether the old record can be read until a single one is complete.
    keeps_old: ClassVar[bool] = False
    #: Bytes per second of a long answer (assumed), and digits of the length in a block's head.
    transfer: ClassVar[float] = 1e6
    digits: ClassVar[int]
    #: What a measurement is answered with that the trace does not show.
    no_measurement: ClassVar[float] = 9.9e37

    #: The word for a channel, before its number.
    channel_word: ClassVar[str] = "CHANnel"

    def __init__(
        self, clock: Clock, *, signals: Mapping[int, Signal], channels: int = 4, identity: str | None = None
    ) -> None:
        self.channels = range(1, channels + 1)
        self._signals = signals
        self.acquisition = Acquisition(self._plan, keeps_old=self.keeps_old, switched_on=clock.now())
        self._restoring = False
        super().__init__(clock, identity=identity, numbered=self.channels)

    # --- what a subclass says of its numbers and its scaling ---

    def spell(self, value: float) -> str:
        """Return a number as this maker prints it."""
        raise NotImplementedError

    def full_scale(self) -> tuple[float, int]:
        """Return samples per second and points of the record that would be taken now."""
        raise NotImplementedError

    def screen(self) -> tuple[float, float]:
        """Return the beginning of the screen [s from the trigger] and its length [s]."""
        raise NotImplementedError

    def scaling(self, channel: int) -> tuple[float, int]:
        """Return volts per code and the code of 0 V, which may lie beyond the converter.

        The offset lifts the trace by whole codes.
        """
        volts_per_code = self.division(channel) / self.codes_per_division
        return volts_per_code, self.middle - round(self.centre(channel) / volts_per_code)

    def centre(self, channel: int) -> float:
        """Return the voltage in the middle of the screen [V]."""
        return -self.value(f"chan{channel}_offset")

    def fit(self, channel: int, middle: float, division: float) -> None:
        """Show this voltage in the middle of the screen, with this scale [V per division]."""
        self.settings |= {f"chan{channel}_scale": division, f"chan{channel}_offset": -middle}

    # --- settings ---

    def level_name(self, channel: int) -> str:
        """Return the setting that holds the trigger level of a channel."""
        return "trigger_level"

    def channel_words(self) -> str:
        """Return the words for the channels."""
        return " ".join(f"{self.channel_word}{n}" for n in self.channels)

    def slope_name(self, channel: int) -> str:
        """Return the setting that holds the trigger slope of a channel."""
        return "trigger_slope"

    def division(self, channel: int) -> float:
        """Return the volts per division."""
        return self.value(f"chan{channel}_scale")

    def probe(self, channel: int) -> float:
        """Return the factor by which the voltage at the probe's tip exceeds that at the input."""
        return self.value(f"chan{channel}_probe")

    def visible_channels(self) -> list[int]:
        """Return the channels that are on."""
        return [n for n in self.channels if self.settings[f"chan{n}_display"]]

    def source_channel(self) -> int | None:
        """Return the channel that triggers, None where it is something else."""
        found = _CHANNEL.fullmatch(str(self.settings["trigger_source"]))
        return int(found[1]) if found else None

    def channel_of(self, text: str) -> int:
        """Return the channel of ``CHAN1`` or ``CHANnel1``.  Raises ScpiError."""
        return int(choice(text, tuple(self.channel_words().split()))[-1])

    # --- when a setting changes ---

    def on_change(self, name: str) -> None:
        """Begin the acquisition again, as a setting has changed."""
        self.on_number_change(name, 0.0)

    def on_number_change(self, name: str, before: float) -> None:
        """Adjust other settings to a number that has changed."""
        if name.endswith("_probe") and before:
            self._follow_probe(name.removesuffix("_probe"), float(self.settings[name]) / before)
        if not name.startswith("wav"):
            self.acquisition.arm_again(self.now)

    def _follow_probe(self, channel: str, ratio: float) -> None:
        """Scale the settings with the probe: the same volts at the input are other volts at its tip."""
        for what in ("scale", "offset"):
            self.settings[f"{channel}_{what}"] = ratio * float(self.settings[f"{channel}_{what}"])
        number = int(channel.removeprefix("chan"))
        level = self.level_name(number)
        if level != "trigger_level" or self.source_channel() == number:
            self.settings[level] = ratio * float(self.settings[level])

    def reset(self) -> None:
        """Go to the state after ``*RST``: it runs."""
        self.acquisition.blocked = False
        super().reset()
        self.run()

    # --- the setup as a whole ---

    def setup(self) -> bytes:
        """Return all settings, as messages that restore them."""
        headers = self._headers().items()
        return "\n".join(f"{header} {self._spell_setting(name)}" for name, header in headers).encode("latin-1")

    def _headers(self) -> dict[str, str]:
        """Return each setting that is part of the setup, and the shortest header of its row."""
        return {name: ":" + short_header(row.header) for row in self.commands.rows for name in row.defaults()}

    def _spell_setting(self, name: str) -> str:
        value: Value = self.settings[name]
        if isinstance(value, bool):
            return str(int(value))
        if isinstance(value, float):
            return f"{value:.15G}"
        return f'"{value}"' if name.endswith("_label") else value

    def restore(self, setup: str) -> None:
        """Take settings from messages; a wrong one leaves those before it set.  Raises ScpiError."""
        if self._restoring:
            raise ScpiError(-224)
        known = set(self._headers().values())
        self._restoring = True
        try:
            for line in setup.split("\n"):
                header = line.partition(" ")[0]
                if header not in known:
                    raise ScpiError(-224)
                self.parser.run(line.partition(";")[0])
        finally:
            self._restoring = False

    # --- acquiring ---

    @property
    def now(self) -> float:
        """When the message under way is worked on [s]."""
        now = self.clock.now()
        return max(self._ready, now) if math.isfinite(self._ready) else now

    def _plan(self, armed: float) -> Plan:
        """Return the plan of an acquisition from this time on [s]."""
        rate, points = self.full_scale()
        start, length = self.screen()
        record = Record(
            trigger=armed,
            forced=False,
            rate=rate,
            points=points,
            # a record longer than the screen goes equally far beyond it on both sides
            origin=start - (points / rate - length) / 2,
            screen=(start, length),
            inputs={n: self._input(n, armed) for n in self.channels},
        )
        return Plan(record, partial(self._search, record), automatic=self.settings["trigger_sweep"] == "AUTO")

    def _input(self, channel: int, start: float) -> Input:
        signal = self._signals.get(channel, no_signal)
        coupling = self.settings[f"chan{channel}_coupling"]
        if coupling == "GND":
            signal = no_signal
        mean = 0.0
        if str(coupling).startswith("A"):
            begin = max(0.0, start - 0.5)
            mean = float(np.mean(signal(begin, COARSEST, round(1 / COARSEST))))
        factor = self.probe(channel) * (-1.0 if self.settings[f"chan{channel}_invert"] else 1.0)
        volts_per_code, zero = self.scaling(channel)
        return Input(signal, factor, mean, volts_per_code, zero, self.lowest, self.highest)

    def _search(self, record: Record, start: float) -> Edge | None:
        """Return a search for the trigger of this record from a time on [s], or None if the source never triggers."""
        channel = self.source_channel()
        if channel is None:
            return None
        step = max(min(COARSEST, record.points / record.rate / 1000), 1 / record.rate)
        return Edge(
            volts=record.inputs[channel].volts,
            level=self.value(self.level_name(channel)),
            hysteresis=_HYSTERESIS * self.division(channel),
            slopes=_SLOPES[str(self.settings[self.slope_name(channel)])],
            step=step,
            fine=0.01 / record.rate,
            position=start,
        )

    def run(self) -> None:
        """Begin to acquire, over and over."""
        self.acquisition.arm(self.now, once=False)

    def single(self) -> None:
        """Begin to acquire one record."""
        self.acquisition.single(self.now)

    def stop(self) -> None:
        """Acquire no more."""
        self.acquisition.stop(self.now)

    def force(self) -> None:
        """Take a record without waiting for an edge."""
        self.acquisition.force(self.now)

    def trigger(self) -> None:
        """``*TRG``."""
        self.force()

    def running(self) -> bool:
        """Return whether the scope acquires or waits for a trigger."""
        return self.acquisition.running(self.now)

    def digitize(self) -> None:
        """Acquire one record; what comes next has to wait for it, for ever if there is no trigger."""
        self.single()
        record = self.acquisition.first(self.now + LOOK_AHEAD)
        if record is None:
            self.acquisition.block()
            self.busy_until(math.inf)
            return
        self.busy_until(record.done)
        self.acquisition.settle(record, self.now)

    def abandon(self) -> None:
        """Clear the device: give up what is under way, an acquisition that blocks included."""
        super().abandon()
        self.acquisition.unblock()

    def end_since(self, begun: float) -> None:
        """See the base: end an acquisition that blocks."""
        super().end_since(begun)
        self.acquisition.unblock()

    def record(self) -> Record:
        """Return the latest record; the answer waits for it if one is under way.  Raises ScpiError if there is none."""
        acquisition = self.acquisition
        acquisition.follow(self.now)
        free = acquisition.armed is not None and not (acquisition.once or acquisition.blocked)
        if acquisition.latest is None and free:
            under_way = acquisition.first(self.now + LOOK_AHEAD)
            if under_way is not None:
                self.busy_until(under_way.done)
                acquisition.settle(under_way, self.now)
        if acquisition.latest is None:
            raise ScpiError(-230)
        return acquisition.latest

    # --- what the record shows ---

    def block(self, data: bytes) -> str:
        """Return a definite-length block as text, and the time that it takes."""
        self.busy_until(self._ready + len(data) / self.transfer)
        return block_text(data, self.digits)

    def on_screen(self, channel: int) -> Measured:
        """Return the trace on the screen, from its codes.  Raises ScpiError if there is none."""
        record = self.record()
        start, length = record.screen
        points = max(2, min(50_000, round(length * record.rate)))
        step = length / points
        codes = record.codes(channel, 0, points, of=points, start=start, step=step)
        return Measured(record.inputs[channel].shown(codes), step, start)

    def measure(self, name: str, channel: int) -> float:
        """Return a measurement on the screen, or the number for none."""
        value = measure(name, self.on_screen(channel))
        return self.no_measurement if value is None else value

    def traces_on_screen(self) -> dict[int, NDArray[np.float64]]:
        """Return each trace on the screen for the picture: 800 columns, from the lower edge, 0, to the upper, 1."""
        record = self.record()
        heights: dict[int, NDArray[np.float64]] = {}
        start, length = record.screen
        for n in self.visible_channels():
            codes = record.codes(n, 0, 800, of=800, start=start, step=length / 800)
            heights[n] = 0.5 + (codes.astype(np.float64) - self.middle) / (8.0 * self.codes_per_division)
        return heights

    def screenshot(self, form: str = "BMP24", *, colour: bool = True, inverted: bool = False) -> bytes:
        """Return the picture of the screen, as a file of this form; see `screenshot.picture_file`."""
        picture = draw(self.traces_on_screen(), columns=self.columns)
        picture = picture if colour else grey(picture)
        return picture_file(255 - picture if inverted else picture, form)

    # --- settings from the signal ---

    def autoscale(self) -> None:
        """Fit scale, offset, time base and level to the signals at the inputs."""
        for n in self.channels:
            signal, factor = self._signals.get(n, no_signal), self.probe(n)
            volts = factor * signal(max(0.0, self.now - 0.5), COARSEST, round(0.5 / COARSEST))
            low, high = float(volts.min()), float(volts.max())
            if high - low < 0.02 * factor:
                continue
            self.settings |= {f"chan{n}_display": True, f"chan{n}_coupling": "DC"}
            self.fit(n, (low + high) / 2, one_two_five((high - low) / 6, up=True))
            found = crossings(volts, (low + high) / 2, 0.1 * (high - low))
            if found.size > 1:
                period = float(np.diff(found).mean()) * COARSEST
                self.settings["time_scale"] = one_two_five(3 * period / self.columns, up=True)
            source = choice(f"{self.channel_word}{n}", tuple(self.channel_words().split()))
            self.settings |= {"trigger_source": source, self.level_name(n): (low + high) / 2}
            self.settings[self.slope_name(n)] = "POS"
            break
        self.settings |= {"time_offset": 0.0, "trigger_sweep": "AUTO"}
        self.run()


#: The setup as a block.
SETUP = Both(
    "SYSTem:SETup",
    lambda s, p: s.restore(block_content(parameter(p)).decode("latin-1")),
    lambda s, _p: s.block(s.setup()),
)


def at_input(lowest: float, highest: float) -> Callable[[VirtualOscilloscope, int], tuple[float, float]]:
    """Return limits that hold at a channel's input [V]: at the tip of its probe they are its factor larger."""
    return lambda scope, n: (lowest * scope.probe(n), highest * scope.probe(n))


def levels(divisions: float) -> Callable[..., tuple[float, float]]:
    """Return the limits of the level of a channel, or of the trigger's source: so far from the middle of the screen."""

    def limits(scope: VirtualOscilloscope, n: int | None = None) -> tuple[float, float]:
        channel = n or scope.source_channel() or 1
        reach, middle = divisions * scope.division(channel), scope.centre(channel)
        return middle - reach, middle + reach

    return limits


def one_two_five(value: float, *, up: bool = False) -> float:
    """Return the number of the series 1, 2, 5, 10 … nearest to a positive one, or the next that is not less.

    >>> one_two_five(3e-3), one_two_five(4e-3), one_two_five(2.1, up=True), one_two_five(0.2, up=True)
    (0.002, 0.005, 5.0, 0.2)
    """
    decade = math.floor(math.log10(value))
    series = [float(f"{m}e{decade}") for m in (1, 2, 5, 10, 20)]
    if up:
        return next(s for s in series if s >= value * (1 - 1e-9))
    return min(series, key=lambda s: abs(s - value))

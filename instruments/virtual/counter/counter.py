"""What the virtual counters share: inputs, one run at a time, and a memory for its readings."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from instruments.ieee488 import INFINITY
from instruments.virtual.core.device import VirtualInstrument, answers, does
from instruments.virtual.core.parameters import at_most_one, limit, nr3, number, one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.core.status import OPERATION_COMPLETE
from instruments.virtual.core.steps import at_once
from instruments.virtual.counter.measurements import Looks, Measurement, Span, measurement
from instruments.virtual.counter.memory import Memory, statistics
from instruments.virtual.counter.parameters import truth, without_channels

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.clock import Clock
    from instruments.virtual.core.device import Answer
    from instruments.virtual.core.steps import Steps
    from instruments.virtual.counter.edges import Array, Input, Signal
    from instruments.virtual.counter.run import Run

#: An answer that never comes is ready then [s].
NEVER = INFINITY
#: Without a time-out a model looks ahead so long, and ten gates, for an edge [s]: then there will be none.
DARK = 60.0

_ABORT = re.compile(r"[\x00-\x20]*:?ABORT?[\x00-\x20]*", re.IGNORECASE)


def darkness(_start: float, _step: float, n: int) -> Array:
    """Nothing is plugged in."""
    return np.zeros(n)


@dataclass(frozen=True)
class Function:
    """A function of a counter.

    header: as the manual prints it behind CONFigure and MEASure; inputs: how many; kind: what is measured, if not what
    its name says.
    """

    header: str
    inputs: int = 1
    kind: str = ""


class VirtualCounter(VirtualInstrument):
    """What both counters are: two inputs, one run at a time, and a memory for its readings.

    signal, second: the voltages at the inputs 1 and 2.
    """

    #: What CONFigure, MEASure and FUNCtion know, by the short name that they answer.
    functions: ClassVar[dict[str, Function]]

    def __init__(self, clock: Clock, *, signal: Signal, second: Signal = darkness, identity: str | None = None) -> None:
        self._signals = {1: signal, 2: second}
        self._run: Run | None = None
        self._memory = Memory()
        self._function = "FREQ"
        self._channels: tuple[int, ...] = (1,)
        self._counted_from = 0
        self._completion_awaited = False
        super().__init__(clock, identity=identity)

    # --- what goes on while nobody asks ---

    def cut_off_by(self, message: str) -> bool:
        """See the base: ABORt does."""
        return bool(_ABORT.fullmatch(message))

    def steps(self, message: str) -> Steps[Answer | None]:
        """Run one message, after what has gone on until it came."""
        yield from self.catch_up()
        return (yield from super().steps(message))

    def status_byte(self, *, message_available: bool = False) -> int:
        """The status byte; see the base."""
        at_once(self.catch_up())
        return super().status_byte(message_available=message_available)

    def abandon(self) -> None:
        """ABORt, and device clear: the measurement ends, what it brought so far stays."""
        super().abandon()
        self._stop()

    def reset(self) -> None:
        """*RST: idle, and nothing in the memory."""
        self.choose("FREQ", (1,))
        self._counted_from = 0
        super().reset()

    def trigger(self) -> None:
        """*TRG: the next readings of a run that waits for it."""
        if self._run:
            self._run.trigger(self._ready)

    def catch_up(self) -> Steps[None]:
        """See the base: a measurement under way goes on."""
        now = self.clock.now()
        if self._run:
            yield from self._run.advance(now)
        if self._completion_awaited and self.idle(now):
            self._completion_awaited = False
            self.status.events |= OPERATION_COMPLETE

    def _stop(self) -> None:
        if self._run:
            self._memory.cut(self.clock.now())
        self._run = None
        self._completion_awaited = False

    def idle(self, now: float) -> bool:
        """Whether nothing is being measured at this time [s]."""
        return self._run is None or (self._run.complete and self._memory.there(now) == self._memory.held)

    def there(self) -> int:
        """Readings in the memory by now."""
        if self._run and self._ready < NEVER:
            at_once(self._run.advance(self._ready))
        return self._memory.there(self._ready)

    def wait_for(self, count: float = math.inf) -> Steps[bool]:
        """The answer to the message under way is ready when so many readings have been taken since INITiate.

        Returns whether that will be; if not, the answer never comes.
        """
        if self._run is None:
            return True
        instant = (yield from self._run.reach(count, self._ready)) if self._ready < NEVER else NEVER
        self.busy_until(min(instant, NEVER))
        if instant < NEVER:
            return True
        # only ABORt or a device clear end this, and the run with it: nobody will see more of it
        self._run = None
        return False

    def begin(self, run: Run) -> None:
        """INITiate: the memory is emptied.  Raises ScpiError if a measurement is under way."""
        if not self.idle(self._ready):
            raise ScpiError(-213)
        self._run, self._memory, self._counted_from = run, run.memory, 0

    def looks(self) -> Looks:
        """The inputs as they are set now."""
        return Looks(
            {
                channel: (signal, self.entry(channel, falling=falling), self.entry(channel, falling=not falling))
                for channel, signal in self._signals.items()
                for falling in (self.settings[f"slope{channel}"] == "NEG",)
            }
        )

    def entry(self, channel: int, *, falling: bool) -> Input:
        """How an input looks at its signal with these settings."""
        raise NotImplementedError

    def measure(self, looks: Looks, span: Span) -> Measurement:
        """One measurement of the function that is set."""
        falling = self.settings[f"slope{self._channels[0]}"] == "NEG"
        return measurement(self.kind, looks, self._channels, span, falling=falling)

    @property
    def kind(self) -> str:
        """What is measured, as the table of measurements calls it."""
        return self.functions[self._function].kind or self._function

    def choose(self, name: str, channels: tuple[int, ...]) -> None:
        """Another function: it is idle, and nothing is in the memory."""
        self._stop()
        self._memory = Memory()
        self._function, self._channels = name, channels

    def choose_as_told(self, words: list[str]) -> None:
        """FUNCtion "FREQ 1": a function and its channels; settings stay.  words: of the string.  Raises ScpiError."""
        rows = ((name, Command("[:][SENSe[1]:]" + function.header)) for name, function in self.functions.items())
        found = next((name for name, row in rows if words and row.header.fullmatch(words[0])), None)
        if found is None or not all(word in {"1", "2"} for word in words[1:]):
            raise ScpiError(-224, words[0][:20] if words else "")
        self.choose(found, tuple(map(int, words[1:])) or self._channels[:1])
        self.changed("function")

    def found_level(self, channel: int) -> float:
        """Where the trigger fires now, if it is found automatically [V]."""
        falling = self.settings[f"slope{channel}"] == "NEG"
        entry = self.entry(channel, falling=falling)
        self.busy_until(self._ready + entry.window)
        return entry.thresholds(self._signals[channel], min(self._ready, self.clock.now() + 1.0)).fire

    # --- rows ---

    def _common(self) -> tuple[Command, ...]:
        own = (
            Command("*OPC", set=does(self._note_when_complete), get=answers(self._completion)),
            Command("*WAI", set=does(self._wait)),
        )
        return (*own, *super()._common())

    def _wait(self) -> Steps[None]:
        yield from self.wait_for()

    def _note_when_complete(self) -> None:
        self._completion_awaited = True

    def _completion(self) -> Steps[str]:
        if self._run and math.isfinite(self._run.wanted):  # a counter that runs freely has nothing pending
            yield from self.wait_for()
        return "1"

    def toggle(self, pattern: str, name: str, *, default: bool = False) -> Command:
        """A row for a switch that takes any number for ON or OFF."""
        self._defaults[name] = default
        return Command(pattern, self._setter(name, truth), answers(lambda: str(int(self.settings[name]))))

    def integer(self, pattern: str, name: str, *, low: float, high: float, default: float) -> Command:
        """A row for a whole number."""
        self._defaults[name] = default

        def ask(parameters: list[str]) -> str:
            asked = at_most_one(parameters)
            value = limit(asked, low=low, high=high, default=default) if asked else float(self.settings[name])
            return self.spell_integer(value)

        read = self._setter(name, lambda text: float(round(number(text, low=low, high=high, default=default))))
        return Command(pattern, lambda parameters: read(without_channels(parameters)), ask)

    @staticmethod
    def spell_integer(value: float) -> str:
        """A whole number as this instrument prints it."""
        return nr3(value) if value >= INFINITY else f"{round(value):+d}"

    def level(self, pattern: str, channel: int, reach: Callable[[], float], spell: Callable[[float], str]) -> Command:
        """A row for an absolute trigger level; setting it fixes it.  reach: the greatest one [V]."""
        name, automatic = f"level{channel}", f"automatic{channel}"
        self._defaults[name] = 0.0

        def set_(parameters: list[str]) -> None:
            text = one(parameters)
            self.settings[name] = number(text, low=-reach(), high=reach(), default=0.0, unit="V")
            self.settings[automatic] = False
            self.changed(name)

        def ask(parameters: list[str]) -> str:
            if asked := at_most_one(parameters):
                return spell(limit(asked, low=-reach(), high=reach(), default=0.0))
            return spell(self.found_level(channel) if self.settings[automatic] else float(self.settings[name]))

        return Command(pattern, set_, ask)

    def automatic(self, pattern: str, channel: int) -> Command:
        """A row for the automatic level: ON, OFF, or ONCE, which finds it and then leaves it."""
        name = f"automatic{channel}"
        self._defaults[name] = True

        def set_(parameters: list[str]) -> None:
            text = one(parameters)
            if text.upper() == "ONCE":
                self.settings[name] = True
                self.settings[f"level{channel}"] = self.found_level(channel)
                self.settings[name] = False
            else:
                self.settings[name] = truth(text)
            self.changed(name)

        return Command(pattern, set_, answers(lambda: str(int(self.settings[name]))))

    def statistics(self) -> dict[str, float]:
        """Of the readings since INITiate, or since they were cleared; "not a number" while that is off."""
        values, _ = self._memory.part(self._counted_from, self.there())
        return statistics(values if self.settings["averaging"] else np.empty(0))

"""What the virtual counters share: inputs, one run at a time, and a memory for its readings."""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from instruments.clock import Clock
from instruments.ieee488 import INFINITY
from instruments.virtual.core.device import Answer, VirtualInstrument, has_node
from instruments.virtual.core.parameters import boolean, limit, number, optional_parameter, parameter
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.rows import Ask, Do, Number, Own, Row, Switch, Word, header_pattern
from instruments.virtual.core.signal import Array, Signal, no_signal
from instruments.virtual.core.status import OPERATION_COMPLETE
from instruments.virtual.core.steps import Steps, run_to_end
from instruments.virtual.counter.edges import TriggerInput
from instruments.virtual.counter.measurements import GateTime, Inputs, Measurement, measurement
from instruments.virtual.counter.run import Memory, Run, statistics

#: When an answer is ready that never comes [s].
NEVER = INFINITY
#: Without a time-out a model looks ahead for this time and ten gates to find an edge [s].
DARK = 60.0

#: The settings behind the rows of a trigger level.
AUTOMATIC, LEVEL = ("automatic{n}", True), ("level{n}", 0.0)

_ABORT = re.compile(r"[\x00-\x20]*:?ABORT?[\x00-\x20]*", re.IGNORECASE)


# blanks match in one place only: \s* before a set that has them, too, takes a time that grows with their square
_CHANNELS = re.compile(r"\(@([\d,\s]+)\)")
_BRACKETED = re.compile(r"\(([^@()]*)\)")
#: Characters of a channel list, for two or three channels; megabytes of it would keep all other clients waiting.
_LONGEST_LIST = 1000


def channels_of(parameters: list[str], numbered: Sequence[int]) -> tuple[int, ...]:
    """Return the channels in channel lists, in their order.

    Args:
        parameters: of a command.
        numbered: the channels of the counter.

    Raises:
        ScpiError: the counter does not have one of them, or a list is longer than it can be.

    >>> channels_of(["10", "(@2)", "(@1)"], (1, 2))
    (2, 1)
    """
    lists = [found for text in parameters if (found := _CHANNELS.fullmatch(text))]
    too_long = any(len(found[1]) > _LONGEST_LIST for found in lists)
    listed = () if too_long else lists
    named = [word.strip().lstrip("0") for found in listed for word in found[1].split(",") if word.strip()]
    if too_long or any(word not in map(str, numbered) for word in named):  # as text: a number may have any length
        raise ScpiError(-224, "channel")
    return tuple(map(int, named))


def without_channels(parameters: list[str]) -> list[str]:
    """Return the parameters without channel lists; a number may stand in brackets, as in the CNT-91's handbook.

    >>> without_channels(["(100)", "(@1)"])
    ['100']
    """
    plain = [text for text in parameters if not _CHANNELS.fullmatch(text)]
    return [found[1].strip() if (found := _BRACKETED.fullmatch(text)) else text for text in plain]


@dataclass(frozen=True)
class Function:
    """A function of a counter.

    Attributes:
        header: as the manual prints it behind CONFigure and MEASure.
        inputs: how many it uses.
        kind: of the measurement, where that is not the name of the function.
    """

    header: str
    inputs: int = 1
    kind: str = ""


@dataclass(frozen=True)
class Count(Number):
    """A whole number, which may stand in brackets.  endless: whether it may be infinite."""

    rounded: Callable[[float], float] = field(default=lambda value: float(round(value)), repr=False)
    endless: bool = False

    def set(self, device: Any, parameters: list[str]) -> None:
        """See the base."""
        super().set(device, without_channels(parameters))

    def read(self, device: Any, text: str) -> float:
        """See the base."""
        return INFINITY if self.endless and text.upper() in {"INF", "INFINITY"} else super().read(device, text)

    def format_value(self, device: Any, value: float) -> str:
        """See the base."""
        return str(device.spell_whole(value))


#: Of every counter.
SHARED: tuple[Row, ...] = (
    Ask("CONFigure", lambda d: d.configuration()),
    Own("[SENSe[1]:]FUNCtion[:ON]", lambda d, p: d.set_function(p), lambda d: d.function()),
    Do("INITiate[:IMMediate]", lambda d: d.initiate()),
    Do("ABORt", lambda d: d.abandon()),
)
#: Of each input of those with two.
INPUT: tuple[Row, ...] = (
    Word("INPut[n]:COUPling", "coupling{n}", "AC DC"),
    Number("INPut[n]:IMPedance", "impedance{n}", 1e6, (50, 1e6), "OHM", values=(50, 1e6)),
    Switch("INPut[n]:FILTer[:LPASs][:STATe]", "filter{n}"),
)
#: Of those with a status system and a number format.
SYSTEM: tuple[Row, ...] = (
    Word("FORMat:BORDer", "byte_order", "NORMal SWAPped"),
    Do("SYSTem:PRESet", lambda d: d.reset()),
    Ask("STATus:OPERation:CONDition", lambda d: d.operation()),
    Do("STATus:PRESet"),
    Ask("*OPT"),
)


class VirtualCounter(VirtualInstrument):
    """A counter: inputs, one run at a time, and a memory for its readings.

    Args:
        clock: of the bench.
        signal: the voltage at input 1.
        second: the voltage at input 2, where the model has one.
        model: identity, numbered, lacks; see the base.
    """

    #: The functions of the family for CONFigure, MEASure and FUNCtion, by the short name in the answer.
    FUNCTIONS: ClassVar[dict[str, Function]]
    numbered: Sequence[int] = (1, 2)

    def __init__(self, clock: Clock, *, signal: Signal, second: Signal = no_signal, **model: Any) -> None:
        self._run: Run | None = None
        self._memory = Memory()
        self._function = "FREQ"
        self._channels: tuple[int, ...] = (1,)
        self._counted_from = 0
        self._completion_awaited = False
        super().__init__(clock, **model)
        self._signals = {n: voltage for n, voltage in ((1, signal), (2, second)) if n in self.numbered}
        self.functions = {
            name: function for name, function in self.FUNCTIONS.items() if not has_node(function.header, self.lacks)
        }

    # --- what happens between messages ---

    def is_abort(self, message: str) -> bool:
        """See the base: ABORt does."""
        return bool(_ABORT.fullmatch(message))

    def steps(self, message: str) -> Steps[Answer | None]:
        """Run one message, after what has happened up to now."""
        yield from self.catch_up()
        return (yield from super().steps(message))

    def begin_next(self) -> None:
        """See the base; all settings in one message take as long as one after the other."""
        self._ready += self.pace

    def status_byte(self, *, message_available: bool = False) -> int:
        """Return the status byte; see the base."""
        run_to_end(self.catch_up())
        return super().status_byte(message_available=message_available)

    def abandon(self) -> None:
        """ABORt, and device clear: end the measurement, and keep its readings so far."""
        super().abandon()
        self._stop()

    def end_since(self, begun: float) -> None:
        """See the base: end a measurement that began since then."""
        super().end_since(begun)
        if self._run and self._run.begin >= begun:
            self._stop()

    def reset(self) -> None:
        """*RST: go idle, with an empty memory."""
        self.choose("FREQ", (1,))
        self._counted_from = 0
        super().reset()

    def trigger(self) -> None:
        """*TRG: trigger the run that waits for it.  Raises ScpiError where none does."""
        if self._run is None or not self._run.waiting:
            raise ScpiError(-211)
        self.arm()

    def arm(self) -> None:
        """Trigger the run where one waits for it; else do nothing."""
        if self._run and self._run.waiting:
            self._run.trigger(self._ready)

    def catch_up(self) -> Steps[None]:
        """See the base: go on with the measurement under way."""
        now = self.clock.now()
        if self._run:
            yield from self._run.advance(now)
        if self._completion_awaited and self.is_idle(now):
            self._completion_awaited = False
            self.status.events |= OPERATION_COMPLETE

    def _stop(self) -> None:
        if self._run:
            self._memory.truncate(self.clock.now())
        self._run = None
        self._completion_awaited = False

    def is_idle(self, now: float) -> bool:
        """Return whether no measurement is under way at this time [s]."""
        return self._run is None or (self._run.complete and self._memory.available(now) == self._memory.size)

    def available(self) -> int:
        """Return the number of readings in the memory by now."""
        if self._run and self._ready < NEVER:
            run_to_end(self._run.advance(self._ready))
        return self._memory.available(self._ready)

    def wait_for(self, count: float = math.inf) -> Steps[bool]:
        """Let the answer to the message under way be ready when there are `count` readings since INITiate.

        Returns:
            Whether that will be; if not, the answer never comes.
        """
        if self._run is None:
            return True
        instant = (yield from self._run.reach(count, self._ready)) if self._ready < NEVER else NEVER
        self.busy_until(min(instant, NEVER))
        if instant < NEVER:
            return True
        # only ABORt or a device clear end this, and the run with it
        self._run = None
        return False

    def begin(self, run: Run) -> None:
        """INITiate: begin a run, with an empty memory.  Raises ScpiError where a measurement is under way."""
        if not self.is_idle(self._ready):
            raise ScpiError(-213)
        self._run, self._memory, self._counted_from = run, run.memory, 0

    def inputs(self) -> Inputs:
        """Return the inputs as they are set now."""
        return Inputs({channel: (signal, self.trigger_input(channel)) for channel, signal in self._signals.items()})

    def is_falling(self, channel: int) -> bool:
        """Return whether an input triggers on falling edges."""
        return self.settings[f"slope{channel}"] == "NEG"

    def trigger_input(self, channel: int) -> TriggerInput:
        """Return the trigger of an input, with the settings that it has now."""
        raise NotImplementedError

    def measure(self, inputs: Inputs, gate: GateTime) -> Measurement:
        """Begin one measurement of the selected function."""
        return measurement(self.kind, inputs, self._channels, gate)

    @property
    def kind(self) -> str:
        """The kind of measurement, as the table of measurements names it."""
        return self.functions[self._function].kind or self._function

    def choose(self, name: str, channels: tuple[int, ...]) -> None:
        """Select another function: go idle, with an empty memory."""
        self._stop()
        self._memory = Memory()
        self._function, self._channels = name, channels

    def function(self) -> str:
        """Answer FUNCtion? with the function that is set."""
        return f'"{self._function}"'

    def set_function(self, parameters: list[str]) -> None:
        """Execute FUNCtion "FREQ (@1)": select a function and its channels, and keep the settings.

        Raises:
            ScpiError: the counter does not have this function or channel.
        """
        words = re.sub(r"[(@),]", " ", parameter(parameters).strip("\"'")).split()
        headers = ((name, "[:][SENSe[1]:]" + function.header) for name, function in self.functions.items())
        found = next((name for name, header in headers if words and header_pattern(header).fullmatch(words[0])), None)
        if found is None or not all(word in map(str, self.numbered) for word in words[1:]):
            raise ScpiError(-224, words[0][:20] if words else "")
        self.choose(found, tuple(map(int, words[1:])) or self._channels[:1])
        self.on_change("function")

    def configure(self, name: str, parameters: list[str]) -> None:
        """CONFigure: a function, its channels, what is expected and how finely.  Raises ScpiError."""
        raise NotImplementedError

    def measure_once(self, name: str, parameters: list[str]) -> Steps[str]:
        """MEASure?: CONFigure and READ?."""
        self.configure(name, parameters)
        return (yield from self.read())

    def initiate(self) -> None:
        """INITiate: one run of as many readings as triggers and samples make."""
        raise NotImplementedError

    def read(self) -> Steps[str]:
        """READ?: INITiate, and the answer comes with the last reading."""
        # the question would wait for a trigger that cannot come before it is answered
        if self.settings["trigger_source"] == "BUS" or math.isinf(self.value("triggers")):
            raise ScpiError(-221)
        self.initiate()
        return (yield from self.fetch())

    def fetch(self) -> Steps[str]:
        """FETCh?: all readings, when there are all; they stay in the memory."""
        if self._run is None and not self._memory.size:
            raise ScpiError(-230)
        if not (yield from self.wait_for()):
            return ""
        return self.spell_all(self._memory.slice(self._memory.n_fetched, self._memory.size)[0])

    def spell_all(self, values: Array) -> str:
        """Return readings as they are answered."""
        return ",".join(map(self.spell, values))

    def greatest_level(self, channel: int) -> float:
        """Return the greatest absolute trigger level [V]."""
        raise NotImplementedError

    def find_level(self, channel: int) -> float:
        """Find the automatic level: where the trigger would fire now [V]."""
        entry = self.trigger_input(channel)
        self.busy_until(self._ready + entry.window)
        return entry.thresholds(self._signals[channel], min(self._ready, self.clock.now() + 1.0)).fire

    # --- what the rows set and ask ---

    def read_boolean(self, text: str) -> bool:
        """See the base; any number is allowed, OFF where it rounds to 0 (SCPI-1999, volume 1, 7.3)."""
        return boolean(text, rounded=True)

    def spell_whole(self, value: float) -> str:
        """Return a whole number as this instrument prints it."""
        return f"{round(value):+d}"

    def note_completion(self) -> None:
        """See the base."""
        self._completion_awaited = True

    def completion(self) -> Steps[str]:
        """See the base."""
        if self._run and math.isfinite(self._run.wanted):  # a counter that runs freely has nothing pending
            yield from self.wait_for()
        return "1"

    def wait(self) -> Steps[None]:
        """See the base."""
        yield from self.wait_for()

    def set_level(self, channel: int, parameters: list[str]) -> None:
        """Set an absolute trigger level, and turn the automatic level off.  Raises ScpiError."""
        text, reach = parameter(parameters), self.greatest_level(channel)
        self.settings[f"level{channel}"] = number(text, low=-reach, high=reach, default=0.0, unit="V")
        self.settings[f"automatic{channel}"] = False
        self.on_change(f"level{channel}")

    def level(self, channel: int, parameters: list[str]) -> str:
        """Answer with the trigger level: the one set, or the automatic one.  Raises ScpiError."""
        if asked := optional_parameter(parameters):
            reach = self.greatest_level(channel)
            return self.spell(limit(asked, low=-reach, high=reach, default=0.0))
        automatic = self.settings[f"automatic{channel}"]
        return self.spell(self.find_level(channel) if automatic else self.value(f"level{channel}"))

    def set_automatic(self, channel: int, parameters: list[str]) -> None:
        """Set the automatic level ON, OFF, or ONCE, which finds it and then keeps it.  Raises ScpiError."""
        name, text = f"automatic{channel}", parameter(parameters)
        if text.upper() == "ONCE":
            self.settings[name] = True
            self.settings[f"level{channel}"] = self.find_level(channel)
            self.settings[name] = False
        else:
            self.settings[name] = self.read_boolean(text)
        self.on_change(name)

    def automatic(self, channel: int) -> str:
        """Return whether the level is found automatically."""
        return f"{self.settings[f'automatic{channel}']:d}"

    def configuration(self) -> str:
        """CONFigure?: the function and its channels."""
        where = ",".join(f"(@{channel})" for channel in self._channels)
        return f'"{self._function} {where}"'

    def statistics(self) -> dict[str, float]:
        """Return the statistics of the readings since INITiate or the last clear; "not a number" while they are off."""
        values, _ = self._memory.slice(self._counted_from, self.available())
        return statistics(values if self.settings["averaging"] else np.empty(0))

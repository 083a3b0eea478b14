"""What happens in a laboratory, step by step: each message, each write and each wait is a step, and may be struck."""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field


class Killed(BaseException):
    """The process is gone.  No handler may take it for a failure, and nothing that it does afterwards has an effect."""


@dataclass(frozen=True)
class Event:
    """Something that goes wrong.

    Attributes:
        what: a name in `levilab.laboratory.events.EVENTS`.
        life: in which process of the laboratory, from 0 on.
        at: at which of its steps, or of the person's tasks.
        value: what it draws, from 0 to 1.
    """

    what: str
    life: int
    at: int
    value: float = 0.5


@dataclass
class Fate:
    """The steps of one process, and what strikes them.

    Attributes:
        strike: carries out an event.
        now: the time on the bench [s].
        life: number of the process.
        counts: kind of step → how many there were in this life.
        dead: whether the process was killed.
        power: whether the computer lost its power then.
        trace: a line for each step.
        struck: the events that have struck, in order.
    """

    strike: Callable[[Event], None]
    now: Callable[[], float] = lambda: 0.0
    life: int = -1
    counts: Counter[str] = field(default_factory=Counter)
    dead: bool = False
    power: bool = False
    trace: list[str] = field(default_factory=list)
    struck: list[Event] = field(default_factory=list)
    _due: dict[tuple[str, int], list[Event]] = field(default_factory=dict)

    def begin(self, events: Iterable[tuple[str, Event]]) -> None:
        """Begin another life.  events: each with the kind of step that it counts."""
        self.life += 1
        self.counts.clear()
        self.dead = self.power = False
        self._due = {}
        for kind, event in events:
            if event.life == self.life:
                self._due.setdefault((kind, event.at), []).append(event)

    def step(self, what: str, kind: str = "step") -> None:
        """Let a step happen.  Raises Killed, or what an event raises."""
        if self.dead:
            raise Killed
        self.counts[kind] += 1
        number = self.counts[kind]
        self.trace.append(f"{self.life}.{number} {self.now():.6f} {what}")
        for event in self._due.pop((kind, number), ()):
            self.struck.append(event)
            self.trace.append(f"! {event.what} {event.value:.6f}")
            self.strike(event)

    def die(self, *, power: bool = False) -> None:
        """Kill the process.  Raises Killed."""
        self.dead, self.power = True, power
        raise Killed

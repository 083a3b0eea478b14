"""Work in steps: what takes long to be worked out, with places between where others may have their turn.

A question such as READ? makes a model look at hours of light.  It is a generator that yields now and then: in process
it is driven to its end at once, a server drives it in slices and serves its other clients meanwhile.
"""

from __future__ import annotations

import inspect
from collections.abc import Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, TypeVar

from instruments.virtual.device import VirtualInstrument
from instruments.virtual.scpi import (
    _UNIT,
    LONGEST_ANSWER,
    Command,
    Parser,
    ScpiError,
    _resolve,
    none,
    split_parameters,
    split_units,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.device import Answer, Clock

T = TypeVar("T")

#: Work that yields where it may be interrupted, and returns its result.
Steps = Generator[None, None, T]


def at_once(steps: Steps[T]) -> T:
    """The result, without interruption."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: T = end.value
            return result


@dataclass(frozen=True)
class SlowCommand(Command):
    """A row of a table whose work is done in steps; see Command.  setting, asking: what set and get do."""

    setting: Callable[[list[str]], Steps[None]] | None = None
    asking: Callable[[list[str]], Steps[str]] | None = None


def slow(
    pattern: str,
    tell: Callable[[list[str]], Steps[str]] | None = None,
    act: Callable[[list[str]], Steps[None]] | None = None,
    *,
    set: Callable[[list[str]], None] | None = None,  # noqa: A002 - as in Command
) -> SlowCommand:
    """A row whose question is answered, or whose command is carried out, in steps."""
    return SlowCommand(pattern, set, setting=act, asking=tell)


def plainly(work: Callable[[], Steps[T]]) -> Callable[[list[str]], Steps[T]]:
    """Work without parameters, for a row of a table."""

    def steps(parameters: list[str]) -> Steps[T]:
        none(parameters)
        return (yield from work())

    return steps


class SteppedParser(Parser):
    """A parser that knows slow rows."""

    def run(self, message: str) -> str | None:
        """See the base."""
        return at_once(self.steps(message))

    def steps(self, message: str) -> Steps[str | None]:
        """What run() does, in steps."""
        answers: list[str] = []
        path = ""
        for unit in split_units(message):
            parts = _UNIT.fullmatch(unit)
            assert parts, "a unit begins with no blank"
            header, rest = parts.groups()
            full, path = _resolve(header, path)
            try:
                answer = yield from self._steps(full, split_parameters(rest))
            except ScpiError as error:
                self.report(error)
                break
            if answer is not None:
                answers.append(answer)
            if sum(map(len, answers)) > LONGEST_ANSWER:
                self.report(ScpiError(-430))
                return None
        return ";".join(answers) if answers else None

    def _steps(self, header: str, parameters: list[str]) -> Steps[str | None]:
        command = self._find(header.removesuffix("?").upper())
        if isinstance(command, SlowCommand):
            work = command.asking if header.endswith("?") else command.setting
            if work is not None:
                return (yield from work(parameters))
        return self._execute(header, parameters)


class Work(Generic[T]):
    """Steps that anybody may drive on, until they are done or given up.

    result: None until then, and if it was given up; error: that ended it, for the one whose work it is.
    """

    def __init__(self, steps: Steps[T]) -> None:
        self._steps = steps
        self.done = False
        self.result: T | None = None
        self.error: Exception | None = None

    def step(self) -> bool:
        """One step; whether there is more to do."""
        if not self.done:
            try:
                next(self._steps)
            except StopIteration as end:
                self.result, self.done = end.value, True
            except Exception as error:  # noqa: BLE001 - raised where the work was asked for
                self.error, self.done = error, True
        return not self.done

    def give_up(self) -> None:
        """No more of it; what gives itself up (ABORt) goes on to its own end."""
        if inspect.getgeneratorstate(self._steps) != inspect.GEN_RUNNING:
            self._steps.close()
            self.done = True


class SteppedInstrument(VirtualInstrument):
    """An instrument whose answers may take long to be worked out: it does that in steps."""

    parser: SteppedParser
    parser_type = SteppedParser

    def __init__(self, clock: Clock) -> None:
        self._work: Work[Answer | None] | None = None
        super().__init__(clock)

    def execute(self, message: str) -> Answer | None:
        """See the base."""
        return at_once(self.steps(message))

    def steps(self, message: str) -> Steps[Answer | None]:
        """What execute() does, in steps; a message that is worked on already comes first."""
        if self._work and self.cut_off_by(message):
            self._work.give_up()
        while self._work and self._work.step():
            yield
        work = self._work = Work(self._answered(message))
        try:
            while work.step():
                yield
        finally:
            work.give_up()
        if work.error:
            raise work.error
        return work.result

    def _answered(self, message: str) -> Steps[Answer | None]:
        yield from self.catch_up()
        self._begin_message()
        return self._answer((yield from self.parser.steps(message)))

    def abandon(self) -> None:
        """See the base."""
        if self._work:
            self._work.give_up()
        super().abandon()

    def cut_off_by(self, message: str) -> bool:
        """Whether this message ends the work on the one before it."""
        return False

    def catch_up(self) -> Steps[None]:
        """Work out what has gone on while nobody asked."""
        yield from ()

"""An instrument that works in steps: what it does with a message, and with the one that it is still working on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from instruments.virtual.device import VirtualInstrument
from instruments.virtual.steps import Work, at_once

if TYPE_CHECKING:
    from instruments.virtual.device import Answer, Clock
    from instruments.virtual.steps import Steps


class SteppedInstrument(VirtualInstrument):
    """An instrument whose answers may take long to be worked out: it does that in steps."""

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

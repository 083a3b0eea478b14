"""What asks a program to end, and what it does then: the only place that handles signals.

An acquisition finishes its reading, switches the outputs off and keeps the run (`watching_for_interruption`); a server
ends when its event loop has its turn (`watching_for_end`); what must not be torn lets Ctrl-C wait
(`interruption_postponed`).  Elsewhere Ctrl-C is Python's KeyboardInterrupt, which the command line turns into one line
and an exit status.
"""

from __future__ import annotations

import contextlib
import signal
import threading
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType

#: What asks a program to end: Ctrl-C, kill, a closed terminal, and on Windows Ctrl-Break.
_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]


class Interrupted(BaseException):
    """The run was asked to end.

    Attributes:
        by: the signal's name.

    No Exception, so that no library on the way takes it for a failure of its own.
    """

    def __init__(self, by: str) -> None:
        self.by = by
        super().__init__(f"interrupted by {by}")


class Stop:
    """Whether the end was asked for.

    The first signal is only noted, so that no exchange with an instrument is torn; `check()` raises it
    where the program can end well.  The second one breaks through, in case an exchange hangs; from then on
    signals are ignored, so that nothing can keep the outputs from going off.
    """

    def __init__(self) -> None:
        self.by: str | None = None
        self._shielded = False
        self._at_once = False

    def check(self) -> None:
        """Raise Interrupted if the end was asked for."""
        if self.by:
            raise Interrupted(self.by)

    def shield(self) -> None:
        """From here on nothing breaks through: the outputs are going off."""
        self._shielded = True

    @contextlib.contextmanager
    def at_once(self) -> Iterator[None]:
        """Here already the first signal breaks through: what waits for a person need not end well."""
        self.check()
        self._at_once = True
        try:
            yield
        finally:
            self._at_once = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """The signal handler."""
        second, self.by = self.by is not None, signal.Signals(number).name
        if (second or self._at_once) and not self._shielded:
            self._shielded = True
            raise Interrupted(self.by)


def _ignored_by_nohup(number: int) -> bool:
    """Whether the run was started to outlive its terminal."""
    return signal.Signals(number).name == "SIGHUP" and signal.getsignal(number) is signal.SIG_IGN


class End:
    """Whether a signal asked for the end, and which.  by: its name; wake: called by the signal's handler, if given."""

    def __init__(self) -> None:
        self.by: str | None = None
        self.wake: Callable[[], object] | None = None

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """The signal handler."""
        self.by = self.by or signal.Signals(number).name
        if self.wake:
            self.wake()


@contextlib.contextmanager
def watching_for_end() -> Iterator[End]:
    """Signals go to the End given here, for as long as this lasts (main thread only)."""
    end = End()
    with _handled_by(end):
        yield end


@contextlib.contextmanager
def watching_for_interruption() -> Iterator[Stop]:
    """Signals go to the Stop given here, for as long as this lasts (main thread only)."""
    stop = Stop()
    with _handled_by(stop):
        yield stop


@contextlib.contextmanager
def _handled_by(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, handler) for number in _SIGNALS if not _ignored_by_nohup(number)}
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)


@contextlib.contextmanager
def interruption_postponed() -> Iterator[Callable[[], None]]:
    """Ctrl-C waits, for what is short and must not be torn, as the compiler must not (main thread only).

    It waits until the function given here is called, or until the end; KeyboardInterrupt is raised then.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: None
        return
    asked: list[int] = []
    postponed = contextlib.ExitStack()

    def admit() -> None:
        postponed.close()
        if asked:
            asked.clear()
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, lambda number, _: asked.append(number))
    postponed.callback(signal.signal, signal.SIGINT, before)
    with postponed:
        yield admit
    admit()

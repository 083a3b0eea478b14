"""Signals that ask a program to end, and how it ends; no other module handles signals.

An acquisition finishes its reading, switches the outputs off and keeps the run (`watching_for_interruption`).  A server
ends when its event loop has its turn (`watching_for_end`).  Work that must not be torn postpones Ctrl-C
(`interruption_postponed`).  A process that works for another leaves Ctrl-C to that one (`interruption_blocked`,
`ignore_interruption`).  While modules are imported, and after the last word, Ctrl-C ends the process at once
(`interruption_ends_process`, `end_process_at_interruption`); while Python ends all signals are ignored
(`ignore_all_signals`).  Elsewhere Ctrl-C is Python's KeyboardInterrupt, which the command line turns into one line and
an exit status (`let_the_status_count`).
"""

import contextlib
import os
import signal
import stat
import sys
import threading
from collections.abc import Callable, Iterator
from types import FrameType

#: Signals that ask a program to end: Ctrl-C, kill, a closed terminal, and on Windows Ctrl-Break.
_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]


#: A pipe that ends within this time had ended before [s].
_ENDED_BEFORE_S = 0.05


class Interrupted(BaseException):
    """A signal asked the run to end.

    It is no Exception, so that no library takes it for a failure of its own.

    Attributes:
        by: the signal's name.
    """

    def __init__(self, by: str) -> None:
        self.by = by
        super().__init__(f"interrupted by {by}")

    @property
    def key(self) -> str:
        """The key that sent the signal, or else the signal."""
        return "Ctrl-C" if self.by == "SIGINT" else self.by


class Stop:
    """Whether a signal asked for the end.

    The first signal is only noted, so that it tears no exchange with an instrument; `check()` raises Interrupted where
    the program can end well.  The second one raises Interrupted at once, in case an exchange hangs, but only within
    `let_second_signal_through()`: while a run folder is made or completed nothing is torn.  Once Interrupted was
    raised, signals are ignored, so that nothing can keep the outputs from going off, nor the run from being kept.

    Attributes:
        by: the name of the latest signal; None: there was none.
    """

    def __init__(self) -> None:
        self.by: str | None = None
        self._is_shielded = True
        self._raises_at_once = False

    def check(self) -> None:
        """Raise Interrupted if a signal asked for the end."""
        if self.by:
            self._is_shielded = True
            raise Interrupted(self.by)

    @contextlib.contextmanager
    def let_second_signal_through(self) -> Iterator[None]:
        """Let the second signal raise Interrupted at once, while an exchange with an instrument may hang."""
        self._is_shielded = False
        try:
            yield
        finally:
            self._is_shielded = True

    def shield(self) -> None:
        """Let no signal raise Interrupted from now on: the outputs are going off."""
        self._is_shielded = True

    @contextlib.contextmanager
    def at_once(self) -> Iterator[None]:
        """Let the first signal raise Interrupted at once, while the program waits for a person."""
        self.check()
        self._raises_at_once = True
        try:
            yield
        finally:
            self._raises_at_once = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Return the signal handler."""
        second, self.by = self.by is not None, signal.Signals(number).name
        if (second or self._raises_at_once) and not self._is_shielded:
            self._is_shielded = True
            raise Interrupted(self.by)


def _ignored_by_nohup(number: int) -> bool:
    """Return whether a signal is the one that nohup ignores, so that the run outlives its terminal."""
    return signal.Signals(number).name == "SIGHUP" and signal.getsignal(number) is signal.SIG_IGN


class End:
    """Whether a signal asked for the end.

    Attributes:
        by: the name of the first signal, or EOF for the end of the standard input; None: there was none.
        wake: called by the signal's handler, unless it is None.
    """

    def __init__(self) -> None:
        self.by: str | None = None
        self.wake: Callable[[], object] | None = None

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Return the signal handler."""
        self.by = self.by or signal.Signals(number).name
        if self.wake:
            self.wake()


@contextlib.contextmanager
def watching_for_end() -> Iterator[End]:
    """Yield an End that takes all signals while the context lasts (main thread only)."""
    end = End()
    with _handle_signals_by(end):
        yield end


def end_with_standard_input(end: End) -> None:
    """Let the end of the standard input ask for the end, where it is a pipe of the program that started this one.

    A pipe ends with the program that holds its other end, however that dies, on every system.  A terminal, a file and
    /dev/null (``nohup``, ``&``, a service) are no pipe; a pipe that has ended already (cron) has no program behind it.
    Those are not watched.
    """
    with contextlib.suppress(OSError):  # there may be no standard input
        if stat.S_ISFIFO(os.fstat(0).st_mode):
            reader = threading.Thread(target=_read_to_the_end, daemon=True)
            reader.start()
            reader.join(_ENDED_BEFORE_S)
            if reader.is_alive():
                threading.Thread(target=_end_after, args=(reader, end), daemon=True).start()


def _read_to_the_end() -> None:
    with contextlib.suppress(OSError):
        while os.read(0, 4096):
            pass


def _end_after(reader: threading.Thread, end: End) -> None:
    reader.join()
    end.by = end.by or "EOF"
    if end.wake:
        end.wake()


@contextlib.contextmanager
def watching_for_interruption() -> Iterator[Stop]:
    """Yield a Stop that takes all signals while the context lasts (main thread only)."""
    stop = Stop()
    with _handle_signals_by(stop):
        yield stop


@contextlib.contextmanager
def _handle_signals_by(handler: Callable[[int, FrameType | None], None]) -> Iterator[None]:
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
    """Postpone Ctrl-C while a short piece of work, such as a compilation, must not be torn (main thread only).

    Yields:
        A function that raises KeyboardInterrupt if Ctrl-C came meanwhile, and lets it through from then on.  The end of
        the context does the same.
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


def ignore_interruption() -> None:
    """Ignore Ctrl-C in this process from now on: the process that started it receives it as well, and ends it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def let_the_status_count() -> None:
    """Let the process end with its own status although a KeyboardInterrupt came.

    Where one passes an exec() of text, as those of dataclasses, Python notes it, and ends by the signal although it
    was handled since.  The next exec() of text takes the note back.
    """
    exec("")  # noqa: S102 - it is empty


def ignore_all_signals() -> None:
    """Ignore what asks for the end, in this process and from now on: it has said its last word, and is ending."""
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_IGN)


@contextlib.contextmanager
def interruption_ends_process(status: int, line: str) -> Iterator[None]:
    """Let Ctrl-C end this process at once while modules are imported and nothing has begun (main thread only).

    KeyboardInterrupt would not do there.  In a callback of the import system Python ignores it, and while a class is
    made it becomes the cause of a RuntimeError.

    Args:
        status: of the process.
        line: what it says on standard error.
    """
    before = end_process_at_interruption(status, line)
    try:
        yield
    finally:
        if before is not None:
            signal.signal(signal.SIGINT, before)


def end_process_at_interruption(status: int, line: str = "") -> Callable[[int, FrameType | None], object] | None:
    """Let Ctrl-C end this process at once from now on; see `interruption_ends_process`.

    Returns:
        Python's handler, which was in force before; None where another is, or none, and stays.
    """

    def end(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - a signal handler
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(Exception):  # it may be at work, or closed
                stream.flush()
        with contextlib.suppress(OSError):
            os.write(2, line.encode())
        os._exit(status)

    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        return None
    signal.signal(signal.SIGINT, end)
    return signal.default_int_handler


@contextlib.contextmanager
def interruption_blocked() -> Iterator[None]:
    """Block Ctrl-C for the moment in which a process is started: it inherits that, and this process gets it afterwards.

    On Windows nothing is blocked; what is started there ignores Ctrl-C once it calls `ignore_interruption`.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)

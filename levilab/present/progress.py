"""The progress of a command on standard error: a bar on a terminal; elsewhere an acquisition prints lines."""

from __future__ import annotations

import contextlib
import multiprocessing
import sys
import time
from typing import TYPE_CHECKING

from levilab.present.characters import for_encoding, printable
from levilab.present.panel import Trend, bench_lines, time_left_in_words
from levilab.texts.text import Text, in_language

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Console
    from rich.progress import Progress
    from rich.text import Text as Styled

    from levilab.telemetry.messages import State

#: Time from one drawing of the bench to the next [s].
_DRAWN_EVERY_S = 0.25
#: Style of a piece → rich's.
_STYLES = {"plain": "", "strong": "bold", "on": "green", "off": "dim", "alarm": "bold red"}


class Display:
    """The progress of an acquisition; this one shows nothing, others override what they show."""

    def preparing(self, text: str, fraction: float) -> None:
        """Show how far the bench is prepared."""

    def reading(self, text: str, elapsed: float, remaining: tuple[float, float]) -> None:
        """Show a reading that is on the disk.

        Args:
            text: the reading.
            elapsed: bench time since the start [s].
            remaining: expected until the end, at least and at most [s].
        """

    def message(self, text: str) -> None:
        """Show a line of its own."""

    def is_due(self) -> bool:
        """Return whether the state of the bench is to be shown now."""
        return False

    def state(self, state: State) -> None:
        """Show the state of the bench."""

    def close(self) -> None:
        """End the display."""


class LineDisplay(Display):
    """One line a reading, for logs, pipes and tests.

    Args:
        bench_time: whether the bench does not keep to the wall clock, so that its time left is not that of a person.
    """

    def __init__(self, *, bench_time: bool = False) -> None:
        self._gone, self._bench_time = False, bench_time
        self._fifths, self._prepared = 0, ""

    def preparing(self, text: str, fraction: float) -> None:
        """Print a line each fifth of the way, of each part of it; none for a step back by noise, or as the last."""
        before, self._fifths = self._fifths, max(int(5 * fraction), min(self._fifths, int(5 * fraction + 0.2)))
        if self._fifths > before and text != self._prepared:
            self._prepared = text
            self.message(text)

    def reading(self, text: str, elapsed: float, remaining: tuple[float, float]) -> None:
        """Print a line."""
        left = time_left_in_words(*remaining, bench_time=self._bench_time)
        self.message(Text("{reading}   {left}", reading=text, left=left) if remaining[1] >= 0.5 else text)

    def message(self, text: str) -> None:
        """Print a line.  A closed standard error does not end a measurement."""
        if self._gone:
            return
        try:
            print(printable(in_language(text)), file=sys.stderr, flush=True)  # noqa: T201 - this is where it is shown
        except OSError:
            self._gone = True


class BarDisplay(Display):
    """The readings as lines, and below them the bench as it is: last value, trend, instruments, time left.

    It has no thread: it is drawn again when the bench has something to show, at most four times a second.  A
    terminal that is gone, as with a window that was closed, ends no measurement.

    Args:
        console: by default one on standard error.
    """

    def __init__(self, console: Console | None = None) -> None:
        from rich.live import Live

        from levilab.present.terminal import Terminal

        self._console = console or Terminal(stderr=True)
        self._trend = Trend()
        self._next = 0.0
        self._shown: State | None = None
        self._live = Live(
            console=self._console,
            auto_refresh=False,
            transient=True,
            redirect_stdout=False,
            redirect_stderr=False,
            get_renderable=self._panel,
        )
        self._gone = False
        self._draw(self._live.start)

    def _draw(self, action: Callable[[], object]) -> None:
        """Write to the terminal, as long as it is there."""
        if self._gone:
            return
        try:
            action()
        except OSError:
            self._gone = True

    def _panel(self) -> Styled:
        from rich.text import Text as Styled

        if self._shown is None:
            return Styled(in_language("connecting"))
        console = self._console
        plain = bool(for_encoding("▁━", console.encoding) != "▁━")
        width = max(console.width - 1, 10)  # a full line would begin another one
        lines = bench_lines(self._shown, self._trend, width, plain=plain)
        text = Styled(no_wrap=True)
        for k, line in enumerate(lines):
            text.append("\n" * bool(k))
            for piece in line:
                text.append(for_encoding(piece.text, console.encoding), style=_STYLES[piece.style])
        return text

    def reading(self, text: str, elapsed: float, remaining: tuple[float, float]) -> None:
        """Print a line above; time left stands below."""
        self.message(text)
        self._next = 0.0

    def message(self, text: str) -> None:
        """Print a line above."""
        self._draw(lambda: self._console.print(printable(in_language(text)), markup=False, highlight=False))

    def is_due(self) -> bool:
        """Return whether the last drawing is long enough ago, or a reading came since."""
        return time.monotonic() >= self._next

    def state(self, state: State) -> None:
        """Draw the bench."""
        self._next = time.monotonic() + _DRAWN_EVERY_S
        self._shown = state
        self._trend.take(state)
        self._draw(self._live.refresh)

    def close(self) -> None:
        """Take the lines of the bench away; the readings stay."""
        self._draw(self._live.stop)


def to_stderr(*, bench_time: bool = False) -> Display:
    """Return a bar on a terminal, lines elsewhere.  bench_time: see LineDisplay."""
    return BarDisplay() if sys.stderr.isatty() else LineDisplay(bench_time=bench_time)


def time_in_words(seconds: float) -> str:
    """Return an estimated time in whole seconds, minutes, hours or days.

    >>> [time_in_words(seconds) for seconds in (0.2, 47, 130, 4000, 40_000, 400_000)]
    ['1 s', '47 s', '2 min', '1 h 7 min', '11 h', '5 days']
    """
    minutes = round(seconds / 60)
    if seconds < 99.5:
        return f"{max(round(seconds), 1)} s"
    if minutes < 60:
        return f"{minutes} min"
    if minutes < 5 * 60:
        return f"{minutes // 60} h {minutes % 60} min"
    return f"{round(minutes / 60)} h" if minutes < 48 * 60 else f"{round(minutes / 60 / 24)} days"


class ShareBar:
    """A bar on a terminal for work whose progress is known, once it takes longer than a second.

    A worker process shows nothing: several bars would be drawn over one another, and its parent shows the whole.
    A share that goes back is a new attempt: a simulation tries shorter steps until its error is small enough.

    Args:
        description: of the work.
        first: the share that was done before.
        line_every: interval between lines [s] where standard error is no terminal, as in a log; None: no lines.
    """

    def __init__(self, description: str, *, first: float = 0.0, line_every: float | None = None) -> None:
        self._description, self._line_every = description, line_every
        self._begin = self._line = time.monotonic()
        self._bar: Progress | None = None
        self._first = self._last = first
        self._attempt = 1

    def __call__(self, share: float, description: str = "") -> None:
        """Show the share that is done, and the work, if its description changes."""
        if multiprocessing.parent_process():
            return
        now = time.monotonic()
        self._description = description or self._description
        if share < self._last:
            self._attempt += 1
            self._first, self._begin = 0.0, now
        self._last = share
        left = self._time_left(share, now)
        if self._bar is None and sys.stderr.isatty() and (now - self._begin > 1 or self._attempt > 1):
            self._bar = self._open()
        if self._bar is not None:
            again = f", attempt {self._attempt} with shorter steps" if self._attempt > 1 else ""
            self._bar.update(self._task, description=self._description + again, completed=share, left=left)
        elif self._line_every is not None and now - self._line >= self._line_every:
            self._line = now
            with contextlib.suppress(OSError):  # a closed standard error ends no work
                text = f"{self._description}: {100 * share:.0f} %{', ' * bool(left)}{left}"
                print(printable(text), file=sys.stderr, flush=True)  # noqa: T201 - this is where it is shown

    def _time_left(self, share: float, now: float) -> str:
        """Return how long the rest takes if it goes on as it did since the first share; empty where that is unknown.

        What begins slowly would take hours by its first per cent.
        """
        since, passed = share - self._first, now - self._begin
        if since <= 0 or share >= 1 or passed < 1 or (since < 0.01 and passed < 30):
            return ""
        return f"about {time_in_words(passed * (1 - share) / since)} left"

    def _open(self) -> Progress:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        percentage, left = TextColumn("{task.percentage:3.0f} %"), TextColumn("{task.fields[left]}")
        columns = TextColumn("{task.description}"), BarColumn(bar_width=30), percentage, left
        bar = Progress(*columns, console=Console(stderr=True), transient=True)
        self._task = bar.add_task(self._description, total=1.0, left="")
        bar.start()
        return bar

    def close(self) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.stop()

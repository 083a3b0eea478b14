"""What reciprocal counters have in common."""

import contextlib
from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from instruments.drivers.counter import LIGHT, Count, Signal
from instruments.drivers.scpi import ScpiInstrument, parse_reading
from instruments.errors import BadAnswer, InstrumentError, NoAnswer, OutOfRange

#: Readings that are fetched with one question: an answer of 25 kB, seconds apart at most.
READINGS_AT_ONCE = 1000
#: Readings that are waited for with one question: so long, at most [s].  VISA waits for 49 days and no longer.
LONGEST_WAIT_S = 30 * 86400.0
#: The impedances of an input [ohm]; the same printed short (regular expression, without a sign).
IMPEDANCES_OHM = (50.0, 1e6)
IMPEDANCES = r"50|1000000|5\.0{1,9}E\+01|1\.0{1,9}E\+06"


class ReciprocalCounter(ScpiInstrument):
    """What the drivers share: how long to wait for an answer, and what to do when none comes.

    MOST: readings that the memory holds; EMPTY_IS_NONE: whether an empty answer, or an empty place in a list, means
    that there was no reading.
    """

    MOST: ClassVar[int] = 1_000_000
    EMPTY_IS_NONE: ClassVar[bool] = False
    ANSWERS_JOINED = True
    SIGNAL: ClassVar[Signal] = LIGHT
    ESTIMATES: ClassVar[bool] = False
    last: Count | None = None

    #: The input in use, which prepare() chooses.
    channel = 1

    #: How long the counter may work on one reading [s]; prepare() sets it.
    _patience = 3.0
    #: Whether it says so itself when there is no signal; prepare() sets it up to do so.
    _gives_up = False
    #: The commands that end the series for which the counter is still set up; none, if it is not.
    _unsent_end: tuple[str, ...] = ()

    def header_in_use(self, header: str) -> str:
        """See the base; the settings are declared with the header of input 1."""
        return header.replace("INP1:", f"INP{self.channel}:")

    @property
    def channels(self) -> tuple[int, ...]:
        """The inputs that count slow pulses; 1 and 2 stand as A and B on the front of a CNT-91."""
        return (1, 2)

    def _choose(self, channel: int) -> None:
        """Measure frequency at this input from now on.  Raises OutOfRange."""
        if channel not in self.channels:
            raise OutOfRange(self.transport.address, "channel", channel, " or ".join(map(str, self.channels)))
        if channel != self.channel:
            self.last_set.clear()  # these settings are the other input's
        self.channel = channel
        self.command(f"CONF:FREQ (@{channel})")

    def frequency(self) -> float | None:
        """Return one reading [Hz], or None; see :class:`Counter`.  Raises CommandRefused if an error was waiting."""
        self._end_old_series()
        answer = self._ask("READ?", self._patience)
        with self.clearing_on_bad_answer():
            return None if answer is None else self._reading("READ?", answer)

    def _reading(self, question: str, answer: str) -> float | None:
        """Return a frequency or a time, or None.  Raises BadAnswer: neither is negative."""
        if not answer and self.EMPTY_IS_NONE:
            return None
        value = parse_reading(self.transport.address, question, answer, self.NUMBER)
        if value is not None and value < 0:
            raise BadAnswer(self.transport.address, question, answer, f"a number from 0 on, as {self.NUMBER.example}")
        return value

    def _ask(self, question: str, patience: float) -> str | None:
        """Read the error queue, then the data; None when a counter that may wait for ever never answers.

        A counter that is set to give up answers in any case: then silence is a fault of the link, and no sign of a dark
        signal.
        """
        self.raise_errors(question)
        try:
            return self.transport.query(question, patience=patience)
        except NoAnswer as silence:
            try:
                self._give_up()
            except InstrumentError:
                raise silence from None
            if self._gives_up:
                raise
            return None

    @contextlib.contextmanager
    def _series(self, *commands: str, end: tuple[str, ...]) -> Iterator[None]:
        """Set the counter up for a series with these commands, and back for single readings, whatever ends it.

        After an error or an interruption the measurement is stopped, too.  If the counter cannot be reached then, or a
        second interruption comes, that is done before the next reading.
        """
        self._end_old_series()
        self._unsent_end = end
        try:
            for command in commands:
                self.command(command)
            yield
        except BaseException:  # Ctrl-C as well
            with contextlib.suppress(InstrumentError):  # the first error says more
                self._give_up()
                self._end_series()
            raise
        self._end_series()

    def _end_series(self) -> None:
        for command in self._unsent_end:
            self.command(command)
        self._unsent_end = ()

    def _end_old_series(self) -> None:
        if self._unsent_end:
            self._give_up()
            self._end_series()

    def _give_up(self) -> None:
        """Stop a measurement that does not end, and raise the link's error where it is dead."""
        self.transport.clear()
        self.forget_errors()  # a query cut off leaves −410 behind
        self.command("ABOR")

    def _check_count(self, count: int) -> None:
        if not 1 <= count <= self.MOST:
            raise OutOfRange(self.transport.address, "count", count, f"1 to {self.MOST}")

    def _split(self, question: str, answer: str, expected: int) -> list[float]:
        """Return the numbers of a list, NaN for no reading.  Raises BadAnswer if there are more or fewer."""
        words = answer.split(",")
        if len(words) != expected:
            raise BadAnswer(self.transport.address, question, answer, f"{expected} numbers, not {len(words)}")
        found = (self._reading(question, word) for word in words)
        return [np.nan if value is None else value for value in found]

"""What can go wrong between a driver and its instrument: one small tree.

Each error says what was seen, what was expected and what to do, and carries the values as attributes.
"""


class InstrumentError(Exception):
    """Anything that an instrument, or the way to it, did wrong.  address: the resource name; reason: all but that."""

    def __init__(self, address: str, reason: str) -> None:
        self.address, self.reason = address, reason
        super().__init__(f"{address}: {reason}")


class NotConnected(InstrumentError):
    """No instrument could be reached at this address."""


class Occupied(NotConnected):
    """Another program holds the instrument."""

    def __init__(self, address: str) -> None:
        text = "another program has locked the instrument, or a lost link still has: end it, or wait"
        super().__init__(address, text)


class NoAnswer(InstrumentError):
    """The instrument stayed silent.  question: what was asked; timeout: how long was waited [s]."""

    ADVICE = "is it switched on, and free of other programs?"

    def __init__(self, address: str, question: str, timeout: float) -> None:
        self.question, self.timeout = question, timeout
        super().__init__(address, f"no answer to {question!r} within {timeout:g} s: {self.ADVICE}")


class SilentLine(NoAnswer):
    """No answer on a serial line."""

    ADVICE = f"{NoAnswer.ADVICE} Are baud rate, data bits and parity those of the instrument?"


#: What to try after a bad answer, and how much of one stands in the message.
_ASK_AGAIN = "ask again; if it stays so, check the model, the cable, and that no other program uses this link"
_LONGEST_SHOWN = 80


class BadAnswer(InstrumentError):
    """The instrument answered something else than was expected.

    question: the message that was sent; answer: what came, whole; expected: the form of an answer, as text; advice:
    what to try.
    """

    def __init__(self, address: str, question: str, answer: str, expected: str, advice: str = _ASK_AGAIN) -> None:
        self.question, self.answer, self.expected = question, answer, expected
        shown = answer if len(answer) <= _LONGEST_SHOWN else f"{answer[:_LONGEST_SHOWN]}…"
        super().__init__(address, f"{question!r} was answered with {shown!r}, expected {expected}: {advice}")


class CommandRefused(InstrumentError):
    """The instrument's error queue was not empty after a command.  entries: its texts, oldest first."""

    def __init__(self, address: str, command: str, entries: tuple[str, ...]) -> None:
        self.command, self.entries = command, entries
        more = f" and {len(entries) - 4} more" if len(entries) > 4 else ""
        super().__init__(address, f"after {command!r} the instrument reports {'; '.join(entries[:4])}{more}")


class SettingsLost(InstrumentError):
    """A person, a program or a reset has changed the instrument's settings.  changed: name → (as set, now)."""

    def __init__(self, address: str, changed: dict[str, tuple[object, object]]) -> None:
        self.changed = changed
        differences = ", ".join(f"{name} = {now} instead of {then}" for name, (then, now) in list(changed.items())[:3])
        super().__init__(
            address, f"its settings were changed meanwhile ({differences}): leave its keys alone during a run"
        )


class WrongInstrument(InstrumentError):
    """Another model than expected answered.  identity: its answer to ``*IDN?``."""

    def __init__(self, address: str, identity: str, expected: str) -> None:
        self.identity, self.expected = identity, expected
        super().__init__(address, f"{identity!r} answered, expected {expected}: check the address")


class OutOfRange(InstrumentError, ValueError):
    """A setting that the instrument, or the bench, does not allow; nothing was sent."""

    def __init__(self, address: str, name: str, value: object, allowed: str) -> None:
        self.name, self.value, self.allowed = name, value, allowed
        super().__init__(address, f"{name} = {value} is refused, allowed is {allowed}")

"""What goes wrong in ways that a person can mend: told in one line, never as a traceback."""

from __future__ import annotations

import re


class LevilabError(Exception):
    """A known failure. The text says what was seen, what was expected and what to do.

    A quantity that the caller can set stands in the text between backquotes, by the name of the function's argument:
    "free space, or choose another place with `out`". The command line writes it as its option, ``--out``.
    """


#: A quantity in a message.
_QUANTITY = re.compile(r"`([a-z]\w*)`")


def unquoted(text: str) -> str:
    """A message as it is stored for people who may never see the command line: quantities without backquotes.

    >>> unquoted("f.csv: say `columns` = t=1,f=2; `levilab analyze` reads it then")
    'f.csv: say columns = t=1,f=2; `levilab analyze` reads it then'
    """
    return _QUANTITY.sub(r"\1", text)


class UsageError(LevilabError):
    """A setting that the caller gave wrongly. The command line ends with the exit status of wrong usage.

    >>> print(UsageError("duration", "a number above 0 is expected", value=-1))
    duration = -1: a number above 0 is expected
    >>> print(UsageError("seed", "goes with `mock` alone"))
    seed: goes with `mock` alone

    Attributes:
        name: the quantity, as the function's argument is called: ``duration``.
        text: what is wrong with it, what was expected, what to do; other quantities stand between backquotes.
        value: what was given, as text; None where it does not matter.
    """

    def __init__(self, name: str, text: str, *, value: object = None) -> None:
        self.name, self.text = name, text
        self.value = None if value is None else _shown(value)
        super().__init__(f"{name}: {text}" if self.value is None else f"{name} = {self.value}: {text}")


class DataError(LevilabError):
    """A data file or run folder that cannot be used as it is."""


class DoesNotSuit(DataError):
    """What lies there is sound, but of another kind than an analysis needs: another experiment, other columns."""


class NoneUsable(DataError):
    """A folder that was searched: of what an analysis takes there, nothing can be used."""


class NoInstrument(LevilabError):
    """No instrument answered that there is a driver for."""


class SimulationError(LevilabError):
    """A simulation that cannot be carried out."""


class LeftRange(SimulationError):
    """A motion that cannot be followed on because its numbers leave their range, as at the base's edges."""


def _shown(value: object) -> str:
    """A number as one writes it, anything else as it was given, cut where it is long."""
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 60 else f"{text[:59]}…"

"""Failures that a user can mend: each is one line, never a traceback."""

import re
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from levilab.texts.text import Text, either, languages


class LevilabError(Exception):
    """A known failure. The text says what was seen, what was expected and what to do.

    A quantity that the caller can set stands in the text between backquotes, by the name of the function's argument:
    "free space, or choose another place with `out`". The command line writes it as its option, ``--out``.
    """

    def __init__(self, text: str = "", /, *in_order: Any, **values: object) -> None:
        """Say why, in a template with its values as `Text` takes them, which has other languages, or in a text."""
        super().__init__(Text(text, *in_order, **values) if in_order or values else text)


#: A quantity in a message.
_QUANTITY = re.compile(r"`([a-z]\w*)`")


def as_typed(path: object) -> str:
    """Return a path as it is typed in a command, on any system.

    >>> as_typed("my.csv"), as_typed("Raw Data.csv")
    ('my.csv', '"Raw Data.csv"')
    """
    return f'"{path}"' if set(str(path)) & set(" &;()") else str(path)


def unquote(text: str) -> str:
    """Return a message without its backquotes, for a file: its reader may not use the command line.

    >>> unquote('f.csv: say `columns` = "t=1,f=2"; `levilab analyze` reads it then')
    'f.csv: say columns = "t=1,f=2"; `levilab analyze` reads it then'
    """
    return _QUANTITY.sub(r"\1", text)


def list_known(name: str, known: Iterable[str]) -> str:
    """Return the end of a message about an unknown name: the one that was probably meant, and all.

    >>> list_known("spindon", ["spin", "spindown"]), list_known("x", ["spin", "spindown"])
    ('did you mean spindown? Known are spin, spindown', 'known are spin, spindown')
    """
    names = [*known]
    near = "".join(get_close_matches(name, names, n=1))
    said = "did you mean {near:s}? Known are {names:s}" if near else "known are {names:s}"
    return Text(said, near=near, names=", ".join(names))


class RequestError(LevilabError):
    """A request that is wrong in itself, whatever the data are. The command line ends with its own exit status."""


class UsageError(RequestError):
    """A wrong value of an argument or of a setting, which the error names.

    >>> print(UsageError("duration", "a number above 0 is expected", value=-1))
    duration = -1: a number above 0 is expected
    >>> print(UsageError("seed", "goes with `mock` alone"))
    seed: goes with `mock` alone

    Attributes:
        name: the name of the function's argument, such as ``duration``.
        text: what is wrong with it, what was expected, what to do; other quantities stand between backquotes.
        value: the wrong value as text; None where it does not matter.
    """

    def __init__(self, name: str, text: str, *in_order: Any, value: object = None) -> None:
        self.name, self.text = name, Text(text, *in_order) if in_order else text
        self.value = None if value is None else _short_text(value)
        super().__init__("{name}: {text}" if value is None else "{name} = {value}: {text}", **vars(self))


def check_ending(path: Path, endings: Iterable[str], name: str = "out") -> None:
    """Raise UsageError for a file that an argument of this name has, and whose name has none of the endings."""
    known = [*endings]
    if path.suffix.lower() not in known:
        raise UsageError(name, "a name that ends in {named} is expected", either(known), value=path)


def check_language(code: str, name: str = "language") -> None:
    """Raise UsageError for a language that levilab does not speak, and that an argument of this name has."""
    if code not in languages():
        raise UsageError(name, "one of {known:s} is expected", ", ".join(languages()), value=code)


class DataError(LevilabError):
    """A data file or run folder that cannot be used as it is."""


class DoesNotSuit(DataError):
    """The data are sound, but not what an analysis needs: they are of another experiment, or have other columns."""


class DoubtWarning(UserWarning):
    """A doubt that makes numbers worthless where it is right, as `doubts` of a result; or a setting without effect."""


class NoInstrument(LevilabError):
    """No instrument with a driver answered."""


class SimulationError(LevilabError):
    """A simulation that cannot be carried out."""


class LeftRange(SimulationError):
    """A motion whose numbers leave their range, as at the base's edges, so that it cannot be continued."""


class WorkersLost(LevilabError):
    """Workers cannot be reached or cannot compute; the results so far are kept."""


def _short_text(value: object) -> str:
    """Return a value as text of at most 60 characters."""
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 60 else f"{text[:59]}…"

"""A call on its way to another process and back: pickled here, so that what fails on the way names its task.

An executor pickles by itself, but if a worker cannot unpickle a call, it dies and takes a whole pool with it.
"""

from __future__ import annotations

import pickle
import platform
import traceback
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from levilab.errors import LevilabError

if TYPE_CHECKING:
    from collections.abc import Callable

#: Results depend to the last bit on the versions of these, and pickles on Python's.
LIBRARIES = ("levilab", "numpy", "numba", "llvmlite")


@dataclass(frozen=True)
class Outcome:
    """What came of a call.

    Attributes:
        result: what the function returned.
        error: what it raised.
        unusable: why this worker cannot do any task of this kind; empty if it can.
    """

    result: Any = None
    error: Exception | None = None
    unusable: str = ""


@cache
def versions() -> dict[str, str]:
    """Name → version of what results depend on, in this process."""
    found = {"Python": ".".join(platform.python_version_tuple()[:2])}
    for name in LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "missing"
    return found


def call_here(function: Callable[[Any], Any], task: Any) -> Outcome:
    """Call a function in this process."""
    try:
        return Outcome(function(task))
    except Exception as error:  # noqa: BLE001 - it goes back with its task
        return Outcome(error=error)


def packed(function: Callable[[Any], Any]) -> Callable[[Any], tuple[Callable[..., Outcome], bytes, bytes]]:
    """Return what turns a task into what a worker is given: a function of this module and two pickles.

    Raises:
        LevilabError: the function or a task cannot be pickled.
    """
    head = pickle.dumps((versions(), _pickled(function, "function")))
    return lambda task: (call_there, head, _pickled(task, "task"))


def _pickled(thing: Any, what: str) -> bytes:
    try:
        return pickle.dumps(thing)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise LevilabError(
            f"this {what} cannot be sent to another process ({error}): "
            "a function at the head of a module and plain data are expected"
        ) from error


def call_there(head: bytes, task: bytes) -> Outcome:
    """Call a packed function with a packed task; this runs in the worker."""
    try:
        function = _function(head)
        argument = pickle.loads(task)
    except _OtherVersionsError as error:
        return Outcome(unusable=str(error))
    except Exception as error:  # noqa: BLE001 - anything may go wrong in unpickling
        return Outcome(unusable=f"cannot load the task ({type(error).__name__}: {error})")
    outcome = call_here(function, argument)
    return outcome if outcome.error is None else Outcome(error=_that_travels(outcome.error))


class _OtherVersionsError(Exception):
    """This process has other versions than the one that sent the call."""


@lru_cache(maxsize=4)
def _function(head: bytes) -> Callable[[Any], Any]:
    """Unpickle a function, once in this process.  Raises what unpickling raises."""
    theirs, function = pickle.loads(head)
    other = [f"{name} {number}" for name, number in versions().items() if number != theirs[name]]
    if other:
        expected = ", ".join(f"{name} {number}" for name, number in theirs.items() if number != versions()[name])
        raise _OtherVersionsError(f"has {', '.join(other)}, and {expected} is expected")
    unpickled: Callable[[Any], Any] = pickle.loads(function)
    return unpickled


def _that_travels(error: Exception) -> Exception:
    """Return an error that can be unpickled, with the traceback as a note: the error itself where it can be."""
    note = "".join(traceback.format_exception(error)).rstrip()
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # noqa: BLE001 - an error's own pickling may raise anything
        known = isinstance(error, LevilabError)
        error = LevilabError(str(error)) if known else RuntimeError(f"{type(error).__name__}: {error}")
    error.add_note(f"in the worker:\n{note}")
    return error

"""Pickle calls for other processes and their outcomes, so that an error in pickling belongs to its task.

An executor pickles by itself, but if a worker cannot unpickle a call, the worker dies and breaks the whole pool.
"""

import pickle
import platform
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from levilab.errors import LevilabError

#: Results depend to the last bit on the versions of these, and pickles on Python's.
LIBRARIES = ("levilab", "Python", "numpy", "numba", "llvmlite")


@dataclass(frozen=True)
class Outcome:
    """The outcome of a call.

    Attributes:
        result: what the function returned.
        error: the error that it raised.
        unusable: why this worker cannot do any task of this kind; empty if it can.
    """

    result: Any = None
    error: Exception | None = None
    unusable: str = ""


@cache
def version_of(name: str) -> str:
    """Return the version of a library in this process."""
    if name == "Python":
        return ".".join(platform.python_version_tuple()[:2])
    try:
        return version(name)
    except PackageNotFoundError:
        return "missing"


def call_here(function: Callable[[Any], Any], task: Any) -> Outcome:
    """Call a function in this process."""
    try:
        return Outcome(function(task))
    except Exception as error:  # noqa: BLE001 - it goes back with its task
        return Outcome(error=error)


def call_packer(function: Callable[[Any], Any]) -> Callable[[Any], tuple[Callable[..., bytes], bytes, bytes]]:
    """Return a function that turns a task into the arguments of `submit`: a function of this module and two pickles.

    The worker returns a pickle, too: `unpack` makes an outcome of it.

    Raises:
        LevilabError: the function or a task cannot be pickled.
    """
    inner = function.func if isinstance(function, partial) else function
    if getattr(inner, "__module__", "") == "__main__":
        raise LevilabError(
            f"the function {getattr(inner, '__name__', inner)} stands in the script that runs, which other processes "
            "do not run again: put it into a module of its own, and import it"
        )
    head = pickle.dumps(({name: version_of(name) for name in LIBRARIES}, _pickle(function, "function")))
    return lambda task: (call_there, head, _pickle(task, "task"))


def _pickle(thing: Any, what: str) -> bytes:
    try:
        return pickle.dumps(thing)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise LevilabError(
            f"this {what} cannot be sent to another process ({error}): "
            "a function at the head of a module and plain data are expected"
        ) from error


def call_there(head: bytes, task: bytes) -> bytes:
    """Call a pickled function with a pickled task and pickle the outcome; this runs in the worker."""
    try:
        function = _function(head)
        argument = pickle.loads(task)
    except _OtherVersionsError as error:
        outcome = Outcome(unusable=str(error))
    except Exception as error:  # noqa: BLE001 - anything may go wrong in unpickling
        outcome = Outcome(unusable=f"cannot load the task ({type(error).__name__}: {error})")
    else:
        outcome = call_here(function, argument)
    if outcome.error is not None:
        outcome = Outcome(error=_make_picklable(outcome.error))
    try:
        return _pickle(outcome, "result")
    except LevilabError as error:
        return pickle.dumps(Outcome(error=error))


def unpack(answer: Outcome | bytes) -> Outcome:
    """Return the outcome of a call in this process or in another one."""
    if isinstance(answer, Outcome):
        return answer
    outcome: Outcome = pickle.loads(answer)
    return outcome


class _OtherVersionsError(Exception):
    """This process has other versions than the one that sent the call."""


@lru_cache(maxsize=4)
def _function(head: bytes) -> Callable[[Any], Any]:
    """Unpickle a function, once in this process.  Raises what unpickling raises."""
    expected, function = pickle.loads(head)
    other = [name for name, number in expected.items() if version_of(name) != number]
    if other:
        seen = ", ".join(f"{name} {version_of(name)}" for name in other)
        raise _OtherVersionsError(f"has {seen} instead of {', '.join(expected[name] for name in other)}")
    unpickled: Callable[[Any], Any] = pickle.loads(function)
    return unpickled


def _make_picklable(error: Exception) -> Exception:
    """Return an error that can be unpickled, with the traceback as a note: the error itself where it can be."""
    note = "".join(traceback.format_exception(error)).rstrip()
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # noqa: BLE001 - an error's own pickling may raise anything
        known = isinstance(error, LevilabError)
        error = LevilabError(str(error)) if known else RuntimeError(f"{type(error).__name__}: {error}")
    error.add_note(f"in the worker:\n{note}")
    return error

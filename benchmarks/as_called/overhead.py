"""The time of a call outside of compiled code: checks, the model, the search for a step, the result."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from numba.core.dispatcher import Dispatcher

from as_called import many
from as_called.contenders import scene_of
from as_called.motions import UNDRIVEN
from levilab.benchmark.simulator.peers import CLOCK
from levilab.simulator.single import simulate

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

SIMULATOR = "levilab.simulator."

#: The module of a call into compiled code, its begin and its end [s].
Kernel = tuple[str, float, float]


@dataclass(frozen=True)
class Watched:
    """A call whose time outside of compiled code is measured.

    Attributes:
        part: of the benchmark.
        name: in words.
        call: makes it.
        outside: from begin, end and kernels of a call to that time [s].
        repetitions: of which the shortest counts.
        aim: [s].
    """

    part: str
    name: str
    call: Callable[[], Any]
    outside: Callable[[float, float, list[Kernel]], float]
    repetitions: int
    aim: float


@dataclass(frozen=True)
class Overhead:
    """The time of a call outside of compiled code, of the whole call, and the aim for the former [s]."""

    call: str
    outside: float
    whole: float
    aim: float


@contextmanager
def watched_kernels() -> Iterator[list[Kernel]]:
    """Yield a list that every call from the simulator into compiled code is written to.

    The compiled functions that its modules call are replaced meanwhile by ones that read the clock.
    """
    calls: list[Kernel] = []

    def watched(function: Any) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            begin = CLOCK()
            result = function(*arguments)
            calls.append((function.py_func.__module__, begin, CLOCK()))
            return result

        return call

    places = [
        (module, name, value)
        for path, module in list(sys.modules.items())
        if path.startswith(SIMULATOR) and not path.startswith(f"{SIMULATOR}kernels")
        for name, value in list(vars(module).items())
        if isinstance(value, Dispatcher)
    ]
    try:
        for module, name, value in places:
            setattr(module, name, watched(value))
        yield calls
    finally:
        for module, name, value in places:
            setattr(module, name, value)


def overhead(watched: Watched) -> Overhead:
    """Measure the call."""
    found = []
    with watched_kernels() as kernels:
        for _ in range(watched.repetitions):
            kernels.clear()
            begin = CLOCK()
            watched.call()
            end = CLOCK()
            found.append((watched.outside(begin, end, kernels), end - begin))
    return Overhead(watched.name, *min(found), watched.aim)


def outside_all(begin: float, end: float, kernels: list[Kernel]) -> float:
    """Return the time that no kernel ran."""
    return end - begin - sum(b - a for _, a, b in kernels)


def before_lanes(begin: float, end: float, kernels: list[Kernel]) -> float:
    """Return the time before the first kernel with lanes in which no other kernel ran."""
    first = min((a for module, a, _ in kernels if module.endswith(".lanes")), default=end)
    return outside_all(begin, first, [kernel for kernel in kernels if kernel[2] <= first])


def _one_top() -> Any:
    return simulate(scene_of(UNDRIVEN), 5.0, tolerance=1e-8, rate=None)


def _ensemble() -> Any:
    return many.simulate_them(many.DURATION, 1e-11)


OVERHEADS = (
    Watched("called", "simulate, 5 s at 1e-8 m, outside of kernels", _one_top, outside_all, 100, 1e-4),
    Watched("ensemble", "simulate_many, 1000 tops, before the first kernel", _ensemble, before_lanes, 5, 0.02),
)

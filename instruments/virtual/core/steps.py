"""Work in steps: what takes long to be worked out, with places between where others may have their turn.

A question such as READ? makes a model look at hours of light.  It is a generator that yields now and then: in process
it is driven to its end at once, a server drives it in slices and serves its other clients meanwhile.
"""

from __future__ import annotations

import inspect
from collections.abc import Generator
from typing import Generic, TypeVar

T = TypeVar("T")

#: Work that yields where it may be interrupted, and returns its result.
Steps = Generator[None, None, T]


def run_to_end(steps: Steps[T]) -> T:
    """The result, without interruption."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: T = end.value
            return result


class Work(Generic[T]):
    """Steps that are driven on one by one, until they are done or cancelled.

    result: None until then, and if it was cancelled; error: that ended it.
    """

    def __init__(self, steps: Steps[T]) -> None:
        self._steps = steps
        self.done = False
        self.result: T | None = None
        self.error: Exception | None = None

    def step(self) -> bool:
        """One step; whether there is more to do."""
        if not self.done:
            try:
                next(self._steps)
            except StopIteration as end:
                self.result, self.done = end.value, True
            except Exception as error:  # noqa: BLE001 - raised where the work was asked for
                self.error, self.done = error, True
        return not self.done

    def cancel(self) -> None:
        """No more of it; what gives itself up (ABORt) goes on to its own end."""
        if inspect.getgeneratorstate(self._steps) != inspect.GEN_RUNNING:
            self._steps.close()
            self.done = True

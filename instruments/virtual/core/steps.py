"""Work in steps: a long computation that pauses so that other work can have its turn.

A query such as READ? makes a model look at hours of light.  Its answer is computed by a generator that yields now and
then: a program in the same process runs it to its end, a server runs it in slices, and serves its other clients in
between.
"""

import inspect
from collections.abc import Generator
from typing import TypeVar

T = TypeVar("T")

#: Work that yields where it may be interrupted, and returns its result.
Steps = Generator[None, None, T]


def run_to_end(steps: Steps[T]) -> T:
    """Run the steps without a pause.  Returns their result."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: T = end.value
            return result


class Work:
    """Steps to run one by one, until they are done or cancelled.

    Attributes:
        done: whether they have ended.
        error: the exception that ended them, None where none did.
    """

    def __init__(self, steps: Steps[None]) -> None:
        self._steps = steps
        self.done = False
        self.error: Exception | None = None

    def step(self) -> bool:
        """Run one step.  Returns whether there is more to do."""
        try:
            next(self._steps)
        except StopIteration:
            self.done = True
        except Exception as error:  # noqa: BLE001 - raised where the end is awaited
            self.error, self.done = error, True
        return not self.done

    def cancel(self) -> None:
        """End the steps early; steps that cancel themselves (ABORt) go on to their own end."""
        if inspect.getgeneratorstate(self._steps) != inspect.GEN_RUNNING:
            self._steps.close()
            self.done = True

"""Functions that a worker process can import, for the tests of what works on many tasks."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import numpy as np

from support.worker_sockets import Address, say_and_wait


def square(number: int) -> int:
    return number * number


def noise(number: int) -> bytes:
    """Numbers that depend on the task alone, to the last bit."""
    return np.random.default_rng(number).normal(size=100).tobytes()


def refuse_seven(number: int) -> int:
    if number == 7:
        raise ValueError("seven is refused")
    return number


class TwoWords(Exception):
    """An error that cannot be unpickled, as many that take more than one argument."""

    def __init__(self, one: str, two: str) -> None:
        super().__init__(f"{one} and {two}")


def raise_two_words(number: int) -> int:
    raise TwoWords("one", "two")


def die() -> None:
    """End this process, as a batch system or a lack of memory does; signal 9 ends one on Windows, too."""
    os.kill(os.getpid(), 9)


def die_at_three_once(task: tuple[int, str]) -> bytes:
    """A worker process dies at task 3 when it is done for the first time."""
    number, folder = task
    mark = Path(folder, "died")
    if number == 3 and not mark.exists():
        mark.touch()
        die()
    return noise(number)


def die_at_three(number: int) -> int:
    if number == 3:
        die()
    return number


def wait_for_ever(address: Address | None) -> None:
    """Say that this process is at work, and wait until the other side ends the conversation; without an address: no."""
    if address is not None:
        say_and_wait(address)


def end_with_what_is_blocked() -> None:
    """End with status 0 where Ctrl-C is blocked in this process."""
    raise SystemExit(signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ()))


def surroundings(number: int) -> dict[str, Any]:
    """What a worker process has inherited."""
    return {
        "interrupted": signal.getsignal(signal.SIGINT) is not signal.SIG_IGN,
        "threads": os.environ["OPENBLAS_NUM_THREADS"],
        "main": __import__("__main__").__dict__.get("__file__"),
    }

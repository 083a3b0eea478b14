"""Functions that a worker process can import, for the tests of what works on many tasks."""

import os
import signal
from pathlib import Path

import numpy as np

from support.worker_sockets import say_and_wait


def square(number):
    return number * number


def noise(number):
    """Numbers that depend on the task alone, to the last bit."""
    return np.random.default_rng(number).normal(size=100).tobytes()


def refuse_seven(number):
    if number == 7:
        raise ValueError("seven is refused")
    return number


class TwoWords(Exception):
    """An error that cannot be unpickled, as many that take more than one argument."""

    def __init__(self, one, two):
        super().__init__(f"{one} and {two}")


def raise_two_words(number):
    raise TwoWords("one", "two")


def die():
    """End this process, as a batch system or a lack of memory does; signal 9 ends one on Windows, too."""
    os.kill(os.getpid(), 9)


def die_at_three_once(task):
    """A worker process dies at task 3 when it is done for the first time."""
    number, folder = task
    mark = Path(folder, "died")
    if number == 3 and not mark.exists():
        mark.touch()
        die()
    return noise(number)


def die_at_three(number):
    if number == 3:
        die()
    return number


def wait_for_ever(address):
    """Say that this process is at work, and wait until the other side ends the conversation; without an address: no."""
    if address is not None:
        say_and_wait(address)


def end_with_what_is_blocked():
    """End with status 0 where Ctrl-C is blocked in this process."""
    raise SystemExit(signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ()))


def surroundings(number):
    """What a worker process has inherited."""
    return {
        "interrupted": signal.getsignal(signal.SIGINT) is not signal.SIG_IGN,
        "threads": os.environ["OPENBLAS_NUM_THREADS"],
        "main": __import__("__main__").__dict__.get("__file__"),
    }

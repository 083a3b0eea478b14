"""Many laboratories, one a seed, in processes on all cores."""

import itertools
import time
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field
from functools import partial

from levilab.laboratory.plan import draw
from levilab.laboratory.visit import Told, visit
from levilab.workers.ways import processes

StatusOf = Callable[[Exception], int | None]


#: Laboratories that a process carries out between two messages.
_BATCH = 20


@dataclass
class Explored:
    """What became of many laboratories.

    Attributes:
        number: of them.
        seconds: that they took, on the wall.
        failed: those in which something was wrong.
    """

    number: int = 0
    seconds: float = 0.0
    failed: list[Told] = field(default_factory=list)

    @property
    def text(self) -> str:
        """The result in a line."""
        rate = 60 * self.number / self.seconds if self.seconds else 0.0
        return f"{self.number} laboratories, {rate:.0f} a minute: {len(self.failed)} failed"


def explore(
    seed: int,
    status_of: StatusOf,
    *,
    number: int | None = None,
    seconds: float | None = None,
    cores: int | None = None,
    tell: Callable[[Told], None] = lambda _: None,
) -> Explored:
    """Carry out the laboratories of a seed and those that follow, until their number or the time is reached.

    Args:
        seed: of the first one.
        status_of: see `levilab.laboratory.visit.Visit`; another process finds it by its name.
        number: of laboratories; None: no end.
        seconds: after which no more are begun; None: no end.
        cores: None: all.
        tell: called with each laboratory that failed.
    """
    workers, explored, begin = processes(cores), Explored(), time.monotonic()
    starts = itertools.count(seed, _BATCH) if number is None else iter(range(seed, seed + number, _BATCH))
    end = None if number is None else seed + number
    with workers.open() as executor:
        under_way: set[Future[tuple[int, list[Told]]]] = set()
        while True:
            is_over = seconds is not None and time.monotonic() - begin > seconds
            while not is_over and len(under_way) < 2 * workers.count and (first := next(starts, None)) is not None:
                last = first + _BATCH if end is None else min(first + _BATCH, end)
                under_way.add(executor.submit(partial(_carry_out, first, last, status_of)))
            if not under_way:
                break
            done, under_way = wait(under_way, return_when=FIRST_COMPLETED)
            for future in done:
                count, failed = future.result()
                explored.number += count
                explored.failed += failed
                for told in failed:
                    tell(told)
    explored.seconds = time.monotonic() - begin
    return explored


def _carry_out(first: int, end: int, status_of: StatusOf) -> tuple[int, list[Told]]:
    told = [visit(draw(seed), status_of) for seed in range(first, end)]
    return len(told), [one for one in told if one.findings]

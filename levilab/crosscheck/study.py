"""Many trials of each subject: do the estimates lie about the truth as their uncertainties say?"""

from __future__ import annotations

import math
import re
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from instruments.errors import InstrumentError
from levilab.errors import LevilabError
from levilab.software import software_versions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from levilab.crosscheck.subject import Pull, Subject

SCHEMA = "levilab-crosscheck/1"
#: What is wanted of the mean and of the standard deviation of pulls, and how likely a true value lies within 1 u.
MEAN_WITHIN, DEVIATION_WITHIN, COVERAGE = 0.1, 0.1, math.erf(1 / math.sqrt(2))
#: What chance alone may add to that, in standard errors.
CHANCE = 3.0
_NUMBER = re.compile(r"(\d+(?:\.\d+)?)")


@dataclass(frozen=True)
class Spread:
    """How the pulls of one quantity lie.

    pulls: shape (n,); relative_u: the median of u over the estimate.
    """

    quantity: str
    pulls: tuple[float, ...]
    relative_u: float

    @property
    def n(self) -> int:
        """How many there are."""
        return len(self.pulls)

    @property
    def mean(self) -> float:
        """Of the pulls; 0 is wanted.  Its standard error is 1/√n."""
        return float(np.mean(self.pulls))

    @property
    def deviation(self) -> float:
        """Standard deviation of the pulls; 1 is wanted.  Its standard error is about 1/√(2n)."""
        return float(np.std(self.pulls, ddof=1)) if self.n > 1 else math.nan

    @property
    def coverage(self) -> float:
        """Share of the truths within one standard uncertainty; 0.683 is wanted."""
        return float(np.mean(np.abs(self.pulls) <= 1))

    @property
    def holds(self) -> bool:
        """Whether nothing speaks against what is wanted, with room for chance; one trial has no scatter."""
        of_mean, of_deviation = CHANCE / math.sqrt(self.n), CHANCE / math.sqrt(2 * self.n)
        of_coverage = CHANCE * math.sqrt(COVERAGE * (1 - COVERAGE) / self.n)
        return (
            abs(self.mean) <= MEAN_WITHIN + of_mean
            and (self.n == 1 or abs(self.deviation - 1) <= DEVIATION_WITHIN + of_deviation)
            and abs(self.coverage - COVERAGE) <= 0.05 + of_coverage
        )


@dataclass(frozen=True)
class Checked:
    """A subject with its trials.

    trials: how many were made; spreads: a quantity each; failures: why trials came to no estimate, and how often; for
    one reason with other numbers in it there is one entry.
    """

    subject: Subject
    trials: int
    seed: int
    spreads: tuple[Spread, ...]
    failures: dict[str, int]

    @property
    def holds(self) -> bool:
        """Whether every quantity's pulls are as they should be."""
        return bool(self.spreads) and all(spread.holds for spread in self.spreads)


def crosscheck(subject: Subject, trials: int, seed: int, progress: Callable[[float], None]) -> Checked:
    """Make the trials of a subject, each with a seed of its own.  progress: called with the share that is done."""
    pulls: list[Pull] = []
    failures: list[str] = []
    for k in range(trials):
        with tempfile.TemporaryDirectory(prefix="levilab-crosscheck-") as folder:
            try:
                pulls += subject.trial(seed + k, Path(folder))
            except (LevilabError, InstrumentError) as error:
                failures.append(str(error).replace(folder, ""))
        progress((k + 1) / trials)
    return Checked(subject, trials, seed, tuple(spreads_of(pulls)), by_reason(failures))


def by_reason(texts: Sequence[str]) -> dict[str, int]:
    """How often each text comes, texts that differ in their numbers alone as one, with the range of these.

    >>> by_reason(["lost at 31.3 Hz of 40 Hz", "dark", "lost at 29.9 Hz of 40 Hz"])
    {'lost at 29.9 to 31.3 Hz of 40 Hz': 2, 'dark': 1}
    """
    alike: dict[tuple[str, ...], list[list[str]]] = {}
    for text in texts:
        parts = _NUMBER.split(text)
        alike.setdefault(tuple(parts[::2]), []).append(parts[1::2])
    found = {}
    for words, numbers in alike.items():
        ranges = [_range(column) for column in zip(*numbers, strict=True)]
        found["".join(a + b for a, b in zip(words, [*ranges, ""], strict=True))] = len(numbers)
    return found


def _range(numbers: Sequence[str]) -> str:
    least, most = min(numbers, key=float), max(numbers, key=float)
    return least if least == most else f"{least} to {most}"


def spreads_of(pulls: Sequence[Pull]) -> Iterable[Spread]:
    """The pulls of each quantity."""
    for quantity in dict.fromkeys(pull.quantity for pull in pulls):
        some = [pull for pull in pulls if pull.quantity == quantity]
        relative = np.median([pull.u / abs(pull.estimate) if pull.estimate else math.nan for pull in some])
        yield Spread(quantity, tuple(pull.value for pull in some), float(relative))


def as_document(checked: Sequence[Checked]) -> dict[str, Any]:
    """All numbers, as JSON has them."""
    return {
        "schema": SCHEMA,
        "software": software_versions(),
        "wanted": {"mean_within": MEAN_WITHIN, "deviation_within": DEVIATION_WITHIN, "coverage": COVERAGE},
        "subjects": [
            {
                "name": one.subject.name,
                "trials": one.trials,
                "seed": one.seed,
                "holds": one.holds,
                "failures": one.failures,
                "quantities": [
                    {
                        "name": spread.quantity,
                        "n": spread.n,
                        "mean": spread.mean,
                        "deviation": None if math.isnan(spread.deviation) else spread.deviation,
                        "coverage": spread.coverage,
                        "relative_u": None if math.isnan(spread.relative_u) else spread.relative_u,
                        "holds": spread.holds,
                        "pulls": list(spread.pulls),
                    }
                    for spread in one.spreads
                ],
            }
            for one in checked
        ],
    }

"""Many trials of a subject: do the estimates lie about the truth as their uncertainties say?

A study is of a world whose numbers are drawn at random, or of readings that are made with the values of a result
(`levilab.crosscheck.own`).  Both have the same spreads, the same criterion and the same document.
"""

import math
import re
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence  # pydantic reads the fields of Study from it
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from analysis.errors import AnalysisError
from analysis.uncertainty import student
from instruments.errors import InstrumentError
from levilab.crosscheck.subject import Pull, Subject, Trial, TrialFailed
from levilab.errors import LevilabError

#: How likely a true value lies within 1 u.
COVERAGE = math.erf(1 / math.sqrt(2))
#: How often chance alone may condemn a right study: the room of each of its numbers follows from that.
FALSE_ALARM = 0.01
#: Degrees of freedom up to which a standard deviation of pulls says nothing.
LONG_TAILS = 8
_NUMBER = re.compile(r"(\d+(?:\.\d+)?)")


class Verdict(Enum):
    """What the pulls of a quantity say."""

    RIGHT = "yes"
    TOO_LARGE = "yes, u is too large"
    WRONG = "NO"


@dataclass(frozen=True)
class Spread:
    """How the pulls of one quantity lie, and how they should.

    Attributes:
        quantity: its name.
        pulls: shape (n,).
        relative_u: the median of u over the estimate; None where that is 0.
        freedom: degrees of freedom of u, where that is the scatter of few values; None: u is as if known.
        widened: degrees of freedom of u, where that was multiplied by Student's factor, so that it covers 68 %.
        among: how many quantities the study has, of which chance may condemn each.
    """

    quantity: str
    pulls: tuple[float, ...]
    relative_u: float | None = None
    freedom: int | None = None
    widened: float | None = None
    among: int = 1

    @property
    def n(self) -> int:
        """Number of pulls."""
        return len(self.pulls)

    @property
    def mean(self) -> float:
        """Mean of the pulls; 0 is wanted."""
        return float(np.mean(self.pulls))

    @property
    def deviation(self) -> float:
        """Standard deviation of the pulls; NaN of a single one."""
        return float(np.std(self.pulls, ddof=1)) if self.n > 1 else math.nan

    @property
    def coverage(self) -> float:
        """Share of the truths within one standard uncertainty."""
        return float(np.mean(np.abs(self.pulls) <= 1))

    @property
    def wanted_deviation(self) -> float:
        """Standard deviation of pulls by Student's law; infinite where its tails are too long to judge it.

        >>> Spread("x", ()).wanted_deviation, round(Spread("x", (), freedom=12).wanted_deviation, 2)
        (1.0, 1.1)
        """
        few = self.freedom if self.freedom is not None else self.widened
        if few is None:
            return 1.0
        if few <= LONG_TAILS:
            return math.inf
        return math.sqrt(few / (few - 2)) / (student(few) if self.freedom is None else 1.0)

    @property
    def wanted_coverage(self) -> float:
        """Share of true values within 1 u, by Student's law.

        >>> round(Spread("x", ()).wanted_coverage, 3), round(Spread("x", (), freedom=3).wanted_coverage, 3)
        (0.683, 0.609)
        """
        if self.freedom is None:
            return COVERAGE
        from scipy.special import stdtr

        return float(2 * stdtr(self.freedom, 1.0) - 1)

    @property
    def u_mean(self) -> float:
        """Standard error of the mean."""
        scale = self.wanted_deviation
        return (scale if math.isfinite(scale) else max(self.deviation, 1.0)) / math.sqrt(self.n)

    @property
    def u_deviation(self) -> float:
        """Standard error of the standard deviation, with the kurtosis of Student's law."""
        few = self.freedom if self.freedom is not None else self.widened
        excess = 0.0 if few is None or few <= LONG_TAILS else 3 / (few - 4)
        return self.wanted_deviation * math.sqrt((1 + excess) / (2 * self.n))

    @property
    def u_coverage(self) -> float:
        """Standard error of the share."""
        return math.sqrt(self.wanted_coverage * (1 - self.wanted_coverage) / self.n)

    @property
    def excess(self) -> float:
        """Factor by which the pulls scatter more than wanted; 1 where that is not judged or chance explains it."""
        wider = self.deviation - self.wanted_deviation
        return self.deviation / self.wanted_deviation if wider > self.room * self.u_deviation else 1.0

    @property
    def misleads(self) -> bool:
        """Whether a reader is misled: a bias above 1 u, or 1 u that holds less than half of the truths."""
        return self.verdict is Verdict.WRONG and (abs(self.mean) > 1 or self.coverage < 0.5)

    @property
    def room(self) -> float:
        """Standard errors that each of the three numbers of each quantity may be off, on either side.

        >>> round(Spread("x", ()).room, 2), round(Spread("x", (), among=8).room, 2)
        (2.94, 3.53)
        """
        from scipy.special import ndtri

        return float(-ndtri(FALSE_ALARM / (2 * 3 * self.among)))

    @property
    def verdict(self) -> Verdict:
        """What the pulls say: a bias or a u that is too small is wrong, a u that is too large is on the safe side."""
        if self.n < 2:  # one trial has no scatter
            return Verdict.RIGHT
        judged = math.isfinite(self.wanted_deviation)
        wider = (self.deviation - self.wanted_deviation) / self.u_deviation if judged else 0.0
        fewer = (self.wanted_coverage - self.coverage) / self.u_coverage
        if abs(self.mean) > self.room * self.u_mean or max(wider, fewer) > self.room:
            return Verdict.WRONG
        return Verdict.TOO_LARGE if min(wider, fewer) < -self.room else Verdict.RIGHT


#: From the pulls of a quantity to what they say.
Judge = Callable[[Spread], Verdict]


def by_pulls(spread: Spread) -> Verdict:
    """Judge mean, width and coverage of the pulls."""
    return spread.verdict


@dataclass(frozen=True)
class Study:
    """A subject with its trials.

    Attributes:
        name: of the subject, or of the analysis of a result.
        about: what is drawn.
        trials, seed: number of trials, and seed of the random numbers.
        spreads: of the pulls, one a quantity.
        failures: why trials came to no estimate → how often; one entry for a reason with other numbers in it.
        inputs: sha256 of a result's readings, in the order of the inputs; none of a world.
        settings: of the result's analysis, as result.json has them.
        law: that was true; empty where none competes.
        laws: law → how often it was favoured.
        excluded, tested: in how many trials the analysis excluded what is true, of how many that tested it.
        hypothesis, expected_share: what that is where it is no law, and the share that chance excludes.
        more: what to know of the pulls.
    """

    name: str
    about: str
    trials: int
    seed: int
    spreads: tuple[Spread, ...] = ()
    failures: Mapping[str, int] = field(default_factory=dict)
    inputs: tuple[str, ...] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)
    law: str = ""
    laws: Mapping[str, int] = field(default_factory=dict)
    excluded: int = 0
    tested: int = 0
    hypothesis: str = ""
    expected_share: float = 0.0
    more: tuple[str, ...] = ()

    @property
    def holds(self) -> bool:
        """Whether no quantity is wrong, by its pulls."""
        return self.holds_by(by_pulls)

    def holds_by(self, judge: Judge) -> bool:
        """Return whether no quantity is wrong."""
        return bool(self.spreads) and all(judge(spread) is not Verdict.WRONG for spread in self.spreads)


def study_world(subject: Subject, trials: int, seed: int, progress: Callable[[float], None]) -> Study:
    """Make the trials of a world, each with a seed of its own.

    Args:
        subject: what is drawn and compared.
        trials: number of trials.
        seed: of the first trial.
        progress: called with the share that is done.
    """

    def trial(k: int) -> Trial:
        with tempfile.TemporaryDirectory(prefix="levilab-crosscheck-") as folder:
            try:
                return Trial(subject.trial(seed + k, Path(folder)))
            except (LevilabError, InstrumentError) as error:
                raise TrialFailed(str(error).replace(folder, "")) from error

    return make_trials(Study(subject.name, subject.about, trials, seed), trial, subject.freedom, progress)


def make_trials(
    study: Study,
    trial: Callable[[int], Trial],
    freedom: Mapping[str, int] | int | None,
    progress: Callable[[float], None],
) -> Study:
    """Return a study with its trials.

    Args:
        study: without trials.
        trial: makes the trial of a number; raises LevilabError or AnalysisError where it comes to no estimate.
        freedom: quantity → degrees of freedom of its u, where these are few; or those of each.
        progress: called with the share that is done.
    """
    done, failures = [], []
    for k in range(study.trials):
        try:
            with np.errstate(all="ignore"):
                done.append(trial(k))
        except (LevilabError, AnalysisError) as error:
            failures.append(str(error))
        progress((k + 1) / study.trials)
    laws = [one.law for one in done if one.law]
    tested = [one.excluded for one in done if one.excluded is not None]
    widened = [one.widened for one in done if one.widened is not None]
    return replace(
        study,
        spreads=tuple(
            spreads_of(
                [pull for one in done for pull in one.pulls], freedom, float(np.median(widened)) if widened else None
            )
        ),
        failures=by_reason(failures),
        laws={law: laws.count(law) for law in sorted(set(laws), key=lambda one: (-laws.count(one), one))},
        excluded=sum(tested),
        tested=len(tested),
    )


def spreads_of(
    pulls: Sequence[Pull], freedom: Mapping[str, int] | int | None, widened: float | None
) -> Iterator[Spread]:
    """Yield the pulls of each quantity."""
    quantities = dict.fromkeys(pull.quantity for pull in pulls)
    for quantity in quantities:
        some = [pull for pull in pulls if pull.quantity == quantity]
        relative = [pull.u / abs(pull.estimate) for pull in some if pull.estimate]
        values = tuple(pull.value for pull in some)
        median = float(np.median(relative)) if relative else None
        few = freedom.get(quantity) if isinstance(freedom, Mapping) else freedom
        yield Spread(quantity, values, median, few, widened, len(quantities))


def by_reason(texts: Sequence[str]) -> dict[str, int]:
    """Return how often each text comes, texts that differ in their numbers alone as one, with the range of these.

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

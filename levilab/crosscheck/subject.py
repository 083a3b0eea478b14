"""What a cross-check is made of: subjects, their trials, and the pulls of these."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from analysis.uncertainty import Estimate
from levilab.errors import LevilabError


class TrialFailed(LevilabError):
    """A trial that came to no estimate."""


@dataclass(frozen=True)
class Pull:
    """An estimate beside the truth.

    quantity: its name; estimate, u, truth: in the quantity's unit.
    """

    quantity: str
    estimate: float
    u: float
    truth: float

    @property
    def value(self) -> float:
        """How far off the estimate is, in its own standard uncertainty."""
        return (self.estimate - self.truth) / self.u


@dataclass(frozen=True)
class Trial:
    """One set of readings that was made and analyzed.

    Attributes:
        pulls: of the quantities.
        law: that the analysis favours; empty where no laws compete.
        excluded: whether the analysis excludes what is true; None where it tests nothing.
        widened: degrees of freedom of u, where that comes from few readings and was multiplied by Student's factor, so
            that 68 % lie within it; None: it was not.
    """

    pulls: list[Pull]
    law: str = ""
    excluded: bool | None = None
    widened: float | None = None


@dataclass(frozen=True)
class Subject:
    """One way from a world whose numbers are known to what the analysis says of them.

    name: on the command line; about: one line; trial: from a seed and an empty folder to pulls, which raises
    LevilabError or an instrument's error where it comes to none; trials: how many unless another number is asked for;
    freedom: degrees of freedom of u where it comes from the scatter of few values.
    """

    name: str
    about: str
    trial: Callable[[int, Path], list[Pull]]
    trials: int = 40
    freedom: int | None = None


def pull_of(quantity: str, found: Estimate | None, truth: float) -> Pull:
    """Return the pull of an estimate.  Raises TrialFailed where it has no value or no uncertainty."""
    if found is None or found.value is None or not found.u:
        raise TrialFailed(f"{quantity}: the analysis gives no value with an uncertainty")
    return Pull(quantity, found.value, found.u, truth)

"""What is made up of a result, and what comes of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import numpy as np

    from levilab.crosscheck.subject import Trial


#: Ends the name of a quantity that each run of several has: its pulls are as many as runs and trials together.
OF_ONE_RUN = "_of_one_run"


@dataclass(frozen=True)
class Own:
    """A result as a subject of trials.

    Attributes:
        about: what is made up, in words.
        trial: from a source of random numbers to a trial; raises TrialFailed, or an error of the analysis.
        cost_s: processor time of a trial on an ordinary computer, as measured [s]; it decides how many a report makes.
        law: that is true in the trials; empty where none competes.
        hypothesis: what the analysis tests and may exclude, in words; empty for nothing.
        expected_share: of the trials in which chance excludes it.
        freedom: quantity → degrees of freedom of its u, where that rests on a scatter of few values: its pulls follow
            Student's law.
        more: what to know of the pulls.
    """

    about: str
    trial: Callable[[np.random.Generator], Trial]
    cost_s: float
    law: str = ""
    hypothesis: str = ""
    expected_share: float = 0.0
    freedom: Mapping[str, int] = field(default_factory=dict)
    more: tuple[str, ...] = ()

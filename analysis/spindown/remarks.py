"""What to know before using the numbers of a spin-down: kinds and values, without words."""

from dataclasses import dataclass
from typing import Literal

Kind = Literal[
    # of a fit
    "not converged",
    "no freedom",  # as many readings as parameters: how many
    "not separated",
    "out of range",  # the constant
    "negative",  # the constant; how many u below zero
    "undetermined",  # the constant
    "factor",  # the constant; the factor to which it is known
    # of a run
    "outlier",  # time [s], frequency [Hz], distance [Hz] from the law, the same in units; stated, kept, falling: 0 or 1
    "calculated",  # rms residual [Hz]
    "no u",
    "understated",  # scatter in units of the stated u
    "overstated",  # the same
    "few readings",  # the laws that no AICc compares; number of readings
    "correlated",  # correlation, its u, number of readings
    # of several runs
    "changed",  # number of the run from 1 on, number of runs, probability of such a change anywhere
    "mixed u",  # runs without stated u, runs
    "one run",
    "few runs",  # runs, half a 68 % interval in u
    "missing",  # the constant; runs without it, runs
    "scatters",  # the constant; scatter of the runs in units of their own u
]


@dataclass(frozen=True)
class Remark:
    """What to know before using the numbers.

    Attributes:
        kind: of which kind.
        law: the law that it is about; empty: none.
        name: the constant that it is about; empty: none.
        values: what was seen, as listed with each `Kind`.
    """

    kind: Kind
    law: str = ""
    name: str = ""
    values: tuple[float, ...] = ()

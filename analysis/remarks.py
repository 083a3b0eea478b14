"""What to know before using numbers: kinds and values, without words."""

from dataclasses import dataclass
from typing import Literal

#: About spin-downs.
SpinDownKind = Literal[
    # of the fit of a law
    "not converged",
    "no freedom",  # as many readings as parameters: how many
    "not separated",
    "out of range",  # the constant
    "negative",  # the constant; how many u below zero
    "undetermined",  # the constant
    "factor",  # the constant; the factor to which it is known
    # of a spin-down
    "outlier",  # time [s], frequency [Hz], distance [Hz] from the law, the same in units; stated, kept, falling: 0 or 1
    "falling",  # the same, of a last reading that is left out
    "calculated",  # rms residual [Hz]
    "no u",
    "understated",  # scatter in units of the stated u
    "overstated",  # the same
    "few left",  # number of readings, the half of a 68 % interval in u
    "few readings",  # the laws that no AICc compares; number of readings, whether BIC compares them: 0 or 1
    "correlated",  # correlation, its u, number of readings
    # of several spin-downs
    "changed",  # number of the run from 1 on, number of runs, probability of such a change anywhere
    "mixed u",  # runs without stated u, runs
    "one run",
    "few runs",  # runs, half a 68 % interval in u
    "missing",  # the constant; runs without it, runs
    "scatters",  # the constant; scatter of the runs in units of their own u
]
#: About sweeps, scans, and the tops that float.
Kind = Literal[
    # of a sweep; points are numbered from 0 on
    "many miscounts",  # points that look like miscounts, points
    "miscount",  # the point
    "unexplained",  # the point, which is far off the line; whether the gates behind it are known: 0 or 1
    "sweep scatters",  # scatter in units of the stated u, probability of such a χ²
    "sweep overstated",  # χ², degrees of freedom
    "sweep exact",
    "few left",  # number of points, the half of a 68 % interval in u
    "moves the slope",  # the point, change of the slope, the same in u
    "holds the line",  # the point, its leverage
    "uncertain drive",  # greatest u of the drive in u of the precession
    "uncertain clock",  # relative u of the drive, the u of the slope from it, u of the slope
    "drive u unknown",
    "ratio",  # of precession and drive, by a count or a unit
    "spins off",  # number of points whose spin is off the drive, points, greatest distance [Hz]
    "spin off",  # mean of spin − drive [Hz]
    "slopes differ",  # number of runs, probability of such slopes
    # of a scan
    "scan scatters",  # χ²/dof
    "scan overstated",  # χ²/dof
    "contradicts",  # the parameter; found, stated, u of the stated one
    "scan bends",  # p of the runs test, where runs are too few
    "no ring",  # rms of the residuals, largest flux density [T]
    "no strength",
    "stray reading",  # height [m], distance from the others in u
    # of the tops that float
    "no such mass",  # mass of a top that floats [kg]
    "another zero",  # stated height, lowest and highest by the scan [m]
    "rough mass",  # u of the mass to set, width of the window [kg]
]


@dataclass(frozen=True)
class Remark:
    """What to know before using numbers.

    Attributes:
        kind: of which kind.
        law: the law that it is about; empty: none.
        name: the constant or parameter that it is about; empty: none.
        values: what was seen, as listed with each kind.
    """

    kind: SpinDownKind | Kind
    law: str = ""
    name: str = ""
    values: tuple[float, ...] = ()

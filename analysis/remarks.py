"""What to know before using numbers: kinds and values, without words."""

from dataclasses import dataclass
from typing import Literal

Kind = Literal[
    # of a sweep; points are numbered from 0 on
    "many miscounts",  # points that look like miscounts, points
    "miscount",  # the point
    "unexplained",  # the point, which is far off the line; whether the gates behind it are known: 0 or 1
    "sweep scatters",  # scatter in units of the stated u, probability of such a χ²
    "sweep overstated",  # χ², degrees of freedom
    "sweep exact",
    "moves the slope",  # the point, change of the slope, the same in u
    "holds the line",  # the point, its leverage
    "uncertain drive",  # greatest u of the drive in u of the precession
    "uncertain clock",  # relative u of the drive, the u of the slope from it, u of the slope
    "drive u unknown",
    "spin off",  # mean of spin − drive [Hz]
    "slopes differ",  # number of runs, probability of such slopes
    # of a scan
    "scan scatters",  # χ²/dof
    "scan overstated",  # χ²/dof
    "contradicts",  # the parameter; found, stated, u of the stated one
    "no strength",
    "stray reading",  # height [m], distance from the others in u
    # of the tops that float
    "another zero",  # stated height, lowest and highest by the scan [m]
    "rough mass",  # u of the mass to set, width of the window [kg]
]


@dataclass(frozen=True)
class Remark:
    """What to know before using numbers.

    Attributes:
        kind: of which kind.
        values: what was seen, as listed with each `Kind`.
        name: the parameter that it is about; empty: none.
    """

    kind: Kind
    values: tuple[float, ...] = ()
    name: str = ""

"""One look for one thing in all figures and pages: colour, line, marker, hatch.

The colours are Okabe and Ito's (jfly.uni-koeln.de/color, 2008), which differ for the colour-blind, too.  There are more
things than colours: two things may share one if they never stand in one figure (`TOGETHER` lists those that do), and
what stands together differs in its dashes, markers or hatch as well, for print without colours.
"""

import itertools
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from analysis.spindown.drag import LAWS

BLACK, GREY, PALE = "#000000", "#6E6E6E", "#D9D9D9"
BLUE, VERMILION, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
ORANGE, SKY, YELLOW = "#E69F00", "#56B4E9", "#F0E442"

#: Lines as (offset, dashes) in parts of their width.
_SOLID, _DASHED, _DOTTED, _DASH_DOT, _LONG = "-", (0, (4, 2)), (0, (1, 1.6)), (0, (6, 2, 1, 2)), (0, (9, 2))
_DASH_DOT_DOT = (0, (6, 2, 1, 2, 1, 2))


@dataclass(frozen=True)
class Look:
    """How a thing is drawn.

    Attributes:
        colour: as #RRGGBB.
        line: as matplotlib takes it: "-", or an offset and the lengths of dashes and gaps.
        marker: as matplotlib takes it; "" where the thing has no points.
        hatch: of an area; "" where the thing is no area.
    """

    colour: str
    line: Any = _SOLID
    marker: str = ""
    hatch: str = ""

    @property
    def as_line(self) -> dict[str, Any]:
        """What `Axes.plot` takes for a line."""
        return {"color": self.colour, "linestyle": self.line}

    @property
    def of_text(self) -> str:
        """The colour for letters: darker where it takes that to stand out from white as 4.5 to 1 (WCAG 2.2, 1.4.3)."""
        rgb = [int(self.colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
        for _ in range(20):
            linear = [x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in rgb]
            if 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2] <= 1.05 / 4.5 - 0.05:
                break
            rgb = [0.95 * x for x in rgb]
        return "#" + "".join(f"{round(255 * x):02X}" for x in rgb)

    @property
    def as_points(self) -> dict[str, Any]:
        """What `Axes.plot` takes for points without a line."""
        face = "white" if self.marker in "osD^v" else self.colour
        return {"color": self.colour, "linestyle": "none", "marker": self.marker, "markerfacecolor": face}


#: Of the drag laws, in the order of their table.
_LAWS = (
    Look(BLUE, _DASH_DOT), Look(VERMILION, _DASHED), Look(GREEN), Look(PURPLE, _LONG), Look(ORANGE, _DOTTED),
    Look(SKY, _DASH_DOT_DOT), Look(YELLOW, _DASHED),
)  # fmt: skip
#: By the thing's name.
LOOKS = MappingProxyType({
    # what was measured
    "readings": Look(BLACK, _SOLID, "o"),
    "left out": Look(VERMILION, _SOLID, "x"),
    "drive": Look(BLACK, _DASHED),
    "fit": Look(BLUE, _SOLID),
    "robust": Look(ORANGE, _DOTTED),
    "locked": Look(BLACK, _DASHED),
    "field": Look(BLUE, _SOLID, "o"),
    "precession": Look(PURPLE, _DASH_DOT, "D"),
    "pulses": Look(VERMILION, _DASHED),
    # drag laws
    **dict(zip(LAWS, itertools.cycle(_LAWS), strict=False)),
    # phases of a run
    "coasting": Look(GREEN, _SOLID, hatch=""),
    "held": Look(VERMILION, _SOLID, hatch="///"),
    "speeding-up": Look(ORANGE, _SOLID, hatch="..."),
    # the top as simulated
    "top": Look(VERMILION, _SOLID, "o"),
    "washers": Look(PURPLE, _DOTTED, "s"),
    "height": Look(BLUE, _SOLID),
    "path": Look(BLUE, _SOLID),
    "tilt": Look(GREEN, _SOLID),
    "energy": Look(BLACK, _SOLID),
    "simulation": Look(SKY, _SOLID, "s"),
    # where tops float
    "floats": Look(GREEN, _SOLID, "s"),
    "to set": Look(ORANGE, _DASHED, "D"),
    "theory": Look(ORANGE, _SOLID),
    "up": Look(BLUE, _SOLID, "o"),
    "lost": Look(PALE, _SOLID, "x", "////"),
})  # fmt: skip

#: Things that stand in one figure.
TOGETHER = (
    ("readings", "left out", "fit", "robust", "locked"),
    ("readings", *LAWS),
    ("readings", "pulses", "fit"),
    ("coasting", "held", "speeding-up"),
    ("drive", "top", "washers"),
    ("readings", "field", "floats", "to set"),
    ("up", "lost", "theory"),
    ("readings", "drive", "precession", "top"),
)
#: One a run, as long as there are so few.
MARKERS = "osD^vP*X"
#: One a run, as long as there are so few; with the run's marker.
SERIES = (BLACK, BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, GREY)

"""How well the clocks of instruments keep their rate, as their makers state.

It stands beside the catalogue, by the name of the driver, so that an analysis reads it without loading any driver.  A
model is missing where no manual was at hand, or where an option decides (the ovens of counters): then the person
who has the instrument has to say.
"""

from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class TimeBase:
    """How well an instrument's clock keeps its rate.

    Attributes:
        limit: largest relative error when it is new.
        per_year: what each year adds to that.
        source: where this stands.
        remedy: what makes it better, where that is no reference of 10 MHz.
    """

    limit: float
    per_year: float
    source: str
    remedy: str = ""


#: Name of the driver, as run.json has it → the time base of its models.
TIME_BASES = MappingProxyType({
    "RigolDS1000Z": TimeBase(25e-6, 5e-6, "Rigol, DS1000Z-E Performance Verification Guide, test record form"),
    "SoundCard": TimeBase(1e-4, 5e-6, "usual crystals of sound cards, docs/sound-card.md", "`levilab bench clock`"),
})  # fmt: skip

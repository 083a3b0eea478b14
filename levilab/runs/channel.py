"""What a run measures: the columns of its readings."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Channel:
    """A column of readings.csv.

    Attributes:
        unit: "" for a pure number.
        source: description of its origin.
    """

    name: str
    unit: str
    source: str

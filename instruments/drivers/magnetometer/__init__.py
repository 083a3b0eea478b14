"""Hall magnetometers: a flux density, whatever the model.

Facts and their sources stand with each driver.
"""

from typing import Protocol

from instruments.drivers import Instrument


class Magnetometer(Instrument, Protocol):
    """What every magnetometer offers."""

    def prepare(self, *, range_t: float | None) -> None:
        """Measure steady flux density up to this [T]; None: the instrument chooses its range."""

    def flux_density(self) -> float | None:
        """Return one reading along the probe's axis [T]; None when it is beyond the range."""

    def zero(self) -> None:
        """Take the present flux density for zero: with the probe in its zero-gauss chamber, and only there."""

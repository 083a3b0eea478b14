"""Function generators: the drive.  Waveform, frequency, amplitude, offset, output, whatever the model."""

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from instruments.drivers import Instrument
from instruments.errors import OutOfRange

#: The highest voltage of either family without a load [V]: offset and half of peak to peak together.
OPEN_V = 10.0


class Beyond(NamedTuple):
    """A value that a limit forbids.  name: the limit's; is_highest: whether the value is above it, not below."""

    name: str
    value: float
    limit: float
    is_highest: bool


@dataclass(frozen=True)
class Limits:
    """What the coil stands.  More is refused before anything is sent, never clipped.

    drive_amplitude_vpp, drive_offset_v: largest; drive_frequency_hz, drive_lowest_hz: the range.  The names are those
    in bench.toml.  Without a word there is no limit beside the instrument's own.
    """

    drive_amplitude_vpp: float = math.inf
    drive_offset_v: float = math.inf
    drive_frequency_hz: float = math.inf
    drive_lowest_hz: float = -math.inf

    def beyond(
        self, *, frequency_hz: float | None = None, amplitude_vpp: float = 0.0, offset_v: float = 0.0
    ) -> Beyond | None:
        """Return the quantity of this signal that is beyond the limits, None where none is.

        frequency_hz: None where there is none.
        """
        rows = (
            ("drive_amplitude_vpp", amplitude_vpp, 0.0, self.drive_amplitude_vpp),
            ("drive_offset_v", abs(offset_v), 0.0, self.drive_offset_v),
            ("drive_frequency_hz", frequency_hz, -math.inf, self.drive_frequency_hz),
            ("drive_lowest_hz", frequency_hz, self.drive_lowest_hz, math.inf),
        )
        for name, value, low, high in rows if self != NO_LIMITS else ():
            if value is not None and not low <= value <= high:  # nan is in no range
                return Beyond(name, value, high if high < math.inf else low, is_highest=high < math.inf)
        return None

    def check(
        self, address: str, *, frequency_hz: float | None = None, amplitude_vpp: float = 0.0, offset_v: float = 0.0
    ) -> None:
        """Raise OutOfRange if this signal is more than they allow, as `beyond` says."""
        found = self.beyond(frequency_hz=frequency_hz, amplitude_vpp=amplitude_vpp, offset_v=offset_v)
        if found:
            allowed = f"up to {found.limit:g}" if found.is_highest else f"from {found.limit:g} on"
            raise OutOfRange(address, found.name, found.value, f"{allowed} (limits.{found.name} in the bench file)")


#: Of a generator by itself.
NO_LIMITS = Limits()


def check_peak(address: str, amplitude_vpp: float, offset_v: float) -> None:
    """Raise OutOfRange for a signal that the terminals cannot give: the instrument would clip it."""
    peak = abs(offset_v) + amplitude_vpp / 2
    if not peak <= OPEN_V:
        raise OutOfRange(address, "|offset| + Vpp/2", peak, f"up to {OPEN_V:g} V")


class Generator(Instrument, Protocol):
    """What every generator offers.

    waveform: a short word; frequency [Hz]; amplitude, peak to peak, and offset of the open terminals [V]; output:
    whether the signal is on the terminals; burst_phase: where a burst starts in its cycle [°]; limits: what the coil
    stands.
    """

    waveform: str
    frequency: float
    amplitude: float
    offset: float
    output: bool
    burst_phase: float
    limits: Limits

    def prepare(self, *, waveform: str, frequency_hz: float, amplitude_vpp: float, offset_v: float = 0.0) -> None:
        """Set the signal; the output is off afterwards.  Raises OutOfRange beyond the limits, with nothing sent."""

    def prepare_triggered(
        self,
        *,
        waveform: str,
        frequency_hz: float,
        amplitude_vpp: float,
        phase_deg: float,
        rising: bool = True,
    ) -> None:
        """Set bursts of a cycle, each started by an edge at the trigger input; the output is off afterwards.

        Args:
            waveform: of the cycle, as of `prepare`.
            frequency_hz: of the cycle.  Edges that come before it has ended are ignored.
            amplitude_vpp: of the cycle.
            phase_deg: where in its cycle a burst starts; 0 is where a sine rises through its middle.
            rising: whether rising edges start it, or falling ones.

        Raises OutOfRange beyond the limits, with nothing sent.
        """

    def off(self) -> None:
        """Switch all outputs off, and see that they are."""

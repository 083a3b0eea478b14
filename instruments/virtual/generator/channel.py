"""One output of a virtual function generator: its triggers, and what stands at its terminals."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from instruments.virtual.generator.settings import INFINITE, ChannelSettings

if TYPE_CHECKING:
    from collections.abc import Callable, MutableMapping

    import numpy as np
    from numpy.typing import NDArray

    from instruments.virtual.core.device import Value
    from instruments.virtual.core.parser import ScpiError
    from instruments.virtual.generator.family import Family


@dataclass(frozen=True)
class Burst:
    """So many cycles at each trigger.  cycles: inf for no end; period: between immediate triggers [s], else None."""

    cycles: float
    period: float | None


@dataclass(frozen=True)
class Output:
    """What stands at the open terminals from some time on.

    waveform: short form; frequency [Hz]; amplitude: half of peak to peak [V], 0 when off; offset [V]; phase [°], of
    bursts that at which they start;
    duty: part of a period that a SQU or PULS is high; symmetry: part of a period that a RAMP rises; inverted: by
    OUTPut:POLarity; burst: None when it runs on; samples: of an arbitrary waveform, −1 to 1, shape (n,).

    The voltage is that of a coil that takes no current worth the name: where ``OUTPut:LOAD`` is 50 Ω it is twice
    what the display says, as on the bench.
    """

    waveform: str
    frequency: float
    amplitude: float
    offset: float
    phase: float = 0.0
    duty: float = 0.5
    symmetry: float = 1.0
    inverted: bool = False
    burst: Burst | None = None
    samples: NDArray[np.float64] | None = field(default=None, compare=False, repr=False)

    def times(self, factor: float) -> Output:
        """The same in another unit: what it makes of something, where it makes so much per volt."""
        return replace(self, amplitude=factor * self.amplitude, offset=factor * self.offset)


class Channel(ChannelSettings):
    """One output.  now: the time [s]; the rest: see the base."""

    def __init__(
        self,
        family: Family,
        settings: MutableMapping[str, Value],
        *,
        index: int,
        report: Callable[[ScpiError], None],
        now: Callable[[], float],
    ) -> None:
        super().__init__(family, settings, index=index, report=report)
        self._now = now
        #: From when to when a triggered burst or sweep lasts [s].
        self.under_way = (-math.inf, -math.inf)

    # --- triggers ---

    @property
    def repeats(self) -> bool:
        """Whether bursts start by themselves."""
        return bool(self["burst"]) and self["burst_mode"] == "TRIG" and self["trigger_source"] in {"IMM", "TIM"}

    @property
    def waits(self) -> bool:
        """Whether it needs a trigger to put something out."""
        armed = (self["burst"] and self["burst_mode"] == "TRIG") or self["sweep"]
        return bool(armed) and self["trigger_source"] not in {"IMM", "TIM"}

    def trigger(self) -> None:
        """A trigger comes now."""
        start = self._now() + self.number("trigger_delay")
        lasts = self.number("burst_cycles") / self.frequency if self["burst"] else self.number("sweep_time")
        endless = self["burst"] and self.number("burst_cycles") >= INFINITE
        self.under_way = (start, math.inf if endless else start + lasts)

    def stop(self) -> None:
        """ABORt: what is under way ends."""
        self.under_way = (-math.inf, -math.inf)

    # --- the terminals ---

    def signal(self, time: float) -> Output:
        """What stands at the open terminals at this time [s]."""
        on = bool(self["output"])
        start, end = self.under_way
        silent = bool(self["burst"]) and (self._gated() or (self.waits and not start <= time < end))
        short, inverted = str(self["waveform"]), self["polarity"] == "INV"
        volt = 1 / self.share
        swing = 0.0 if silent or not on or short == "DC" else self.number("amplitude_vpp") / 2 * volt
        return Output(
            waveform=short,
            frequency=self.number("prbs_rate") if short == "PRBS" else self.frequency,
            amplitude=swing,
            offset=self.number("offset") * volt if on else 0.0,
            phase=self.number("burst_phase" if self["burst"] else "phase"),
            duty={"SQU": self.number("duty"), "PULS": self.number("pulse_duty")}.get(short, 50.0) / 100,
            symmetry=self.number("symmetry") / 100 if short == "RAMP" else 1.0,
            inverted=inverted,
            burst=self._burst(),
            samples=self.samples if short == self.family.arb else None,
        )

    def _gated(self) -> bool:
        """Whether a closed gate keeps the signal in: nothing is plugged into the virtual one's gate."""
        return self["burst_mode"] == "GAT" and self["gate_polarity"] == "NORM"

    def _burst(self) -> Burst | None:
        if not self["burst"]:
            return None
        cycles = self.number("burst_cycles")
        period = self.number("burst_period") if self.repeats else None
        return Burst(math.inf if cycles >= INFINITE or self["burst_mode"] == "GAT" else cycles, period)

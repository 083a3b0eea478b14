"""A counter made of an oscilloscope and an estimator: each count is the frequency of the pulses in a record."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from analysis.arrays import Array
from analysis.errors import AnalysisError
from analysis.pulses import spin_of_trace
from instruments.drivers import Value
from instruments.drivers.counter import LIGHT, Count, Signal
from instruments.drivers.oscilloscope import Oscilloscope
from instruments.drivers.oscilloscope.sound import SamplesLost
from instruments.links.transport import Transport

#: Points of a record for each second, if the oscilloscope is fast enough; 12 000 place a pulse of 1 ms well.
_POINTS_PER_S = 12_000
#: The scale of a record about the trigger level, as of `levilab acquire trace` [V].
_VOLTS_PER_DIVISION = 0.2
#: A record that needs no trigger is waited for this much longer than it lasts [s].
_PATIENCE_S = 5.0
#: The standard uncertainty of the bench time of a record [s]: arrivals and polls scatter by some milliseconds.
_TIME_U_S = 5e-3


class SampledCounter:
    """A counter made of an oscilloscope; see :class:`instruments.drivers.counter.Counter`.

    scope: the oscilloscope, whose identity, settings and link are the counter's.
    """

    MODELS: ClassVar[str] = ".*"
    SERIAL: ClassVar[Mapping[str, Any]] = {}
    #: A record needs no trigger, so there is no level that could be wrong.
    SIGNAL: ClassVar[Signal] = Signal(
        LIGHT.name, "is the top floating and lit, and the phototransistor plugged into the first input"
    )
    ESTIMATES: ClassVar[bool] = True

    def __init__(self, scope: Oscilloscope) -> None:
        self.scope = scope
        self.transport: Transport = scope.transport
        self.last_set: dict[str, Value] = {}
        self.last: Count | None = None
        self.channel = 1

    def prepare(self, *, gate_s: float, trigger_level_v: float, channel: int = 1) -> None:
        """Take records of the length of a gate from now on; a sound card has no trigger level.  Raises OutOfRange."""
        level = trigger_level_v if "DC" in self.scope.INPUT_COUPLINGS else 0.0
        self.scope.prepare(
            channels=(channel,),
            duration_s=gate_s,
            points=math.ceil(_POINTS_PER_S * gate_s),
            volts_per_division=_VOLTS_PER_DIVISION,
            offset_v=level,
            coupling=self.scope.INPUT_COUPLINGS[0],
            trigger_level_v=level,
            trigger_source=channel,
            sweep="auto",
        )
        self.channel, self.last_set = channel, {"gate_s": gate_s, "trigger_level_v": level}

    def frequency(self) -> float | None:
        """Return the frequency of the pulses in the next record [Hz]; None where there are none."""
        self.last = None
        self.scope.acquire(timeout_s=_PATIENCE_S)
        try:
            trace = self.scope.trace(self.channel)
        except SamplesLost as lost:
            if lost.kept is None:
                raise
            trace = lost.kept
        try:
            found = spin_of_trace(trace.volts, 1 / trace.dt_s)
        except AnalysisError:  # no pulses return regularly
            return None
        if found.frequency.value is None:
            return None
        time = self.scope.ended - trace.codes.size * trace.dt_s + found.reference_time
        u = math.hypot(found.frequency.u or 0.0, (found.chirp.value or 0.0) * _TIME_U_S)
        self.last = Count(found.frequency.value, u or None, time)
        return found.frequency.value

    def readings(self, count: int) -> Array:
        """Return this number of counts; see :class:`instruments.drivers.counter.Counter`."""
        return np.array([self.frequency() for _ in range(count)], dtype=np.float64)

    # --- what every instrument offers, as the oscilloscope does ---

    def identity(self) -> str:
        """Return the identity of the oscilloscope."""
        return self.scope.identity()

    def settings(self) -> dict[str, Value]:
        """Return the settings of the oscilloscope."""
        return self.scope.settings()

    def changed_settings(
        self, now: Mapping[str, Value] | None = None, *, since: Mapping[str, Value] | None = None
    ) -> dict[str, tuple[object, object]]:
        """Return nothing: the oscilloscope compares its settings before it hands a record out."""
        return {}

    def forget_errors(self) -> None:
        """Empty the error queue of the oscilloscope."""
        self.scope.forget_errors()

    def close(self) -> None:
        """Give the oscilloscope back."""
        self.scope.close()

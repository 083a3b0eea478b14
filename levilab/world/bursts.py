"""The pull of bursts that the top itself triggers: its tape's pulse starts each of them at a set phase.

The moment's part across the axis, μ⊥, at an angle ψ to the coil's axis, feels the torque −μ⊥ sin ψ · B(t) about the
vertical.  A burst of whole cycles begins at the same ψ in every turn, so its mean torque over a turn is an integral of
a product of two sines, in closed form: with a start phase a quarter behind or ahead of the moment it drives or brakes.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from analysis.arrays import Array
from instruments.virtual.counter.edges import Thresholds
from instruments.virtual.generator.channel import Output
from instruments.virtual.generator.voltage import fundamental


@dataclass(frozen=True)
class TriggerWire:
    """The wire from the tape's phototransistor to the generator's trigger input, with a comparator that makes TTL.

    Attributes:
        level_v, hysteresis_v: of the comparator [V].
        lost: share of the pulses that do not come through, by chance.
    """

    level_v: float = 0.6
    hysteresis_v: float = 0.2
    lost: float = 0.0

    def thresholds(self, *, rising: bool) -> Thresholds:
        """Return where an edge of the comparator lies in the light's voltage."""
        high, low = self.level_v, self.level_v - self.hysteresis_v
        return Thresholds(high, low) if rising else Thresholds(low, high, -1.0)


def mean_pull(output: Output, rate: float, place: float, *, jitter: float = 0.0, lost: float = 0.0) -> float:
    """Return the mean torque of triggered bursts over a turn, over that of a sine of 1 T in phase with the top.

    Only the first harmonic counts, as it does for a plain signal.

    Args:
        output: the generator's, that waits for edges; amplitude in T.
        rate: of turns [Hz].
        place: of the moment at an edge, from the coil's axis [turns].
        jitter: scatter of an edge's place, 1σ [turns].
        lost: share of the edges that do not come.

    Returns:
        [T], above 0 where the bursts drive the top.

    >>> from instruments.virtual.generator.channel import Output, Triggered
    >>> sine = Output("SIN", 30.0, 0.0, 0.0, phase=180.0, triggered=Triggered(4e-4, 1, True, 0.0, 0.0))
    >>> braking = replace(sine, phase=0.0)
    >>> round(1e4 * mean_pull(sine, 29.9, 0.0), 2), round(1e4 * mean_pull(braking, 29.9, 0.0), 2)
    (3.99, -3.99)
    """
    bursts = output.triggered
    if bursts is None or not math.isfinite(bursts.cycles) or rate <= 0:
        return 0.0
    lasts = bursts.cycles / output.frequency
    field = fundamental(replace(output, amplitude=bursts.amplitude, burst=None)) * (-1.0 if output.inverted else 1.0)
    moment, phase = 2 * math.pi * (place + rate * bursts.delay), math.radians(output.phase)
    difference, total = (math.pi * lasts * (rate + sign * output.frequency) for sign in (-1.0, 1.0))
    # 2 ∫ sin(ψ + ωt) sin(φ + ω′t) dt over the burst
    product = math.cos(moment - phase + difference) * _sinc(difference)
    product -= math.cos(moment + phase + total) * _sinc(total)
    scatter = 2 * math.pi * math.hypot(jitter, rate * bursts.jitter)
    turns = _turns_per_burst(rate * (bursts.delay + lasts), jitter) + lost / (1 - lost)
    return -field * rate * lasts / turns * product * math.exp(-(scatter**2) / 2)


def _sinc(x: float) -> float:
    return math.sin(x) / x if x else 1.0


def _turns_per_burst(length: float, jitter: float) -> float:
    """Return the mean number of turns from the start of one burst to that of the next one.

    An edge that comes before the end of a burst is ignored; jitter decides about one that comes near it.

    Args:
        length: from the edge to the end of the burst [turns].
        jitter: scatter of an edge's place, 1σ [turns].
    """
    spread = 2 * max(jitter, 1e-9)  # of the interval between two edges, √2 σ, times √2 of the error function
    later = range(1, math.ceil(length + 4 * jitter) + 1)
    return 1 + sum(0.5 * math.erfc((k - length) / spread) for k in later)


def burst_starts(edges: Array, length: float) -> Array:
    """Return those of the edges that start a burst: none that comes before the last burst has ended.

    Args:
        edges: shape (n,), increasing [s].
        length: from an edge to the end of its burst [s].

    >>> burst_starts(np.array([0.0, 0.01, 0.033, 0.066, 0.07]), 0.03).tolist()
    [0.0, 0.033, 0.066]
    """
    starts: list[float] = []
    for edge in edges.tolist():
        if not starts or edge >= starts[-1] + length:
            starts.append(edge)
    return np.array(starts)

"""How fast a drive can spin a top: its pull on the tilted moment against the drag of the air and the drive's own ramp.

A field B along one line turns with the top with half its size, so it accelerates the spin by at most α = δ|μ|B/(2I₃), δ
being the part of the moment across the axis.  A top that leans in step with its moment has more of it across: δ grows
by δ/((ν/ν_r)² − 1), with the resonance ν_r of the wobble.  The laminar flow about a disc takes C ω^(3/2), a ramp
2π dν/dt.  The lag φ behind the drive is that of a pendulum, φ̈ = load − α sin φ: where the load is α, the lag is a
quarter turn, and no top is held.  One that swings about the drive is lost earlier, where the barrier is no higher than
its swing.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

#: Range of spins in which a balance is looked for, above the resonance in parts of it, and at most [Hz].
_ABOVE_RESONANCE, _FASTEST_HZ = 1.2, 500.0
#: Points of the integral over a swing at the barrier.
_POINTS = 2001


@dataclass(frozen=True)
class Driven:
    """A top under a drive that goes up.

    Attributes:
        strongest: greatest angular acceleration by the drive of a top that does not lean, α [rad/s²].
        drag: constant C of the disc's law [(rad/s)^-1/2/s].
        ramp: rate of the drive [Hz/s].
        resonance: of the wobble, by which the top leans [Hz]; None: it does not lean.
    """

    strongest: float
    drag: float
    ramp: float = 0.0
    resonance: float | None = None

    def pull(self, spin: float) -> float:
        """Return the greatest acceleration by the drive at a spin [Hz], in rad/s²."""
        lean = 0.0 if self.resonance is None else 1 / ((spin / self.resonance) ** 2 - 1)
        return self.strongest * (1 + lean)

    def load(self, spin: float) -> float:
        """Return the acceleration that drag and ramp take at a spin [Hz], in rad/s²."""
        return float(self.drag * (2 * math.pi * spin) ** 1.5 + 2 * math.pi * self.ramp)

    def highest(self) -> float:
        """Return the spin at which drag and ramp take all that the drive gives [Hz]; NaN where they always do.

        >>> round(Driven(2.4745, 2.37e-4).highest(), 1), round(Driven(2.4745, 2.37e-4, ramp=0.1).highest(), 1)
        (76.0, 62.5)
        """
        left = self.strongest - 2 * math.pi * self.ramp
        if self.resonance is None:
            return (left / self.drag) ** (2 / 3) / (2 * math.pi) if left > 0 else math.nan
        lowest = _ABOVE_RESONANCE * self.resonance  # nearer to it the lean is no small addition
        if self.pull(lowest) <= self.load(lowest):
            return math.nan
        return float(brentq(lambda spin: self.pull(spin) - self.load(spin), lowest, _FASTEST_HZ))

    def highest_with_swing(self, swing: float, start: float) -> float:
        """Return the spin at which a top is lost that swings about the drive [Hz]; NaN where it is at once.

        The ramp is slow beside the swing, so drag alone changes its action ∮ φ̇ dφ: a faster top is braked more, at the
        rate 3/2 C √ω.  The top is lost where the action is as large as at the barrier.

        Args:
            swing: amplitude of the spin about the drive at the start [Hz].
            start: spin at which the ramp begins [Hz].
        """
        end, pull, load = self.highest(), self.pull(start), self.load(start)
        if not swing or not self.ramp or not end > start:
            return end
        energy = (2 * math.pi * swing) ** 2 / 2 / pull
        if energy >= barrier(load / pull):
            return math.nan
        begun = math.sqrt(pull) * action(load / pull, energy)

        def room(spin: float) -> float:
            damped = begun * math.exp(-self.drag * math.sqrt(2 * math.pi) * (spin**1.5 - start**1.5) / self.ramp)
            part = min(self.load(spin) / self.pull(spin), 1.0)
            return math.sqrt(self.pull(spin)) * action(part, barrier(part)) - damped

        return float(brentq(room, start, end))


def barrier(load: float) -> float:
    """Return the energy ½φ̇² that a lag needs to turn over, in units of α.

    load: that of drag and ramp, as a part of the pull.

    >>> barrier(0.0), round(barrier(1.0), 9)
    (2.0, 0.0)
    """
    rest = math.asin(min(load, 1.0))
    return 2 * math.cos(rest) - load * (math.pi - 2 * rest)


def action(load: float, energy: float) -> float:
    """Return ∮ φ̇ dφ of a lag φ that swings with an energy up to the barrier, in units of √α.

    load, energy: as in `barrier`.

    >>> round(action(0.0, 2.0), 3), round(action(0.5, 0.5 * 0.01**2) / (math.pi * 0.01**2) * 0.75**0.25, 3)
    (16.0, 1.0)
    """
    rest, most = math.asin(min(load, 1.0)), barrier(load)
    if energy <= 0 or most <= 0:
        return 0.0

    def kinetic(lag: Any) -> Any:
        return energy + load * (lag - rest) + np.cos(lag) - math.cos(rest)

    last = math.pi - rest
    over = last if energy >= most else float(brentq(kinetic, rest, last))
    back = -math.pi if load == 0 and over == last else float(brentq(kinetic, -math.pi - rest, rest))
    # φ = middle + half·sin: the root of the energy is smooth in the angle, up to both ends
    angle = np.linspace(-math.pi / 2, math.pi / 2, _POINTS)
    half = (over - back) / 2
    lag = (over + back) / 2 + half * np.sin(angle)
    rate = np.sqrt(np.maximum(2 * kinetic(lag), 0.0))
    return float(2 * np.trapezoid(rate * half * np.cos(angle), angle))

"""What a counter counts of a top whose moment is tilted: the spin, and its wobble with it.

A mark on the rim passes the counter at the rate Ω at which the body turns about the vertical.  A moment that points
off the axis by the angle δ makes the axis go round with the body (the synchronous tilt θ), and θ grows as the spin
falls towards the resonance ν_r = √(P/(I₃ − I₁))/2π, P = |μ|B.  Three things follow for a top that turns evenly
about the vertical, with x = (Ω/2πν_r)², κ = 1 − I₁/I₃:

- torque:    tan θ (x cos θ − 1) = δ, in linear theory θ = δ/(x − 1);
- height:    a tilted moment is lifted less, so the top sinks to where the field is stronger, and P grows by the
             part β(θ²/2 + δθ), β = B′²/(B B″);
- balance:   the field exerts no torque about the vertical, so d/dt[Ω(1 − κ sin²θ)] = −f(Ω cos θ) cos θ, where the drag
             f acts on the axial spin ω₃ = Ω cos θ.

A top that was driven up goes on nutating.  Its amplitude changes as A² ~ e^∓φ/sinh φ, cosh φ = ν/ν_s, the upper
sign for the nutation, the lower for the precession (slowly varying solution of I₁N̈ − iI₃ω₃Ṅ + PN = 0), and what each
adds to the count, A²/2 times its frequency, has one shape: K/√((ν/ν_s)² − 1).  The spin of a top that just sleeps is
ν_s = 2√(I₁P)/2πI₃ = 2√(κ(1 − κ)) ν_r.

With η = tan θ/δ and s = δ² these read x(η) = (1 + 1/η)(1 + βs(η + η²/2))√(1 + sη²): everything is an explicit
function of η, and depends on s alone, so that s = 0 is an ordinary point, and a fit may come from either side of it.

Source: H. Goldstein, Classical Mechanics, §5.7 for the symmetric top; PHYSICS.md §4, §5.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.spindown.drag import DragLaw

Array = NDArray[np.float64]

# Of the thesis's top, and of Simon's three to 0.1: a tenth of κ changes C by 0.05 %.
KAPPA = 0.4
# At a height in the middle of the stable range (computed for the thesis's base at 7.4 cm); it is 2.5 at its upper end.
BETA = 3.3
# What of the change that the tilt makes in a constant is not known, as κ and β are of another top, and since the top's
# other motions count, too.  With a tenth, pulls of C of simulated tops scatter by 0.7, with this by 0.8 to 0.9.
UNKNOWN_PART = 0.05
# The same of δ itself, which stands and falls with the height that β is for: of 40 other tops 85 % had it within 2 u
# without this part, 95 % have it with it.
UNKNOWN_TILT = 0.15
# The resonance lies below the last reading, x there being 1 + exp(a).  Where a tilt is seen at all, a is so much: 32
# simulated tops fell at −1.1 ± 0.4.
LAST_GAP, LAST_GAP_U = -1.1, 0.5


@dataclass(frozen=True)
class Wobble:
    """K/ν_ref as it is expected, and its standard uncertainty; 0.001 of it change C by 0.12 %."""

    value: float
    u: float


# How a top came to its spin is not known: set by a calm hand it has hardly any.
UNKNOWN_ORIGIN = Wobble(0.0008, 0.0013)
# A drive makes the top nutate while it raises it: 58 virtual tops had 0.0013 in the median, nine in ten of them 0.0003
# to 0.004, measured in their motion (the counts know it to 0.001).
AFTER_DRIVE = Wobble(0.0015, 0.0010)

PARAMETERS = ("moment_tilt", "resonance", "wobble")
UNITS = ("rad", "Hz", "Hz")
MORE = len(PARAMETERS)
_SLEEPING = 2 * float(np.sqrt(KAPPA * (1 - KAPPA)))
_NODES = 120
_GRID = np.linspace(0.0, 1.0, _NODES)
# Counts at so many times are worked out at once: for few readings numpy's calls cost more than their numbers.
_AT_ONCE = 20_000
_LARGEST_TILT2 = 0.3  # tan²θ: far beyond what a top survives
_GAUSS = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)]), np.array([5.0, 8.0, 5.0]) / 18


@dataclass(frozen=True, eq=False)
class CountedLaw:
    """A drag law as a counter sees it: three parameters more, and what is known of two of them beforehand.

    The additional parameters are A, tan²θ at the last reading by linear theory, and a, by which the last reading
    stands above the resonance, x = 1 + exp(a): these two hardly depend on each other, δ and ν_r do.
    The third is K/ν_ref.

    Attributes:
        law: of the drag.
        last: the last reading, in units of ν_ref.
        gap: a as expected.
        gap_u: standard uncertainty of that.
        wobble: K/ν_ref as expected.
    """

    law: DragLaw
    last: float
    gap: float = LAST_GAP
    gap_u: float = LAST_GAP_U
    wobble: Wobble = UNKNOWN_ORIGIN

    @property
    def name(self) -> str:
        """Of the law."""
        return self.law.name

    @property
    def constants(self) -> tuple[str, ...]:
        """Names of the law's constants."""
        return self.law.constants

    @property
    def orders(self) -> tuple[float, ...]:
        """Of the law."""
        return self.law.orders

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters."""
        return (*self.law.parameters, *PARAMETERS)

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """Their units."""
        return (*self.law.parameter_units, *UNITS)

    @property
    def expected(self) -> tuple[tuple[int, float, float], ...]:
        """Which parameter is known beforehand, its value and u."""
        return (-2, self.gap, self.gap_u), (-1, self.wobble.value, self.wobble.u)

    def shape(self, q: Array) -> tuple[float, float, float]:
        """δ², ν_r/ν_ref, and K/ν_ref."""
        a = min(max(float(q[-2]), -5.0), 4.0)
        s = min(max(float(q[-3]) * float(np.exp(2 * a)), -0.01), 0.1)
        return s, self.last / float(np.sqrt(1 + np.exp(a))), float(q[-1])

    def solution(self, q: Array) -> Array:
        """The law's parameters, then δ², ν_r/ν_ref and K/ν_ref, shape (p,)."""
        return np.array([*q[:-MORE], *self.shape(q)])

    def spin(self, tau: Array, q: Array) -> Array:
        """What the counter counts, shape (n,)."""
        return np.asarray(self.spins(tau, q[None])[0])

    def gradient(self, tau: Array, q: Array) -> Array:
        """Its slopes with q, shape (p, n), by differences: good to 1e-7 of themselves."""
        sizes = 1e-5 * np.maximum(np.abs(q), 0.1)
        sizes[-MORE:] = 1e-4
        steps, p = np.diag(sizes), len(q)
        spins = self.spins(tau, np.vstack([q + steps, q - steps]))
        return np.asarray((spins[:p] - spins[p:]) / (2 * sizes[:, None]))

    def spins(self, tau: Array, rows: Array) -> Array:
        """The same for several q, shape (r, p) → (r, n)."""
        shapes = np.array([self.shape(q) for q in rows])
        with np.errstate(all="ignore"):
            return counts(self.law, tau, rows[:, :-MORE], shapes)

    def natural(self, q: Array, reference_hz: float, duration: float) -> tuple[Array, Array]:
        """As `DragLaw.natural`, then δ [rad], ν_r [Hz] and K [Hz]."""
        values, slopes = self.law.natural(q[:-MORE], reference_hz, duration)
        n, (s, resonance, wobble) = len(values), self.shape(q)
        delta = float(np.sqrt(max(s, 0.0)))
        share = float(np.exp(q[-2]) / (1 + np.exp(q[-2]))) / 2
        full = np.zeros((n + MORE, n + MORE))
        full[:n, :n] = slopes
        full[n, n : n + 2] = [delta / (2 * float(q[-3])) if delta else np.nan, delta]
        full[n + 1, n + 1] = -share * resonance * reference_hz
        full[n + 2, n + 2] = reference_hz
        return np.array([*values, delta, resonance * reference_hz, wobble * reference_hz]), full

    def dimensionless(self, values: Array, reference_hz: float, duration: float) -> Array:
        """The inverse of `natural`."""
        q = self.law.dimensionless(values[:-MORE], reference_hz, duration)
        delta, resonance, wobble = (float(value) for value in values[-MORE:])
        ratio = max((self.last * reference_hz / resonance) ** 2 - 1, 1e-2)
        a = float(np.log(ratio))
        return np.array([*q, delta**2 * float(np.exp(-2 * a)), a, wobble / reference_hz])


Law = DragLaw | CountedLaw


def counted(law: DragLaw, tau: Array, solution: Array) -> Array:
    """The curve of a solution, with the tilt where it has one; shape (n,)."""
    p = len(law.parameters)
    if len(solution) == p:
        return law.spin(tau, solution)
    s, resonance, wobble = (float(value) for value in solution[p:])
    return count(law, tau, solution[:p], s, resonance, wobble=wobble)


@dataclass(frozen=True, eq=False)
class _Path:
    """The ways of tops down their spin, in units of the resonance, at points of ln η; shape (r, k) each."""

    spin: Array  # Ω/Ω_r
    slope: Array  # dΩ/d ln η
    axial: Array  # cos θ
    momentum_slope: Array  # of Ω(1 − κ sin²θ), with ln η


def _path(log_eta: Array, s: Array) -> _Path:
    """The way at these points, for each s.

    With w = 1 + sη², l = 1 + βs(η + η²/2) and sin²θ = sη²/w: Ω² = (1 + 1/η) l √w, and
    dΩ/d ln η = Ω/2 [βs(η + η²)/l + sin²θ − 1/(1 + η)].

    It is worked out in place: three quarters of the time would go into memory for what comes in between.
    """
    eta = np.exp(log_eta)
    eta2 = eta * eta
    sin2 = s * eta2
    w = np.maximum(sin2 + 1, 0.1)
    sin2 /= w
    axial = np.sqrt(w)
    lift = eta2 * 0.5
    lift += eta
    lift *= BETA * s
    lift += 1
    np.maximum(lift, 0.1, out=lift)
    spin = 1 / eta
    spin += 1
    spin *= lift
    spin *= axial
    np.sqrt(spin, out=spin)
    slope = eta2
    slope += eta
    slope *= BETA * s
    slope /= lift
    slope += sin2
    eta += 1
    slope -= np.divide(1, eta, out=eta)
    slope *= spin
    slope *= 0.5
    momentum_slope = sin2 * -KAPPA
    momentum_slope += 1
    momentum_slope *= slope
    sin2 *= spin
    sin2 /= w
    sin2 *= 2 * KAPPA
    momentum_slope -= sin2
    return _Path(spin, slope, np.divide(1, axial, out=axial), momentum_slope)


def count(law: DragLaw, tau: Array, q: Array, s: float, resonance: float, *, wobble: float = 0.0) -> Array:
    """What the counter counts, in the dimensionless numbers of `analysis.spindown.drag`.

    Args:
        law: of the drag.
        tau: shape (n,), rising from 0 on.
        q: of the law, the start being that of the count.
        s: δ², of either sign.
        resonance: ν_r/ν_ref.
        wobble: K/ν_ref of the free wobble.

    Returns:
        Shape (n,); beyond the fall, which a search may meet, a straight line.
    """
    return np.asarray(counts(law, tau, np.array([q]), np.array([[s, resonance, wobble]]))[0])


def counts(law: DragLaw, tau: Array, q: Array, shapes: Array) -> Array:
    """The same of several tops; q of shape (r, p), shapes: s, resonance and wobble of each, shape (r, 3) → (r, n)."""
    many = max(_AT_ONCE // max(len(tau), 1), 1)
    parts = [_counts(law, tau, q[k : k + many], shapes[k : k + many]) for k in range(0, len(q), many)]
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _counts(law: DragLaw, tau: Array, q: Array, shapes: Array) -> Array:
    s, resonance, wobble = shapes.T[:, :, None]
    of_law = q.T[:, :, None]
    x0 = np.minimum(np.maximum(of_law[0], resonance * 1.001), 1e3)
    log_eta, path = _nodes(1 / ((1.01 * x0 / resonance) ** 2 - 1), s)
    # time between the nodes by three points of Gauss and Legendre: 1e-10 of it
    width = np.diff(log_eta)
    inner = (log_eta[:, :-1, None] + width[:, :, None] * _GAUSS[0]).reshape(len(q), -1)
    within = _path(inner, s)
    lapse = (_time_slope(law, within, of_law, resonance).reshape(*width.shape, 3) @ _GAUSS[1]) * width
    time = np.concatenate([np.zeros((len(q), 1)), np.cumsum(lapse, axis=1)], axis=1)
    spin = resonance * path.spin
    slope = resonance * path.slope / _time_slope(law, path, of_law, resonance)  # dx/dτ
    start = _hermite(-x0, -spin, time, -1 / slope)
    even = _hermite(tau + start, time, spin, slope)
    even = np.nan_to_num(np.minimum(np.maximum(even, -1e3), 1e3))  # a search may go anywhere
    return np.asarray(even + wobble / np.sqrt(np.maximum((even / (_SLEEPING * resonance)) ** 2 - 1, 0.05)))


def _nodes(first: Array, s: Array) -> tuple[Array, _Path]:
    """From a little above the start down to the fall, where the spin would rise again, or to the resonance.

    first, s: shape (r, 1).
    """
    begin = np.log(first)
    last = np.minimum(2e3, np.sqrt(_LARGEST_TILT2 / np.maximum(np.abs(s), 1e-12)))
    end = np.log(np.maximum(last, 1.5 * first))
    log_eta = begin + (end - begin) * _GRID
    path = _path(log_eta, s)
    turned = np.minimum(-path.slope, -path.momentum_slope) <= 1e-4
    falls = turned.any(axis=1)
    if not falls.any():
        return log_eta, path
    at = np.maximum(np.argmax(turned, axis=1) - 1, 2)
    end[falls, 0] = log_eta[falls, at[falls]]
    log_eta = begin + (end - begin) * _GRID
    return log_eta, _path(log_eta, s)


def _time_slope(law: DragLaw, path: _Path, q: Array, resonance: Array) -> Array:
    """dτ/d ln η."""
    slowing = law.slowing(resonance * path.spin * path.axial, q) * path.axial
    return np.asarray(-resonance * path.momentum_slope / np.where(np.abs(slowing) > 1e-30, slowing, 1e-30))


def _hermite(at: Array, x: Array, y: Array, slope: Array) -> Array:
    """y(at) by a cubic between the nodes x, which rise; beyond them by a straight line; shape (r, n) of (r, k)."""
    found = np.array([row.searchsorted(wanted) for row, wanted in zip(x, at, strict=True)])
    k = np.minimum(np.maximum(found - 1, 0), x.shape[1] - 2)
    k += x.shape[1] * np.arange(len(x))[:, None]  # of the flat arrays
    left, before, after = x.take(k), slope.take(k), slope.take(k + 1)
    h = np.maximum(x.take(k + 1) - left, 1e-300)
    u = (at - left) / h
    inside = np.minimum(np.maximum(u, 0.0), 1.0)
    v = 1 - inside
    value = v * v * ((1 + 2 * inside) * y.take(k) + inside * h * before)
    value = value + inside * inside * ((1 + 2 * v) * y.take(k + 1) - v * h * after)
    beyond = (u - inside) * h
    return np.asarray(value + beyond * np.where(beyond < 0, before, after))

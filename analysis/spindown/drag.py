"""The drag laws of a free axial spin, their closed forms and exact gradients.

Drag takes spin from the top by a power of the spin, ω̇ = −c ωⁿ, or by C₁ω + C₂ω² together. Each has a
closed form, evaluated here without a singularity where n → 1 or C₁ → 0.

Fits work with dimensionless numbers of order one: spin x = ν/ν_ref and time τ = t/T, with ν_ref [Hz] a
typical spin frequency and T [s] the length of the run. A power law reads dx/dτ = −κ x^(m+1), m = n − 1, where κ is
the decay rate at ν_ref; the parameters are (x₀, κ) and, where the exponent is free, m. The mixed law reads
dx/dτ = −α x − β x². `DragLaw.natural` turns them into start frequency [Hz] and textbook constants.

Source: PHYSICS.md §5; the exponents are those of Stokes's drag (1), of a laminar rotating disc (3/2; von Kármán,
Z. angew. Math. Mech. 1, 233 (1921)) and of Newton's drag (2).
"""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from types import MappingProxyType

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike

from analysis.arrays import Array

LARGEST_LOG = 200.0  # |ln x| is kept below this, so that squares of spins and slopes stay finite during a fit
LARGEST_DECAY = 1e100  # the same for κτ: any larger and the spin is zero anyway
SMALL = 0.03  # below it slopes come from a series; ten terms leave 0.03¹⁰ ≈ 6e-16, differences would lose 1e-14

_POWER_SERIES = np.array([(-1.0) ** i * (i + 1) / (i + 2) for i in range(10)])
_MIXED_SERIES = np.array([-0.5, 1 / 3, -1 / 8, 1 / 30, -1 / 144, 1 / 840, -1 / 5760, 1 / 45360])


def _clip(x: Array, limit: float) -> Array:
    return np.minimum(np.maximum(x, -limit), limit)  # np.clip is slower on short arrays


def _or_one(value: Array, x: Array) -> Array:
    """value/x, and its limit 1 where x = 0."""
    return np.divide(value, x, out=np.ones_like(x), where=x != 0)


def _quotient(difference: Array, divisor: Array, y: Array, series: Array) -> Array:
    """difference/divisor, and the power series in y that stands for it where both vanish."""
    small = np.abs(y) < SMALL
    value = np.divide(difference, divisor, out=np.zeros_like(y), where=~small)
    value[small] = polyval(y[small], series)
    return value


def _decay(tau: Array, x0: float, kappa: float, m: float) -> tuple[Array, Array, Array, float]:
    """Return S = κ x₀ᵐ τ, mS (above −1), x, and x₀ᵐ, for a power law: x = x₀ exp(−ln(1 + mS)/m)."""
    log_x0 = float(np.log(max(x0, 1e-80)))
    scale = float(np.exp(min(max(m * log_x0, -LARGEST_LOG), LARGEST_LOG)))
    s = _clip((kappa * scale) * tau, LARGEST_DECAY)
    ms = m * s
    over = ms <= -1  # n < 1: the top has stopped; a negative κ with n > 1: the spin has grown beyond all bounds
    ms = np.maximum(ms, np.nextafter(-1.0, 0.0))
    x = np.exp(_clip(log_x0 - s * _or_one(np.log1p(ms), ms), LARGEST_LOG))
    if m < 0 and over.any():
        x[over] = 0.0
    return s, ms, x, scale


def _power(tau: Array, q: Array, m: float | None = None) -> Array:
    """Spin of a power law; q is (x₀, κ) and m, unless m is given."""
    return _decay(tau, q[0], q[1], q[2] if m is None else m)[2]


def _power_gradient(tau: Array, q: Array, m: float | None = None) -> Array:
    """Return the slopes of `_power` with x₀, κ and, if it is free, m: shape (p, n)."""
    exponent = float(q[2]) if m is None else m
    s, ms, x, scale = _decay(tau, q[0], q[1], exponent)
    falling = x / (1 + ms)
    rows = [falling / max(float(q[0]), 1e-80), (-scale) * tau * falling]
    if m is None:
        # ln x = ln x₀ − S L(mS) with L(y) = ln(1+y)/y, and −L′ is [L(y) − 1/(1+y)]/y, a difference near y = 0
        slope = _quotient(np.log1p(ms) - ms / (1 + ms), ms * ms, ms, _POWER_SERIES)
        rows.append(x * s * s * slope - falling * s * float(np.log(max(q[0], 1e-80))))
    return np.array(rows)


def _power_slowing(x: Array, q: Array, m: float | None = None) -> Array:
    """Return −dx/dτ of a power law."""
    order = q[2] if m is None else m
    return np.asarray(q[1] * np.exp(_clip((order + 1) * np.log(x), LARGEST_LOG)))


def _mixture(tau: Array, x0: float, alpha: float, beta: float) -> tuple[Array, Array, Array, Array]:
    """Return y = ατ, e⁻ʸ, E = (1 − e⁻ʸ)/y and the denominator of x = x₀ e⁻ʸ/(1 + β x₀ τ E)."""
    y = _clip(alpha * tau, LARGEST_LOG)
    fall = np.exp(-y)
    mean = _or_one(-np.expm1(-y), y)
    return y, fall, mean, np.maximum(1 + _clip(beta * x0 * tau, LARGEST_DECAY) * mean, 1e-16)


def _mixed(tau: Array, q: Array) -> Array:
    """Return the spin of the mixed law; q is (x₀, α, β)."""
    _, fall, _, grown = _mixture(tau, q[0], q[1], q[2])
    return np.asarray(q[0] * fall / grown)


def _mixed_gradient(tau: Array, q: Array) -> Array:
    """Return the slopes of `_mixed` with x₀, α, β: shape (3, n)."""
    y, fall, mean, grown = _mixture(tau, q[0], q[1], q[2])
    slope = _quotient(fall - mean, y, y, _MIXED_SERIES)  # dE/dy
    x = q[0] * fall / grown
    eaten = q[0] * tau * x / grown
    return np.array([fall / grown**2, -tau * x - q[2] * tau * eaten * slope, -mean * eaten])


def _mixed_slowing(x: Array, q: Array) -> Array:
    """Return −dx/dτ of the mixed law."""
    return np.asarray((q[1] + q[2] * x) * x)


@dataclass(frozen=True)
class DragLaw:
    """A law ω̇ = −f(ω).

    Attributes:
        name: its name in every result.
        constants: names of its constants; with the start frequency these are its parameters, in this order.
        units: of the constants.
        symbols: of the constants.
        orders: m = n − 1 of each term, none where the exponent is itself a parameter.
        torque: to what the drag's torque is proportional, and where that is so.
        spin: dimensionless closed form, (τ, q) → x, shapes (n,), (p,) → (n,).
        gradient: its slopes with respect to q, (τ, q) → (p, n).
        slowing: −dx/dτ at spins x, (x, q) → (n,), shapes (n,), (p,); of several tops (r, n), (p, r, 1) → (r, n).
    """

    name: str
    constants: tuple[str, ...]
    units: tuple[str, ...]
    symbols: tuple[str, ...]
    orders: tuple[float, ...]
    torque: str
    spin: Callable[[Array, Array], Array]
    gradient: Callable[[Array, Array], Array]
    slowing: Callable[[Array, Array], Array]

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters: start_frequency and the constants."""
        return ("start_frequency", *self.constants)

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """Their units."""
        return ("Hz", *self.units)

    @property
    def exponent(self) -> float | None:
        """N of a law of one fixed power, else None."""
        return self.orders[0] + 1 if len(self.orders) == 1 else None

    @property
    def equation(self) -> str:
        """The law in plain notation: what follows ^ in brackets is raised.

        >>> [LAWS[name].equation for name in ("disc", "mixed", "power")]
        ['ω̇ = −C₃/₂ω^(3/2)', 'ω̇ = −C₁ω − C₂ω^(2)', 'ω̇ = −cω^(n)']
        """
        powers = [str(Fraction(m + 1).limit_denominator(100)) for m in self.orders] or [self.symbols[1]]
        terms = zip(self.symbols, powers, strict=False)
        return "ω̇ = −" + " − ".join(f"{symbol}ω" + (f"^({n})" if n != "1" else "") for symbol, n in terms)

    def contains(self, other: "DragLaw") -> bool:
        """Return whether another law is this one with fewer constants.

        >>> LAWS["mixed"].contains(LAWS["newton"]), LAWS["power"].contains(LAWS["disc"])
        (True, True)
        >>> LAWS["mixed"].contains(LAWS["disc"]), LAWS["power"].contains(LAWS["mixed"])
        (False, False)
        """
        if not self.orders:
            return other.exponent is not None
        return bool(other.orders) and set(other.orders) < set(self.orders)

    def natural(self, q: Array, reference_hz: float, duration: float) -> tuple[Array, Array]:
        """Start frequency [Hz] and constants for dimensionless parameters q, and their slopes with q.

        Args:
            q: shape (p,).
            reference_hz: ν_ref, the unit of spin frequency [Hz].
            duration: T, the unit of time [s].

        Returns:
            Values, shape (p,), and the matrix of slopes, shape (p, p). The c of a free exponent may overflow
            to inf or fall to 0: c = κ/(T ω_refᵐ) depends exponentially on m.
        """
        log_omega = float(np.log(2 * np.pi * reference_hz))
        free = not self.orders
        orders = q[2:] if free else np.array(self.orders)
        with np.errstate(over="ignore"):
            units = [reference_hz, *np.exp(-orders * log_omega) / duration]
            slopes = np.diag([*units, 1.0] if free else units)
            values = np.diagonal(slopes) * q
        if free:
            slopes[1, 2] = -log_omega * values[1]
            values[2] += 1
        return values, slopes

    def dimensionless(self, values: ArrayLike, reference_hz: float, duration: float) -> Array:
        """Return the parameters q for a start frequency [Hz] and constants: the inverse of `natural`."""
        q = np.array(values, dtype=float)
        q[0] /= reference_hz
        if not self.orders:
            q[2] -= 1
        rates = slice(1, 1 + max(len(self.orders), 1))
        q[rates] *= duration * (2 * np.pi * reference_hz) ** np.array(self.orders or q[2:])
        return q


_LOW = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def power_law(name: str, n: Fraction, torque: str = "") -> DragLaw:
    """Return the law ω̇ = −C ωⁿ, with its constant's name, unit and symbol.

    Args:
        name: of the law.
        n: its exponent.
        torque: see `DragLaw`.
    """
    m = float(n - 1)
    units = {Fraction(1): "1/s", Fraction(2): "1/rad"}
    return DragLaw(
        name=name,
        constants=(f"c{n}".replace("/", ""),),
        units=(units.get(n, f"(rad/s)^{1 - n}/s"),),
        symbols=(f"C{n}".translate(_LOW),),
        orders=(m,),
        torque=torque,
        spin=partial(_power, m=m),
        gradient=partial(_power_gradient, m=m),
        slowing=partial(_power_slowing, m=m),
    )


#: One row a law.  Everything that names, shows, nests or explains laws is made from these rows.
_TABLE = (
    power_law("stokes", Fraction(1), "the spin, as of eddy currents, or of air that creeps"),
    power_law("newton", Fraction(2), "the square of the spin, as of air that is stirred up"),
    power_law(
        "disc", Fraction(3, 2), "the spin to the power 3/2, as of the laminar layer of air on a disc (von Kármán, 1921)"
    ),
    DragLaw(
        name="mixed",
        constants=("c1", "c2"),
        units=("1/s", "1/rad"),
        symbols=("C₁", "C₂"),
        orders=(0.0, 1.0),
        torque="the spin in one part, and to its square in another",
        spin=_mixed,
        gradient=_mixed_gradient,
        slowing=_mixed_slowing,
    ),
    DragLaw(
        name="power",
        constants=("c", "exponent"),
        units=("(rad/s)^(1-exponent)/s", "1"),
        symbols=("c", "n"),
        orders=(),
        torque="a power n of the spin, which the fit chose",
        spin=_power,
        gradient=_power_gradient,
        slowing=_power_slowing,
    ),
)
LAWS = MappingProxyType({law.name: law for law in _TABLE})


def spin(law: str, time: ArrayLike, start_frequency_hz: float, *constants: float) -> Array:
    """Spin frequency [Hz] of a top left alone.

    Args:
        law: one of `LAWS`.
        time: shape (n,), since the start [s].
        start_frequency_hz: spin frequency at time 0 [Hz].
        constants: of the law, in the order and units of `LAWS[law].constants`.

    Returns:
        Shape (n,) [Hz]; 0 after the top has stopped, which it does in finite time when n < 1.

    >>> spin("stokes", [0, 100], 40.0, 3.18e-3).round(3)
    array([40.   , 29.104])
    >>> spin("power", [0, 100], 40.0, 2.34e-4, 1.5).round(3) == spin("disc", [0, 100], 40.0, 2.34e-4).round(3)
    array([ True,  True])
    """
    drag = LAWS[law]
    q = drag.dimensionless([start_frequency_hz, *constants], start_frequency_hz, 1.0)
    return start_frequency_hz * drag.spin(np.asarray(time, dtype=float), q)

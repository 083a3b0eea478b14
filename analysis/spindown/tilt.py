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

A top nutates, too.  Its amplitude changes as A² ~ e^∓φ/sinh φ, cosh φ = ν/ν_s, the upper sign for the nutation, the
lower for the precession (slowly varying solution of I₁N̈ − iI₃ω₃Ṅ − PN = 0), and what each adds to the count, A²/2 times
its frequency, has one shape: K/√((ν/ν_s)² − 1).  The spin of a top that just sleeps is
ν_s = 2√(I₁P)/2πI₃ = 2√(κ(1 − κ)) ν_r.  How much of it there is follows from the release:

- A top that is set free spins about its axis, which stands upright, where its moment would have it lean by θ.  Nutation
  (f, amplitude α) and precession (p) make up for −θ, and for the −2πiνθ of its rate: α = θ(ν − p)/(f − p).  What the
  precession adds to the count is 3 to 6 % of what the nutation adds, and is left out.
- A drive feeds the nutation.  The air slows the top about its axis (the torque −D along N); the drive turns it about
  the vertical by the torque T, which has no part across, but its pull on the transverse moment, which nods with the
  axis, has one: TN/2.  Beside I₃ω̇₃ = T − D this leaves TN/2 in the equation of N, so that K grows at the rate
  (T/I₃ω₃)/tanh φ: by e^(φ − φ₀) with the spin, and by what the air meanwhile takes, threefold within 4 min.

With η = tan θ/δ and s = δ² these read x(η) = (1 + 1/η)(1 + βs(η + η²/2))√(1 + sη²): everything is an explicit
function of η, and depends on s alone, so that s = 0 is an ordinary point, and a fit may come from either side of it.

Source: H. Goldstein, Classical Mechanics, §5.7 for the symmetric top; PHYSICS.md §4, §5.
"""

from dataclasses import dataclass, replace

import numpy as np

from analysis.arrays import Array
from analysis.spindown.drag import DragLaw

PARAMETERS = ("moment_tilt", "resonance", "wobble")
UNITS = ("rad", "Hz", "Hz")
MORE = len(PARAMETERS)
#: The same, and κ, β and the share of the nutation: what the model has beside the law's own parameters.
UNCERTAIN = MORE + 3

#: Mean of δ²: makers of magnets give 3° as the largest error of direction (95 % of a Rayleigh distribution).
TILT2 = 0.000915
#: What is expected of a top that still stands at its last reading, by this reading in units of the ν_r that was given:
#: ν_r in the same units, with u; δ² in units of TILT2; u of A, relative.  Of all tops half are read until they fall,
#: where x(η) or Ω(1 − κ sin²θ) has its minimum (the last reading lies up to 1.25 Hz above, which a top loses in 10 s);
#: the others end anywhere in the 15 Hz above.  Far above the fall the reading says nothing.  ν_r is given to 4 %: its
#: square is |μ|B/(κI₃), with κ and I₃ good to 5 %, and |μ|B = mgB/B′ to 4 % over the stable heights.
STANDING = np.array([
    [1.00, 0.934, 0.025, 0.094, 0.65],
    [1.05, 0.962, 0.028, 0.20, 0.60],
    [1.10, 0.986, 0.030, 0.40, 0.53],
    [1.15, 1.005, 0.032, 0.74, 0.48],
    [1.20, 1.019, 0.034, 1.22, 0.50],
    [1.25, 1.024, 0.041, 1.72, 0.69],
    [1.30, 1.015, 0.046, 1.75, 1.10],
    [1.35, 1.004, 0.043, 1.31, 1.40],
    [1.40, 1.001, 0.041, 1.09, 1.23],
    [1.50, 1.000, 0.040, 1.04, 1.08],
    [1.60, 1.000, 0.040, 1.03, 1.06],
])  # fmt: skip

#: Share of the nutation that a top has by the way it was released (`Release`).  Switching a drive on adds a tenth
#: (0.2 mT across 18 mT are 0.011 rad, δ is 0.03), the hand adds to it or takes from it, and what the air takes from a
#: nutation is left out: 0.6 is a guess.  This was not checked at a bench.
SHARE, SHARE_U = 1.1, 0.6
#: u of K/ν_ref beside it: 95 % of the nutations of calm tops are below 0.02 rad, which move the rim by 0.3 mm, as much
#: as the eye sees from 1 m; K/ν_ref = 1.2 α² there.
CALM_U = 0.00016
#: In units of ν_r: no hand and no drive starts a top below, where it falls within half a minute.
_SLOWEST_START = 1.15

_NODES = 120
_GRID = np.linspace(0.0, 1.0, _NODES)
#: Least slope of spin and momentum with ln η, in units of the resonance: half a second before the fall, where the spin
#: still drops at a third of its usual rate.  The line that goes on from there keeps the count smooth in all parameters;
#: in the half second it is 7 mHz off.
_EDGE = 0.01
# Counts at this number of times are worked out at once: for few readings numpy's calls cost more than their numbers.
_AT_ONCE = 20_000
#: Steps of A, a, K/ν_ref, κ, β and the share for slopes by differences.
_STEPS = (1e-4, 1e-3, 1e-4, 1e-3, 1e-2, 1e-2)
_LARGEST_TILT2 = 0.3  # tan²θ: far beyond what a top survives
_LARGEST_DELTA2 = 0.1  # of a moment 18° off the axis; a tenth of it below zero
_FARTHEST = 4.0  # of κ and β, in u: beyond κ = 1/2 and β = 0 there is no top
#: Of the count, relative to ν_ref: cubics between the nodes.  No noise is taken to be smaller.
ACCURACY = 1e-7
# Times at which the wobble is worked out; between them it is a straight line, good to 1e-5 Hz.
_MOST_POINTS = 1000
_GAUSS = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)]), np.array([5.0, 8.0, 5.0]) / 18


@dataclass(frozen=True)
class Top:
    """What is known beforehand of a top whose count is analyzed.

    Attributes:
        kappa, kappa_u: κ = 1 − I₁/I₃, and its standard uncertainty.
        beta, beta_u: β = B′²/(B B″) where the top floats.
        resonance_hz: ν_r [Hz]; a run that ends far above it ended before the fall.
        disc_constant: C of a bare disc of its radius in laminar air [(rad/s)^-1/2/s], see `analysis.spindown.air`.
    """

    kappa: float = 0.4
    kappa_u: float = 0.02
    beta: float = 3.3
    beta_u: float = 0.8
    resonance_hz: float = 22.0
    disc_constant: float = 2.235e-4


#: κ of PHYSICS.md §1, with moments of inertia good to 2 % each; Simon's three tops have it to 0.1.  β is 3.3 in the
#: middle of the stable heights, 2.5 at their upper end (computed for the thesis's base at 7.4 cm).
THESIS_TOP = Top()


@dataclass(frozen=True)
class Release:
    """How a top came to its first reading.

    Attributes:
        spin_hz: at which it was set free, or at which a drive took hold of it [Hz].
        driven_s: how long the drive then turned it [s].
    """

    spin_hz: float
    driven_s: float = 0.0


@dataclass(frozen=True, eq=False)
class CountedLaw:
    """A drag law as a counter sees it: with the tilt and the nutation of the top, and what is known of them beforehand.

    The additional parameters are A, tan²θ at the last reading by linear theory, and a, by which the last reading
    stands above the resonance, x = 1 + exp(a): these two hardly depend on each other, δ and ν_r do.
    The third is K/ν_ref beyond that of a release.  κ, β and SHARE follow.  A law that fits badly asks for any tilt: δ²,
    κ and β approach their bounds smoothly, for a search would end at a kink.

    Attributes:
        law: of the drag.
        first, last: readings, in units of ν_ref.
        reference_hz: ν_ref [Hz].
        top: whose count it is.
        released: the spin at which it was set free, or a drive took hold of it, in units of ν_ref; None: the first one.
        lost: ln of the spin that the air would have taken from it while a drive turned it.
    """

    law: DragLaw
    first: float
    last: float
    reference_hz: float
    top: Top = THESIS_TOP
    released: float | None = None
    lost: float = 0.0

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters that are reported."""
        return (*self.law.parameters, *PARAMETERS)

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """Their units."""
        return (*self.law.parameter_units, *UNITS)

    @property
    def expected(self) -> tuple[Array, Array]:
        """A, a, K/ν_ref, κ, β and the share before the readings, and their standard uncertainties, shape (6,) each."""
        top = self.top
        last = max(self.last * self.reference_hz / top.resonance_hz, float(STANDING[0, 0]))
        resonance, resonance_u, tilt2, tilt2_u = (np.interp(last, STANDING[:, 0], row) for row in STANDING.T[1:])
        x = (last / resonance) ** 2
        gap = x - 1
        value = np.array([TILT2 * tilt2 / gap**2, np.log(gap), 0.0, top.kappa, top.beta, SHARE])
        gap_u = 2 * resonance_u / resonance * x / gap
        return value, np.array([tilt2_u * value[0], gap_u, CALM_U, top.kappa_u, top.beta_u, SHARE_U])

    def shape(self, q: Array) -> Array:
        """Return δ², ν_r/ν_ref, K/ν_ref, κ and β, shape (…, 5).

        q: A, a, K/ν_ref beyond that of a release, κ, β and the share, shape (…, 6).
        """
        top, (strength, a, more, kappa, beta, share) = self.top, np.moveaxis(q, -1, 0)
        a = np.minimum(np.maximum(a, -5.0), 40.0)
        s = strength * np.exp(np.minimum(2 * a, 8.0))
        s = _bound(s, np.where(s > 0, _LARGEST_DELTA2, _LARGEST_DELTA2 / 10))
        kappa = top.kappa + _bound(kappa - top.kappa, _FARTHEST * top.kappa_u)
        beta = top.beta + _bound(beta - top.beta, _FARTHEST * top.beta_u)
        resonance = self.last / np.sqrt(1 + np.exp(a))
        return np.stack([s, resonance, more + share * s * self._nutation(resonance, kappa), kappa, beta], axis=-1)

    def _nutation(self, resonance: Array, kappa: Array) -> Array:
        """Return K/ν_ref over δ² after the release; the top of the file derives it."""
        sleeping, slowest = 2 * np.sqrt(kappa * (1 - kappa)) * resonance, _SLOWEST_START * resonance
        first = np.maximum(self.first, slowest)
        released = np.maximum(self.released or first, slowest)
        w = np.sqrt(1 - (sleeping / released) ** 2)
        frequency = released * (1 + w) / (2 * (1 - kappa))
        alpha = (1 - 2 * kappa + w) / (2 * w) / ((released / resonance) ** 2 - 1)
        before, after = np.arccosh(released / sleeping), np.arccosh(first / sleeping)
        grown = after - before + self.lost / np.tanh((before + after) / 2)
        return np.asarray(frequency * alpha**2 / 2 * np.sqrt((released / sleeping) ** 2 - 1) * np.exp(grown))

    def spin(self, tau: Array, q: Array) -> Array:
        """Return the counted frequency, shape (n,)."""
        return np.asarray(self.spins(tau, q[None])[0])

    def gradient(self, tau: Array, q: Array) -> Array:
        """Return the slopes with q, shape (p, n), by differences: good to 1e-6 of themselves."""
        sizes = 1e-5 * np.maximum(np.abs(q), 0.1)
        sizes[-UNCERTAIN:] = _STEPS
        steps, p = np.diag(sizes), len(q)
        spins = self.spins(tau, np.vstack([q + steps, q - steps]))
        return np.asarray((spins[:p] - spins[p:]) / (2 * sizes[:, None]))

    def spins(self, tau: Array, rows: Array) -> Array:
        """Return the same for several q, shape (r, p) → (r, n)."""
        p = len(self.law.parameters)
        shapes = self.shape(rows[:, p:])
        with np.errstate(all="ignore"):
            if len(tau) <= _MOST_POINTS:
                return counts(self.law, tau, rows[:, :p], shapes)
            few = np.linspace(tau[0], tau[-1], _MOST_POINTS)
            added = counts(self.law, few, rows[:, :p], shapes) - [self.law.spin(few, q[:p]) for q in rows]
            return np.array(
                [self.law.spin(tau, q[:p]) + np.interp(tau, few, more) for q, more in zip(rows, added, strict=True)]
            )

    def natural(self, q: Array, reference_hz: float, duration: float) -> tuple[Array, Array]:
        """Return `DragLaw.natural`, then δ [rad], ν_r [Hz] and K [Hz]; slopes of shape (p + 3, p + 6).

        δ is the root of δ², which noise may make negative: then it is 0, with the slope of the uncertainty's own root.
        """
        n = len(self.law.parameters)
        values, slopes = self.law.natural(q[:n], reference_hz, duration)
        s, resonance, wobble, *_ = self.shape(q[n:]).tolist()
        delta = float(np.sqrt(max(s, 0.0)))
        growth = float(np.exp(min(2 * float(q[n + 1]), 8.0)))
        share = float(1 / (1 + np.exp(-min(float(q[n + 1]), 40.0)))) / 2
        full = np.zeros((n + MORE, n + UNCERTAIN))
        full[:n, :n] = slopes
        # beside δ its u may be as large as δ itself, where the slope of a root has no end
        full[n, n] = growth / (2 * max(delta, 0.5 * float(np.sqrt(self.expected[1][0] * growth))))
        full[n, n + 1] = delta
        full[n + 1, n + 1] = -share * resonance * reference_hz
        steps = np.diag(_STEPS)
        moved = self.shape(q[n:] + steps) - self.shape(q[n:] - steps)
        full[n + 2, n:] = reference_hz * moved[:, 2] / (2 * np.asarray(_STEPS))
        return np.array([*values, delta, resonance * reference_hz, wobble * reference_hz]), full

    def solution(self, q: Array) -> Array:
        """Return the law's parameters, then δ², ν_r/ν_ref and K/ν_ref, shape (p + 3,)."""
        n = len(self.law.parameters)
        return np.array([*q[:n], *self.shape(q[n:])[:MORE]])

    def moved_top(self, q: Array) -> Top:
        """Return the top with κ and β as the readings move them."""
        kappa, beta = self.shape(q[len(self.law.parameters) :])[MORE:].tolist()
        return replace(self.top, kappa=kappa, beta=beta)


def _bound(value: Array, most: Array | float) -> Array:
    return np.asarray(most * np.tanh(value / most))


def count_of(law: DragLaw, tau: Array, solution: Array, top: Top = THESIS_TOP) -> Array:
    """Return the curve of a solution, with the tilt where it has one (δ², ν_r/ν_ref, K/ν_ref at its end)."""
    p = len(law.parameters)
    if len(solution) == p:
        return law.spin(tau, solution)
    shape = np.array([[*solution[p:], top.kappa, top.beta]])
    with np.errstate(all="ignore"):
        return np.asarray(counts(law, tau, np.array([solution[:p]]), shape)[0])


@dataclass(frozen=True, eq=False)
class _Path:
    """The ways of tops down their spin, in units of the resonance, at points of ln η; shape (r, k) each."""

    spin: Array  # Ω/Ω_r
    slope: Array  # dΩ/d ln η
    axial: Array  # cos θ
    momentum_slope: Array  # of Ω(1 − κ sin²θ), with ln η


def _path(log_eta: Array, s: Array, kappa: Array, beta: Array) -> _Path:
    """Return the path at these points, for each s.

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
    lift *= beta * s
    lift += 1
    np.maximum(lift, 0.1, out=lift)
    spin = 1 / eta
    spin += 1
    spin *= lift
    spin *= axial
    np.sqrt(spin, out=spin)
    slope = eta2
    slope += eta
    slope *= beta * s
    slope /= lift
    slope += sin2
    eta += 1
    slope -= np.divide(1, eta, out=eta)
    slope *= spin
    slope *= 0.5
    momentum_slope = sin2 * -kappa
    momentum_slope += 1
    momentum_slope *= slope
    sin2 *= spin
    sin2 /= w
    sin2 *= 2 * kappa
    momentum_slope -= sin2
    return _Path(spin, slope, np.divide(1, axial, out=axial), momentum_slope)


def slowing_by_tilt(spin: Array, resonance: float, delta: float, top: Top = THESIS_TOP) -> Array:
    """Return the drag of a count over that of an upright top at the same spin, for a drag ω^(3/2), shape (n,).

    Args:
        spin: counted, shape (n,) [Hz]; near and below the fall the factor is that at the fall.
        resonance: ν_r [Hz].
        delta: tilt of the moment [rad].
        top: whose count it is.

    >>> slowing_by_tilt(np.array([45.0, 26.0]), 22.0, 0.03).round(3)
    array([1.   , 0.951])
    """
    first = np.array([[1 / ((1.01 * float(spin.max()) / resonance) ** 2 - 1)]])
    numbers = (np.array([[x]]) for x in (delta**2, top.kappa, top.beta))
    _, path = _nodes(first, *numbers)
    factor = path.axial[0] ** 2.5 * path.slope[0] / path.momentum_slope[0]
    return np.asarray(np.interp(-spin / resonance, -path.spin[0], factor))


def counts(law: DragLaw, tau: Array, q: Array, shapes: Array) -> Array:
    """Return what a counter counts of several tops, in the dimensionless numbers of `analysis.spindown.drag`.

    Args:
        law: of the drag.
        tau: shape (n,), rising from 0 on.
        q: of the law, the start being that of the count, shape (r, p).
        shapes: δ² of either sign, ν_r/ν_ref, K/ν_ref, κ and β of each, shape (r, 5).

    Returns:
        Shape (r, n); beyond the edge of the fall, which a search may meet, the straight line that goes on from there.
    """
    many = max(_AT_ONCE // max(len(tau), 1), 1)
    parts = [_counts(law, tau, q[k : k + many], shapes[k : k + many]) for k in range(0, len(q), many)]
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _counts(law: DragLaw, tau: Array, q: Array, shapes: Array) -> Array:
    s, resonance, wobble, kappa, beta = shapes.T[:, :, None]
    of_law = q.T[:, :, None]
    x0 = np.minimum(np.maximum(of_law[0], resonance * 1.001), 1e3)
    log_eta, path = _nodes(1 / ((1.01 * x0 / resonance) ** 2 - 1), s, kappa, beta)
    # time between the nodes by three points of Gauss and Legendre: 1e-10 of it
    width = np.diff(log_eta)
    inner = (log_eta[:, :-1, None] + width[:, :, None] * _GAUSS[0]).reshape(len(q), -1)
    within = _path(inner, s, kappa, beta)
    lapse = (_time_slope(law, within, of_law, resonance).reshape(*width.shape, 3) @ _GAUSS[1]) * width
    time = np.concatenate([np.zeros((len(q), 1)), np.cumsum(lapse, axis=1)], axis=1)
    spin = resonance * path.spin
    slope = resonance * path.slope / _time_slope(law, path, of_law, resonance)  # dx/dτ
    start = _hermite(-x0, -spin, time, -1 / slope)
    even = _hermite(tau + start, time, spin, slope)
    even = np.nan_to_num(np.minimum(np.maximum(even, -1e3), 1e3))  # a search may go anywhere
    sleeping = 2 * np.sqrt(kappa * (1 - kappa)) * resonance
    return np.asarray(even + wobble / np.sqrt(np.maximum((even / sleeping) ** 2 - 1, 0.05)))


def _nodes(first: Array, s: Array, kappa: Array, beta: Array) -> tuple[Array, _Path]:
    """From a little above the start down to the edge of the fall, where the spin would rise again, or to the resonance.

    first, s: shape (r, 1).
    """
    begin = np.log(first)
    last = np.minimum(2e3, np.sqrt(_LARGEST_TILT2 / np.maximum(np.abs(s), 1e-12)))
    end = np.log(np.maximum(last, 1.5 * first))
    log_eta = begin + (end - begin) * _GRID
    path = _path(log_eta, s, kappa, beta)
    left = np.minimum(-path.slope, -path.momentum_slope) - _EDGE
    falls = np.asarray((left <= 0).any(axis=1))
    if not falls.any():
        return log_eta, path
    after = np.maximum(np.argmax(left <= 0, axis=1), 3)
    before, here = (np.take_along_axis(left, k[:, None], axis=1) for k in (after - 1, after))
    share = np.clip(before / np.maximum(before - here, 1e-12), 0.0, 1.0)
    edge = np.take_along_axis(log_eta, after[:, None] - 1, axis=1) + share * (end - begin) / (_NODES - 1)
    end = np.where(falls[:, None], edge, end)
    log_eta = begin + (end - begin) * _GRID
    return log_eta, _path(log_eta, s, kappa, beta)


def _time_slope(law: DragLaw, path: _Path, q: Array, resonance: Array) -> Array:
    """Return dτ/d ln η."""
    slowing = law.slowing(resonance * path.spin * path.axial, q) * path.axial
    return np.asarray(-resonance * path.momentum_slope / np.where(np.abs(slowing) > 1e-30, slowing, 1e-30))


def _hermite(at: Array, x: Array, y: Array, slope: Array) -> Array:
    """Return y(at) by a cubic between the nodes x, which rise, and a straight line beyond; (r, n) of (r, k)."""
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

"""All lines of a record fitted together: the roots of the quartic, with what is known of top and base as priors.

Each window has a height of its own; mass, I₁, I₃ and the sizes of the base are common, and the moment is the one that
carries the weight.  The slow swings have the angular momentum ρ I₃ω₃: ρ = 1 is geometric magnetism, 0 the null, without
a split.  The precession has I₃ω₃.  The error of a correction is a parameter, or part of u of the split.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.arrays import Array
from analysis.stability import SymmetricTop, modes
from analysis.sway.known import Known
from analysis.sway.lines import Swings
from analysis.uncertainty import Estimate, partly_believed

#: Rounds in which a slow root is computed from itself; each gains a digit.
_ROUNDS = 12
#: Height that one step of its parameter stands for [m].
_STEP_M = 1e-4
#: Step of the slopes, in parameters.
_STEP = 1e-3
#: Parameters before the heights: ρ − 1 in parts of a thousand; the others in their standard uncertainties.
_COMMON = ("ratio", "mass", "transverse", "axial", "size 1", "size 2", "size 3", "lean", "precession")
_RATIO_STEP = 1e-3


@dataclass(frozen=True)
class Corrections:
    """What is taken from the lines before, with how well it is known.

    Attributes:
        shifts: of the slow swings at finite amplitude, shape (n, 2) [Hz].
        leans: parts by which the precession makes the split smaller, shape (n,).
        lean_u: their relative standard uncertainty.
        precession_u: relative standard uncertainty of the precession's frequency in each window, shape (n,).
        split_u: standard uncertainty of each split beside that of its lines, alike in all windows, shape (n,) [Hz].
        motion_u: relative standard uncertainty of ρ from changes within a window.
    """

    shifts: Array
    leans: Array
    lean_u: float
    precession_u: Array
    split_u: Array
    motion_u: float


@dataclass(frozen=True)
class Joint:
    """The parameters that suit all lines.

    Attributes:
        ratio: ρ.
        gradient: B′/2B in the mean of the heights [1/m].
        height: the mean of the heights [m].
        mass, transverse, axial: of the top, after the fit [kg, kg m²].
        chi_square: of lines and priors together.
        freedom: lines less free parameters.
    """

    ratio: Estimate
    gradient: Estimate
    height: Estimate
    mass: Estimate
    transverse: Estimate
    axial: Estimate
    chi_square: float
    freedom: int


def _slow_roots(top: SymmetricTop, stiffness: Array, spin: float) -> Array:
    """Return the slow roots of the quartic [Hz], also of spins at which the fast ones are not real."""
    tilt, sideways, both = stiffness.tolist()
    alpha = np.array([-1.0, 1.0])
    for _ in range(_ROUNDS):
        stiff = top.transverse * alpha**2 - top.axial * 2 * math.pi * spin * alpha - tilt
        alpha = np.sign(alpha) * np.sqrt(np.maximum(sideways + both**2 / stiff, 1e-6 * top.mass) / top.mass)
    return np.asarray(alpha / (2 * math.pi))


def fit_together(swings: Sequence[Swings], spin: Array, heights: Array, known: Known, less: Corrections) -> Joint:
    """Fit ρ, the heights, and what is known but not exactly, to all lines.

    Args:
        swings: of each window.
        spin: in the middle of each, shape (n,) [Hz].
        heights: from which the search starts, shape (n,) [m].
        known: about top and base.
        less: the corrections.
    """
    from scipy.optimize import least_squares

    count = len(_COMMON)
    root = np.linalg.cholesky(known.covariance + 1e-24 * np.eye(3))  # a size that is exact may stand in it

    def suited(q: Array) -> Known:
        top, (mass, transverse, axial) = known.top, q[1:4]
        thickness, inner, outer = root @ q[4:7]
        ring = replace(
            known.ring,
            thickness=max(known.ring.thickness + thickness, 0.0),
            inner_radius=known.ring.inner_radius + inner,
            outer_radius=known.ring.outer_radius + outer,
        )
        body = replace(
            top,
            mass=top.mass + known.mass_u * mass,
            transverse=top.transverse + known.transverse_u * transverse,
            axial=top.axial + known.axial_u * axial,
        )
        return replace(known, top=body, ring=ring)

    owners = [np.full(min(one.frequency.size, 3), k) for k, one in enumerate(swings)]

    def residuals(q: Array) -> Array:
        ratio, lean, late = 1 + _RATIO_STEP * q[0], *q[7:count]
        here, found = suited(q), []
        for k, (one, nu) in enumerate(zip(swings, spin.tolist(), strict=True)):
            z = float(heights[k] + _STEP_M * q[count + k])
            top = here.top_at(z)
            carried = ratio * (1 - (1 + less.lean_u * lean) * less.leans[k])
            expected = _slow_roots(top, top.stiffness(here.field, np.array([z]))[:, 0], carried * nu)
            seen = one.frequency[:2] - less.shifts[k]
            off = seen - expected
            split_u = math.hypot(one.u_split, math.sqrt(len(swings)) * less.split_u[k])  # no smaller in the mean
            found += [(off[0] + off[1]) / split_u, (off[1] - off[0]) / split_u]
            if one.frequency.size > 2:
                line = sorted(modes(here.field, top, z, nu).real.tolist(), key=abs)[2]
                line *= 1 + less.precession_u[k] * late
                found.append((one.frequency[2] - line) / one.u[2])
        return np.concatenate([found, q[1:count]])

    which = np.concatenate([*owners, np.full(count - 1, -1)])

    def slopes_at(q: Array) -> Array:
        """Return the slopes of the residuals; one step of all heights is enough, each window has its own."""
        here = residuals(q)
        steps = [*np.eye(q.size)[:count], np.r_[np.zeros(count), np.ones(len(swings))]]
        each = [(residuals(q + _STEP * step) - here) / _STEP for step in steps]
        of_heights = np.where(which[:, None] == np.arange(len(swings)), each[-1][:, None], 0.0)
        return np.column_stack([*each[:-1], of_heights])

    end = least_squares(residuals, np.zeros(count + len(swings)), jac=slopes_at, x_scale="jac")
    jacobian = np.asarray(end.jac, dtype=np.float64)
    freedom = end.fun.size - end.x.size
    # The doubt of each split, times √n, makes χ² small, which says nothing about the lines or the priors
    scale = max(partly_believed(float(2 * end.cost), freedom), 1.0)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * scale**2
    here, mean = suited(end.x), float(np.mean(heights + _STEP_M * end.x[count:]))
    u = np.sqrt(np.diagonal(covariance))

    def gradient(q: Array) -> float:
        return suited(q).gradient(float(np.mean(heights + _STEP_M * q[count:])))

    value, steps = gradient(end.x), np.maximum(u, 1e-6)
    slopes = np.array([gradient(end.x + step) - value for step in np.diag(steps)]) / steps
    ratio = 1 + _RATIO_STEP * float(end.x[0])
    weights = np.full(len(swings), _STEP_M / len(swings))
    u_height = math.sqrt(float(weights @ covariance[count:, count:] @ weights))
    return Joint(
        ratio=Estimate(ratio, math.hypot(_RATIO_STEP * u[0], less.motion_u * ratio), "1"),
        # Ω_g goes with the square of B′/2B
        gradient=Estimate(value, math.hypot(math.sqrt(slopes @ covariance @ slopes), less.motion_u / 2 * value), "1/m"),
        height=Estimate(mean, u_height, "m"),
        mass=Estimate(here.top.mass, known.mass_u * float(u[1]), "kg"),
        transverse=Estimate(here.top.transverse, known.transverse_u * float(u[2]), "kg m2"),
        axial=Estimate(here.top.axial, known.axial_u * float(u[3]), "kg m2"),
        chi_square=float(2 * end.cost),
        freedom=freedom,
    )

"""The motion that every contender integrates, with its equations once more, apart from the simulator's.

In place, velocity, axis and angular momentum (12 numbers; with the direction of the moment, where it is not the axis,
15), and in Euler angles, as the master's thesis on the Levitron has them (12 numbers, singular at θ = 0).
"""

import json
import math
from importlib.resources import files
from typing import Any

import levilab.simulator.kernels  # noqa: F401 - first, since its error says what to do without numba

# isort: split
import numba
import numpy as np

from analysis.arrays import Array

M, A2, B2, K = 0.02526, 0.030**2, 0.055**2, 2 * math.pi * 1.40e-3
G, I1, I3, MU = 9.82, 1.04e-6, 1.731314e-6, -0.714
TILT = 0.01
DRIVE_T, DRIVE_HZ = 4e-4, 30.0


#: Length of the motion [s], the top's spin ω₃ and φ̇ = ψ̇ at the start [rad/s].
DURATION, SPIN = 5.0, 2 * math.pi * 30.0
PRECESSION = SPIN / (1 + math.cos(TILT))


def references() -> dict[str, Any]:
    """Return the true ends, from heyoka in extended precision (`python benchmarks/references.py` writes them again).

    "places_m": of each motion by its name and its length in whole seconds; "ensemble_m": of some tops of the ensemble.
    """
    text = files(__package__).joinpath("references.json").read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found


def vector_start(spin: float = SPIN) -> Array:
    """(r, v, n, L) at the start, with a spin ω₃ [rad/s]."""
    n = np.array([0.0, -math.sin(TILT), math.cos(TILT)])
    precession = spin / (1 + math.cos(TILT))
    momentum = I3 * spin * n + I1 * precession * (np.array([0.0, 0.0, 1.0]) - n * math.cos(TILT))
    return np.concatenate([[0.001, 0, 0.071, -0.0007, 0, 0.002], n, momentum])


def euler_start() -> Array:
    """(x, y, z, θ, φ, ψ and their rates) at the start."""
    return np.array([0.001, 0, 0.071, TILT, 0, 0, -0.0007, 0, 0.002, 0, PRECESSION, PRECESSION])


@numba.njit(cache=True)
def potential(z: float) -> tuple[float, float, float, float]:
    """φ₁ … φ₄ of the ring."""
    u, w = 1 / math.sqrt(A2 + z * z), 1 / math.sqrt(B2 + z * z)
    a3, b3 = A2 * u**3, B2 * w**3
    a5, b5, a7, b7 = a3 * u * u, b3 * w * w, a3 * u**4, b3 * w**4
    phi3 = 3 * K * (a7 * (4 * z * z - A2) - b7 * (4 * z * z - B2))
    phi4 = -15 * K * z * (a7 * u * u * (4 * z * z - 3 * A2) - b7 * w * w * (4 * z * z - 3 * B2))
    return K * (a3 - b3), -3 * K * z * (a5 - b5), phi3, phi4


@numba.njit(cache=True)
def vector_rate(t: float, s: Array, mass: float, steady: float, swing: float) -> Array:
    """ṙ = v, v̇ = ∇(M·B)/m − g, ṅ = L×n/I₁, L̇ = M×(B + B_d), and for a moment across the axis ė = ω×e.

    steady, swing: the drive along y is steady + swing cos 2π DRIVE_HZ t [T].
    """
    x, y, z = s[0], s[1], s[2]
    p1, p2, p3, p4 = potential(z)
    nx, ny, nz, lx, ly, lz = s[6], s[7], s[8], s[9], s[10], s[11]
    d = np.empty(s.size)
    mx, my, mz = nx, ny, nz
    if s.size == 15:
        mx, my, mz = s[12], s[13], s[14]
        twist = (1 / I3 - 1 / I1) * (lx * nx + ly * ny + lz * nz)
        wx, wy, wz = lx / I1 + twist * nx, ly / I1 + twist * ny, lz / I1 + twist * nz
        d[12], d[13], d[14] = wy * mz - wz * my, wz * mx - wx * mz, wx * my - wy * mx
    bx, by, bz = p2 * x / 2, p2 * y / 2, p3 * (x * x + y * y) / 4 - p1
    by += steady + swing * math.cos(2 * math.pi * DRIVE_HZ * t)
    q = MU / mass
    d[0], d[1], d[2] = s[3], s[4], s[5]
    d[3], d[4] = q * (mx * p2 / 2 + mz * p3 * x / 2), q * (my * p2 / 2 + mz * p3 * y / 2)
    d[5] = q * ((mx * x + my * y) * p3 / 2 + mz * (p4 * (x * x + y * y) / 4 - p2)) - G
    d[6], d[7], d[8] = (ly * nz - lz * ny) / I1, (lz * nx - lx * nz) / I1, (lx * ny - ly * nx) / I1
    d[9], d[10], d[11] = MU * (my * bz - mz * by), MU * (mz * bx - mx * bz), MU * (mx * by - my * bx)
    return d


@numba.njit(cache=True)
def euler_rate(t: float, s: Array) -> Array:
    """Lagrange's equations of the symmetric top in θ, φ, ψ; n = (sinφ sinθ, −cosφ sinθ, cosθ)."""
    x, y, z, theta, phi = s[0], s[1], s[2], s[3], s[4]
    p1, p2, p3, p4 = potential(z)
    st, ct, sp, cp = math.sin(theta), math.cos(theta), math.sin(phi), math.cos(phi)
    nx, ny, nz = sp * st, -cp * st, ct
    r2, q = x * x + y * y, MU / M
    bx, by, bz = p2 * x / 2, p2 * y / 2, p3 * r2 / 4 - p1
    td, pd, sd = s[9], s[10], s[11]
    w3 = sd + pd * ct
    d = np.empty(12)
    for k in range(6):  # a slice would take five times as long to compile, with numba's text of shapes that differ
        d[k] = s[k + 6]
    d[6], d[7] = q * (nx * p2 / 2 + nz * p3 * x / 2), q * (ny * p2 / 2 + nz * p3 * y / 2)
    d[8] = q * ((nx * x + ny * y) * p3 / 2 + nz * (p4 * r2 / 4 - p2)) - G
    # generalised torques ∂(M·B)/∂θ and ∂(M·B)/∂φ
    along_theta = MU * (bx * sp * ct - by * cp * ct - bz * st)
    along_phi = MU * (bx * cp * st + by * sp * st)
    d[9] = pd * pd * st * ct - I3 * w3 * pd * st / I1 + along_theta / I1
    d[10] = (along_phi - 2 * I1 * st * ct * td * pd + I3 * w3 * td * st) / (I1 * st * st)
    d[11] = -d[10] * ct + pd * td * st  # ω₃ is constant
    return d

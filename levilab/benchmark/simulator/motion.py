"""The motion that every contender integrates: scene `undriven`, IC1, 30 Hz, 25.26 g, 5 s, with its equations once more.

Written apart from the simulator, for the peers: in place, velocity, axis and angular momentum (12 numbers), and in
Euler angles as the master's thesis on the Levitron has them (12 numbers, singular at θ = 0).
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

A2, B2, K = 0.030**2, 0.055**2, 2 * math.pi * 1.40e-3
M, G, I1, I3, MU = 0.02526, 9.82, 1.04e-6, 1.731314e-6, -0.714
TILT, SPIN, DURATION = 0.01, 2 * math.pi * 30.0, 5.0
RATE = SPIN / (1 + math.cos(TILT))  # φ̇ = ψ̇

#: The place after 5 s [m], from heyoka in extended precision with a tolerance of 1e-18: IC1 of the golden data.
REFERENCE = np.array([0.00030264930749574636, -0.0001858576495552388, 0.07450378489258647])


def vector_start() -> Array:
    """(r, v, n, L) at the start."""
    n = np.array([0.0, -math.sin(TILT), math.cos(TILT)])
    momentum = I3 * SPIN * n + I1 * RATE * (np.array([0.0, 0.0, 1.0]) - n * math.cos(TILT))
    return np.concatenate([[0.001, 0, 0.071, -0.0007, 0, 0.002], n, momentum])


def euler_start() -> Array:
    """(x, y, z, θ, φ, ψ and their rates) at the start."""
    return np.array([0.001, 0, 0.071, TILT, 0, 0, -0.0007, 0, 0.002, 0, RATE, RATE])


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
def vector_rate(t: float, s: Array) -> Array:
    """ṙ = v, v̇ = ∇(M·B)/m − g, ṅ = L×n/I₁, L̇ = M×B."""
    x, y, z = s[0], s[1], s[2]
    p1, p2, p3, p4 = potential(z)
    nx, ny, nz, lx, ly, lz = s[6], s[7], s[8], s[9], s[10], s[11]
    bx, by, bz = p2 * x / 2, p2 * y / 2, p3 * (x * x + y * y) / 4 - p1
    q = MU / M
    d = np.empty(12)
    d[0], d[1], d[2] = s[3], s[4], s[5]
    d[3], d[4] = q * (nx * p2 / 2 + nz * p3 * x / 2), q * (ny * p2 / 2 + nz * p3 * y / 2)
    d[5] = q * ((nx * x + ny * y) * p3 / 2 + nz * (p4 * (x * x + y * y) / 4 - p2)) - G
    d[6], d[7], d[8] = (ly * nz - lz * ny) / I1, (lz * nx - lx * nz) / I1, (lx * ny - ly * nx) / I1
    d[9], d[10], d[11] = MU * (ny * bz - nz * by), MU * (nz * bx - nx * bz), MU * (nx * by - ny * bx)
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
    d[:6] = s[6:]
    d[6], d[7] = q * (nx * p2 / 2 + nz * p3 * x / 2), q * (ny * p2 / 2 + nz * p3 * y / 2)
    d[8] = q * ((nx * x + ny * y) * p3 / 2 + nz * (p4 * r2 / 4 - p2)) - G
    # generalised torques ∂(M·B)/∂θ and ∂(M·B)/∂φ
    along_theta = MU * (bx * sp * ct - by * cp * ct - bz * st)
    along_phi = MU * (bx * cp * st + by * sp * st)
    d[9] = pd * pd * st * ct - I3 * w3 * pd * st / I1 + along_theta / I1
    d[10] = (along_phi - 2 * I1 * st * ct * td * pd + I3 * w3 * td * st) / (I1 * st * st)
    d[11] = -d[10] * ct + pd * td * st  # ω₃ is constant
    return d

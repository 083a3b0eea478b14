"""Drag of the air: that of a bare disc in laminar flow, and what a top of its size can have."""

import math

#: Air at 20 °C: density [kg/m³] and kinematic viscosity [m²/s].
AIR_KG_M3, AIR_M2_S = 1.20, 1.50e-5
#: Torque on both sides of a disc over π ρ R⁴ √(ν ω³): von Kármán's momentum integral, Z. angew. Math. Mech. 1, 233
#: (1921), with Cochran's number (Schlichting, Boundary-Layer Theory, §5.2.4).
KARMAN = 0.616
#: Least and greatest drag of a top over that of a bare disc of its radius.  Both faces of a disc are the least; air at
#: 3000 m drags 0.84 times as much, a radius known to 10 % is 0.66 in R⁴, and R⁴/I₃ of a top twice as large is half.
#: A rim as high as the radius adds 2, as by the friction at the edge; the lightest top in print, Simon's third, has
#: 2.6 times the I₃/m² of the thesis's, and its loss goes with I₃/m²: 3 · 2.6 ≈ 8.
LEAST, MOST = 0.25, 8.0


def disc_constant(radius: float, inertia: float) -> float:
    """Return C of ω̇ = −C ω^(3/2) of a bare disc of a radius [m] in laminar air, for a moment of inertia [kg m²].

    >>> f"{disc_constant(0.0144, 1.731314e-6):.3e}"
    '2.234e-04'
    """
    return KARMAN * math.pi * AIR_KG_M3 * radius**4 * math.sqrt(AIR_M2_S) / inertia

"""The limits of the spin that the master's thesis on the Levitron simulated and measured, and their device."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from levilab.simulator.scene import Scene

#: Simulated, without drag, 30 s: start → lower and upper limit [Hz].
SIMULATED_HZ = {"IC1": (22.06, 70.90), "IC2": (21.78, 81.73), "IC3": (22.27, 70.50), "IC4": (23.02, 65.01)}
#: Measured ten times: the lower limit and its standard error [Hz].
MEASURED_HZ, MEASURED_U_HZ = 21.86, 0.08
#: About the highest spin that the drive could hold [Hz].
HIGHEST_HZ = 61.0


def is_thesis_device(scene: Scene) -> bool:
    """Whether base and top are the thesis's, whatever the mass: it prints one that its own field cannot lift."""
    base, top = scene.base, scene.top
    ring = (base.inner_radius_m, base.outer_radius_m, base.strength_t_m, base.thickness_m)
    body = (top.inertia_transverse_kg_m2, top.inertia_axial_kg_m2, abs(top.moment_a_m2))
    return ring == (0.030, 0.055, 1.40e-3, 0.0) and body == (1.04e-6, 1.731314e-6, 0.714)

"""The limits of the spin that the master's thesis on the Levitron simulated and measured, and their device."""

import math
import statistics

from levilab.simulator.published.printed import published, several
from levilab.simulator.scene import Scene

_THESIS = published("thesis")

#: Its four starts, as settings of the scene undriven, which has the first.  The third's x is printed as 5 mm.
STARTS: dict[str, tuple[str, ...]] = {
    "IC1": (),
    "IC2": ("start.position_m=[0.0001,0,0.073]", "start.velocity_m_s=[0,0,0]"),
    "IC3": ("start.position_m=[0.003,0,0.0725]", "start.velocity_m_s=[-0.002,0,0.0005]"),
    "IC4": ("start.tilt_rad=0.1",),
}
#: Simulated, without drag, 30 s: start → lower and upper limit [Hz].
SIMULATED_HZ = {name: (_THESIS[f"limits.lower.{name}"].value, _THESIS[f"limits.upper.{name}"].value) for name in STARTS}
#: Simulated, with drag from 30 Hz: start → spin at the fall [Hz].
WITH_DRAG_HZ = {name: _THESIS[f"limits.drag.{name}"].value for name in STARTS}
#: Measured ten times: the mean of the lower limit, and its standard error [Hz], which the thesis does not print.
MEASURED_HZ = _THESIS["measured.mean"].value
_TEN = [one.value for one in several("thesis", "measured.limits")]
MEASURED_U_HZ = round(statistics.stdev(_TEN) / math.sqrt(len(_TEN)), 2)
#: About the highest spin that the drive could hold, and the one that it reached with loose washers [Hz].
HIGHEST_HZ, LOOSE_HZ = _THESIS["measured.highest"].value, _THESIS["measured.loose"].value
#: In a scan of the scene undriven in steps of 0.5 Hz all four starts are up to the first of these spins, and none above
#: the second one; between them there are islands [Hz].
ISLANDS_HZ = (59.5, 81.0)


def is_thesis_device(scene: Scene) -> bool:
    """Return whether base and top are the thesis's, whatever the mass: it prints one that its own field cannot lift."""
    base, top = scene.base, scene.top
    ring = (base.inner_radius_m, base.outer_radius_m, scene.strength, base.thickness_m)
    body = (top.inertia_transverse_kg_m2, top.inertia_axial_kg_m2, abs(scene.moment))
    return ring == (0.030, 0.055, 1.40e-3, 0.0) and body == (1.04e-6, 1.731314e-6, 0.714)

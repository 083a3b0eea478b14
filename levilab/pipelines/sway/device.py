"""What is known of top and base: of a scene, of a device's file and a Hall scan, or of the thesis."""

from pathlib import Path
from typing import Any

import numpy as np

from analysis.errors import AnalysisError
from analysis.field.magnet import Disc
from analysis.field.ring import Ring
from analysis.stability import SymmetricTop
from analysis.sway import Known
from analysis.top import top_of
from analysis.uncertainty import Estimate
from levilab.errors import DataError
from levilab.formats.device import Device
from levilab.pipelines.field.device import inertias, parts_of
from levilab.pipelines.field.document import FIELD
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import FieldOptions, SwayOptions
from levilab.pipelines.sway.readings import SwayReadings
from levilab.simulator.keys import SceneError
from levilab.simulator.scene import scene_of

#: The thesis's base and top, taken where nothing is known, with a warning; of both sizes by a calliper.
_RING, _SIZE_U_M = Ring(1.40e-3, 0.0, 0.0, 0.030, 0.055), 1e-4
_MASS = Estimate(0.02526, 1e-5, "kg")


def known_of(source: Source[SwayReadings], options: SwayOptions) -> tuple[Known, tuple[str, ...]]:
    """Return what is known of an input's top and base, and what of it is the thesis's.  Raises DataError."""
    if (table := source.settings("scene")) and not (options.device or options.scan):
        return _of_scene(source, table), ()
    device = options.device or Device()
    made = top_of(parts_of(device.top)) if device.top.parts else None
    transverse, axial, missing = inertias(device.top)
    mass = made.mass if made else _MASS
    if device.top.mass_kg is not None:
        mass = Estimate(device.top.mass_kg, device.top.mass_u_kg, "kg")
    elif made is None:
        missing = ["mass", *missing]
    ring, covariance = _base(device, options.scan)
    if ring is None:
        ring, covariance, missing = _RING, np.diag([0.0, _SIZE_U_M**2, _SIZE_U_M**2]), [*missing, "radii of the base"]
    m, i1, i3 = (float(one.value or 0.0) for one in (mass, transverse, axial))
    top = SymmetricTop(m, i1, i3, -1.0, device.gravity_m_s2)
    size = device.top.magnet_radius_m, device.top.magnet_height_m
    magnet = None if size[0] is None else Disc(size[0], size[1] or 0.0)
    return Known(top, mass.u or 0.0, axial.u or 0.0, ring, covariance, magnet, transverse.u or 0.0), (*missing,)


def _base(device: Device, scan: Path | None) -> tuple[Ring | None, np.ndarray]:
    """Return the ring by a Hall scan or else by the calliper, and the covariance of its thickness and its radii."""
    if scan is not None:
        found = FIELD.analyze([scan], FieldOptions(device=device if device.base.inner_radius_m else None)).runs
        if len(found) > 1:
            several = "{path:s}: holds {n} scans of the base, one is expected: name its run or file"
            raise DataError(several, path=scan, n=len(found))
        sizes = [2, 4, 5]
        return found[0].scan.ring, found[0].scan.covariance[np.ix_(sizes, sizes)]
    base = device.base
    if base.inner_radius_m is None or base.outer_radius_m is None:
        return None, np.empty(0)
    ring = Ring(1.0, 0.0, base.thickness_m or 0.0, base.inner_radius_m, base.outer_radius_m)
    u = (base.thickness_u_m if base.thickness_m else 0.0, base.inner_radius_u_m, base.outer_radius_u_m)
    return ring, np.diag(np.square(u))


def _of_scene(source: Source[SwayReadings], table: dict[str, Any]) -> Known:
    try:
        scene = scene_of(table)
    except (SceneError, AnalysisError) as error:
        raise DataError("{path:s}/run.json: configuration.scene: {why}", path=source.path, why=error) from error
    top, base = scene.top, scene.base
    body = SymmetricTop(
        top.mass_kg, top.inertia_transverse_kg_m2, top.inertia_axial_kg_m2, top.moment_a_m2, scene.gravity_m_s2
    )
    ring = Ring(base.strength_t_m, base.origin_m, base.thickness_m, base.inner_radius_m, base.outer_radius_m)
    magnet = Disc(top.magnet_radius_m, top.magnet_height_m) if top.magnet == "disc" else None
    return Known(body, 0.0, 0.0, ring, np.zeros((3, 3)), magnet)

"""From what calliper, data sheet and scales say, in the run and in a file, to what an analysis takes."""

from typing import Any, TypeVar

import numpy as np
from pydantic import ValidationError

from analysis.field.fit import Known, Prior
from analysis.field.floating import KnownTop
from analysis.field.magnet import Disc
from analysis.top import Cylinder, top_of
from analysis.uncertainty import Estimate
from levilab.errors import DataError
from levilab.formats.device import BaseTable, Device, TopTable
from levilab.pipelines.field.readings import FieldReadings
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import FieldOptions
from levilab.settings import in_one_line

Table = TypeVar("Table", BaseTable, TopTable)

#: The thesis's top: what is taken where nothing is known, with a warning.
THESIS = {"transverse": (1.04e-6, "kg m^2"), "axial": (1.731314e-6, "kg m^2"), "moment": (0.714, "A m^2")}
#: What a run says of the base and of the top begins with these in the settings of its experiment.
_OF_BASE, _OF_TOP = "base_", "top_"


def known_of(source: Source[FieldReadings], device: Device | None) -> Known:
    """Return what is known of the base and the instrument: what the file says, else the run.  Raises DataError."""
    of_run = source.settings("field")
    base = _merged(source, BaseTable, _OF_BASE, of_run, device.base if device else None)
    if base.inner_radius_m is None or base.outer_radius_m is None:
        raise DataError(
            "{path:s}: the radii of the base are not known: write three lines with yours into a file, [base], "
            "inner_radius_m = 0.030 and outer_radius_m = 0.055, and give it to levilab analyze field with `device`",
            path=source.path,
        )
    magnetometer = device.magnetometer if device else None
    gain = magnetometer.gain_u if magnetometer and magnetometer.gain_u is not None else _number(of_run, "gain_u", 0.0)
    background = (
        magnetometer.background_u_t
        if magnetometer and magnetometer.background_u_t is not None
        else _number(of_run, "background_u_t", Known.background.u)
    )
    return Known(
        Prior(base.inner_radius_m, base.inner_radius_u_m),
        Prior(base.outer_radius_m, base.outer_radius_u_m),
        None if base.origin_m is None else Prior(base.origin_m, base.origin_u_m),
        None if base.thickness_m is None else Prior(base.thickness_m, base.thickness_u_m),
        Prior(0.0, background),
        gain if source.readings.has_own_u or device else 0.0,
    )


def _merged(
    source: Source[FieldReadings], table: type[Table], prefix: str, of_run: dict[str, Any], given: Table | None
) -> Table:
    """Return the run's, and over it what the file sets."""
    own = {key.removeprefix(prefix): value for key, value in of_run.items() if key.startswith(prefix)}
    try:
        return table.model_validate(own | (given.model_dump(exclude_unset=True) if given else {}))
    except ValidationError as error:
        what = "{path:s}: configuration.field in run.json: {key:s}{fault}"
        raise DataError(what, path=source.path, key=prefix, fault=in_one_line(error)) from error


def _number(table: dict[str, Any], key: str, default: float) -> float:
    value = table.get(key, default)
    return float(value) if isinstance(value, int | float) and value >= 0 else default


# --- the top ---


def parts_of(top: TopTable) -> list[Cylinder]:
    """Return the parts as cylinders."""
    return [
        Cylinder(
            part.name,
            part.mass_kg,
            part.outer_radius_m,
            part.inner_radius_m,
            part.height_m,
            part.offset_m,
            part.mass_u_kg,
            part.outer_radius_u_m,
            part.inner_radius_u_m,
            part.height_u_m,
            part.offset_u_m,
        )
        for part in top.parts
    ]


def known_top(
    source: Source[FieldReadings], options: FieldOptions, height_u: float | None
) -> tuple[KnownTop, tuple[str, ...]]:
    """Return what is known of the top, and which quantities of the thesis's top stand for others.

    On a virtual bench the thesis's top floats.

    Args:
        source: a scan, whose run may say something of the top.
        options: with what calliper and data sheet say.
        height_u: standard uncertainty of the scan's heights [m].

    Raises:
        ImpossibleCylinder: a part of the top has no such size.
    """
    device = options.device or Device()
    table = _merged(source, TopTable, _OF_TOP, source.settings("field"), options.device.top if options.device else None)
    made = top_of(parts_of(table)) if table.parts else None
    moment = _estimate(table.moment_a_m2, table.moment_u_a_m2, "A m^2")
    mass = made.mass if made else _estimate(table.mass_kg, table.mass_u_kg, "kg")
    height = None
    if options.height_m is not None:
        u = options.height_u_m if options.height_u_m is not None else height_u
        height = Estimate(options.height_m, u or 0.0, "m")
        if mass is None:
            raise DataError(
                "`height_m` tells the moment of a top only if its mass is known: write [top] with mass_kg or its parts "
                "into a file, as sample_data/device.toml, and give it with `device`"
            )
    transverse, axial, missing = inertias(table)
    if moment is None and height is None:
        moment = Estimate(THESIS["moment"][0], 0.0, "A m^2")
        missing = [*missing, "moment"]
    magnet = Disc(table.magnet_radius_m, table.magnet_height_m or 0.0) if table.magnet_radius_m else None
    missing = [*missing, *([] if magnet else ["magnet"])]
    covariance = made.covariance if made else None
    top = KnownTop(transverse, axial, moment, mass, height, device.gravity_m_s2, covariance, magnet)
    return top, () if source.synthetic and options.device is None else tuple(missing)


def inertias(table: TopTable) -> tuple[Estimate, Estimate, list[str]]:
    """Return the moments of inertia across and along the axis, and what is missing in the file; then the thesis's."""
    made = top_of(parts_of(table)) if table.parts else None
    if made:
        return made.transverse, made.axial, []
    transverse = _estimate(table.inertia_transverse_kg_m2, table.inertia_transverse_u_kg_m2, "kg m^2")
    axial = _estimate(table.inertia_axial_kg_m2, table.inertia_axial_u_kg_m2, "kg m^2")
    if transverse and axial:
        return transverse, axial, []
    return Estimate(THESIS["transverse"][0], 0.0, "kg m^2"), Estimate(THESIS["axial"][0], 0.0, "kg m^2"), ["inertias"]


def _estimate(value: float | None, u: float, unit: str) -> Estimate | None:
    return None if value is None else Estimate(value, u, unit)


def usual(values: np.ndarray | None) -> float | None:
    """Return the median; None where there are none."""
    return None if values is None else float(np.median(values))

"""The calculator for the top: a device's parts → mass and moments of inertia, for people and for programs."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.errors import AnalysisError
from analysis.numbers import digits
from analysis.top import Cylinder, Top, top_of
from analysis.uncertainty import Estimate
from levilab.errors import DataError
from levilab.files import finite
from levilab.formats.device import read_device
from levilab.pipelines.document import values_of
from levilab.pipelines.field.device import parts_of
from levilab.pipelines.row import Quantity
from levilab.present.numbers import with_uncertainty
from levilab.present.tables import Row, Table, table

SCHEMA = "levilab-top/1"


@dataclass(frozen=True, eq=False)
class Calculated:
    """A top from its parts.

    Attributes:
        alone: each part as if it were the whole top.
    """

    parts: tuple[Cylinder, ...]
    alone: tuple[Top, ...]
    top: Top

    @property
    def values(self) -> dict[str, Estimate]:
        """The results by name."""
        return {
            "mass": self.top.mass,
            "inertia_transverse": self.top.transverse,
            "inertia_axial": self.top.axial,
            "centre_of_mass": self.top.centre,
        }


def calculate_top(path: Path) -> Calculated:
    """Calculate the top that a device file describes by its parts.  Raises DataError."""
    parts = tuple(parts_of(read_device(path).top))
    if not parts:
        raise DataError(
            "{path:s}: has no [[top.parts]]: describe each part of the top as a cylinder, as sample_data/device.toml",
            path=path,
        )
    try:
        return Calculated(parts, tuple(top_of([part]) for part in parts), top_of(parts))
    except AnalysisError as error:
        raise DataError("{path:s}: {error}", path=path, error=error) from error


def top_table(found: Calculated) -> Table:
    """Return a table of the parts, each about its own centre of mass, and of the whole."""
    rows = [Row((part.name, *_cells(alone))) for part, alone in zip(found.parts, found.alone, strict=True)]
    rows.append(Row(("the top", *_cells(found.top)), "together"))
    heads = ("part", "mass", "I₁, across", "I₃, about the axis", "centre")
    return table("The top from its parts", heads, rows)


def _cells(top: Top) -> tuple[str, ...]:
    estimates = (top.mass, top.transverse, top.axial, top.centre)
    return tuple(with_uncertainty(Quantity("", one.unit, "", fine=True).show(one)) for one in estimates)


def top_text(found: Calculated) -> str:
    """Return what to mind, and how a scene takes the top."""
    top = found.top
    ratio = (top.axial.value or 0.0) / (top.transverse.value or 1.0)
    kind = "flat, as a Levitron's" if ratio > 1 else "long: a Levitron's is flat, with I₃ > I₁"
    keys = {
        "top.mass_kg": top.mass.value,
        "top.inertia_transverse_kg_m2": top.transverse.value,
        "top.inertia_axial_kg_m2": top.axial.value,
    }
    settings = "\n".join(f"--set {key}={value:.6g}" for key, value in keys.items())
    return f"I₃/I₁ = {digits(ratio, 3)}: the top is {kind}.\nFor a scene:\n{settings}"


def top_document(found: Calculated) -> dict[str, Any]:
    """Return the same in SI; covariance: of mass, inertia_transverse and inertia_axial."""
    document: dict[str, Any] = finite({
        "schema": SCHEMA,
        "values": values_of(found.values),
        "covariance": found.top.covariance.tolist(),
        "parts": [
            {"name": part.name, "values": values_of(Calculated((part,), (alone,), alone).values)}
            for part, alone in zip(found.parts, found.alone, strict=True)
        ],
    })  # fmt: skip
    return document

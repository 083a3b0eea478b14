"""The figure of each analysis; importing this loads matplotlib."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from levilab.pipelines.field.figure import field_figure
from levilab.pipelines.limit.figure import limit_figure
from levilab.pipelines.precession.figure import precession_figure
from levilab.pipelines.spin.figure import spin_figure
from levilab.pipelines.spindown.figure import spindown_figure

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

#: Name of the analysis → from what was found to the figure.
FIGURES: Mapping[str, Callable[[Any], Any]] = MappingProxyType(
    {
        "spindown": spindown_figure,
        "spin": spin_figure,
        "field": field_figure,
        "limit": limit_figure,
        "precession": precession_figure,
    }
)

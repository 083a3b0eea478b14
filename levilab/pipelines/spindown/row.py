"""A spin-down as a row of a table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from analysis.spindown.drag import LAWS, DragLaw
from levilab.pipelines.row import Column, entry, estimate, name_with_unit, value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

#: Statistics of a law: name in the result, its unit, what it is.
_STATISTICS = (
    ("reduced_chi_square", "1", "χ² per degree of freedom"),
    ("rms_residual", "Hz", "root of the mean square of what it leaves over"),
    ("difference", "1", "ΔAICc, its criterion above that of the best law"),
)


def _model(part: Mapping[str, Any], law: str) -> Mapping[str, Any]:
    found: Mapping[str, Any] = next(model for model in part["models"] if model["name"] == law)
    return found


def _parameter(law: str, name: str) -> Callable[[Mapping[str, Any]], Any]:
    return lambda part: _model(part, law)["parameters"].get(name)


def _statistic(law: str, name: str) -> Callable[[Mapping[str, Any]], Any]:
    return lambda part: _model(part, law)["statistics"][name]


def _of_law(law: DragLaw) -> Iterator[Column]:
    """Its constants with their uncertainties, and how well it fits."""
    for name, unit in zip(law.parameters, law.parameter_units, strict=True):
        yield from estimate(f"{law.name}_{name}", unit, f"{name} of the law {law.name}", _parameter(law.name, name))
    for name, unit, meaning in _STATISTICS:
        heading = "delta_aicc" if name == "difference" else name
        read = _statistic(law.name, name)
        yield Column(name_with_unit(f"{law.name}_{heading}", unit), "number", f"of the law {law.name}: {meaning}", read)


SPINDOWN_ROW = (
    Column("readings_used", "count", "readings in the fits", lambda part: part["models"][0]["statistics"]["n"]),
    entry("outliers", "count", "readings that do not belong to the others", "result.outliers"),
    value("start_time", "s", "time of the first reading"),
    value("duration", "s", "from the first reading to the last"),
    entry("best_model", "text", "the law with the smallest criterion"),
    entry("decided", "truth", "whether the readings single it out"),
    entry("describes", "truth", "whether any law describes the readings"),
    *(column for law in LAWS.values() for column in _of_law(law)),
    *estimate("moment_tilt", "rad", "angle between moment and axis, where the count shows it"),
    *estimate("residual_correlation", "1", "how much neighbouring residuals are alike"),
    entry("verdict", "text", "what the readings say about the laws"),
)

"""The quantities of a spin-down, and its readings as columns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from analysis.spindown.drag import LAWS
from levilab.pipelines.row import Column, Quantity, columns_of, entry, estimate, statistic
from levilab.present.units import name_with_unit

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from analysis.spindown.drag import DragLaw

#: Of `analysis.spindown.fit.SpinDown`, each with a column in the tables of runs; the constants of laws are in
#: `analysis.spindown.drag.LAWS`.
OF_RUN = (
    Quantity("start_time", "s", "time of the first reading", "begins at", has_u=False),
    Quantity("duration", "s", "time from the first reading to the last", "lasts", has_u=False,
             of=lambda run: float(run.time[-1] - run.time[0])),
)  # fmt: skip
#: Of what the counter sees of the wobble, by the best law, and of the noise; they have a table of their own.
TILT = Quantity("moment_tilt", "rad", "angle between moment and axis, where the count shows it", "δ", fine=True,
                of=lambda run: run.fit(run.best).parameters.get("moment_tilt"), optional=True)  # fmt: skip
CORRELATION = Quantity("residual_correlation", "1", "correlation of neighbouring residuals", "correlation",
                       of="correlation.value", u="correlation.u", optional=True)  # fmt: skip
QUANTITIES = (*OF_RUN, TILT, CORRELATION)

#: Statistics of a law: name in the result, name of the column, unit, meaning.
_STATISTICS = (
    ("reduced_chi_square", "reduced_chi_square", "1", "χ² per degree of freedom"),
    ("rms_residual", "rms_residual", "Hz", "root mean square of the residuals"),
    ("difference", "delta_aicc", "1", "ΔAICc, its criterion above that of the best law"),
)


def _of_law(law: DragLaw) -> Iterator[Column]:
    """Yield the columns of a law: its constants with their uncertainties, and how well it fits."""

    def model(part: Mapping[str, Any]) -> Mapping[str, Any]:
        found: Mapping[str, Any] = next(model for model in part["models"] if model["name"] == law.name)
        return found

    for name, unit in zip(law.parameters, law.parameter_units, strict=True):
        yield from estimate(
            f"{law.name}_{name}", unit, f"{name} of the law {law.name}",
            lambda part, name=name: model(part)["parameters"].get(name),  # type: ignore[misc]
        )  # fmt: skip
    for name, heading, unit, meaning in _STATISTICS:
        yield Column(
            name_with_unit(f"{law.name}_{heading}", unit), "number", f"of the law {law.name}: {meaning}",
            lambda part, name=name: model(part)["statistics"][name],  # type: ignore[misc]
        )  # fmt: skip


SPINDOWN_ROW = (
    statistic("n", "1", "readings in the fits", "readings_used", kind="count"),
    entry("outliers", "count", "readings that do not belong to the others", "result.outliers"),
    *columns_of(OF_RUN),
    entry("best_model", "text", "the law with the smallest criterion"),
    entry("decided", "truth", "whether the readings single it out"),
    entry("describes", "truth", "whether any law describes the readings"),
    *(column for law in LAWS.values() for column in _of_law(law)),
    *columns_of((TILT, CORRELATION)),
    entry("verdict", "text", "what the readings say about the laws"),
)

"""What is observed at each point of a sweep, by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from levilab.errors import UsageError
from levilab.simulator.ensemble import simulate_many
from levilab.simulator.keys import nearest

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from levilab.sweeps.plan import Plan


@dataclass(frozen=True)
class Observable:
    """One column of results.

    Attributes:
        name: with its unit at the end.
        unit: "1" for a number.
        meaning: a line.
        dtype: of its array.
        needs: what must be simulated for it.
    """

    name: str
    unit: str
    meaning: str
    dtype: str
    needs: str


OBSERVABLES: dict[str, Observable] = {
    one.name: one
    for one in (
        Observable("survived", "1", "whether the top is still up at the end", "bool", "ends"),
        Observable(
            "lifetime_s", "s", "how long the top stays up, the whole duration if it survives", "float64", "ends"
        ),
    )
}


def columns_of(names: Iterable[str]) -> tuple[Observable, ...]:
    """Return the columns that these observables fill.  Raises UsageError for a name that is unknown."""
    found = []
    for name in names:
        if name not in OBSERVABLES:
            near = nearest(name, OBSERVABLES)
            meant = f"did you mean {near}? Known" if near else "known"
            raise UsageError(
                "observe", f"there is no such observable; {meant} are {', '.join(OBSERVABLES)}", value=name
            )
        found.append(OBSERVABLES[name])
    return tuple(found)


def observe(plan: Plan, values: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Simulate some points and return column → values, in the shape to which the values of the keys broadcast.

    Args:
        plan: its axes are not looked at.
        values: key → values of these points.
    """
    ends = simulate_many(
        plan.scene, values, plan.duration_s, tolerance=plan.tolerance, step_share=plan.step_share, cores=1, errors=False
    )
    found = {"survived": ends.survived, "lifetime_s": ends.time}
    return {column.name: np.asarray(found[column.name], dtype=column.dtype) for column in columns_of(plan.observables)}

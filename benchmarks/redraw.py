"""The kept figures of the benchmarks and of the cross-check, drawn anew from their kept numbers: nothing is measured.

python benchmarks/redraw.py
"""

from __future__ import annotations

import json
import math
from dataclasses import fields
from pathlib import Path
from typing import Any

from levilab.benchmark.estimators.figure import estimators_figure
from levilab.benchmark.estimators.study import Score, Study
from levilab.benchmark.simulator.as_called.comparison import Case
from levilab.benchmark.simulator.as_called.figure import as_called_figure
from levilab.benchmark.simulator.as_called.tasks import TASKS
from levilab.benchmark.simulator.figure import work_precision_figure
from levilab.benchmark.simulator.peers import Point
from levilab.benchmark.simulator.work_precision import Comparison
from levilab.crosscheck.catalogue import SUBJECTS
from levilab.crosscheck.figure import crosscheck_figure
from levilab.crosscheck.study import Checked, Spread
from levilab.present.style import save_png

RESULTS = Path(__file__).parent / "results"


def main() -> None:
    """Replace the pictures."""
    simulator, estimators, checked = (
        json.loads((RESULTS / f"{name}.json").read_text("utf-8")) for name in ("simulator", "estimators", "crosscheck")
    )
    kernels = Comparison(points=tuple(map(point, simulator["points"])))
    save_png(work_precision_figure(kernels), RESULTS / "simulator.png")
    save_png(as_called_figure([case(one) for one in simulator["called"]]), RESULTS / "simulator_as_called.png")
    study = Study(
        estimators["trials"], tuple(map(score, estimators["methods"])), tuple(map(score, estimators["hard_cases"]))
    )
    save_png(estimators_figure(study), RESULTS / "estimators.png")
    save_png(crosscheck_figure([subject(one) for one in checked["subjects"]]), RESULTS / "crosscheck.png")


def point(row: dict[str, Any]) -> Point:
    return Point(row["method"], row["setting"], number(row["error_m"]), row["simulated_s_per_s"])


def case(row: dict[str, Any]) -> Case:
    wanted = (row["motion"], row["duration_s"], row["tops"])
    (task,) = [task for task in TASKS if (task.name, task.duration, task.tops) == wanted]
    return Case(task, tuple(map(point, row["points"])))


def score(row: dict[str, Any]) -> Score:
    optional = {"coverage"}
    values = {field.name: row[field.name] for field in fields(Score)}
    return Score(**{name: math.nan if x is None and name not in optional else x for name, x in values.items()})


def subject(row: dict[str, Any]) -> Checked:
    spreads = tuple(Spread(one["name"], tuple(one["pulls"]), one["relative_u"]) for one in row["quantities"])
    return Checked(SUBJECTS[row["name"]], row["trials"], row["seed"], spreads, row["failures"])


def number(value: float | None) -> float:
    return math.nan if value is None else value


if __name__ == "__main__":
    main()

"""Limits of as many tops and runs as in a result, with its mean, its scatters and its steps of the drive."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.limits import Sample, combine
from levilab.crosscheck.own.model import Own
from levilab.crosscheck.subject import Trial, TrialFailed, pull_of

if TYPE_CHECKING:
    from levilab.pipelines.limit.analysis import LimitAnalysis, Limits

#: Processor time of a trial, for each group of runs [s].
_COST_S = 0.0005


def trials_of(found: LimitAnalysis) -> Own:
    """Return the trials of limits: each group of runs under the same conditions."""
    groups = [group for group in found.groups if group.statistics.scatter]

    def trial(random: np.random.Generator) -> Trial:
        if not groups:
            raise TrialFailed("a single limit has no scatter to make others by")
        return Trial(
            [
                pull_of(_name(group, groups), combine(_samples(random, found, group)).mean, truth)
                for group in groups
                if (truth := group.statistics.mean.value) is not None
            ]
        )

    return Own(
        about="limits of as many tops and runs from a normal law, with this scatter and these steps of the drive",
        trial=trial,
        cost_s=_COST_S * max(len(groups), 1),
        freedom={_name(group, groups): round(min(group.statistics.freedom or 1e6, 1e6)) for group in groups},
    )


def _name(group: Limits, groups: list[Limits]) -> str:
    return "mean" if len(groups) == 1 else f"{group.which} mean"


def _samples(random: np.random.Generator, found: LimitAnalysis, group: Limits) -> list[Sample]:
    """Return the limits of each run; the drive's steps are the same for all tops, and lie anywhere."""
    statistics = group.statistics
    scatter = (statistics.scatter.value or 0.0) if statistics.scatter else 0.0
    between = (statistics.between.value or 0.0) if statistics.between else 0.0
    step = group.conditions.step_hz if statistics.step else None
    origin = random.uniform(0, step) if step else 0.0
    error = statistics.common * random.standard_normal()
    made = []
    for k in group.runs:
        n = len(found.sources[k].readings)
        limits = (
            (statistics.mean.value or 0.0) + between * random.standard_normal() + scatter * random.standard_normal(n)
        )
        if step:
            limits = (np.floor((limits - origin) / step) + 0.5) * step + origin
        made.append(Sample(limits + error, None, np.full(n, step) if step else None, np.full(n, statistics.common)))
    return made

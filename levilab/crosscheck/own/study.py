"""Trials with the parameters of a result.

The random numbers follow from the readings' hashes, so that the same result has the same trials.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from analysis.errors import AnalysisError
from levilab.crosscheck.own import field, hold, limit, precession, spin, spindown, sway
from levilab.crosscheck.own.model import Own
from levilab.crosscheck.study import Study, make_trials
from levilab.errors import LevilabError
from levilab.pipelines.analyzed import Analyzed

#: Analysis → its result as a subject of trials.
OWN: Mapping[str, Callable[[Any], Own]] = MappingProxyType({
    "spindown": spindown.trials_of, "precession": precession.trials_of, "spin": spin.trials_of,
    "field": field.trials_of, "limit": limit.trials_of, "sway": sway.trials_of,
    "hold": hold.trials_of,
})  # fmt: skip
#: Number of trials where none is asked for.
TRIALS = 200
#: A report makes the trials that fit into this processor time [s], but at least ENOUGH ...
REPORT_S, ENOUGH = 2.0, 25
#: ... up to this time [s]: then the trials that fit into it, which say less, and none below FEWEST.
LONGEST_S, FEWEST = 4.0, 5


def seed_of(analysis: str, inputs: Sequence[str]) -> int:
    """Return the seed of the random numbers, from the readings."""
    digest = hashlib.sha256("\n".join([analysis, *inputs]).encode()).digest()
    return int.from_bytes(digest[:6], "big")


def trials_of_report(subject: Own) -> int:
    """Return how many trials a report makes of its own accord; 0 where there is no time for enough of them.

    The cost is the subject's own estimate, and no clock is read: the bytes of a report do not depend on the machine.
    """
    wanted, longest = (int(time / subject.cost_s) for time in (REPORT_S, LONGEST_S))
    count = min(TRIALS, max(wanted, min(ENOUGH, longest)))
    return count if count >= FEWEST else 0


def study_result(
    analysis: str,
    found: Analyzed[Any, Any, Any, Any],
    settings: Mapping[str, Any],
    trials: int = TRIALS,
    progress: Callable[[float], None] = lambda _: None,
) -> Study:
    """Make the trials of a result.

    Args:
        analysis: its name.
        found: its result.
        settings: of the analysis, as result.json has them.
        trials: number of trials.
        progress: called with the share that is done.
    """
    subject = OWN[analysis](found)
    inputs = tuple(source.sha256 for source in found.sources)
    seed = seed_of(analysis, inputs)
    study = Study(
        analysis,
        subject.about,
        trials,
        seed,
        inputs=inputs,
        settings=settings,
        law=subject.law,
        hypothesis=subject.hypothesis,
        expected_share=subject.expected_share,
        more=subject.more,
    )
    return make_trials(study, lambda k: subject.trial(np.random.default_rng((seed, k))), subject.freedom, progress)


def quick_study(analysis: str, found: Analyzed[Any, Any, Any, Any], settings: Mapping[str, Any]) -> Study | None:
    """Make as many trials as a report has time for; None where these are too few, or the result has no trials."""
    try:
        count = trials_of_report(OWN[analysis](found))
    except (LevilabError, AnalysisError):
        return None
    return study_result(analysis, found, settings, count) if count else None

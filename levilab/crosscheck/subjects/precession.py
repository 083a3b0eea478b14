"""The sweep of the drive: a locked top wobbles at the drive's frequency, so the line has slope 1 and meets 0."""

from pathlib import Path

from levilab.crosscheck.mock import acquire_mock
from levilab.crosscheck.subject import Pull, Subject, pull_of
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.precession.words import intercept_of, slope_of


def trial(seed: int, folder: Path) -> list[Pull]:
    """Try one sweep of a top in full motion; the seed draws the phase at which the drive takes hold, and the noise."""
    run = acquire_mock("precession", seed, folder)
    analysis = ANALYSES["precession"]
    (found,) = analysis.analyze([run.folder]).runs
    return [pull_of("slope", slope_of(found.fit), 1.0), pull_of("intercept", intercept_of(found.fit), 0.0)]


SUBJECT = Subject(
    "precession",
    "the sweep of the drive of a top in full motion: slope and intercept of its precession",
    trial,
    trials=10,
)

"""Readings of a held spin, and the gain at the full amplitude that was measured before and after it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from analysis.arrays import Array
from levilab.errors import DataError, DoesNotSuit
from levilab.formats.columns import TableError
from levilab.formats.table import FEWEST
from levilab.pipelines.inputs.source import Readings
from levilab.pipelines.options import InputOptions
from levilab.runs.events import RunEvent
from levilab.runs.run import Run
from levilab.texts.text import how_many


@dataclass(frozen=True, eq=False)
class HoldReadings(Readings):
    """A held spin, each array of shape (n,).

    Attributes:
        time: [s].
        spin, u: [Hz].
        share: of the full amplitude.
        gains: times [s] and counts [Hz] at the full amplitude.
        warnings: about the run.
    """

    time: Array
    spin: Array
    u: Array
    share: Array
    gains: tuple[tuple[Array, Array], ...]
    warnings: tuple[str, ...]

    compared: ClassVar[tuple[str, ...]] = ("time", "share", "spin")


def read_hold_file(path: Path, _: InputOptions) -> HoldReadings:
    """Raise DoesNotSuit: a file has no gain."""
    said = "{path:s}: a run folder of `levilab acquire hold` is expected: the gain stands in its events"
    raise DoesNotSuit(said, path=path)


def read_hold_run(run: Run, _: InputOptions) -> HoldReadings:
    """Return the readings of a run.  Raises DataError."""
    table = run.readings()
    time, spin, u, volts = (
        table.column(name) for name in ("time_s", "spin_frequency_hz", "spin_frequency_u_hz", "drive_amplitude_v")
    )
    if len(time) < FEWEST:
        raise TableError(
            table.path,
            "holds {readings}, at least {fewest} are needed: hold the spin longer",
            how_many(len(time), "reading"),
            FEWEST,
        )
    full = run.record.number("hold", "drive_amplitude_vpp")
    if full is None or not full > 0:
        said = "{path:s}/run.json: configuration.hold.drive_amplitude_vpp, above 0, is expected"
        raise DataError(said, path=run.folder)
    return HoldReadings(time, spin, u, volts / (full / 2), _gains(run), table.warnings)


def _gains(run: Run) -> tuple[tuple[Array, Array], ...]:
    found = (_gain(event) for event in run.events() if event["kind"] == RunEvent.GAIN)
    return tuple(gain for gain in found if gain)


def _gain(event: dict[str, Any]) -> tuple[Array, Array] | None:
    """Return the times and counts of a gain, three counts at least; None for a damaged event."""
    try:
        times, spins = gain = np.array([event.get("times_s"), event.get("spins_hz")], dtype=float)
    except (TypeError, ValueError):
        return None
    whole = gain.ndim == 2 and gain.shape[1] >= FEWEST and np.isfinite(gain).all() and np.ptp(times) > 0
    return (times, spins) if whole else None

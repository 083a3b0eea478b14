"""Sweeps of the drive at some paths: each by itself and together."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from analysis.arrays import Array
from analysis.comparison import weighted_mean
from analysis.errors import AnalysisError
from analysis.precession.coherence import Coherence, coherence, pulse_times
from analysis.precession.sweep import Sweep, SweepFit, fit_sweep
from analysis.remarks import Remark
from levilab.errors import DataError
from levilab.pipelines.analyzed import Analyzed
from levilab.pipelines.budget import gate_of
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import PrecessionOptions
from levilab.pipelines.precession.readings import SweepReadings
from levilab.pipelines.precession.words import remarks_of, verdict
from levilab.runs.traces import StoredTrace

#: The experiment whose runs it takes, and whose settings count.
EXPERIMENT = "precession"


#: A record that is kept at the moment of a reading is that reading's [s].
_AT_ONCE_S = 0.01
#: Slopes of runs that differ with less probability than this are named.
DIFFERENT_P = 0.01


@dataclass(frozen=True)
class PointCoherence:
    """How firmly the laser's pulses follow the drive at a point.

    Attributes:
        point: its number, from 0 on.
    """

    point: int
    coherence: Coherence


@dataclass(frozen=True)
class PrecessionRun:
    """One sweep.

    Attributes:
        coherences: of the records that were kept.
        warnings: about these.
    """

    fit: SweepFit
    coherences: tuple[PointCoherence, ...] = ()
    warnings: tuple[str, ...] = ()


class PrecessionAnalysis(Analyzed[SweepReadings, PrecessionRun, SweepFit, PrecessionOptions]):
    """Sweeps, each by itself and together: the line through the points of all of them."""

    @property
    def text(self) -> str:
        """What the data say, in a few sentences."""
        return verdict(self.combined)

    def about_all(self) -> Iterable[str]:
        """Return what to know of the line through all points."""
        return remarks_of(self.combined) if len(self.runs) > 1 else ()

    def about_run(self, run: PrecessionRun) -> Iterable[str]:
        """Return what to know of one sweep."""
        return (*remarks_of(run.fit), *run.warnings)


def fit_source(source: Source[SweepReadings], options: PrecessionOptions) -> PrecessionRun:
    """Return the line through one sweep, and the coherence of its records.  Raises AnalysisError."""
    readings = source.readings
    u = readings.u if options.reading_u is None else np.full(len(readings), options.reading_u)
    sweep = Sweep(
        drive=readings.drive,
        precession=readings.precession,
        u=u,
        u_drive=readings.u_drive,
        spin=readings.spin,
        u_spin=readings.u_spin,
        gate_s=gate_of(source, EXPERIMENT),
        gates=readings.laser,
    )
    fit = fit_sweep(sweep, orthogonal=options.orthogonal, keep_miscounts=options.keep_outliers)
    coherences, warnings = _coherences(source)
    return PrecessionRun(fit, coherences, warnings)


def combine(runs: Sequence[PrecessionRun], options: PrecessionOptions) -> SweepFit:
    """Return the line through the points of all runs that their own lines go through; of one run it is that run's."""
    if len(runs) == 1:
        return runs[0].fit
    fits = [run.fit for run in runs]
    used = [np.array([point.used for point in fit.points]) for fit in fits]

    def joined(name: str) -> Array | None:
        columns = [fit.column(name)[which] for fit, which in zip(fits, used, strict=True)]
        all_known = all(bool(np.isfinite(column).all()) for column in columns)
        return np.concatenate(columns) if all_known else None

    drive, precession = joined("drive"), joined("precession")
    assert drive is not None
    assert precession is not None
    sweep = Sweep(drive, precession, joined("u"), joined("u_drive"), joined("spin"), joined("u_spin"))
    fit = fit_sweep(sweep, orthogonal=options.orthogonal, keep_miscounts=True)
    return replace(fit, remarks=(*fit.remarks, *_about_slopes(fits)))


def _about_slopes(fits: Sequence[SweepFit]) -> Iterable[Remark]:
    """Yield a remark where the slopes of the runs differ by more than their u."""
    from scipy.special import chdtrc

    slopes = [(fit.line.slope, fit.line.u_slope) for fit in fits if fit.line.u_slope]
    if len(slopes) < 2:
        return
    p = float(chdtrc(len(slopes) - 1, weighted_mean(*np.array(slopes).T)[2]))
    if p < DIFFERENT_P:
        yield Remark("slopes differ", values=(len(slopes), p))


# --- phase lock ----------------------------------------------------------------------------------------


def _coherences(source: Source[SweepReadings]) -> tuple[tuple[PointCoherence, ...], tuple[str, ...]]:
    """Return how firmly the pulses follow the drive in each pair of records of a run, laser and drive."""
    if source.run is None or source.readings.time is None:
        return (), ()
    try:
        traces = source.run.traces()
    except DataError as error:
        return (), (f"the records of the oscilloscope are not used: {error}",)
    found, warnings = [], []
    for laser, drive in pairwise(traces):
        if (laser.channel, drive.channel) != ("laser", "drive"):
            continue
        # a record is taken once its point's reading is kept
        point = int(np.searchsorted(source.readings.time, laser.time_s + _AT_ONCE_S, side="right")) - 1
        if point < 0:
            continue
        try:
            found.append(PointCoherence(point, _coherence(laser, drive, float(source.readings.drive[point]))))
        except AnalysisError as error:
            warnings.append(f"record {laser.number}, of point {point + 1}: {error}")
    doubtful = [f"{one.point + 1}" for one in found if not one.coherence.locked]
    if doubtful:
        points = f"point{'s' * (len(doubtful) > 1)} {', '.join(doubtful)}"
        warnings.append(f"the laser's pulses do not keep to the drive's phase at {points}")
    return tuple(found), tuple(warnings)


def _coherence(laser: StoredTrace, drive: StoredTrace, frequency: float) -> Coherence:
    record, beside = laser.trace, drive.trace
    pulses = pulse_times(record.volts, record.dt_s, record.t0_s)
    return coherence(pulses, beside.volts, beside.dt_s, frequency, beside.t0_s)

"""A magnetometer's record: components of the field against time, as a phone writes them, and the spin in it."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.pulses import Finding, SpinFrequency
from analysis.rotation import FieldSpin, FieldTrack, rate_of
from analysis.uncertainty import Estimate
from levilab.formats.columns import TableError
from levilab.formats.table import read_table
from levilab.formats.titles import COMPONENTS, MAGNITUDE
from levilab.formats.understanding import Request, SeveralRuns, plan_of
from levilab.pipelines.options import InputOptions
from levilab.texts.note import of_file
from levilab.texts.text import Text

#: Columns of a record; a Bz beside a Bx is a component.
QUANTITIES = ("time_s", *COMPONENTS, "flux_density_t", MAGNITUDE)
#: Those that make a table a record: any of these pairs.
NEEDED = tuple(("time_s", name) for name in (*COMPONENTS, MAGNITUDE))
#: No field that a phone survives is as strong [T]: the unit is in doubt.
STRONGEST_T = 0.1
#: Samples were written again where more than this part of them stands twice to this often in succession; of a field at
#: rest they are alike for longer.
_REPEATS, _LONGEST = 0.3, 6
#: A slower record shows no spin [samples/s]: a scan of the field by hand has one a second.
SLOWEST_RATE = 20.0


@dataclass(frozen=True, eq=False)
class FieldRecord:
    """Samples of a magnetometer.

    Attributes:
        times: increasing, shape (n,) [s].
        field: shape (n, k) [T].
        axes: their names, "x" to "z", or "|B|" alone.
        warnings: about the file.
    """

    times: Array
    field: Array
    axes: tuple[str, ...]
    warnings: tuple[str, ...]

    def __len__(self) -> int:
        return self.times.size

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return float(self.times[-1] - self.times[0])

    @property
    def rate(self) -> float:
        """Samples per second, without gaps."""
        return rate_of(self.times)

    @property
    def kind(self) -> str:
        """The kind of record, as text."""
        return Text("magnetometer, {axes}, {rate:.4g} samples/s", axes=self.axes, rate=self.rate)


def read_field_record(path: Path, options: InputOptions) -> FieldRecord | None:
    """Return the samples in a data file; None: it holds no field against time.

    Raises:
        TableError: it does, but cannot be used.
    """
    needed = _needed(path, options)
    if needed is None:
        return None
    table = read_table(path, quantities=QUANTITIES, needed=needed, **options.of_tables | {"guess": False})
    axes = {name: name[-3] for name in COMPONENTS if name in table.columns}
    if COMPONENTS[2] not in axes and "flux_density_t" in table.columns:
        axes["flux_density_t"] = "z"
    axes = axes or {MAGNITUDE: "|B|"}
    times = table.column("time_s")
    field = np.stack([table.column(name) for name in axes], axis=1)
    warnings = list(table.warnings)
    back = np.flatnonzero(np.diff(times) < 0)
    if back.size:
        k = int(back[0])
        back_to = "the time {then:.9g} s comes after {now:.9g} s: cut the file where the recording was started again"
        raise TableError(path, Text(back_to, then=times[k + 1], now=times[k]), line=int(table.lines[k + 1]))
    first = _first_of_each(field)
    if first.size < times.size:
        said = (
            "{name:s}: {n} of {samples} samples repeat the one before, as of an app that writes faster than the sensor "
            "is read: they are left out"
        )
        warnings.append(of_file("repeats", Text(said, path.name, times.size - first.size, times.size)))
        times, field = times[first], field[first]
    strongest = float(np.abs(np.median(field, axis=0)).max())
    if strongest > STRONGEST_T:
        units = ",".join(f"{'babs' if axis == '|B|' else 'b' + axis}=NAME [µT]" for axis in axes.values())
        strong = (
            "{name:s}: a field of {field:.3g} T is stronger than a phone measures, so the unit is another; say it with "
            "the columns: {units:s}"
        )
        warnings.append(of_file("strongest", Text(strong, name=path.name, field=strongest, units=units)))
    if MAGNITUDE in axes:
        alone = (
            "{name:s}: holds the field's magnitude alone: where the field that turns is the stronger part, its line "
            "lies at twice the spin; record the axes x, y and z, too"
        )
        warnings.append(of_file("magnitude", Text(alone, name=path.name)))
    record = FieldRecord(times, field, tuple(axes.values()), tuple(warnings))
    return record if record.duration > 0 and record.rate > SLOWEST_RATE else None


def _first_of_each(field: Array) -> NDArray[np.intp]:
    """Return the indices of samples that do not repeat the one before; all where few do, or a field is at rest.

    field: shape (n, k).
    """
    starts = np.flatnonzero(np.append(True, np.any(np.diff(field, axis=0) != 0, axis=1)))
    lengths = np.diff(np.append(starts, len(field)))
    again = lengths[(lengths > 1) & (lengths <= _LONGEST)].sum()
    return starts if again > _REPEATS * len(field) else np.arange(len(field))


def _needed(path: Path, options: InputOptions) -> tuple[str, str] | None:
    """Return the pair of columns that makes a file a record; None where it has none.  Raises SeveralRuns."""
    try:  # one look at a file with one table, which most files are
        found = _columns(path, options, ("time_s",))
    except SeveralRuns:  # of which some may be records
        return next((pair for pair in NEEDED if _columns(path, options, pair)), None)
    return next((pair for pair in NEEDED if {*pair} <= found), None)


def _columns(path: Path, options: InputOptions, needed: tuple[str, ...]) -> frozenset[str]:
    """Return the names of the columns of a file that holds the needed ones, else none.  Raises SeveralRuns."""
    try:
        plan = plan_of(path, Request(options.columns or {}, QUANTITIES, needed, guess=False))
    except SeveralRuns:
        raise
    except (TableError, OSError):  # another reader says why
        return frozenset()
    return frozenset(column.name for column in plan.columns if not column.behind)


# --- as the spin of a train of pulses has it ---


def spin_of_line(found: FieldSpin) -> SpinFrequency:
    """Return a line's frequency in the form of a result of pulses: its turns, and the time scatter of one turn."""
    return SpinFrequency(
        frequency=Estimate(found.frequency, found.u_frequency, "Hz"),
        chirp=Estimate(found.chirp, found.u_chirp, "Hz/s"),
        phase=Estimate(None, None, "1"),
        reference_time=found.reference_time,
        method="line",
        bound=found.bound,
        pulses=found.turns,
        missing=0,
        doubled=0,
        scatter=found.scatter,
        snr_db=found.snr_db,
        notes=findings_of([found]),
        u_of_pulses=found.u_of_noise,
    )


def findings_of(spins: Sequence[FieldSpin]) -> tuple[Finding, ...]:
    """Return the findings of windows, each name once."""
    counts = Counter(kind for spin in spins for kind in spin.kinds)
    first = {kind: next(spin for spin in spins if kind in spin.kinds) for kind in counts}
    whole = len(spins)
    return tuple(
        Finding(
            kind,
            values=(first[kind].rate, *(fold.frequency for fold in first[kind].folds)),
            where=(spins.index(first[kind]) + 1, number, whole) if whole > 1 else (),
        )
        for kind, number in counts.items()
    )


def track_middle(track: FieldTrack) -> int:
    """Return the number of the window in the middle."""
    return int(np.abs(track.time - 0.5 * (track.time[0] + track.time[-1])).argmin())

"""How a data file is understood, whatever it holds, for a person to see and to correct."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from analysis.numbers import digits
from levilab.errors import LevilabError
from levilab.formats.columns import Choice, Doubt, DoubtfulRows
from levilab.formats.table import read_table
from levilab.formats.texts import locate
from levilab.formats.titles import COMPONENTS, MAGNITUDE, dimension
from levilab.formats.understanding import UnderstoodColumn, UnderstoodRun, is_possible_spin, understand
from levilab.formats.waveforms.header import NoRate, NoWaveform
from levilab.formats.waveforms.record import read_record
from levilab.formats.waveforms.waveform import PulseTimes, Waveform
from levilab.pipelines.field import readings as scan
from levilab.pipelines.inputs.correction import corrected_parts, read_correction
from levilab.pipelines.limit import readings as limit
from levilab.pipelines.precession import readings as precession
from levilab.pipelines.spin import magnetometer
from levilab.pipelines.spindown import readings as spindown
from levilab.texts.text import Text, text_of

#: Quantities that a column may hold, as text, and the units to choose from.
QUANTITIES: Mapping[str, tuple[str, tuple[str, ...]]] = MappingProxyType({
    "time_s": ("time", ("s", "ms", "min", "h", "hh:mm", "mm:ss")),
    "spin_frequency_hz": ("spin frequency", ("Hz", "rpm", "rad/s", "°/s", "kHz", "mHz")),
    "spin_frequency_u_hz": ("u of the spin frequency", ("Hz", "rpm", "rad/s", "°/s", "kHz", "mHz")),
    "drive_frequency_hz": ("drive frequency", ("Hz", "rpm", "rad/s")),
    "precession_frequency_hz": ("precession frequency", ("Hz", "rpm", "rad/s")),
    "height_m": ("height", ("m", "cm", "mm")),
    "flux_density_t": ("flux density", ("T", "mT", "μT", "G")),
    **{name: (f"flux density {name[-3]}", ("T", "mT", "μT", "G")) for name in COMPONENTS},
    MAGNITUDE: ("magnitude of the flux density", ("T", "mT", "μT", "G")),
})  # fmt: skip
#: Tables by their columns: those that are wanted, and those without which it is another one; the first that fits.
_TABLES = (
    (scan.QUANTITIES, scan.NEEDED),
    (precession.QUANTITIES, precession.NEEDED),
    (spindown.QUANTITIES, spindown.QUANTITIES[:2]),
    (limit.QUANTITIES, limit.NEEDED),
    *((magnetometer.QUANTITIES, needed) for needed in magnetometer.NEEDED),
)
_SPIN_DOWN = _TABLES[2]
#: Points of a small plot at most, the samples that it shows, and the largest table that is read for it [bytes].
_POINTS, _SAMPLES, _LARGEST = 400, 4000, 30 << 20
#: Dimensions that a small plot shows in the unit of the file.
_IN_OWN_UNIT = frozenset({"flux density", "length"})
#: First values of a record.
_SHOWN = 5


@dataclass(frozen=True)
class Plot:
    """A small plot: one quantity against another.

    Attributes:
        x, y: values, equally many.
        x_axis, y_axis: name and unit.
    """

    x: tuple[float, ...]
    y: tuple[float, ...]
    x_axis: tuple[str, str]
    y_axis: tuple[str, str]


@dataclass(frozen=True)
class Look:
    """How a file is understood.

    Attributes:
        holds: the kind of content, as text.
        runs: its tables; of a record one, whose columns are the channels.
        problem: why nothing of it is read; empty if any run is.
        channels: names of the channels of a record.
        rate: samples per second of a record [Hz].
        plots: of each run that is read, by its number.
    """

    path: Path
    holds: str
    runs: tuple[UnderstoodRun, ...]
    problem: str = ""
    channels: tuple[str, ...] = ()
    rate: float | None = None
    plots: Mapping[int, tuple[Plot, ...]] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON has it."""
        runs = [{**asdict(run), "path": str(run.path)} for run in self.runs]
        plots = {str(number): [asdict(plot) for plot in drawn] for number, drawn in self.plots.items()}
        about = {"path": str(self.path), "name": name_of(self.path), "holds": self.holds, "problem": self.problem}
        return about | {"channels": list(self.channels), "rate": self.rate, "runs": runs, "plots": plots}


def name_of(path: Path) -> str:
    """Return the name of a file, with that of a sheet or run in it.

    >>> from pathlib import Path
    >>> name_of(Path("a/my.csv"))
    'my.csv'
    """
    file, inside = locate(path)
    return f"{file.name}/{inside}" if inside else file.name


def look_at(path: Path, options: Mapping[str, Any], *, plots: bool = True) -> Look:
    """Return how a file is understood; one that cannot be read has a `problem`.

    Args:
        path: the file, or a sheet or run in it.
        options: columns, skip_doubtful, channel and rate by their names.
        plots: whether small plots are made, for which a table is read.
    """
    columns = options.get("columns")
    try:
        record = read_record(path, columns=columns, rate=options.get("rate"))
    except LevilabError as error:
        look = _look_at_table(path, options, plots=plots)
        if look.problem and (limits := _look_at_limits(path)):
            return limits
        is_record = isinstance(error, NoRate) or not isinstance(error, NoWaveform)
        return Look(path, "", look.runs, text_of(error)) if look.problem and is_record else look
    try:
        return _look_at_record(path, record, options.get("channel"))
    except LevilabError as error:
        return Look(path, record.format, (), text_of(error))


def look_as_kept(path: Path, options: Mapping[str, Any], *, plots: bool = True) -> Look:
    """Return how a file is understood with the corrections kept beside it, of the file and of its sheets alone.

    Args:
        path: the file, or a sheet or run in it.
        options: as `look_at` takes them; they go before those that are kept.
        plots: whether small plots are made.

    Raises:
        CorrectionError: a correction cannot be used.
    """
    looks = [look_at(part, {**read_correction(part), **options}, plots=plots) for part in corrected_parts(path)]
    if len(looks) == 1:
        return looks[0]
    runs = tuple(replace(run, name=locate(run.path)[1]) for look in looks for run in look.runs)
    drawn = [look.plots.get(k) for look in looks for k in range(len(look.runs))]
    problem = "" if any(not look.problem for look in looks) else looks[0].problem
    return Look(path, _count_tables(runs), runs, problem, plots={k: plot for k, plot in enumerate(drawn) if plot})


def _look_at_table(path: Path, options: Mapping[str, Any], *, plots: bool) -> Look:
    columns = options.get("columns")
    seen = [(wanted, understand(path, columns=columns, quantities=wanted[0], needed=wanted[1])) for wanted in _TABLES]
    wanted, found = next(((wanted, one) for wanted, one in seen if not one.problem), (_SPIN_DOWN, seen[2][1]))
    if found.problem:
        return Look(path, Text("a table"), _with_known_columns(path, found.runs, columns), found.problem)
    if not plots:
        return Look(path, _count_tables(found.runs), found.runs)
    given = {name: options[name] for name in ("columns", "skip_doubtful") if options.get(name)}
    runs, drawn = list(found.runs), dict[int, tuple[Plot, ...]]()
    for k, run in enumerate(runs):
        try:
            drawn[k] = _plots_of_table(run, given, wanted)
        except DoubtfulRows as error:
            doubt = Doubt("rows", text_of(error), None, (Choice(Text("Leave such rows out"), {}),))
            runs[k] = replace(run, doubts=(doubt,), problem=doubt.text)
        except LevilabError:
            continue
    problem = "" if any(not run.problem for run in runs) else runs[0].problem
    return Look(path, _count_tables(runs), tuple(runs), problem, plots={k: plot for k, plot in drawn.items() if plot})


def _count_tables(runs: Sequence[UnderstoodRun]) -> str:
    return Text("a table") if len(runs) == 1 else Text("{n} tables", n=len(runs))


def _with_known_columns(
    path: Path, runs: Sequence[UnderstoodRun], columns: Mapping[str, str] | None
) -> tuple[UnderstoodRun, ...]:
    """Return tables that are not read with those of their columns that are known."""
    known = understand(path, columns=columns, quantities=_SPIN_DOWN[0], needed=(), guess=False).runs
    found = {run.path: run.columns for run in known if not run.problem}
    return tuple(replace(run, columns=found.get(run.path, run.columns)) for run in runs)


def _plots_of_table(run: UnderstoodRun, given: Mapping[str, Any], wanted: tuple[Any, Any]) -> tuple[Plot, ...]:
    """Return the first two quantities of a table, or each component of a field, against the first.

    Fields and lengths stay in the unit of the file; a spin in Hz shows whether its unit was understood.  A table that
    is too large has none.  Raises LevilabError.
    """
    if run.problem or (run.path.is_file() and run.path.stat().st_size > _LARGEST):
        return ()
    table = read_table(run.path, quantities=wanted[0], needed=wanted[1], **given)
    names = [name for name in wanted[0] if name in table.columns and name in QUANTITIES]
    first, *others = wanted[1] if "drive_frequency_hz" in wanted[1] else names
    count = len(table.columns[first])
    step = max(1, -(-count // _POINTS))
    of_file = {one.quantity: one for one in run.columns if one.quantity and dimension(one.quantity) in _IN_OWN_UNIT}

    def points(name: str) -> tuple[tuple[float, ...], tuple[str, str]]:
        words, (unit, *_) = QUANTITIES[name]
        own = of_file.get(name)
        values = table.columns[name][::step] / (own.factor if own else 1.0)
        return tuple(values.tolist()), (words, own.unit if own else unit)

    x, x_axis = points(first) if others else (tuple(range(1, count + 1, step)), ("reading", ""))
    components = [name for name in others if dimension(name) == "flux density" and name != MAGNITUDE]
    drawn = components or others[:1] or [first]
    return tuple(Plot(x, y, x_axis, y_axis) for y, y_axis in map(points, drawn))


def _look_at_limits(path: Path) -> Look | None:
    """Return how one column of limits is understood; None of another file."""
    table = limit.single_column(path, guess=True)
    if table is None or not is_possible_spin(float(np.median(spins := table.column("spin_frequency_hz")))):
        return None
    values = tuple(digits(spin, 6) for spin in spins[:_SHOWN])
    column = UnderstoodColumn(0, "".join(table.header), "spin_frequency_hz", "Hz", 1.0, inverse=False, values=values)
    plot = Plot((*range(1, len(spins) + 1),), tuple(spins.tolist()), ("reading", ""), ("spin frequency", "Hz"))
    run = UnderstoodRun(path, "", 0, (column,), warnings=table.warnings)
    return Look(path, Text("{n} limits", n=len(spins)), (run,), plots={0: (plot,)})


def _look_at_record(path: Path, record: Waveform | PulseTimes, channel: str | None) -> Look:
    """Return how a record is understood.  Raises LevilabError."""
    if isinstance(record, PulseTimes):
        values = tuple(digits(time, 7) for time in record.times[:_SHOWN])
        column = UnderstoodColumn(0, "", "pulse times", "s", 1.0, inverse=False, values=values)
        run = UnderstoodRun(path, "", 0, (column,), warnings=record.warnings)
        turns = np.diff(record.times[: _POINTS + 1])
        plot = Plot(tuple(record.times[1 : len(turns) + 1].tolist()), tuple((1 / turns).tolist()),
                    ("time", "s"), ("1 / time between pulses", "Hz"))  # fmt: skip
        holds = Text("{n} times of pulses ({format:s})", n=len(record.times), format=record.format)
        return Look(path, holds, (run,), plots={0: (plot,)})
    chosen = record.signal(channel)
    columns: list[UnderstoodColumn] = []
    plots: dict[int, tuple[Plot, ...]] = {}
    for k, signal in enumerate(record.signals):
        first = next(islice(record.read(k), 1), np.zeros(0))[:_SAMPLES]
        values = tuple(digits(value, 4) for value in first[:_SHOWN])
        quantity = "signal" if k == chosen else None
        columns.append(UnderstoodColumn(k, signal.name, quantity, signal.unit, 1.0, inverse=False, values=values))
        if k == chosen:
            times = record.times_of(0, len(first))
            axes = (("time", "s"), (signal.name, signal.unit))
            plots[0] = (Plot(tuple(times.tolist()), tuple(first.tolist()), *axes),)
    run = UnderstoodRun(path, "", 0, tuple(columns), warnings=record.warnings)
    rate, said = digits(record.rate, 6), "{format:s}: {seconds:n} s, {rate:n} samples a second"
    holds = Text(said, format=record.format, seconds=digits(record.duration, 3), rate=rate)
    names = tuple(signal.name for signal in record.signals)
    return Look(path, holds, (run,), channels=names, rate=record.rate, plots=plots)

"""What is exported of a run, a data file or a sweep: tables with units, the result, and where all of it comes from."""

import json
import re
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.errors import AnalysisError
from levilab.errors import DataError, unquote
from levilab.files import as_json
from levilab.formats.waveforms.waveform import Waveform
from levilab.pipelines.document import Analysis
from levilab.pipelines.inputs.unread import skipped_by_all, texts_of
from levilab.pipelines.recall import recall_suiting
from levilab.pipelines.result import Place, Result
from levilab.pipelines.row import plain
from levilab.present.units import UNITS, split, u_of
from levilab.present.words import free_name
from levilab.runs.find import RECORD, find_run
from levilab.runs.run import EVENTS, READINGS, STATES, Run
from levilab.runs.waveforms import run_waveforms
from levilab.sweeps.plan import unit_of
from levilab.sweeps.quantities import columns_of, quantity_of
from levilab.sweeps.store import Store
from levilab.texts.text import ENGLISH, Text, in_language

Results = Sequence[tuple[Analysis[Any], Any]]


@dataclass(frozen=True, eq=False)
class Column:
    """A column of a table, or an array of a map.

    Attributes:
        name: with the unit at its end.
        values: numbers, flags or texts.
        unit: in SI.
        meaning: for people.
        source: where it comes from.
    """

    name: str
    values: NDArray[Any]
    unit: str
    meaning: str
    source: str = ""


@dataclass(frozen=True)
class Table:
    """Columns of one length.

    Attributes:
        name: of its file, such as readings or trace-000001.
        columns: in their order.
        about: what a row is.
        labelled: whether the first column names the rows.
    """

    name: str
    columns: tuple[Column, ...]
    about: str
    labelled: bool = False

    @property
    def length(self) -> int:
        """Number of rows."""
        return len(self.columns[0].values)


class Value(NamedTuple):
    """A quantity of a result; of no model where the model is empty."""

    analysis: str
    model: str
    name: str
    value: float | None
    u: float | None
    unit: str


@dataclass(frozen=True)
class Contents:
    """What is exported.

    Attributes:
        name: of the run, the file or the sweep.
        title: for people.
        tables: the readings first.
        traces: records of an oscilloscope, a table each: time_s, and the channels.
        about: facts by their names in the conventions CF and ACDD.
        values: of the results.
        files: that go into a package as they are, by their names.
        axes: of a map, whose columns have the shape of these; its only table has a row for each point.
        arrays: the columns of a map.
    """

    name: str
    title: str
    tables: tuple[Table, ...]
    about: Mapping[str, str]
    traces: tuple[Table, ...] = ()
    values: tuple[Value, ...] = ()
    files: Mapping[str, bytes] = field(default_factory=dict)
    axes: tuple[Column, ...] = ()
    arrays: tuple[Column, ...] = ()

    @property
    def result(self) -> Table:
        """The values as a table."""
        heads = (*Value._fields[:3], "value", "u", "unit")
        kinds = (str, str, str, float, float, str)
        meanings = ("", "empty: of no model", "", "in the unit of its row", "standard uncertainty of the value", "")
        columns = zip(*self.values, strict=True) if self.values else ((),) * len(heads)
        made: list[NDArray[Any]] = [np.array(column, dtype=kind) for column, kind in zip(columns, kinds, strict=True)]
        described = zip(heads, made, meanings, strict=True)
        return Table("result", tuple(Column(name, values, "1", text) for name, values, text in described), "a quantity")


def contents_of(
    place: Sequence[Path] | Store, tell: Callable[[str], None] = lambda _: None, given: Mapping[str, Any] | None = None
) -> Contents:
    """Return what is exported of run folders, data files or a sweep.

    Args:
        place: paths, or the store of a sweep.
        tell: called with the reason why there is no result.
        given: options of analyses by their names.

    Raises:
        DataError: there is nothing.
    """
    if isinstance(place, Store):
        return _of_sweep(place)
    path, *others = paths = [*map(find_run, place)]
    if (path / "zarr.json").exists() and not others:
        return _of_sweep(Store.open(path))
    run = Run.load(path) if (path / RECORD).exists() and not others else None
    try:
        results = recall_suiting(paths, given or {})
        for text in texts_of(skipped_by_all([found.skipped for _, found in results])):
            tell(text)
        if not run and any(
            source.run and run_waveforms(source.run) for _, found in results for source in found.sources
        ):
            tell(Text("of several runs the readings are exported, without their traces: export each run for these"))
    except (DataError, AnalysisError) as error:
        if run is None:
            raise
        tell(f"without a result: {error}")
        results = []
    return contents_of_results(path, run, results)


def contents_of_results(path: Path, run: Run | None, results: Results) -> Contents:
    """Return what is exported of an input, or of several, and of what analyses found of them.  Raises DataError."""
    inputs = {source.path: source for _, found in results for source in found.sources}
    if len(inputs) > 1:
        return _of_several(path.stem, results)
    if inputs:  # also those of a folder that was searched
        path, run = next((path, source.run) for path, source in inputs.items())
    waveforms = run_waveforms(run) if run else _waveforms_of(results)
    tables = [table for table in (*_readings(run), *map(_of_analysis, results)) if table.length]
    traces = [table for table in map(_of_waveform, enumerate(waveforms, 1)) if table.length]
    written = [analysis.result_of(found, Place(Path())) for analysis, found in results]
    files = {
        f"result{f'.{one.analysis}' * (k > 0)}.json": f"{as_json(one.as_dict())}\n".encode(errors="replace")
        for k, one in enumerate(written)
    }
    names = (RECORD, EVENTS) if run else ()
    files |= {name: (path / name).read_bytes() for name in names if (path / name).exists()}
    if not (tables or traces):
        raise DataError(f"{path}: holds no reading and no record, so nothing can be exported")
    return Contents(
        name=path.name if run else path.stem,
        title=f"levilab {run.record.experiment} run {path.name}" if run else f"readings of {path.name}",
        tables=tuple(tables),
        about=facts_of(run, path, results),
        traces=tuple(traces),
        values=tuple(value for one in written for value in _values(one)),
        files=files,
    )


def contents_of_readings(analysis: Analysis[Any], found: Any) -> Contents:
    """Return the readings of one result, with its values and models."""
    if len(found.sources) > 1:
        return _of_several(found.place.name, [(analysis, found)])
    (source,) = found.sources
    about = facts_of(source.run, source.path, [(analysis, found)])
    written = analysis.result_of(found, Place(Path()))
    about |= {"best_model": getattr(written, "best_model", None) or ""}
    title, table = f"{analysis.name} of {about['source']}", readings_of(analysis, found)
    return Contents(
        source.name, title, (replace(table, columns=table.columns[1:]),), about, values=(*_values(written),)
    )


def readings_of(analysis: Analysis[Any], found: Any) -> Table:
    """Return a row for each reading of all inputs, with its residual; the first column names the input."""
    import pandas as pd

    frames = [pd.DataFrame(dict(one)) for one in analysis.columns(found)]
    for source, frame in zip(found.sources, frames, strict=True):
        frame.insert(0, "input", source.name)
    return table_of(pd.concat(frames, ignore_index=True), "readings", "a reading")


def _of_several(name: str, results: Results) -> Contents:
    """Return what analyses found of several inputs: their readings, a row for each input, and all together."""
    tables, values, files = list[Table](), list[Value](), dict[str, bytes]()
    names = dict.fromkeys(source.name for _, found in results for source in found.sources)
    for analysis, found in results:
        written = analysis.result_of(found, Place(Path()))
        own = f"{analysis.name}-" * (len(results) > 1)
        readings = readings_of(analysis, found)
        inputs = _of_each([source.name for source in found.sources], analysis, written.as_dict()["runs"])
        tables += [replace(readings, name=f"{own}readings"), replace(inputs, name=f"{own}inputs")]
        values += _values(written)
        files[f"{own}result.json"] = f"{as_json(written.as_dict())}\n".encode(errors="replace")
    runs = {source.name: source.run for _, found in results for source in found.sources if source.run}
    for k, run in enumerate(runs.values(), 1):
        files[f"run-{k:03d}.json"] = (run.folder / RECORD).read_bytes()
    synthetic = any(source.synthetic for _, found in results for source in found.sources)
    made = {"synthetic": str(synthetic).lower(), "history": f"analyzed by levilab {version('levilab')}"}
    about = facts_of(None, Path(), results) | made
    title = f"{' and '.join(analysis.name for analysis, _ in results)} of {len(names)} inputs"
    return Contents(name or "inputs", title, tuple(tables), about, values=tuple(values), files=files)


def _of_each(names: Sequence[str], analysis: Analysis[Any], parts: Sequence[Mapping[str, Any]]) -> Table:
    """Return a row for each input, with the columns of `levilab analyze --table` of which something is known."""
    columns = [Column("input", np.array(names), "1", "the input")]
    for one in analysis.row:
        cells = [plain(one.read(part), one.kind) for part in parts]
        if all(cell is None for cell in cells):
            continue
        if one.kind == "text":
            values = np.array(["" if cell is None else cell for cell in cells], dtype=str)
        else:
            values = np.array([np.nan if cell is None else cell for cell in cells])
        columns.append(Column(one.name, values, unit_of_name(one.name), one.meaning))
    return Table("inputs", tuple(columns), "an input", labelled=True)


def _readings(run: Run | None) -> Iterator[Table]:
    """Yield the readings of a run, or its simulated states."""
    if run is None or not any((run.folder / name).exists() for name in (READINGS, STATES)):
        return
    described = {one["name"]: one for one in run.record.channels if "name" in one}
    yield table_of(run.to_dataframe(), "readings", "a reading", described)


def table_of(frame: Any, name: str, about: str, described: Mapping[str, Mapping[str, str]] | None = None) -> Table:
    """Return a DataFrame as a table.

    Args:
        frame: columns with the unit in their names.
        name: of the table.
        about: what a row is.
        described: unit and source of columns by their names.
    """
    columns = []
    for title in map(str, frame):
        unit, source = ((described or {}).get(title, {}).get(key, "") for key in ("unit", "source"))
        values = frame[title].to_numpy()
        values = values.astype(str) if values.dtype.kind == "O" else values
        columns.append(Column(title, values, unit or unit_of_name(title), _meaning(title), source))
    return Table(name, tuple(columns), about)


def _of_analysis(result: tuple[Analysis[Any], Any]) -> Table:
    """Return the readings that an analysis used or made, with their residuals."""
    analysis, found = result
    columns = next(iter(analysis.columns(found)))
    made = (Column(name, np.asarray(values), unit_of_name(name), _meaning(name)) for name, values in columns.items())
    return Table(analysis.name, tuple(made), f"a reading of the analysis {analysis.name}")


def _of_waveform(numbered: tuple[int, Waveform]) -> Table:
    """Return a record of an oscilloscope in seconds and volts."""
    number, waveform = numbered
    about, taken = f"a sample of {waveform.format}", {"time_s"}
    columns = [Column("time_s", waveform.times_of(0, waveform.count), "s", "time of the sample")]
    for k, signal in enumerate(waveform.signals):
        # a code has 16 bits at most, and a float of 32 bits 24
        samples = np.concatenate([*waveform.read(k)]).astype(np.float32)
        name = free_name(f"{signal.name}_{re.sub(r'[^a-z]+', '_', signal.unit.lower())}", taken)
        columns.append(Column(name, samples, signal.unit, signal.name))
    return Table(f"trace-{number:06d}", tuple(columns), about)


def _waveforms_of(results: Results) -> list[Waveform]:
    """Return the records in a data file."""
    sources = (source for _, found in results for source in found.sources)
    found = [waveform for source in sources for waveform in getattr(source.readings, "waveforms", ())]
    return list(dict.fromkeys(found))


def _values(written: Result) -> Iterator[Value]:
    """Yield the values of a result, and the parameters of its models."""
    parts = [("", written.values), *((model.name, model.parameters) for model in written.models)]
    for model, quantities in parts:
        for name, one in quantities.items():
            yield Value(written.analysis, model, name, one.value, one.u, one.unit)


def facts_of(run: Run | None, path: Path, results: Results = ()) -> dict[str, str]:
    """Return where readings and result come from, by names of CF and ACDD; without what is not known."""
    warnings = dict.fromkeys(unquote(text) for _, found in results for text in found.all_warnings)
    facts = {"warnings": "; ".join(warnings)}
    if run is None:
        names = dict.fromkeys(source.name for _, found in results for source in found.sources)
        source = f"the file {path.name}" if path.name in names or not names else "; ".join(names)  # or arrays
        facts |= {"source": source, "history": f"read by levilab {version('levilab')}"}
        return {name: text for name, text in facts.items() if text}
    record = run.record
    models = "; ".join(filter(None, (str(about.get("identity", "")) for about in record.instruments.values())))
    facts |= {
        "source": record.synthetic_how or "synthetic" if record.synthetic else models or f"the run {path.name}",
        "synthetic": str(record.synthetic).lower(),
        "history": "\n".join(
            [
                f"{record.started_utc or ''} {' '.join(record.command_line)}".strip(),
                *([f"analyzed by levilab {version('levilab')}"] if results else []),
            ]
        ).strip(),
        "comment": record.note,
        "creator_name": record.group,
        "date_created": record.started_utc or "",
        "time_zero_utc": record.time_zero_utc or "",
        "run": record.as_json(),
    }
    return {name: text for name, text in facts.items() if text}


def _of_sweep(store: Store) -> Contents:
    from levilab.sweeps.summary import headline, summarise

    plan, found = store.plan, store.load()
    described = {axis.key: (unit_of(axis.key), quantity_of(axis.key).name) for axis in plan.axes}
    described |= {one.name: (one.unit, one.meaning) for one in columns_of(plan.observables)}
    rows = (Column(name, values, *described[name]) for name, values in found.columns().items())
    grid = () if plan.is_table else tuple(Column(axis.key, axis.values, *described[axis.key]) for axis in plan.axes)
    arrays = tuple(Column(name, values, *described[name]) for name, values in found.values.items()) if grid else ()
    name, begun = store.path.stem if store.path else "sweep", str(store.group.attrs.get("created_utc", ""))
    about = {
        "source": "levilab sweep, simulated",
        "synthetic": "true",
        "history": " ".join([begun, *(store.attribute("command_line") or ())]).strip(),
        "date_created": begun,
        "plan": json.dumps(plan.as_table(), ensure_ascii=False),
    }
    table = Table("points", tuple(rows), "a point of the map")
    return Contents(name, in_language(headline(summarise(store)), ENGLISH), (table,), about, axes=grid, arrays=arrays)


def unit_of_name(name: str) -> str:
    """Return the unit at the end of a name, "1" where there is none.

    >>> unit_of_name("spin_frequency_u_hz"), unit_of_name("top")
    ('Hz', '1')
    """
    unit = split(name)[1]
    return unit.si if unit else "1"


def _meaning(name: str) -> str:
    """Return a column's name as people say it.

    >>> _meaning("spin_frequency_u_hz"), _meaning("used")
    ('standard uncertainty of spin frequency', 'used')
    """
    quantity = split(name)[0]
    words = quantity.removesuffix("_u").replace("_", " ")
    return f"standard uncertainty of {words}" if quantity.endswith("_u") else words


CONVENTIONS = "CF-1.8"
_SI = {one.si for one in UNITS}


@dataclass(frozen=True, eq=False)
class Variable:
    """A variable.

    Attributes:
        name: letters, digits and low lines.
        dimensions: one for each axis of the values; a variable of the name of a dimension holds its coordinates.
        values: of int8, int32, float32, float64, or texts.
        attributes: text, numbers or arrays.
    """

    name: str
    dimensions: tuple[str, ...]
    values: NDArray[Any]
    attributes: Mapping[str, Any]


def variables_of(contents: Contents) -> list[Variable]:
    """Return the variables of what is exported: a map's over its axes, else readings, traces and the result.

    Variables of all tables but the first begin with the table's name, those of a result with it and the analysis.
    """
    if contents.axes:
        keys = tuple(plain_name(axis.name) for axis in contents.axes)
        axes = [_variable(axis, key, (key,)) for axis, key in zip(contents.axes, keys, strict=True)]
        return [*axes, *(_variable(one, plain_name(one.name), keys) for one in contents.arrays)]
    taken: set[str] = set()
    found = [*_of_tables(contents.tables, taken), *_of_traces(contents.traces, taken)]
    return [*found, *(one for value in contents.values for one in _of_value(value, taken))]


def attributes_of(contents: Contents) -> dict[str, str]:
    """Return the attributes of the whole file; those that are not known are left out."""
    facts = {"Conventions": CONVENTIONS, "title": contents.title, **contents.about}
    return {name: text for name, text in facts.items() if text}


def plain_name(name: str) -> str:
    """Return a name of letters, digits and low lines (§2.3).

    >>> plain_name("start.spin_hz"), plain_name("trace-000001_CH1 (x)_v"), plain_name("1")
    ('start_spin_hz', 'trace_000001_CH1_x_v', 'n1')
    """
    plain = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    return plain if plain[:1].isalpha() else f"n{plain}"


def units_of(si: str) -> dict[str, str]:
    """Return the attribute `units`, which UDUNITS has to understand (§3.1); another name for other units.

    >>> units_of("T m"), units_of("Vpp"), units_of("(rad/s)^-1/2/s")
    ({'units': 'T m'}, {'units': 'V'}, {'unit': '(rad/s)^-1/2/s'})
    """
    # a power that is no whole number, a logarithm, a unit of a file's own
    if si not in _SI or si.startswith("(") or si == "dB":
        return {"unit": si}
    return {"units": {"Vpp": "V", "turns": "turn"}.get(si, si)}


def _of_tables(tables: Sequence[Table], taken: set[str]) -> Iterator[Variable]:
    """Yield the columns of the readings, the first table, and over their dimension what analyses say of each reading.

    A table whose rows are no readings has a dimension of its own.  A dimension is the table's first column where that
    increases, else the number of the row; of a table whose rows have names these, and the dimension has its name.
    """
    readings: dict[str, Column] = {}
    over, length = "", 0
    for table in tables:
        prefix = f"{table.name}_" if readings else ""
        rows = None if table.labelled else _rows_in(readings, table)
        names: dict[str, str] = {}
        for column in table.columns:
            given = readings.get(column.name) if rows is not None else None
            known = given is not None and _are_equal(given.values[rows], column.values)
            names[column.name] = plain_name(column.name if known else f"{prefix}{column.name}")
        if table.labelled:
            names[table.columns[0].name] = plain_name(table.name)
        columns = [column for column in table.columns if names[column.name] not in taken]
        taken |= {*names.values()}
        dimension = over
        if rows is None:
            dimension, length = names[table.columns[0].name], table.length
            if not (table.labelled or _increases(table.columns[0].values)):
                dimension = free_name(plain_name(f"{prefix}reading"), taken)
                yield _numbers(dimension, length, table.about)
        if not readings:
            over, readings = dimension, {column.name: column for column in columns}
        for column in columns:
            made = _variable(column, names[column.name], (dimension,), _beside(column.name, names, dimension))
            yield made if rows is None or len(rows) == length else _spread(made, rows, length)


def _beside(column: str, names: Mapping[str, str], dimension: str) -> dict[str, str]:
    """Return the attributes that name a column's places, the first column and the time, and its u."""
    places = dict.fromkeys(names[name] for name in (next(iter(names)), "time_s") if name in names)
    places.pop(dimension, None)
    is_place = names[column] in {dimension, *places}
    more = {"coordinates": "" if is_place else " ".join(places), "ancillary_variables": names.get(u_of(column))}
    return {name: text for name, text in more.items() if text}


def _rows_in(readings: Mapping[str, Column], table: Table) -> list[int] | None:
    """Return the number of the reading that each row belongs to; None: the rows are no readings.

    They have the readings' values of time or, without it, of the first common column.  The pulses of a record that a
    reading is made of lie before the reading's time.
    """
    columns = {column.name: column.values for column in table.columns}
    common = [name for name in columns if name in readings and "_u_" not in name and columns[name].dtype.kind != "U"]
    if not common:
        return None
    key = "time_s" if "time_s" in common else common[0]
    own, all_of_them = columns[key], readings[key].values
    if len(own) == len(all_of_them) or len(np.unique(all_of_them)) == len(all_of_them):
        left = enumerate(all_of_them)
        rows = [next((number for number, value in left if value == one), -1) for one in own]
        if -1 not in rows:
            return rows
    every = [*range(len(all_of_them))]
    return every if key == "time_s" and [*np.searchsorted(all_of_them, own)] == every else None


def _are_equal(one: NDArray[Any], other: NDArray[Any]) -> bool:
    return np.array_equal(one, other, equal_nan=one.dtype.kind == other.dtype.kind == "f")


def _increases(values: NDArray[Any]) -> bool:
    return values.dtype.kind == "f" and bool(np.isfinite(values).all() and (np.diff(values) > 0).all())


def _numbers(name: str, length: int, of: str) -> Variable:
    """Return the coordinates of a dimension that only counts."""
    return Variable(
        name, (name,), np.arange(1, length + 1, dtype=np.int32), {"long_name": f"number of {of}", "units": "1"}
    )


def _spread(variable: Variable, rows: list[int], length: int) -> Variable:
    """Return a variable over all readings: those that it has no row of are missing."""
    if variable.values.dtype.kind == "U":
        values = np.full(length, "", variable.values.dtype)
        values[rows] = variable.values
        return replace(variable, values=values)
    missing = {"_FillValue": variable.attributes.get("_FillValue", variable.values.dtype.type(-1))}
    values = np.full(length, missing["_FillValue"])
    values[rows] = variable.values
    attributes = {name: value for name, value in variable.attributes.items() if name != "dtype"}  # no bool is missing
    return replace(variable, values=values, attributes=attributes | missing)


def _of_traces(traces: Sequence[Table], taken: set[str]) -> Iterator[Variable]:
    """Yield the traces, a variable for each channel; channels that were sampled together share their dimensions."""
    channels: dict[str, list[tuple[NDArray[Any], Column]]] = {}
    for trace in traces:
        for column in trace.columns[1:]:
            channels.setdefault(column.name, []).append((trace.columns[0].values, column))
    together: dict[tuple[Any, ...], list[str]] = {}
    for name, records in channels.items():
        together.setdefault(tuple((len(times), times[0], times[-1]) for times, _ in records), []).append(name)
    for number, names in enumerate(together.values()):
        prefix, times = f"{names[0]}_" * (number > 0), [times for times, _ in channels[names[0]]]
        dimensions, place = yield from _of_samples(prefix, times, taken)
        for name in names:
            first, values = channels[name][0][1], [column.values for _, column in channels[name]]
            stacked = np.stack(values) if len(dimensions) > 1 else np.concatenate(values)
            yield _variable(
                replace(first, values=stacked), free_name(plain_name(name), taken), dimensions, {"coordinates": place}
            )


def _of_samples(
    prefix: str, times: Sequence[NDArray[Any]], taken: set[str]
) -> Generator[Variable, None, tuple[tuple[str, ...], str]]:
    """Yield what places the samples of some traces in time; return the dimensions, and the name of the times.

    Traces of one length and rate are over (trace, sample), others one behind the other: contiguous and ragged (§9.3).
    """

    def name_of(name: str) -> str:
        return free_name(plain_name(f"{prefix}{name}"), taken)

    trace, sample, since = name_of("trace"), name_of("sample"), times[0] - times[0][0]
    yield _numbers(trace, len(times), "the trace")
    start, about = name_of("trace_time_s"), {"long_name": "time of the trace's first sample", "units": "s"}
    yield Variable(start, (trace,), np.array([one[0] for one in times]), about)
    if all(one.shape == since.shape and np.allclose(one - one[0], since, rtol=1e-6, atol=0) for one in times):
        yield Variable(sample, (sample,), since, {"long_name": "time since the trace's first sample", "units": "s"})
        return (trace, sample), start
    yield _numbers(sample, sum(map(len, times)), "the sample")
    about = {"long_name": "number of samples of the trace", "units": "1", "sample_dimension": sample}
    yield Variable(name_of("trace_row_size"), (trace,), np.array([*map(len, times)], dtype=np.int32), about)
    place = name_of("sample_time_s")
    yield Variable(place, (sample,), np.concatenate(times), {"long_name": "time of the sample", "units": "s"})
    return (sample,), place


def _variable(
    column: Column, name: str, dimensions: tuple[str, ...], more: Mapping[str, str] | None = None
) -> Variable:
    comment = {"comment": column.source} if column.source else {}
    values, attributes = column.values, {"long_name": column.meaning or column.name, **comment, **(more or {})}
    if values.dtype.kind == "b":
        flags = {"flag_values": np.array([0, 1], dtype=np.int8), "flag_meanings": "no yes", "dtype": "bool"}  # xarray's
        return Variable(name, dimensions, values.astype(np.int8), attributes | flags)
    if values.dtype.kind == "U":
        return Variable(name, dimensions, values, attributes)
    if values.dtype.kind in "iu":
        return Variable(name, dimensions, values.astype(np.int32), attributes | units_of(column.unit))
    missing = {} if (name,) == dimensions else {"_FillValue": np.array(np.nan, dtype=values.dtype)}
    return Variable(name, dimensions, values, attributes | units_of(column.unit) | missing)


def _of_value(value: Value, taken: set[str]) -> Iterator[Variable]:
    """Yield a quantity of a result, and its standard uncertainty."""
    name = free_name(plain_name(f"result_{value.analysis}_{value.model}_{value.name}"), taken)
    words = f"{value.name.replace('_', ' ')}{f' of the {value.model} model' * bool(value.model)}"
    missing = {"_FillValue": np.array(np.nan)}
    more = {"ancillary_variables": f"{name}_u"} if value.u is not None else {}
    attributes = {"long_name": words, **units_of(value.unit), **missing}
    yield Variable(name, (), np.array(np.nan if value.value is None else value.value), attributes | more)
    if value.u is not None:
        of_u = attributes | {"long_name": f"standard uncertainty of {words}"}
        yield Variable(f"{name}_u", (), np.array(value.u), of_u)

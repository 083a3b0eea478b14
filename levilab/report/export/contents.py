"""What is exported of a run, a data file or a sweep: tables with units, the result, and where all of it comes from."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from importlib.metadata import version
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from analysis.errors import AnalysisError
from levilab.errors import DataError, unquote
from levilab.files import as_json
from levilab.pipelines.result import Place
from levilab.pipelines.suits import recall_suiting
from levilab.present.units import UNITS, split
from levilab.runs.find import RECORD, find_run, find_runs
from levilab.runs.run import EVENTS, READINGS, STATES, Run
from levilab.runs.waveforms import run_waveforms
from levilab.sweeps.plan import unit_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from levilab.formats.waveforms.waveform import Waveform
    from levilab.pipelines.document import Analysis
    from levilab.pipelines.result import Result
    from levilab.sweeps.store import Store

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
    """

    name: str
    columns: tuple[Column, ...]
    about: str


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
    place: Path | Store, tell: Callable[[str], None] = lambda _: None, given: Mapping[str, Any] | None = None
) -> Contents:
    """Return what is exported of a run folder, a data file or a sweep.

    Args:
        place: a path, or the store of a sweep.
        tell: called with the reason why there is no result.
        given: options of analyses by their names.

    Raises:
        DataError: there is nothing, or several runs.
    """
    if not isinstance(place, Path):
        return _of_sweep(place)
    path = find_run(place)
    if (path / "zarr.json").exists():
        from levilab.sweeps.store import Store  # with kernels of the simulator

        return _of_sweep(Store.open(path))
    if len(runs := [] if path.is_file() else find_runs(path)) > 1:
        raise _several(path, len(runs))
    run = Run.load(path) if (path / RECORD).exists() else None
    try:
        results = recall_suiting([path], given or {}, tell)
    except (DataError, AnalysisError) as error:
        if run is None:
            raise
        tell(f"without a result: {error}")
        results = []
    return contents_of_results(path, run, results)


def contents_of_results(path: Path, run: Run | None, results: Results) -> Contents:
    """Return what is exported of one input and of what analyses found of it.  Raises DataError for several inputs."""
    inputs = {source.path: source for _, found in results for source in found.sources}
    if len(inputs) > 1:
        raise _several(path, len(inputs))
    if inputs:  # also those of a folder that was searched
        path, run = next((path, source.run) for path, source in inputs.items())
    waveforms = run_waveforms(run) if run else _waveforms_of(results)
    tables = [*_readings(run), *map(_of_analysis, results), *map(_of_waveform, enumerate(waveforms, 1))]
    written = [analysis.result_of(found, Place(Path())) for analysis, found in results]
    files = {
        f"result{f'.{one.analysis}' * (k > 0)}.json": f"{as_json(one.as_dict())}\n".encode(errors="replace")
        for k, one in enumerate(written)
    }
    names = (RECORD, EVENTS) if run else ()
    files |= {name: (path / name).read_bytes() for name in names if (path / name).exists()}
    if not any(len(table.columns[0].values) for table in tables):
        raise DataError(f"{path}: holds no reading and no record, so nothing can be exported")
    return Contents(
        name=path.name if run else path.stem,
        title=f"levilab {run.record.experiment} run {path.name}" if run else f"readings of {path.name}",
        tables=tuple(table for table in tables if len(table.columns[0].values)),
        about=facts_of(run, path, results),
        values=tuple(value for one in written for value in _values(one)),
        files=files,
    )


def _several(path: Path, count: int) -> DataError:
    return DataError(f"{path}: holds {count} runs, and one is exported at a time: name one of them")


def _readings(run: Run | None) -> Iterator[Table]:
    """Yield the readings of a run, or its simulated states."""
    if run is None or not any((run.folder / name).exists() for name in (READINGS, STATES)):
        return
    described = {one["name"]: one for one in run.record.channels if "name" in one}
    frame = run.to_dataframe()
    columns = []
    for name in map(str, frame):
        unit, source = (described.get(name, {}).get(key, "") for key in ("unit", "source"))
        columns.append(Column(name, frame[name].to_numpy(), unit or unit_of_name(name), _meaning(name), source))
    yield Table("readings", tuple(columns), "a reading")


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
        facts |= {"source": f"the file {path.name}", "history": f"read by levilab {version('levilab')}"}
        return {name: text for name, text in facts.items() if text}
    record = run.record
    models = [str(about.get("identity", "")) for about in record.instruments.values()]
    facts |= {
        "source": record.synthetic_how or "synthetic" if record.synthetic else "; ".join(filter(None, models)),
        "synthetic": str(record.synthetic).lower(),
        "history": f"{record.started_utc or ''} {' '.join(record.command_line)}".strip(),
        "comment": record.note,
        "creator_name": record.group,
        "date_created": record.started_utc or "",
        "time_zero_utc": record.time_zero_utc or "",
        "run": record.as_json(),
    }
    return {name: text for name, text in facts.items() if text}


def _of_sweep(store: Store) -> Contents:
    from levilab.sweeps.observables import columns_of
    from levilab.sweeps.quantities import quantity_of
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
    return Contents(name, headline(summarise(store)), (table,), about, axes=grid, arrays=arrays)


def free_name(name: str, taken: set[str]) -> str:
    """Return the name, with a number behind it where it is taken; it is taken from then on.

    >>> taken = {"CH1_v"}
    >>> free_name("CH1_v", taken), free_name("CH1_v", taken), free_name("CH2_v", taken)
    ('CH1_v_2', 'CH1_v_3', 'CH2_v')
    """
    names = chain([name], (f"{name}_{number}" for number in count(2)))
    free = next(one for one in names if one not in taken)
    taken.add(free)
    return free


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
        values: of int8, int32, float32 or float64.
        attributes: text, numbers or arrays.
    """

    name: str
    dimensions: tuple[str, ...]
    values: NDArray[Any]
    attributes: Mapping[str, Any]


def variables_of(contents: Contents) -> list[Variable]:
    """Return the variables of what is exported: a map's over its axes, else the columns of its tables and the result.

    Variables of all tables but the first begin with the table's name, those of a result with it and the analysis.
    """
    if contents.axes:
        keys = tuple(plain_name(axis.name) for axis in contents.axes)
        axes = [_variable(axis, key, (key,)) for axis, key in zip(contents.axes, keys, strict=True)]
        return [*axes, *(_variable(one, plain_name(one.name), keys) for one in contents.arrays)]
    taken: set[str] = set()
    tables = enumerate(contents.tables)
    found = [one for k, table in tables for one in _of_table(table, f"{table.name}_" if k else "", taken)]
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


def _of_table(table: Table, prefix: str, taken: set[str]) -> Iterator[Variable]:
    """Yield the columns of a table over the first one where that increases, else over the number of the row."""
    first, names = table.columns[0], {column.name for column in table.columns}
    increases = first.values.dtype.kind == "f" and bool(np.isfinite(first.values).all())
    increases &= bool((np.diff(first.values) > 0).all())
    dimension = plain_name(f"{prefix}{first.name if increases else 'row'}")
    if not increases:
        rows = np.arange(1, len(first.values) + 1, dtype=np.int32)
        taken.add(dimension)
        yield Variable(dimension, (dimension,), rows, {"long_name": f"number of {table.about}", "units": "1"})
    for column in table.columns:
        more = {}
        if "time_s" in names and column.name != "time_s" and not increases:
            more["coordinates"] = plain_name(f"{prefix}time_s")
        quantity, unit = split(column.name)
        if unit and (of_u := f"{quantity}_u_{unit.ending}") in names:
            more["ancillary_variables"] = plain_name(f"{prefix}{of_u}")
        yield _variable(column, free_name(plain_name(f"{prefix}{column.name}"), taken), (dimension,), more)


def _variable(
    column: Column, name: str, dimensions: tuple[str, ...], more: Mapping[str, str] | None = None
) -> Variable:
    comment = {"comment": column.source} if column.source else {}
    values, attributes = column.values, {"long_name": column.meaning or column.name, **comment, **(more or {})}
    if values.dtype.kind == "b":
        flags = {"flag_values": np.array([0, 1], dtype=np.int8), "flag_meanings": "no yes"}
        return Variable(name, dimensions, values.astype(np.int8), attributes | flags)
    if values.dtype.kind in "US":
        words, numbers = np.unique(values, return_inverse=True)
        meanings = " ".join(re.sub(r"[^\w.+-]", "_", word) or "_" for word in words.tolist())
        flags = {"flag_values": np.arange(len(words), dtype=np.int32), "flag_meanings": meanings}
        return Variable(name, dimensions, numbers.astype(np.int32), attributes | flags)
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

"""How a file of readings is understood: its tables, what each column holds, and the questions that are left.

`understand` shows it as data, and `levilab.formats.table.read_table` reads by the same plan: what is shown is what is
analyzed.
"""

import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise, product
from pathlib import Path
from statistics import median

import numpy as np

from analysis.arrays import Array
from analysis.numbers import digits
from levilab.formats.beside import Part, parts_of
from levilab.formats.columns import (
    SHORTHANDS,
    Ambiguous,
    Choice,
    Column,
    Doubt,
    NoSuchColumn,
    NoTable,
    TableError,
    choose_columns,
    how_else,
    quote_names,
    shorten,
    total_beside_others,
)
from levilab.formats.dialect import UNVALUED
from levilab.formats.layout import Layout, sniff
from levilab.formats.rows import read_rows
from levilab.formats.texts import Text, locate, texts_of
from levilab.formats.titles import (
    CANONICAL,
    COMPANIONS,
    EXAMPLES,
    LISTED,
    LOGGED,
    LOGGED_FIELD,
    NAMES,
    NEED_UNITS,
    OTHER_SENSORS,
    OVER_TIME,
    QUANTITIES,
    SENSOR_LOGGER,
    TOTAL,
    Title,
    as_a_period,
    companion,
    dimension,
    is_total,
    motion_sensor,
    nearly_a_frequency,
    plain_name,
    plain_unit,
    read_title,
    unit_factor,
)
from levilab.formats.transposed import LIES, set_upright, tables_of
from levilab.texts.note import of_file
from levilab.texts.text import Sentences, text_of, verbatim
from levilab.texts.text import Text as Said

TITLES_WITHOUT_HEADER = ("time_s", "spin_frequency_hz", "spin_frequency_u_hz")
#: No such top floats far below or above these [Hz], linear theory says 21.65 to 80.6: the unit is in doubt there.
#: 20 to 60 turns a second are 126 to 377 rad/s: taken for turns, they lie above.
SLOWEST_SPIN_HZ, FASTEST_SPIN_HZ = 15.0, 100.0
#: Air takes 0.003 of a top's spin in a second [1/s]: times in minutes that pass for seconds make it 0.2, seconds that
#: pass for minutes 5e-5, times in ms 3e-6; a brake of eddy currents lies between.
FASTEST_LOSS_PER_S, USUAL_LOSS_PER_S, SLOWEST_LOSS_PER_S = 0.1, 0.003, 1e-4
#: A record whose spin falls by less than this part is no spin-down: in 6 s, a top that coasts loses twice as much.
LEAST_FALL = 0.01
#: Numbers without titles whose range is less than this part of their mean, and that do not grow, are no times.
_MOST_SPREAD = 0.25
#: Rank correlation with the number of the row above which spins are those of one top, and not limits of several.
LEAST_TREND = 0.9
#: What a title says of an uncertainty that is no standard one, or of a scatter that is not of the mean: f_std.
_NO_U = re.compile(r"(?i)2 ?(σ|sigma)|k ?= ?2|fehler|error|unsicherheit|uncertaint|stdev|stabw|(?<![a-z])st?d(?![a-z])")
#: Units in which the numbers of a file may be meant.
_UNITS, _UNITS_OF_TIME = ("Hz", "rpm", "rad/s", "°/s"), ("s", "ms", "min", "h", "μs")
#: Uncertainties of a spreadsheet, in % or without a unit, below which they may be parts of one, shown in %.
_LEAST_PERCENT = 0.02
_NO_TIMES_OF_PERIODS = (
    "no column is known to be time_s, at which the turns were timed: say `columns` = t=NAME; where each row is the "
    "next turn, keep the times of the turns alone in a file, titled as dt [ms]"
)
_NUMBERS_OF_READINGS = (
    "no column is known to be time_s; '{title:s}' has the numbers of the readings: say `columns` = "
    '"t={number} [2 s]", where 2 s lie from one reading to the next'
)
#: Columns of a spin-down.
SPIN = ("time_s", "spin_frequency_hz", "spin_frequency_u_hz")
_SPIN = "spin_frequency_hz"
#: First values that are shown.
_SHOWN = 5
#: Where a text has more numbers in a line than this factor times its lines, they are readings.
_IN_LINE = 8


# --- what is shown -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class UnderstoodColumn:
    """A column of a table.

    Attributes:
        index: in the file, from 0 on; `columns` counts from 1.
        title: in the file; empty where it has none.
        quantity: canonical name of its quantity; None: it is not used.
        unit: of its numbers as they are taken; empty where it is not used.
        factor: from those numbers to SI; of a period, to seconds a turn.
        inverse: whether it holds a period, or its uncertainty.
        values: its first fields, as they stand in the file.
    """

    index: int
    title: str
    quantity: str | None
    unit: str
    factor: float
    inverse: bool
    values: tuple[str, ...]


@dataclass(frozen=True)
class UnderstoodRun:
    """A table of readings in a file: the whole file, a sheet, a file of a zip, or one of several runs side by side.

    Attributes:
        path: what analyses take for it: the file, or the file and behind it, as if it were a folder, the run's name.
        name: of the run; empty where the file holds one alone.
        header_line: line (row of a sheet) of the titles, 0 where there are none.
        columns: all columns of the table but those of other runs.
        doubts: questions; those without whose answers nothing is read have a `problem`, too.
        warnings: what is read with a note.
        problem: why it is not read; empty if it is.
    """

    path: Path
    name: str
    header_line: int
    columns: tuple[UnderstoodColumn, ...]
    doubts: tuple[Doubt, ...] = ()
    warnings: tuple[str, ...] = ()
    problem: str = ""


@dataclass(frozen=True)
class Understanding:
    """How a file is understood.

    Attributes:
        path: as given.
        runs: its tables, in their order, also those that are not read; none where `problem` says why.
        problem: why nothing of it is read; empty if any run is.
    """

    path: Path
    runs: tuple[UnderstoodRun, ...]
    problem: str = ""


def understand(
    path: Path,
    *,
    columns: Mapping[str, str] | None = None,
    quantities: Collection[str] = SPIN,
    needed: Collection[str] = SPIN[:2],
    guess: bool = True,
) -> Understanding:
    """Return how a file of readings is understood.

    It reads the first rows of its tables, and all rows of those that leave the unit of the times open.

    It looks at the file with the same functions as `read_table`. A correction is another `columns`: the chosen
    answer's `Choice.columns`, or any {t, f, u, z, b or canonical name: title or 1-based number, a unit in brackets}.

    Args:
        path: the file, or a sheet or run in it: ``mess.xlsx/Tabelle2``.
        columns: as `read_table` takes it, for all runs.
        quantities: canonical columns that are wanted.
        needed: those without which a table is of another kind.
        guess: whether columns without titles or units are taken for what they look like.

    Returns:
        The understanding; a file that cannot be read has a `problem` and raises nothing.
    """
    request = Request(columns or {}, quantities, needed, guess)
    try:
        looks = list(_looks(path, request))
    except (TableError, OSError) as error:
        return Understanding(path, (), text_of(error))
    runs = tuple(_shown(look, request, alone=len(looks) == 1) for look in looks)
    problem = "" if any(not run.problem for run in runs) else next(run.problem for run in runs)
    return Understanding(path, runs, problem)


def _shown(look: "_Look", request: "Request", *, alone: bool) -> UnderstoodRun:
    """Return one look at a run as data."""
    plan, error, layout, part = look.plan, look.error, look.layout, look.part
    name = "" if alone else look.name
    if layout is None or part is None or isinstance(error, NoTable):
        return UnderstoodRun(look.path, name, 0, (), problem=text_of(error) if error else "")
    known = _known(look, layout, part, request)
    used = {column.index: column for column in (known.columns if known else ()) if not column.behind}
    seen = [_column(k, layout, used.get(k)) for k in range(layout.width) if part.has(k, layout.header)]
    seen = [column for column in seen if column.title or any(column.values)]
    doubts = [doubt for column in used.values() if known and (doubt := _unit_doubt(known, column))]
    asked = error.doubt if isinstance(error, NoSuchColumn | Ambiguous) else None
    doubts += [asked] if asked and asked not in doubts else []
    problem = text_of(error) if error else ""
    return UnderstoodRun(
        look.path, name, layout.header_line, tuple(seen), tuple(doubts), plan.warnings if plan else (), problem
    )


def _known(look: "_Look", layout: Layout, part: Part, request: "Request") -> "Plan | None":
    """Return how a table is read, or of one that is not read how its known columns would be."""
    if look.plan:
        return look.plan
    try:
        return _plan(look.path, look.text, layout, part, replace(request, needed=(), guess=False))
    except TableError:
        return None


def _column(k: int, layout: Layout, used: Column | None) -> UnderstoodColumn:
    title = layout.header[k] if k < len(layout.header) else ""
    values = tuple(row[k] if k < len(row) else "" for row in layout.sample[:_SHOWN])
    values = tuple(map(_shorten_number, values)) if layout.aligned else values
    if used is None:
        return UnderstoodColumn(k, title, None, "", 1.0, inverse=False, values=values)
    return UnderstoodColumn(k, title, used.name, used.unit, used.factor, inverse=used.inverse, values=values)


def _shorten_number(cell: str) -> str:
    """Return a cell of a spreadsheet with 6 digits at most, which holds 1981.9199999999998 where it shows 1981.92."""
    number = re.fullmatch(r"-?(\d+)\.\d+", cell)
    if not number:
        return cell
    places = max(6 - len(number[1].lstrip("0")), 0)
    return np.format_float_positional(float(cell), places, trim="-")


# --- questions about units -----------------------------------------------------------------------------


def is_possible_spin(frequency: float) -> bool:
    """Return whether a top floats at a spin [Hz]; else its unit is in doubt."""
    return SLOWEST_SPIN_HZ <= frequency <= FASTEST_SPIN_HZ


def possible_spins(number: float) -> dict[str, float]:
    """Return the spin [Hz] that a number of a file means in each unit in which a top can have it.

    >>> {unit: round(spin, 2) for unit, spin in possible_spins(238.97).items()}
    {'rad/s': 38.03}
    """
    spins = {unit: number * (unit_factor(unit, "frequency") or 1.0) for unit in _UNITS}
    return {unit: spin for unit, spin in spins.items() if is_possible_spin(spin)}


def is_possible_loss(loss: float) -> bool:
    """Return whether a top in air loses such a part of its spin in a second [1/s]; else its times are in doubt."""
    return SLOWEST_LOSS_PER_S <= loss <= FASTEST_LOSS_PER_S


def possible_times(loss: float) -> dict[str, float]:
    """Return the units [s] in which times may be meant between which a spin falls, by its loss while they grow by 1.

    >>> possible_times(3e-6), possible_times(0.18)
    ({'ms': 0.001}, {'min': 60})
    """
    units = {unit: unit_factor(unit, "time") or 1.0 for unit in _UNITS_OF_TIME}
    return {unit: factor for unit, factor in units.items() if is_possible_loss(loss / factor)}


def is_likely_unit(unit: str, loss: float) -> bool:
    """Return whether a spin is lost more usually in this unit of its times than in the others in which it can be lost.

    >>> is_likely_unit("s", 0.003), is_likely_unit("s", 0.06), is_likely_unit("min", 0.06)
    (True, False, True)
    """
    off = {one: abs(math.log(loss / factor / USUAL_LOSS_PER_S)) for one, factor in possible_times(loss).items()}
    return unit in off and off[unit] == min(off.values())


def trend_of(values: Array) -> float:
    """Return the rank correlation of values, shape (n,), with their order: -1 where each is below the one before."""
    ordered = np.sort(values)
    ranks = np.searchsorted(ordered, values) + np.searchsorted(ordered, values, "right")  # equal ones share one
    return float(np.corrcoef(np.arange(len(values)), ranks)[0, 1]) if ordered[0] < ordered[-1] else 0.0


def length_of(seconds: float) -> Said:
    """Return a length of time for people.

    >>> length_of(180), length_of(180e3)
    ('3 min', '50 h')
    """
    unit, size = next((one for one in (("h", 3600), ("min", 60)) if seconds >= 2 * one[1]), ("s", 1))
    return Said("{n:n} {unit:s}", digits(seconds / size, 3), unit)


def _numbers(layout: Layout, index: int) -> list[float]:
    """Return the numbers among the first fields of a column."""
    fields = [row[index] for row in layout.sample if index < len(row) and layout.dialect.kind(row[index]) == "number"]
    return [layout.dialect.value(field) for field in fields]


def _question(
    layout: Layout, index: int, time: Column | None, given: Mapping[str, str], what: str = "", *, always: bool = False
) -> Doubt | None:
    """Return the question in which unit a spin is, None where it can be in none or, if not always, in Hz alone."""
    numbers = _numbers(layout, index)
    total = _spins_of_total(layout, numbers, time)
    units = [TOTAL] if total else [*possible_spins(median(numbers))] if numbers else []
    per_reading = "" if total else _turns_per_reading(layout, numbers, time)
    counts = is_total("".join(layout.header[index : index + 1]))
    if units == ["Hz"] and not always and not (counts and per_reading):
        return None
    units = [*filter(None, [per_reading]), *units]
    spins = {unit: total or [number * (unit_factor(unit, "frequency") or 1.0) for number in numbers] for unit in units}
    if not spins and numbers[-1:] > numbers[:1]:  # the turns of a top that slows down last ever longer
        spins = _likely(_spins_of_periods(numbers))
    said = what or "no unit", _ranges(spins), ("rpm", "Hz")
    return _ask(layout, index, "f", {**_at(time), **given}, numbers=numbers, said=said) if spins else None


def _ranges(spins: Mapping[str, Sequence[float]]) -> dict[str, str]:
    """Return the text of each unit in which spins can be, with their first and last one in it [Hz]."""
    said = {TOTAL: "turns since the start ({first:.3g} to {last:.3g} Hz)"}
    usual = "{unit:s} ({first:.3g} to {last:.3g} Hz)"
    return {unit: Said(said.get(unit, usual), unit=unit, first=of[0], last=of[-1]) for unit, of in spins.items()}


def _at(time: Column | None) -> dict[str, str]:
    """Return the times in the option `columns`."""
    return {"t": str(time.index + 1)} if time else {}


def _ask(
    layout: Layout,
    index: int,
    key: str,
    given: Mapping[str, str],
    *,
    numbers: Sequence[float] | Array,
    said: tuple[str, Mapping[str, str], Sequence[str]],
) -> Doubt:
    """Return the question in which unit a column is.

    Args:
        layout: of its table.
        index: of the column.
        key: of its quantity in the option `columns`.
        given: that option for the other columns.
        numbers: in the column.
        said: what is known of the unit; the likely units with their texts; others to choose from.
    """
    what, likely, others = said
    answers = {**likely, **{unit: unit for unit in others if unit not in likely}}
    choices = tuple(Choice(text, {**given, key: f"{index + 1} [{unit}]"}) for unit, text in answers.items())
    title = "".join(layout.header[index : index + 1])
    *some, end = answers.values()
    ends = (digits(numbers[0], 4), digits(numbers[-1], 4))
    units = Said("{units} or {end}", (*some,), end) if some else end
    asked = "column {n}{title:s} has the values {first:n} to {last:n} and {what}: {units}?"
    text = Said(asked, index + 1, f" '{shorten(title)}'" if title else "", *ends, what, units)
    return Doubt("unit", text, index, choices, open=len(likely) > 1)


def _question_of_period(plan: "Plan", column: Column) -> Doubt | None:
    """Return the question in which unit the times of turns are: of ms and s that in which a top can have them."""
    numbers = [number for number in _numbers(plan.layout, column.index) if number > 0]
    spins = _spins_of_periods(numbers, column.factor)
    likely = _likely(spins)
    said = "no unit", _ranges(likely), () if likely else (*spins,)
    given = {**_at(plan.column("time_s")), **plan.request.columns}
    return _ask(plan.layout, column.index, "f", given, numbers=numbers, said=said) if numbers else None


def _spins_of_periods(numbers: Sequence[float], turns: float = 1.0) -> dict[str, list[float]]:
    """Return spins [Hz] by the unit in which numbers are the times of a turn, or of its share `turns`."""
    return {unit: [1 / (turns * size * n) for n in numbers if n > 0] for unit, size in (("ms", 1e-3), ("s", 1.0))}


def _likely(spins: Mapping[str, list[float]]) -> dict[str, list[float]]:
    return {unit: of for unit, of in spins.items() if of and is_possible_spin(median(of))}


def _spins_of_total(layout: Layout, numbers: Sequence[float], time: Column | None) -> list[float]:
    """Return the spins [Hz] between readings of whole numbers that only grow, as turns since the start do; else none.

    The numbers of the rows, 1, 2, 3, are no turns.
    """
    times = [time.factor * number for number in _numbers(layout, time.index)] if time else []
    if len(times) != len(numbers) or len(numbers) <= 2 or not all(number.is_integer() for number in numbers):
        return []
    pairs = zip(pairwise(numbers), pairwise(times), strict=True)
    steps = [(b - a, later - sooner) for (a, b), (sooner, later) in pairs]
    if not all(turns > 0 and wait > 0 for turns, wait in steps) or {turns for turns, _ in steps} == {1}:
        return []
    spins = [turns / wait for turns, wait in steps]
    return spins if is_possible_spin(median(spins)) else []


def _turns_per_reading(layout: Layout, numbers: Sequence[float], time: Column | None) -> str:
    """Return the unit of turns between two readings, where whole numbers at even times can be such; else nothing."""
    times = [time.factor * number for number in _numbers(layout, time.index)] if time else []
    steps = {round(after - before, 6) for before, after in pairwise(times)}
    if len(steps) != 1 or not all(number.is_integer() for number in numbers):
        return ""
    (step,) = steps
    return f"turns in {step:g} s" if step > 0 and is_possible_spin(median(numbers) / step) else ""


def _unanswered(path: Path, doubt: Doubt) -> NoSuchColumn:
    """Return the error for a spin whose unit is asked for."""
    return NoSuchColumn(path, '{question} say `columns` = "{example:s}"', doubt.text, doubt.answer, doubt=doubt)


def _must_be_sure(plan: "Plan") -> "Plan":
    """Return a plan; raise NoSuchColumn for a unit in doubt, TableError for two, or for a formula without its value."""
    doubts: list[Doubt] = []
    for column in plan.columns:
        plan.layout.must_have_one_unit(plan.path, column.index)
        doubts += filter(None, [None if column.written else _unit_doubt(plan, column)])
    if doubts:
        raise _unanswered(plan.path, _or_one_column(plan.layout, reduce(_both, doubts)))
    if UNVALUED.encode() in (plan.text.content or b""):
        read_rows(replace(plan.text, path=plan.path), plan.layout, plan.columns)
    return plan


def _or_one_column(layout: Layout, doubt: Doubt) -> Doubt:
    """Return a question about the unit of a spin that begins with the other reading of a row without a point."""
    if not layout.may_be_one_column:
        return doubt
    asked = (
        "is {row:s} a time and a spin, or one number with decimal comma? For one number write the title f [Hz] into a "
        "line above; for two:"
    )
    return replace(doubt, text=Said("{which} {unit}", Said(asked, ",".join(layout.sample[0])), doubt.text))


def _both(one: Doubt, other: Doubt) -> Doubt:
    """Return two questions about units as one, whose answers are those of both."""
    choices = []
    for first, second in product(one.choices, other.choices):
        said = [*first.columns.items(), *second.columns.items()]
        columns = dict(said) | {key: to for key, to in said if "[" in to}  # each has its own column's unit alone
        choices.append(Choice(Said("{answers}", (first.text, second.text)), columns))
    return Doubt("unit", Sentences(one.text, other.text), None, tuple(choices))


def _unit_doubt(plan: "Plan", column: Column) -> Doubt | None:
    """Return the question about a spin or a time that is taken in a unit in which no top has it."""
    what = Said("the unit {unit:s}" if column.written else "no unit, and would be in {unit:s}", unit=column.unit)
    if column.name == "time_s":
        return _doubt_about_times(plan, column, what)
    if column.name != _SPIN or column.is_total:
        return None
    if column.inverse:
        return None if column.written else _question_of_period(plan, column)
    numbers = _numbers(plan.layout, column.index)
    if not numbers or is_possible_spin(median(numbers) * column.factor):
        return None
    return _question(plan.layout, column.index, plan.column("time_s"), plan.request.columns, what=what)


def _doubt_about_times(plan: "Plan", column: Column, what: str) -> Doubt | None:
    """Return the question about times in which no top loses its spin, if the first rows and then all rows say so."""
    spin = plan.column(_SPIN)
    if not spin or spin.is_total or not {*plan.request.quantities} <= {*SPIN}:
        return None
    times, spins = (np.array(_numbers(plan.layout, one.index)) for one in (column, spin))
    if not len(times) or _is_in_unit(column, _loss(times, spins, inverse=spin.inverse)):
        return None
    with suppress(TableError):
        times, spins = read_rows(plan.text, plan.layout, (column, spin), skip_doubtful=True).values
    loss = _loss(times, spins, inverse=spin.inverse)
    units = possible_times(loss)
    if _is_in_unit(column, loss) or not units:
        return None
    times = times[np.isfinite(times)]
    lasts = float(times[-1] - times[0])
    fall, length = digits(100 - 100 * math.exp(-loss * lasts)), length_of(lasts * column.factor)
    what = Said("{unit}, in which the spin falls by {fall:n} % in {length}", what, fall, length)
    answers = {unit: Said("{unit:s} ({length})", unit, length_of(lasts * factor)) for unit, factor in units.items()}
    of_run = {"f": str(spin.index + 1)} if column.index in plan.own else {}
    given = {**plan.request.columns, **of_run}
    return _ask(plan.layout, column.index, "t", given, numbers=times, said=(what, answers, (column.unit,)))


def _is_in_unit(column: Column, loss: float) -> bool:
    """Return whether a loss is possible in a stated unit of the times, or more usual in an assumed one."""
    return is_possible_loss(loss / column.factor) if column.written else is_likely_unit(column.unit, loss)


def _loss(times: Array, spins: Array, *, inverse: bool) -> float:
    """Return the part of a top's spin that is lost while the times grow by 1; 0 where it does not clearly fall."""
    if len(times) != len(spins):
        return 0.0
    there = np.isfinite(times) & (spins > 0)
    times, spins = times[there], 1 / spins[there] if inverse else spins[there]
    if len(times) < 3 or times[-1] <= times[0] or trend_of(spins) > -LEAST_TREND:
        return 0.0
    fall = math.log(spins[0] / spins[-1])
    return fall / float(times[-1] - times[0]) if fall > LEAST_FALL else 0.0


def _by_values(
    path: Path, layout: Layout, meant: Sequence[str], chosen: Sequence[Column], request: "Request"
) -> tuple[Column | None, str]:
    """Return the only column left as the spin, where its values are those of a top in Hz, and a note.

    Raises:
        NoSuchColumn: with the question in which unit it is.
    """
    time = next((column for column in chosen if column.name == "time_s"), None)
    kinds = [name for name in request.quantities if name in QUANTITIES and dimension(name) == "frequency"]
    if kinds != [_SPIN] or time is None or any(column.name == _SPIN for column in chosen):
        return None, ""
    used = {column.index for column in chosen}
    stated = [k for k in range(len(meant)) if k not in used and _is_spin_of_some_kind(layout, meant[k], k)]
    if len(stated) == 1:  # beside f mean [Hz] a column without a unit is another quantity
        unit = read_title(meant[stated[0]]).unit or ""
        factor = unit_factor(unit, "frequency") or 1.0
        return Column(_SPIN, stated[0], layout.header[stated[0]], factor, unit=unit, written=True), ""
    left = [k for k in range(len(meant)) if k not in used and _could_be_spin(layout, meant, k)]
    if len(left) != 1:
        return None, ""
    (index,) = left
    if doubt := _question(layout, index, time, request.columns, always=_needs_unit(meant[index])):
        raise _unanswered(path, doubt)
    numbers = _numbers(layout, index)
    if "Hz" not in possible_spins(median(numbers) if numbers else 0.0):
        return None, ""
    label = layout.header[index]
    said = "{path:s}: column '{label:s}' has no unit and is taken as the spin in Hz"
    note = of_file("no unit", Said(said, shorten(str(path), 200), shorten(label)))
    return Column(_SPIN, index, label, 1.0, unit="Hz"), note


def _needs_unit(title: str) -> bool:
    """Return whether a name goes with turns a second as with turns a minute."""
    return plain_name(title) in NEED_UNITS


def _is_spin_of_some_kind(layout: Layout, text: str, index: int) -> bool:
    """Return whether a title begins with a name of the spin and ends in a unit in which the numbers are a top's."""
    title, numbers = read_title(text), _numbers(layout, index)
    factor = unit_factor(title.unit or "", "frequency")
    named = title.column is None and NAMES.get(plain_name(text).split("_")[0]) == _SPIN
    return named and factor is not None and bool(numbers) and is_possible_spin(factor * median(numbers))


def _could_be_spin(layout: Layout, meant: Sequence[str], index: int) -> bool:
    """Return whether a column of numbers has a title that says neither another quantity nor a unit."""
    text = meant[index]
    title = read_title(text)
    nearly = nearly_a_frequency(text) is not None and not _needs_unit(text)
    if not text or title.column is not None or title.unit is not None or nearly:
        return False
    numbers = _numbers(layout, index)
    counts = len(numbers) > 1 and all(b - a == 1 for a, b in pairwise(numbers))
    return 2 * len(numbers) > len(layout.sample) and not counts


# --- the plan by which a table is read -----------------------------------------------------------------


@dataclass(frozen=True)
class Request:
    """What is wanted of a table; see `understand`."""

    columns: Mapping[str, str]
    quantities: Collection[str]
    needed: Collection[str] = ()
    guess: bool = True


@dataclass(frozen=True)
class Plan:
    """How one table is read.

    Attributes:
        path: of the run, for messages and analyses.
        text: the lines.
        header: titles in the file, or numbers in their place.
        columns: those that are read, and for each quantity what may stand behind a ± in its fields.
        own: indices of the columns of this run alone; none where it stands by itself.
        request: what is wanted of it, with `columns` as `Choice.columns` has them.
        warnings: about guesses.
    """

    path: Path
    text: Text
    layout: Layout
    header: tuple[str, ...]
    columns: tuple[Column, ...]
    own: frozenset[int]
    request: Request
    warnings: tuple[str, ...]

    def column(self, name: str) -> Column | None:
        """Return the column of a quantity."""
        return next((column for column in self.columns if column.name == name), None)


@dataclass(frozen=True)
class _Look:
    """What was seen of one table: a plan, or an error."""

    path: Path
    name: str
    text: Text
    layout: Layout | None = None
    part: Part | None = None
    plan: Plan | None = None
    error: TableError | None = None


class SeveralRuns(TableError):
    """A file with several runs of which none is named.  `paths` are theirs."""

    def __init__(self, path: Path, paths: tuple[Path, ...], names: Iterable[str]) -> None:
        self.paths = paths
        one = shorten(str(paths[0]), 200)
        super().__init__(path, "holds several runs ({names:s}): name one, as {path:s}", quote_names(names), one)


def plan_of(path: Path, request: Request) -> Plan:
    """Return how the only table of a file, or the named one, is read.

    Raises:
        SeveralRuns: there are several.
        TableError: there is none, or it cannot be understood without doubt.
    """
    looks = list(_looks(path, request))
    plans = [look.plan for look in looks if look.plan]
    if len(plans) > 1:
        raise SeveralRuns(path, tuple(plan.path for plan in plans), (look.name for look in looks if look.plan))
    errors = [look.error for look in looks if look.error]
    if plans:
        (plan,) = plans
        wrong = [error for error in errors if not isinstance(error, NoTable | NoSuchColumn)]
        notes = [of_file("not read", Said("not read: {problem}", error)) for error in wrong]
        return replace(plan, warnings=(*plan.warnings, *notes))
    raise next((error for error in errors if not isinstance(error, NoTable)), errors[0])


def _looks(path: Path, request: Request) -> Iterator[_Look]:
    """Yield what is seen of each table at a path.  Raises TableError, OSError."""
    file, inside = locate(path)
    found = [look for text in texts_of(file) for look in _looks_at(file, text, request)]
    taken = [look for look in found if is_named(inside, look.name)]
    if not taken:
        names = quote_names(look.name for look in found if look.name) or "none"
        raise TableError(file, "has no sheet, file or run '{name:s}'; it has {names}", shorten(inside), names)
    yield from taken


def is_named(inside: str, name: str) -> bool:
    """Return whether a name in a file, such as "Tabelle1/Messung 2", is that of a run: all or one end of it."""
    return not inside or f"/{name}/".startswith(f"/{inside}/") or f"/{name}/".endswith(f"/{inside}/")


def _looks_at(file: Path, text: Text, request: Request) -> Iterator[_Look]:
    """Yield what is seen of each run in a text."""
    name = text.path.relative_to(file).as_posix() if text.path != file else ""
    text = set_upright(text)
    try:
        layout = sniff(text)
        tables, titles = tables_of(text, layout), layout.titles()
    except TableError as error:
        yield _Look(text.path, name, text, error=error)
        return
    if tuple(titles) == SENSOR_LOGGER:
        titles = LOGGED_FIELD if text.path.stem.casefold().startswith("magnetometer") else LOGGED
    if len(tables) > 1:
        yield from (look for table in tables for look in _looks_at(file, table, request))
        return
    one_alone = set(request.columns) - {"t", "time_s"} or not layout.header
    parts = [Part("", titles)] if one_alone else parts_of(titles, layout.above, request.quantities)
    for part in parts:
        path = text.path / part.name if part.name else text.path
        here = "/".join(filter(None, (name, part.name)))
        try:
            plan = _must_be_sure(_plan(path, text, layout, part, request))
        except TableError as error:
            yield _Look(path, here, text, layout, part, error=error)
        else:
            yield _Look(path, here, text, layout, part, plan)


def _plan(path: Path, text: Text, layout: Layout, part: Part, request: Request) -> Plan:
    """Return how one run in a text is read.  Raises TableError."""
    quantities, needed = request.quantities, request.needed
    header, wanted, warnings = _titles(path, layout, request.columns, guess=request.guess)
    if text.lies:
        warnings.append(of_file("lies", Said("{path:s}: {what}", shorten(str(path), 200), LIES)))
    meant, request = part.titles, replace(request, columns={_key(name): title for name, title in wanted.items()})
    if not {"t", "time_s"} & {*wanted}:
        _must_be_one_time(path, layout, meant)
    chosen, doubts = choose_columns(path, header, wanted, quantities, meant=meant)
    if request.guess and _SPIN in quantities:
        spin, note = _by_values(path, layout, meant, chosen, request)
        chosen, warnings = (*chosen, *([spin] if spin else [])), [*warnings, *([note] if note else [])]
    if not chosen:
        examples = [EXAMPLES[name] for name in quantities if name in EXAMPLES]
        known = ", ".join([*(name for name in quantities if name in LISTED and name not in COMPANIONS), *examples])
        wanted_names = needed or [name for name in SHORTHANDS.values() if name in quantities][:2]
        numbers = any(_numbers(layout, k) for k in range(layout.width))
        if not numbers and locate(path)[1]:
            raise NoTable(path, "is a sheet without numbers")
        among = "no title is known ({known:s} …) among {titles:s}: say `columns` = {columns:s}"
        unknown = Said(among, known, quote_names(header), _in_one_word(f"{_key(name)}=NAME" for name in wanted_names))
        raise NoSuchColumn(
            path,
            unknown if numbers else Said("there are no numbers in it, and {text}", text=unknown),
            line=layout.header_line or layout.first_line,
            doubt=_which_columns(layout, wanted_names),
        )
    for name in needed:
        if name not in {column.name for column in chosen}:
            raise _of_turns(path, name, layout, chosen, request) or no_column(
                path, name, meant, _which_columns(layout, [name])
            )
    warnings += _notes_on_u(path, layout, chosen, wanted=companion(_SPIN) in quantities)
    chosen = tuple(sorted(chosen, key=lambda column: CANONICAL.index(column.name)))
    behind = [replace(one, name=companion(one.name), behind=True) for one in chosen if one.name in QUANTITIES]
    return Plan(path, text, layout, header, (*chosen, *behind), part.own, request, (*warnings, *doubts))


def _notes_on_u(path: Path, layout: Layout, chosen: Sequence[Column], *, wanted: bool) -> list[str]:
    """Return notes on columns of other uncertainties, where standard ones are missing, and on cells in %."""
    name = shorten(str(path), 200)
    half = (
        "{path:s}: column '{title:s}' is not read: u is half of 2σ or of U (k = 2), a greatest error divided by √3, "
        "of a mean of n readings their scatter divided by √n: write it in a column u [Hz]"
    )
    missing = wanted and {_SPIN, companion(_SPIN)} & {one.name for one in chosen} == {_SPIN}
    titles = zip(layout.header, layout.titles(), strict=False) if missing else ()
    expanded = [title for title, full in titles if _NO_U.search(title) and _may_be_of_spin(read_title(full))]
    notes: list[str] = [of_file("expanded u", Said(half, name, shorten(title))) for title in expanded]
    said = "{path:s}: column '{title:s}' holds {number:g}, taken in {unit:s}; if it shows {shown:g} %, write u in Hz"
    for column in (one for one in chosen if layout.aligned and one.name == companion(_SPIN)):
        bare = column.unit == "%" or read_title(column.label).unit is None
        number = max(_numbers(layout, column.index), default=1.0)
        if bare and number < _LEAST_PERCENT:
            title, unit = shorten(column.label), column.unit or "Hz"
            text = Said(said, path=name, title=title, number=number, unit=unit, shown=100 * number)
            notes.append(of_file("percent", text))
    return notes


def _may_be_of_spin(title: Title) -> bool:
    """Return whether a title that is that of no quantity could be one of an uncertainty of the spin."""
    unit = title.unit or "%"
    return title.column is None and (unit == "%" or "σ" in unit or unit_factor(unit, "frequency") is not None)


def _must_be_one_time(path: Path, layout: Layout, meant: Sequence[str]) -> None:
    """Raise TableError for times in two columns: whole minutes, and seconds below 60 beside them."""
    titles = [Title("time_s", text) if unit_factor(text, "time") else read_title(text) for text in meant]
    times = [unit_factor(one.unit or "", "time") if one.column == "time_s" else None for one in titles]
    for minutes in (k for k in range(len(times)) if times[k : k + 2] == [60, 1] and not as_a_period(meant[k + 1])):
        whole, seconds = _numbers(layout, minutes), _numbers(layout, minutes + 1)
        if any(whole) and all(n == int(n) for n in whole) and seconds and max(seconds) < 60:
            what = "its times stand in two columns, {names:s}: write them as one, in seconds or as 1:20"
            names = quote_names(meant[minutes : minutes + 2])
            raise TableError(path, what, names, line=layout.header_line or layout.first_line)


def _which_columns(layout: Layout, names: Collection[str]) -> Doubt | None:
    """Return the question which columns hold the quantities of these canonical names; None where none can."""
    title = dict(enumerate(layout.header))
    numeric = [k for k in range(layout.width) if _numbers(layout, k) and not _is_of_another(title.get(k, ""), names)]
    if not numeric:
        return None
    shown = {k: verbatim(shorten(title[k])) if k in title else Said("column {number}", k + 1) for k in numeric}
    choices = tuple(
        Choice(Said("{key:s}: {title}", _key(name), shown[k]), {_key(name): str(k + 1)})
        for name in names
        for k in numeric
    )
    if _SPIN in names:
        choices += tuple(
            Choice(Said("{title:s}, as turns since the start", title.get(k, str(k + 1))), {"f": f"{k + 1} [turns]"})
            for k in numeric
            if len(counted := _numbers(layout, k)) > 2 and {b - a for a, b in pairwise(counted)} == {1}
        )
    asked, *others = map(_in_words, names)
    for one in others:
        asked = Said("{first} and which {second}", first=asked, second=one)
    return Doubt("titles", Said("which column is {quantity}?", quantity=asked), None, choices)


def _is_of_another(title: str, names: Collection[str]) -> bool:
    """Return whether a title says another quantity than these."""
    column = read_title(title).column
    return column not in names if column else _SPIN in names and _is_field(title)


def _is_field(title: str) -> bool:
    """Return whether a title's unit is that of a magnetic field."""
    return unit_factor(read_title(title).unit or "", "flux density") is not None


def _in_words(name: str) -> str:
    """Return a canonical name for people: the time, the spin frequency."""
    return Said("the {quantity}", quantity=name.rpartition("_")[0].replace("_", " "))


def _in_one_word(columns: Iterable[str]) -> str:
    """Return columns as any shell takes them: PowerShell would split them at a comma."""
    text = ",".join(columns)
    return f'"{text}"' if "," in text else text


def _key(name: str) -> str:
    """Return the key of a canonical column in the option `columns`."""
    return next((short for short, long in SHORTHANDS.items() if long == name), name)


def _of_turns(path: Path, name: str, layout: Layout, chosen: Sequence[Column], request: Request) -> NoSuchColumn | None:
    """Return the error for a table of turns that were timed without their own times, or were counted without a spin.

    Counted since the beginning, they only grow.  A column of whole numbers, one after another, counts the readings.
    """
    if name == "time_s" and any(column.inverse for column in chosen):
        return NoSuchColumn(path, _NO_TIMES_OF_PERIODS, doubt=_which_columns(layout, [name]))
    counts = (k for k in range(len(layout.header)) if set(np.diff(_numbers(layout, k))) == {1})
    if name == "time_s" and (counted := next(counts, None)) is not None:
        said = Said(_NUMBERS_OF_READINGS, shorten(layout.header[counted]), counted + 1)
        return NoSuchColumn(path, said, doubt=_which_columns(layout, [name]))
    time = next((column for column in chosen if column.name == "time_s"), None)
    for k, title in enumerate(layout.header if name == _SPIN else ()):
        if nearly_a_frequency(title) == OVER_TIME and _spins_of_total(layout, _numbers(layout, k), time):
            doubt = _question(layout, k, time, request.columns, always=True)
            return _unanswered(path, doubt) if doubt else None
    return None


def no_column(path: Path, name: str, header: Sequence[str], doubt: Doubt | None = None) -> NoSuchColumn:
    """Return the error for a quantity that no column is known to hold."""
    said = "no column is known to be {name:s}; it has {titles:s}: say `columns` = {key:s}=NAME"
    text = Said(said, name, quote_names(header), _key(name))
    nearly = next((title for title in header if nearly_a_frequency(title)), None) if "frequency" in name else None
    foreign = next((title for title in header if read_title(title).column == name), None)
    if foreign and dimension(name) == "frequency" and is_total(read_title(foreign).unit or ""):
        text = total_beside_others(foreign)
    elif foreign and ((unit := read_title(foreign).unit) is None or unit_factor(unit, dimension(name))):
        said = "column '{title:s}' is {name:s} by its title, and `columns` takes it for another quantity: correct that"
        text = Said(said, shorten(foreign), name)
    elif foreign:
        unit = shorten(unit or "")
        said = "column '{title:s}' is in {unit:s}, which is no unit of {kind}: {do}"
        text = Said(said, shorten(foreign), unit, dimension(name), how_else(foreign, name))
        asks = "'{title:s}' is in {unit:s}, which is no unit of {kind}: {question}"
        asked = Said(asks, shorten(foreign), unit, dimension(name), doubt.text) if doubt else ""
        doubt = replace(doubt, text=asked) if doubt else None
    elif tuple(header) == LOGGED:
        said = "Sensor Logger names its files by the sensor: are x, y and z of {name:s} those of the magnetometer?"
        text, columns = Said(said, path.name), {"t": "2", "bx": "5 [μT]", "by": "4 [μT]", "bz": "3 [μT]"}
        doubt = Doubt("column", text, None, (Choice(Said("the magnetometer, in μT"), columns),))
    elif nearly:
        said = "no column is known to be {name:s}; '{title:s}' could become one: {do}"
        text = Said(said, name, shorten(nearly), how_else(nearly, name))
    else:
        sensors = {title: OTHER_SENSORS.get(plain_unit(read_title(title).unit or "")) for title in header}
        title, sensor = motion_sensor(header) or next((pair for pair in sensors.items() if pair[1]), ("", None))
        field = next((one for one in header if name == _SPIN and _is_field(one)), None)
        if field:
            said = "'{title:s}' is a magnetic field, no spin frequency: levilab analyze spin FILE reads it"
            text = Said(said, shorten(field))
        elif sensor:
            said = (
                "'{title:s}' is of {sensor}, which shows no turns: record with the magnetometer, or name its sheet or "
                "file; no column is known to be {name:s}"
            )
            text = Said(said, shorten(title), sensor, name)
            doubt = None  # no column is likely
    return NoSuchColumn(path, text, doubt=doubt)


def _with_time(wanted: Mapping[str, str], filled: Sequence[str]) -> Mapping[str, str]:
    """Return what is taken for what, of two columns without titles the other one as the time."""
    left = [number for number in filled if number not in {title.split(" ")[0] for title in wanted.values()}]
    alone = len(wanted) == 1 and {*wanted} <= {"f", _SPIN} and len(filled) == 2
    return {"t": left[0], **wanted} if alone and left else wanted


def _is_numbered(layout: Layout, filled: Sequence[str]) -> bool:
    """Return whether three columns have the numbers of the rows, times, which grow, and spins."""
    if len(filled) != len(TITLES_WITHOUT_HEADER):
        return False
    rows, times, spins = (_numbers(layout, int(number) - 1) for number in filled)
    counts, grows = {after - before for before, after in pairwise(rows)} == {1}, all(a < b for a, b in pairwise(times))
    return counts and grows and is_possible_spin(median(spins or [0.0]))


def _spin_comes_first(layout: Layout, filled: Sequence[str]) -> bool:
    """Return whether the first column falls beside a second that rises from where no top spins: times."""
    first, second = ([*pairwise(_numbers(layout, int(number) - 1))] for number in [*filled, "1", "1"][:2])
    falls, rises = (all(before >= after for before, after in first), all(before < after for before, after in second))
    return bool(first and second) and falls and rises and second[0][0] < SLOWEST_SPIN_HZ


def _by_units(layout: Layout, numbers: Sequence[str]) -> dict[str, str]:
    """Return name → number of the columns whose cells have a unit of time, and of frequency, where one has each."""
    found = {
        name: [n for n, unit in zip(numbers, layout.units, strict=False) if unit_factor(unit, dimension(name))]
        for name in TITLES_WITHOUT_HEADER[:2]
    }
    return {name: of[0] for name, of in found.items()} if all(len(of) == 1 for of in found.values()) else {}


def _titles(
    path: Path, layout: Layout, wanted: Mapping[str, str], *, guess: bool
) -> tuple[tuple[str, ...], Mapping[str, str], list[str]]:
    """Return the file's titles, or numbers in their place; what to take for what; a warning where that is a guess."""
    if layout.header:
        return layout.header, wanted, []
    numbers = tuple(str(n + 1) for n in range(layout.width))
    filled = [n for n in numbers if any(row[int(n) - 1 : int(n)] not in {(), ("",)} for row in layout.sample)]
    if wanted:
        return numbers, _with_time(wanted, filled), []
    if layout.header_line:
        what = 'is no header for the {width} columns below: correct it, or say `columns` = "t=1,f=2"'
        raise NoSuchColumn(path, what, layout.width, line=layout.header_line)
    taken = _by_units(layout, numbers)
    if len(layout.sample) <= len(filled) // _IN_LINE:
        what = "all readings stand in one line: write a line for each, its time and its spin"
        raise NoSuchColumn(path, what, line=layout.first_line)
    if (len(filled) > len(TITLES_WITHOUT_HEADER) and not taken) or not guess:
        what = '{width} columns and no header; add one, or say `columns` = "t=1,f=2"'
        raise NoSuchColumn(path, what, layout.width, line=layout.first_line)
    first = np.array(_numbers(layout, 0))
    alike = len(first) > 2 and np.ptp(first) < _MOST_SPREAD * first.mean() and abs(trend_of(first)) < LEAST_TREND
    if layout.may_be_one_column and alike and is_possible_spin(median(first)):
        what = "'{row:s}' is one number with decimal comma, or a time that does not increase; title it f [Hz], or t,f"
        raise NoSuchColumn(path, what, ",".join(layout.sample[0]), line=layout.first_line)
    time, spin, u = TITLES_WITHOUT_HEADER
    filled = filled[_is_numbered(layout, filled) :]
    names = (spin, time, u) if _spin_comes_first(layout, filled) else TITLES_WITHOUT_HEADER
    taken = taken or dict(zip(names, filled, strict=False))
    said = "{path:s}: no header; the columns are taken as {names:s}"
    return numbers, taken, [of_file("no header", Said(said, shorten(str(path), 200), ", ".join(taken)))]

"""An analysis: one row says how its inputs are read and analyzed, its result.json, and what people are shown."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, Generic, Literal, TypeAlias, get_type_hints

from pydantic import BeforeValidator, Field, PlainSerializer, create_model

from analysis.errors import AnalysisError
from levilab.errors import DataError, UsageError, unquote
from levilab.files import finite
from levilab.formats.device import Device
from levilab.pipelines.analyzed import FOR_THIS_PAGE, NOW, A, Origin
from levilab.pipelines.budget import budgets_of_result
from levilab.pipelines.inputs.correction import read_correction
from levilab.pipelines.inputs.search import Found, collect
from levilab.pipelines.inputs.source import Needs, Source
from levilab.pipelines.inputs.unread import NoneUsable, Skipped, skip
from levilab.pipelines.options import OF_FILES, InputOptions, options_of
from levilab.pipelines.result import (
    AGAIN,
    SCHEMA,
    Archive,
    Dump,
    Earlier,
    Part,
    Place,
    Result,
    RunPart,
    place_of,
    relative,
)
from levilab.present.units import name_with_unit, split
from levilab.runs.find import find_run
from levilab.software import software_versions
from levilab.texts.text import Sentences, Text, as_tables

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np

    from analysis.budget import Budget
    from analysis.uncertainty import Estimate
    from levilab.pipelines.part import ReportPart
    from levilab.pipelines.row import Column
    from levilab.present.document.blocks import Block
    from levilab.present.style import Figure
    from levilab.present.tables import Table

    #: An input, what is found of it, where that comes from.
    Done: TypeAlias = tuple[Source[Any], Any, Origin[Any]]

#: The data file's own names of columns: an empty table where none were given.
Columns = Annotated[
    dict[str, str] | None, BeforeValidator(lambda names: names or None), PlainSerializer(lambda names: names or {})
]


def settings_model(options: type[InputOptions]) -> type[Part]:
    """Return the model of how inputs were analyzed: the options by their names, which in the file end in the unit."""
    types = get_type_hints(options, localns={"Device": Device, "Mapping": Mapping}) | {"columns": Columns}
    given: dict[str, Any] = {}
    for name, option in options_of(options).items():
        typed = name if split(name)[1] else name_with_unit(name, option.unit)
        given[name] = types[name], Field(default=getattr(options, name), alias=typed, gt=option.above)
    return create_model("Settings", __base__=Part, **given)


def refuse_columns_of_runs(found: Found[Any], options: InputOptions) -> None:
    """Raise UsageError where names of columns are given, and all inputs are runs, whose columns are known."""
    runs = [source.run for source in found.sources if source.run]
    if options.columns and len(runs) == len(found.sources):
        names = ", ".join(str(channel["name"]) for channel in runs[0].record.channels if "name" in channel)
        known = f"{runs[0].folder} is a run, whose columns are known{f' ({names})' * bool(names)}"
        raise UsageError("columns", Text("goes with a data file, and {known}: leave it out", known=known))


def whole_u(_run: Any, _model: str, _name: str, u: float) -> float:
    """Return the shared part of a quantity's u where it is the whole of it."""
    return u


@dataclass(frozen=True, kw_only=True)
class Analysis(Needs[Any], Generic[A]):
    """One analysis: what it needs of its inputs, how it is carried out, its result.json, and what people are shown.

    Attributes:
        kind: what was found, an Analyzed.
        options: of the analysis.
        fit: one input; raises AnalysisError, or DataError that names the file.
        combine: all inputs together.
        mixed: what is wrong with numbers over real and synthetic inputs; empty where there are none.
        of_files: names of options that say nothing about runs, whose columns are known.
        skips: whether of several inputs one that cannot be used is skipped with a warning.
        budget_of_run: what the uncertainties of one input's numbers are made of.
        budget_of_all: those of all inputs together, from what was found of each; of one input they are its own.
        set_beside: puts a path that goes beside the inputs into the options.
        finding, combination: types of what is found of one input and of all together, frozen dataclasses; None: as the
            base has it.
        base: of the model of result.json, with the entries that no other analysis has.
        entries: its own entries at the top of result.json, for people: `values`, `models`; None: those of the only
            input, and of several none.
        run_entries: likewise those of one input.
        check: raises ValueError for what was read of one input and cannot have been found.
        outdated: why this version cannot use what was read of one input, so that it is analyzed again; empty: it can.
        renumber: what was found of all together, for inputs in another order: the number of each in the result.
        tables: for the terminal.
        part: of a report.
        columns: the readings of each input as columns of a table, with residuals.
        row: the columns that an input has as one row of a table of many.
        symbols: of its quantities, for people.
        files: tables for other analyses that are saved with the result, by their names.
        compared: quantities that groups of a class compare; empty: the constants of the law, or where there is none
            the first quantities.
        apart: why groups have no common value of these, and so no mean; empty: they have.
        shared_u: the part of a quantity's u that is the same for all inputs of one top or base, which no mean makes
            smaller: of what is found of an input, the model's name, the quantity's name and its u.
        common: why this part is there, for people; empty: the models say it.
        curve: the fitted curve of an input, by its number and the model's name, as a function of arrays in SI; None:
            there is none.
        curve_u: its standard uncertainty, likewise.
    """

    kind: type[A]
    options: type[InputOptions]
    fit: Callable[[Source[Any], Any], Any]
    combine: Callable[[Sequence[Source[Any]], Sequence[Any], Any], Any] = lambda *_: None
    mixed: str = ""
    of_files: frozenset[str] = frozenset(OF_FILES)
    skips: bool = False
    budget_of_run: Callable[[Source[Any], Any, Any], tuple[Budget, ...]] = lambda *_: ()
    budget_of_all: Callable[[A], tuple[Budget, ...]] = lambda _: ()
    set_beside: Callable[[Sequence[Path], Any], tuple[Sequence[Path], Any]] = lambda paths, options: (paths, options)
    finding: Any
    combination: Any = None
    base: type[Result] = Result
    entries: Callable[[A], dict[str, Any]] | None = None
    run_entries: Callable[[Any], dict[str, Any]]
    check: Callable[[Any], None] = lambda _: None
    outdated: Callable[[Any], str] = lambda _: ""
    renumber: Callable[[Any, Sequence[int]], Any] = lambda combined, _: combined
    tables: Callable[[A], tuple[Table, ...]]
    part: Callable[[A], ReportPart]
    columns: Callable[[A], Iterable[Mapping[str, np.ndarray]]]
    row: tuple[Column, ...] = ()
    symbols: Mapping[str, str] = field(default_factory=dict)
    files: Callable[[A], Mapping[str, str]] = lambda _: {}
    compared: tuple[str, ...] = ()
    apart: Callable[[A], str] = lambda _: ""
    shared_u: Callable[[Any, str, str, float], float] = lambda *_: 0.0
    common: str = ""
    curve: Callable[[A, int, str], Callable[[np.ndarray], np.ndarray]] | None = None
    curve_u: Callable[[A, int, str], Callable[[np.ndarray], np.ndarray]] | None = None

    def options_from(self, given: Mapping[str, Any]) -> InputOptions:
        """Choose its options out of those that were given, some of which belong to other analyses."""
        own = {one.name for one in fields(self.options)}
        return self.options(**{name: value for name, value in given.items() if name in own})

    # --- analyzing ---

    def analyze(self, paths: Sequence[Path], options: Any = None) -> A:
        """Analyze the inputs at the paths.

        Args:
            paths: of the inputs.
            options: of the analysis; None: all at their defaults.

        Raises:
            DataError: one of them cannot be used; it names the file.
            UsageError: names of columns are given, and all inputs are runs.
        """
        paths, options = self.set_beside([find_run(path) for path in paths], options or self.options())
        found = collect(paths, self, lambda _: options)
        refuse_columns_of_runs(found, options)
        return self.analyze_found(paths, found, options)

    def analyze_found(self, paths: Sequence[Path], found: Found[Any], options: Any) -> A:
        """Do the same for inputs that were found already."""

        def one(source: Source[Any]) -> Done:
            own = replace(options, **source.kept)
            return source, self.find_in(source, own), Origin(own, NOW)

        return self.gather(paths, found, options, one)

    def find_in(self, source: Source[Any], options: Any) -> Any:
        """Return what is found of one input.  Raises DataError, which names the file."""
        try:
            return self.fit(source, options)
        except AnalysisError as error:
            raise DataError("{path:s}: {error}", path=source.data, error=error) from error

    def gather(
        self,
        paths: Sequence[Path],
        found: Found[Any],
        options: Any,
        one: Callable[[Source[Any]], Done],
        recall: Callable[[Sequence[Any]], Any] | None = None,
        *,
        skips: bool = False,
    ) -> A:
        """Return what is found of all inputs, each by itself and together.  Raises DataError.

        Args:
            paths: run folders, data files, folders that were searched.
            found: what lies there.
            options: as they were given.
            one: from one input to what is found of it.
            recall: from what is found of each to what was found of all together; None where it is not known.
            skips: whether of several inputs one that cannot be used is skipped, also where the analysis skips none.
        """
        done, skipped = self._each(found.sources, one, skips=skips or self.skips)
        sources, runs, origins = (list(column) for column in zip(*done, strict=True))
        used = origins[0].options if all(origin.options == origins[0].options for origin in origins) else options
        for k, (source, run, origin) in enumerate(zip(sources, runs, origins, strict=True)):
            if origin.budget is None:
                origins[k] = replace(origin, budget=self.budget_of_run(source, run, origin.options))
        found_of_all = self.kind(
            sources=tuple(sources),
            runs=tuple(runs),
            combined=recall(runs) if recall else self.combine(sources, runs, used),
            options=used,
            place=place_of(paths, sources),
            warnings=(*found.warnings, *self.about_inputs(sources, used)),
            skipped=(*found.skipped, *skipped),
            origins=tuple(origins),
        )
        of_all = (origins[0].budget or ()) if len(origins) == 1 else self.budget_of_all(found_of_all)
        return replace(found_of_all, budget=of_all)

    def _each(
        self, sources: Sequence[Source[Any]], one: Callable[[Source[Any]], Done], *, skips: bool
    ) -> tuple[list[Done], list[Skipped]]:
        """Return what is found of each input, and those that are skipped.  Raises DataError."""
        if not skips or len(sources) == 1:
            return [one(source) for source in sources], []
        done: list[Done] = []
        skipped: list[Skipped] = []
        for source in sources:
            try:
                done.append(one(source))
            except DataError as error:
                skipped.append(skip(error, source.path))
        if not done:
            raise NoneUsable(Sentences(*(one.reason for one in skipped), between="; "), skipped)
        return done, skipped

    def about_inputs(self, sources: Sequence[Source[Any]], options: Any) -> Iterable[str]:
        """Return what to know of the inputs before using the numbers."""
        synthetic = sum(source.synthetic for source in sources)
        if self.mixed and 0 < synthetic < len(sources):
            said = "{some} of {n} inputs are SYNTHETIC, the others are not known to be: {mixed}"
            yield Text(said, some=synthetic, n=len(sources), mixed=self.mixed)
        reading_u = getattr(options, "reading_u", None)
        given = [source.name for source in sources if getattr(source.readings, "u", None) is not None]
        if reading_u is not None and given:
            said = "the given u of a reading, {u:g} Hz, replaces the uncertainties in {names:s}"
            yield Text(said, u=reading_u, names=tuple(given))
        if options.columns and all(source.run for source in sources):
            yield "names of columns were given, but none of the inputs is a data file"

    # --- result.json ---

    @cached_property
    def model(self) -> type[Result]:
        """The model of its result.json."""
        part = create_model("RunPart", __base__=RunPart, result=(Annotated[self.finding, Dump()], ...))  # type: ignore[arg-type]
        combined = self.combination
        more: dict[str, Any] = {"combined": (Annotated[combined, Dump()], ...)} if combined else {}
        return create_model(
            f"{self.name}Result",
            __base__=self.base,
            analysis=(Literal[self.name], self.name),  # type: ignore[arg-type]
            settings=(settings_model(self.options), ...),
            runs=(tuple[part, ...], ...),  # type: ignore[valid-type]
            **more,
        )

    def document(self, found: A, folder: Path) -> dict[str, Any]:
        """Return the content of result.json for a folder."""
        return self.result_of(found, Place(folder)).as_dict()

    def settings_of(self, found: A) -> dict[str, Any]:
        """Return the options of an analysis as result.json has them."""
        return self.settings(found.options).model_dump(mode="json", by_alias=True)

    def result_of(self, found: A, place: Place) -> Result:
        """Return the result for a place: paths in it are relative to the place."""
        document = {
            "schema": SCHEMA,
            "analysis": self.name,
            "inputs": [{"path": relative(one.data, place.folder), "sha256": one.sha256} for one in found.sources],
            "synthetic": any(source.synthetic for source in found.sources),
            "software": software_versions(),
            "settings": self.settings(found.options),
            "text": found.text,
            "sentences": as_tables(found.text.each if isinstance(found.text, Sentences) else (found.text,)),
            "doubts": as_tables(found.doubts),
            "notes": as_tables(text for text in found.all_warnings if text not in found.doubts),
            "models": [],
            "runs": [
                {
                    "path": relative(source.path, place.folder),
                    "synthetic": source.synthetic,
                    "warnings": [unquote(text) for text in (*source.warnings, *found.about_run(run))],
                    "models": [],
                    "result": run,
                }
                | ({"group": source.group} if source.group else {})
                | _budget(origin.budget or ())
                | self.run_entries(run)
                for source, run, origin in zip(found.sources, found.runs, found.origins, strict=True)
            ],
            "warnings": [unquote(text) for text in found.all_warnings],
            "combined": found.combined,
        }
        alone = self.run_entries(found.runs[0]) if len(found.runs) == 1 else {"values": {}}
        entries = self.entries(found) if self.entries else alone
        return self.model.model_validate(finite(document | _budget(found.budget) | entries))

    def settings(self, options: Any) -> Part:
        """Return the options as they stand in the file."""
        kind: type[Part] = self.model.model_fields["settings"].annotation  # type: ignore[assignment]
        return kind.model_validate({name: getattr(options, name) for name in kind.model_fields})

    # --- reading ---

    def archive(self, paths: Sequence[Path], results: Sequence[Path] = ()) -> Archive[Any]:
        """Return the results that were written before of inputs at the paths; results: files that lie elsewhere."""
        return Archive(paths, self.model, results)

    def reading(self, archive: Archive[Any], options: Any) -> Callable[[Path], Any]:
        """Return how an input is read: with the given options, those kept beside it, those of its earlier result."""
        given = _given_options(options)

        def reading(path: Path) -> Any:
            earlier = archive.earlier(path, path / self.data if path.is_dir() else path)
            return replace(self._options(earlier), **{**read_correction(path), **given}) if earlier else options

        return reading

    def recall(self, paths: Sequence[Path], options: Any = None) -> A:
        """Read what `analyze` found from result.json; inputs without a result that holds are analyzed.

        A result holds as long as the readings are the same bytes, and it was made with the given options.  Those at
        their defaults are not given, nor any where `options` is None.

        Raises DataError for what cannot be used, a damaged result.json included.
        """
        paths, options = [find_run(path) for path in paths], options or self.options()
        archive = self.archive(paths)
        found = collect(paths, self, self.reading(archive, options))
        return self.recall_found(paths, found, archive, options)

    def recall_found(
        self,
        paths: Sequence[Path],
        found: Found[Any],
        archive: Archive[Any],
        options: Any,
        *,
        skips: bool = False,
        step: Callable[[], None] = lambda: None,
    ) -> A:
        """Do the same for inputs that were found already; skips: see `gather`; step: called before each is analyzed."""
        given = _given_options(options)
        whole = archive.whole(found.sources)
        if whole and not any(self._problem(whole.of(source), given, source) for source in found.sources):
            numbers = [whole.of(source).number for source in found.sources]
            return self.gather(
                paths,
                found,
                options,
                lambda source: self._read_one(source, whole.of(source)),
                lambda _: self.renumber(whole.result.combined, numbers),
            )

        def one(source: Source[Any]) -> Done:
            step()
            return self._recall_one(source, archive, given)

        return self.gather(paths, found, options, one, skips=skips)

    def _options(self, earlier: Earlier[Any]) -> Any:
        return self.options(**dict(earlier.result.settings))

    def _problem(self, earlier: Earlier[Any], given: Mapping[str, Any], source: Source[Any]) -> str:
        """Return why an input has to be analyzed again; empty where its result holds."""
        if earlier.sha256 != source.sha256:
            return Text("the readings are others than in {file}", file=earlier.file)
        made_with = self._options(earlier)
        if self.settings(replace(made_with, **self._own_values(given, source))) != self.settings(made_with):
            return Text("other options than those of {file}", file=earlier.file)
        return self.outdated(earlier.part.result)

    def _own_values(self, given: Mapping[str, Any], source: Source[Any]) -> dict[str, Any]:
        """Return those of the given and kept options that matter to an input."""
        left_out = self.of_files if source.run else frozenset[str]()
        return {**source.kept, **{name: value for name, value in given.items() if name not in left_out}}

    def _recall_one(self, source: Source[Any], archive: Archive[Any], given: Mapping[str, Any]) -> Done:
        """Read the result of one input, or analyze it."""
        earlier, own = archive.earlier(source.path, source.data, source.sha256), self._own_values(given, source)
        if earlier is None:
            options, why = self.options(**own), "there was no result yet"
        elif why := self._problem(earlier, given, source):
            options = replace(self._options(earlier), **own)
        else:
            return self._read_one(source, earlier)
        origin = Origin(options, Text(FOR_THIS_PAGE, why=why))
        return source, self.find_in(source, options), origin

    def _read_one(self, source: Source[Any], earlier: Earlier[Any]) -> Done:
        """Read the result of one input.  Raises DataError."""
        part = earlier.part
        try:
            self.check(part.result)
        except ValueError as error:
            raise DataError("{file:s}: {error}: {again}", file=earlier.file, error=error, again=AGAIN) from error
        return source, part.result, Origin(self._options(earlier), earlier.text)

    # --- for people ---

    def budgets(self, found: A) -> tuple[Block, ...]:
        """Return the budgets of its uncertainties, as blocks of a document."""
        return budgets_of_result(found, self.symbols)

    def figure(self, found: A, *, short: bool = False) -> Figure:
        """Draw the figure, by the function NAME_figure, or short_figure, of levilab.pipelines.NAME.figure."""
        drawing = import_module(f"levilab.pipelines.{self.name}.figure")  # with matplotlib
        drawn: Figure = getattr(drawing, "short_figure" if short else f"{self.name}_figure")(found)
        return drawn

    def png(self, found: A) -> bytes:
        """Draw the figure, as PNG."""
        from levilab.present.style import as_png  # with matplotlib

        return as_png(self.figure(found))


def _given_options(options: Any) -> dict[str, Any]:
    """Return the options that are not at their defaults."""
    return {one.name: value for one in fields(options) if (value := getattr(options, one.name)) != one.default}


def _budget(budgets: Sequence[Budget]) -> dict[str, Any]:
    """Return the entry of budgets; empty where there are none."""
    return {"budget": tuple(budgets)} if budgets else {}


#: Statistics that a result has of each model; None where a model has no such number.
_STATISTICS = (
    "n", "degrees_of_freedom", "rms_residual", "reduced_chi_square", "aicc", "bic", "weight", "durbin_watson",
    "runs_test_p", "difference",
)  # fmt: skip


def statistics_of(statistics: Any) -> dict[str, Any]:
    """Return how well a model fits, as a result has it."""
    return {name: getattr(statistics, name, None) for name in _STATISTICS}


def values_of(estimates: Mapping[str, Estimate]) -> dict[str, dict[str, Any]]:
    """Return quantities as a result has them, by their names."""
    return {name: value_of(estimate) for name, estimate in estimates.items()}


def value_of(estimate: Estimate) -> dict[str, Any]:
    """Return a quantity as a result has it."""
    value = number(estimate.value, estimate.unit, estimate.u)
    return value | ({"interval_68": list(estimate.interval)} if estimate.interval else {})


def number(value: float | None, unit: str, u: float | None = None) -> dict[str, Any]:
    """Return a quantity as a result has it, most often one without an uncertainty."""
    return {"value": value, "u": u, "unit": unit}

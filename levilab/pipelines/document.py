"""What an analysis found ↔ result.json: what every analysis writes and reads back alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Annotated, Any, Generic, Literal, TypeVar, get_type_hints

from pydantic import BeforeValidator, Field, PlainSerializer, create_model

from levilab.errors import DataError, unquote
from levilab.files import finite
from levilab.formats.device import Device
from levilab.pipelines.analyzed import FOR_THIS_PAGE, A, Method, Opt, Origin, R, S
from levilab.pipelines.correction import read_correction
from levilab.pipelines.dump import Dump
from levilab.pipelines.options import options_of
from levilab.pipelines.result import AGAIN, SCHEMA, Archive, Earlier, Part, Result, RunPart, relative
from levilab.pipelines.sources import collect
from levilab.present.units import name_with_unit, split
from levilab.runs.find import find_run
from levilab.software import software_versions

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from analysis.budget import Budget
    from analysis.uncertainty import Estimate
    from levilab.pipelines.options import InputOptions
    from levilab.pipelines.result import Place
    from levilab.pipelines.sources import Found, Source

#: The data file's own names of columns: an empty table where none were given.
Columns = Annotated[
    dict[str, str] | None, BeforeValidator(lambda names: names or None), PlainSerializer(lambda names: names or {})
]


D = TypeVar("D", bound=Result)


def settings_model(options: type[InputOptions]) -> type[Part]:
    """Return the model of how inputs were analyzed: the options by their names, which in the file end in the unit."""
    types = get_type_hints(options, localns={"Device": Device, "Mapping": Mapping}) | {"columns": Columns}
    given: dict[str, Any] = {}
    for name, option in options_of(options).items():
        typed = name if split(name)[1] else name_with_unit(name, option.unit)
        given[name] = types[name], Field(default=getattr(options, name), alias=typed, gt=option.above)
    return create_model("Settings", __base__=Part, **given)


def result_model(
    method: Method[Any, Any, Any, Any], run: Any, combined: Any = None, base: type[Result] = Result
) -> type[Result]:
    """Return the model of an analysis's result.json.

    Args:
        method: of the analysis.
        run: type of the finding of one input, a frozen dataclass.
        combined: likewise of all inputs together; None: as the base has it.
        base: model with the entries that no other analysis has.
    """
    name = method.needs.analysis
    part = create_model("RunPart", __base__=RunPart, result=(Annotated[run, Dump()], ...))
    more: dict[str, Any] = {"combined": (Annotated[combined, Dump()], ...)} if combined else {}
    return create_model(
        f"{name}Result",
        __base__=base,
        analysis=(Literal[name], name),  # type: ignore[arg-type]
        settings=(settings_model(method.options), ...),
        runs=(tuple[part, ...], ...),  # type: ignore[valid-type]
        **more,
    )


@dataclass(frozen=True)
class Document(Generic[S, R, Opt, A, D]):
    """result.json of an analysis.

    Attributes:
        method: of the analysis.
        result: all that is in it, with the parts of which it is made.
        entries: its own entries at the top, for people: `values`, `models`.
        run_entries: likewise those of one input.
        check: raises ValueError for what was read of one input and cannot have been found.
        outdated: why this version cannot use what was read of one input, so that it is analyzed again; empty: it can.
        renumber: what was found of all together, for inputs in another order: the number of each in the result.
    """

    method: Method[S, R, Opt, A]
    result: type[D]
    entries: Callable[[A], dict[str, Any]]
    run_entries: Callable[[R], dict[str, Any]]
    check: Callable[[R], None] = lambda _: None
    outdated: Callable[[R], str] = lambda _: ""
    renumber: Callable[[Any, Sequence[int]], Any] = lambda combined, _: combined

    # --- writing ---

    def of(self, found: A, place: Place) -> D:
        """Return the result for a place: paths in it are relative to the place."""
        document = {
            "schema": SCHEMA,
            "analysis": self.method.needs.analysis,
            "inputs": [{"path": relative(one.data, place.folder), "sha256": one.sha256} for one in found.sources],
            "synthetic": any(source.synthetic for source in found.sources),
            "software": software_versions(),
            "settings": self.settings(found.options),
            "text": found.text,
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
        return self.result.model_validate(finite(document | _budget(found.budget) | self.entries(found)))

    def settings(self, options: Opt) -> Part:
        """Return the options as they stand in the file."""
        kind: type[Part] = self.result.model_fields["settings"].annotation  # type: ignore[assignment]
        return kind.model_validate({name: getattr(options, name) for name in kind.model_fields})

    # --- reading ---

    def archive(self, paths: Sequence[Path], results: Sequence[Path] = ()) -> Archive[D]:
        """Return the results that were written before of inputs at the paths; results: files that lie elsewhere."""
        return Archive(paths, self.result, results)

    def reading(self, archive: Archive[D], options: Opt) -> Callable[[Path], Opt]:
        """Return how an input is read: with the given options, those kept beside it, those of its earlier result."""
        given = _given_options(options)

        def reading(path: Path) -> Opt:
            earlier = archive.earlier(path, path)
            return replace(self._options(earlier), **{**read_correction(path), **given}) if earlier else options

        return reading

    def recall(self, paths: Sequence[Path], options: Opt) -> A:
        """Read what `analyze` found from result.json; inputs without a result that holds are analyzed.

        A result holds as long as the readings are the same bytes, and it was made with the given options.  Those at
        their defaults are not given.

        Raises DataError for what cannot be used, a damaged result.json included.
        """
        paths = [find_run(path) for path in paths]
        archive = self.archive(paths)
        found = collect(paths, self.method.needs, self.reading(archive, options))
        return self.recall_found(paths, found, archive, options)

    def recall_found(self, paths: Sequence[Path], found: Found[S], archive: Archive[D], options: Opt) -> A:
        """Do the same for inputs that were found already."""
        given = _given_options(options)
        whole = archive.whole(found.sources)
        if whole and not any(self._problem(whole.of(source), given, source) for source in found.sources):
            numbers = [whole.of(source).number for source in found.sources]
            return self.method.gather(
                paths,
                found,
                options,
                lambda source: self._read_one(source, whole.of(source)),
                lambda _: self.renumber(whole.result.combined, numbers),
                budget=whole.result.budget,
            )
        return self.method.gather(paths, found, options, lambda source: self._recall_one(source, archive, given))

    def _options(self, earlier: Earlier[D]) -> Opt:
        return self.method.options(**dict(earlier.result.settings))

    def _problem(self, earlier: Earlier[D], given: Mapping[str, Any], source: Source[S]) -> str:
        """Return why an input has to be analyzed again; empty where its result holds."""
        if earlier.sha256 != source.sha256:
            return f"the readings are others than in {earlier.file}"
        made_with = self._options(earlier)
        if self.settings(replace(made_with, **self._own_values(given, source))) != self.settings(made_with):
            return f"other options than those of {earlier.file}"
        return self.outdated(earlier.part.result)

    def _own_values(self, given: Mapping[str, Any], source: Source[S]) -> dict[str, Any]:
        """Return those of the given and kept options that matter to an input."""
        left_out = self.method.of_files if source.run else frozenset[str]()
        return {**source.kept, **{name: value for name, value in given.items() if name not in left_out}}

    def _recall_one(
        self, source: Source[S], archive: Archive[D], given: Mapping[str, Any]
    ) -> tuple[Source[S], R, Origin[Opt]]:
        """Read the result of one input, or analyze it."""
        earlier, own = archive.earlier(source.path, source.data, source.sha256), self._own_values(given, source)
        if earlier is None:
            options, why = self.method.options(**own), "there was no result yet"
        elif why := self._problem(earlier, given, source):
            options = replace(self._options(earlier), **own)
        else:
            return self._read_one(source, earlier)
        origin = Origin(options, f"{FOR_THIS_PAGE}: {why}", lacks_result=earlier is None)
        return source, self.method.fit(source, options), origin

    def _read_one(self, source: Source[S], earlier: Earlier[D]) -> tuple[Source[S], R, Origin[Opt]]:
        """Read the result of one input.  Raises DataError."""
        part = earlier.part
        try:
            self.check(part.result)
        except ValueError as error:
            raise DataError(f"{earlier.file}: {error}: {AGAIN}") from error
        return source, part.result, Origin(self._options(earlier), earlier.text, part.budget)


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

"""What an analysis found ↔ result.json: what every analysis writes and reads back alike."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Annotated, Any, Generic, Self, TypeVar

from pydantic import BeforeValidator, PlainSerializer

from levilab.errors import unquoted
from levilab.files import finite
from levilab.pipelines.analyzed import FOR_THIS_PAGE, A, Method, Opt, Origin, R, S
from levilab.pipelines.result import SCHEMA, Archive, BudgetPart, Earlier, Part, Result, budgets_of, relative
from levilab.pipelines.sources import collect
from levilab.runs.run import find_run
from levilab.software import software_versions

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
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


class Settings(Part):
    """How inputs were analyzed: the options by their names, which in the file end in the unit."""

    columns: Columns

    @classmethod
    def of(cls, options: InputOptions, **more: Any) -> Self:
        """From options, but for those in `more`."""
        return cls.model_validate(
            {name: getattr(options, name) for name in cls.model_fields if name not in more} | more
        )

    def arguments(self) -> dict[str, Any]:
        """The options by their names."""
        return {name: getattr(self, name) for name in type(self).model_fields}


D = TypeVar("D", bound=Result)
#: Why an input was analyzed for a page.
NO_RESULT = "there was no result yet"


@dataclass(frozen=True)
class Looked(Generic[S, Opt, D]):
    """Inputs as they lie there, and the results that were written of them.

    Attributes:
        paths: where they were looked for.
        found: the inputs.
        archive: the results.
        options: as given.
        given: those of them that are not at their defaults.
    """

    paths: Sequence[Path]
    found: Found[S]
    archive: Archive[D]
    options: Opt
    given: Mapping[str, Any]

    def has_result(self, source: Source[S]) -> bool:
        """Whether there is a result of an input, of earlier readings or with other options perhaps."""
        return self.archive.earlier(source.path, source.data, source.sha256) is not None


@dataclass(frozen=True)
class Document(Generic[S, R, Opt, A, D]):
    """result.json of an analysis.

    Attributes:
        method: of the analysis.
        result: all that is in it, with the parts of which it is made.
        entries: its own entries at the top.
        run_entries: those of one input; `warnings` are added to the source's.
        run: what was found of one input, from its part of the result, with the options of that time; raises ValueError
            for what does not go with the readings.
        combined: what was found of all together, from the result, the runs, and the number of each of them in the
            result; raises ValueError.
    """

    method: Method[S, R, Opt, A]
    result: type[D]
    entries: Callable[[A], dict[str, Any]]
    run_entries: Callable[[Source[S], R], dict[str, Any]]
    run: Callable[[Any, Source[S], Opt], R]
    combined: Callable[[D, Sequence[R], Sequence[int]], Any] = lambda *_: None

    # --- writing ---

    def of(self, found: A, place: Place) -> D:
        """The result for a place: paths in it are relative to that."""
        document = {
            "schema": SCHEMA,
            "analysis": self.method.needs.analysis,
            "inputs": [{"path": relative(one.data, place.folder), "sha256": one.sha256} for one in found.sources],
            "synthetic": any(source.synthetic for source in found.sources),
            "software": software_versions(),
            "settings": self.settings(found.options),
            "values": {},
            "models": [],
            "runs": [
                self._part(source, run, origin, place.folder)
                for source, run, origin in zip(found.sources, found.runs, found.origins, strict=True)
            ],
            "warnings": [unquoted(text) for text in found.all_warnings],
        }
        return self.result.model_validate(finite(document | _budget(found.budget) | self.entries(found)))

    def _part(self, source: Source[S], run: R, origin: Origin[Opt], folder: Path) -> dict[str, Any]:
        head = {"path": relative(source.path, folder), "synthetic": source.synthetic, "values": {}, "models": []}
        own = self.run_entries(source, run) | _budget(origin.budget or ())
        return head | own | {"warnings": [unquoted(text) for text in (*source.warnings, *own.get("warnings", ()))]}

    def settings(self, options: Opt) -> Settings:
        """The options as they stand in the file."""
        kind: type[Settings] = self.result.model_fields["settings"].annotation  # type: ignore[assignment]
        return kind.of(options)

    # --- reading ---

    def look(self, paths: Sequence[Path], options: Opt, results: Sequence[Path] = ()) -> Looked[S, Opt, D]:
        """What lies at the paths, and the results that were written of it.  Raises DataError.

        Args:
            paths: run folders, data files, folders to search.
            options: as given; those at their defaults are not given, and those of an earlier result count.
            results: files of results that do not lie beside their inputs.
        """
        paths = [find_run(path) for path in paths]
        archive = Archive(paths, self.result, results)
        given = {one.name: value for one in fields(options) if (value := getattr(options, one.name)) != one.default}

        def reading(path: Path) -> Opt:
            earlier = archive.earlier(path, path)
            return replace(self._options(earlier), **given) if earlier else options

        return Looked(paths, collect(paths, self.method.needs, reading), archive, options, given)

    def recall(self, looked: Looked[S, Opt, D]) -> A:
        """What `analyze` found, from its result.json; analyzed anew is only what has none that holds.

        A result holds as long as the readings are the same bytes, and it was made with the given options.

        Raises DataError for what cannot be used, a damaged result.json included.
        """
        found, archive, given = looked.found, looked.archive, looked.given
        whole = archive.whole(found.sources)
        if whole and all(self._holds(whole.of(source), given, source) for source in found.sources):
            found = replace(found, warnings=(*whole.result.warnings, *map(unquoted, found.warnings)))
            numbers = [whole.of(source).number for source in found.sources]
            return self.method.gather(
                looked.paths,
                found,
                looked.options,
                lambda source: self._restored(source, whole.of(source)),
                lambda runs: whole.restore(lambda: self.combined(whole.result, runs, numbers)),
                budget=budgets_of(whole.result.budget),
            )
        return self.method.gather(
            looked.paths, found, looked.options, lambda source: self._recalled(source, archive, given)
        )

    def _options(self, earlier: Earlier[D]) -> Opt:
        settings: Settings = earlier.result.settings
        return self.method.options(**settings.arguments())

    def _holds(self, earlier: Earlier[D], given: Mapping[str, Any], source: Source[S]) -> bool:
        """Whether a result was made with the given options, as far as they matter to the input."""
        made_with = self._options(earlier)
        return self.settings(replace(made_with, **self._own(given, source))) == self.settings(made_with)

    def _own(self, given: Mapping[str, Any], source: Source[S]) -> dict[str, Any]:
        """Those of the given options that matter to an input."""
        left_out = self.method.of_files if source.run else frozenset[str]()
        return {name: value for name, value in given.items() if name not in left_out}

    def _recalled(
        self, source: Source[S], archive: Archive[D], given: Mapping[str, Any]
    ) -> tuple[Source[S], R, Origin[Opt]]:
        """One input: what was found of it, or its analysis."""
        earlier, own = archive.earlier(source.path, source.data, source.sha256), self._own(given, source)
        if earlier is None:
            options, why = self.method.options(**own), NO_RESULT
        elif earlier.sha256 != source.sha256:
            options, why = replace(self._options(earlier), **own), f"the readings are others than in {earlier.file}"
        elif not self._holds(earlier, given, source):
            options, why = replace(self._options(earlier), **own), f"other options than those of {earlier.file}"
        else:
            return self._restored(source, earlier)
        return source, self.method.fit(source, options), Origin(options, f"{FOR_THIS_PAGE}: {why}")

    def _restored(self, source: Source[S], earlier: Earlier[D]) -> tuple[Source[S], R, Origin[Opt]]:
        """One input as it was found; its warnings are those of that time."""
        options, part = self._options(earlier), earlier.part
        run = earlier.restore(lambda: self.run(part, source, options))
        return replace(source, warnings=part.warnings), run, Origin(options, earlier.text, budgets_of(part.budget))


def _budget(budgets: Sequence[Budget]) -> dict[str, Any]:
    """The entry of budgets, where there are any."""
    return {"budget": [BudgetPart.of(one).model_dump(exclude_unset=True) for one in budgets]} if budgets else {}


def values_of(estimates: Mapping[str, Estimate]) -> dict[str, dict[str, Any]]:
    """Quantities as a result has them, by their names."""
    return {name: value_of(estimate) for name, estimate in estimates.items()}


def value_of(estimate: Estimate) -> dict[str, Any]:
    """A quantity as a result has it."""
    value = number(estimate.value, estimate.unit, estimate.u)
    return value | ({"interval_68": list(estimate.interval)} if estimate.interval else {})


def number(value: float | None, unit: str, u: float | None = None) -> dict[str, Any]:
    """A quantity as a result has it, most often one without an uncertainty."""
    return {"value": value, "u": u, "unit": unit}

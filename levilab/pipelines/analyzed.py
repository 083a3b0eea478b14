"""From inputs to what is found of each and of all together: what every analysis does alike."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from levilab.errors import DataError, UsageError
from levilab.pipelines.options import OF_FILES, InputOptions
from levilab.pipelines.result import Place, place_of
from levilab.pipelines.sources import Needs, Readings, Remark, Skipped, Source, collect
from levilab.runs.find import find_run

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from pathlib import Path

    from analysis.budget import Budget
    from levilab.pipelines.sources import Found

#: Readings of an input, what is found of it, of all together; options of the analysis.
S = TypeVar("S", bound=Readings)
R = TypeVar("R")
T = TypeVar("T")
Opt = TypeVar("Opt", bound=InputOptions)

#: Where numbers come from that no result had.
NOW = "analyzed now"
FOR_THIS_PAGE = "analyzed for this page"


@dataclass(frozen=True)
class Origin(Generic[Opt]):
    """Where the numbers of one input come from.

    Attributes:
        options: how they were made.
        text: for people.
        budget: what the uncertainties of the input's numbers are made of; None: to be worked out from what was found,
            empty: the result that was read holds none.
        lacks_result: whether it was analyzed since no result of it was found.
    """

    options: Opt
    text: str = NOW
    budget: tuple[Budget, ...] | None = None
    lacks_result: bool = False


@dataclass(frozen=True)
class Analyzed(Generic[S, R, T, Opt]):
    """Inputs, each by itself and together.

    Attributes:
        sources: the inputs.
        runs: what was found of each.
        combined: what was found of all together; None where an analysis combines nothing.
        options: how they were analyzed.
        place: where the result belongs.
        warnings: about the inputs.
        remarks: what does not belong to the analysis, and is no cause for a warning.
        origins: one per source.
        budget: what the uncertainties of the numbers of all together are made of; empty where that is not known.
    """

    sources: tuple[Source[S], ...]
    runs: tuple[R, ...]
    combined: T
    options: Opt
    place: Place
    warnings: tuple[str, ...]
    remarks: tuple[Remark, ...]
    origins: tuple[Origin[Opt], ...]
    budget: tuple[Budget, ...] = ()

    @property
    def output_folder(self) -> Path:
        """The folder that the result belongs to."""
        return self.place.folder

    @property
    def text(self) -> str:
        """What the data say, in a few sentences."""
        raise NotImplementedError

    @property
    def averaged(self) -> Sequence[Sequence[Source[S]]]:
        """Inputs whose numbers are taken together."""
        return (self.sources,)

    def inputs_of(self, group: int | None) -> Sequence[Source[S]]:
        """Return the inputs of a group, by its number in values and budgets of all together; None: all inputs."""
        return self.sources

    def about_all(self) -> Iterable[str]:
        """Return what to know of all inputs together before using the numbers."""
        return ()

    def about_run(self, run: R) -> Iterable[str]:
        """Return what to know of one input."""
        raise NotImplementedError

    @property
    def doubts(self) -> list[str]:
        """Warnings that make the numbers worthless where they are right, as of a wrong unit."""
        return [
            text if len(self.sources) == 1 else _with_name(source, text)
            for source in self.sources
            for text in source.warnings[: getattr(source.readings, "doubts", 0)]
        ]

    @property
    def all_warnings(self) -> list[str]:
        """Every warning once, doubts first; an input's with its name, unless it says it or is of every input."""
        texts = [*self.doubts, *self.warnings, *self.about_all()]
        of_runs = [
            [*source.warnings, *self.about_run(run)] for source, run in zip(self.sources, self.runs, strict=True)
        ]
        of_every = set.intersection(*map(set, of_runs))
        for source, said in zip(self.sources, of_runs, strict=True):
            own = said[getattr(source.readings, "doubts", 0) :]
            texts += [text if text in of_every else _with_name(source, text) for text in own]
        return list(dict.fromkeys(texts))

    @property
    def grouped_warnings(self) -> list[list[str]]:
        """Every warning once, those together that differ in the names of inputs and in numbers alone."""
        names = sorted((source.name for source in self.sources), key=len, reverse=True)
        name = re.compile("|".join([*map(re.escape, names), _RUN.pattern]))
        groups: dict[str, list[str]] = {}
        for text in self.all_warnings:
            groups.setdefault(_NUMBER.sub("#", name.sub("…", text)), []).append(text)
        return [*groups.values()]


class Described(Protocol):
    """Findings of one input, which no analysis combines with those of others."""

    @property
    def text(self) -> str:
        """Findings in a few sentences."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Doubts about the numbers."""


D = TypeVar("D", bound=Described)


class EachAlone(Analyzed[S, D, None, Opt]):
    """Inputs, each by itself."""

    @property
    def text(self) -> str:
        """Findings in a few sentences for each input."""
        if len(self.runs) == 1:
            return self.runs[0].text
        return "  ".join(f"{source.name}: {run.text}" for source, run in zip(self.sources, self.runs, strict=True))

    def about_run(self, run: D) -> Iterable[str]:
        """Return what to know of one input."""
        return run.warnings


#: A run's folder with what stands before it and behind it, and a number with its uncertainty.
_RUN = re.compile(r"\S*\d{8}T\d{6}Z-\S+")
_NUMBER = re.compile(r"\d[\d.]*(\(\d+\))?([eE][+-]?\d+)?")

A = TypeVar("A", bound=Analyzed[Any, Any, Any, Any])


def _with_name(source: Source[Any], text: str) -> str:
    """Put the name of the input before a text, unless it begins with the name or the path."""
    return text if source.path.name in text.partition(": ")[0] else f"{source.name}: {text}"


def refuse_columns_of_runs(found: Found[Any], options: InputOptions) -> None:
    """Raise UsageError where names of columns are given, and all inputs are runs, whose columns are known."""
    runs = [source.run for source in found.sources if source.run]
    if options.columns and len(runs) == len(found.sources):
        names = ", ".join(str(channel["name"]) for channel in runs[0].record.channels if "name" in channel)
        known = f"{runs[0].folder} is a run, whose columns are known{f' ({names})' * bool(names)}"
        raise UsageError("columns", f"goes with a data file, and {known}: leave it out")


@dataclass(frozen=True)
class Method(Generic[S, R, Opt, A]):
    """How an analysis is carried out.

    Attributes:
        needs: its name, and what it needs of its inputs.
        kind: what was found, an Analyzed.
        options: of the analysis.
        fit: one input; raises DataError, which names the file.
        combine: all inputs together.
        mixed: what is wrong with numbers over real and synthetic inputs; empty where there are none.
        of_files: names of options that say nothing about runs, whose columns are known.
        skips: whether of several inputs one that cannot be used is skipped with a warning.
        budget_of_run: what the uncertainties of one input's numbers are made of.
        budget_of_all: those of all inputs together, from what was found of each; of one input they are its own.
        set_beside: puts a path that goes beside the inputs into the options.
    """

    needs: Needs[Any]
    kind: type[A]
    options: type[Opt]
    fit: Callable[[Source[S], Opt], R]
    combine: Callable[[Sequence[Source[S]], Sequence[R], Opt], Any] = lambda *_: None
    mixed: str = ""
    of_files: frozenset[str] = frozenset(OF_FILES)
    skips: bool = False
    budget_of_run: Callable[[Source[S], R, Opt], tuple[Budget, ...]] = lambda *_: ()
    budget_of_all: Callable[[A], tuple[Budget, ...]] = lambda _: ()
    set_beside: Callable[[Sequence[Path], Opt], tuple[Sequence[Path], Opt]] = lambda paths, options: (paths, options)

    def analyze(self, paths: Sequence[Path], options: Opt) -> A:
        """Analyze the inputs at the paths.

        Raises:
            DataError: one of them cannot be used; it names the file.
            UsageError: names of columns are given, and all inputs are runs.
        """
        paths, options = self.set_beside([find_run(path) for path in paths], options)
        found = collect(paths, self.needs, lambda _: options)
        refuse_columns_of_runs(found, options)
        return self.analyze_found(paths, found, options)

    def analyze_found(self, paths: Sequence[Path], found: Found[S], options: Opt) -> A:
        """Do the same for inputs that were found already."""

        def one(source: Source[S]) -> tuple[Source[S], R, Origin[Opt]]:
            own = replace(options, **source.kept)
            return source, self.fit(source, own), Origin(own, NOW)

        return self.gather(paths, found, options, one)

    def gather(
        self,
        paths: Sequence[Path],
        found: Found[Any],
        options: Opt,
        one: Callable[[Source[S]], tuple[Source[S], R, Origin[Opt]]],
        recall: Callable[[Sequence[R]], Any] | None = None,
        *,
        budget: tuple[Budget, ...] = (),
    ) -> A:
        """Return what is found of all inputs, each by itself and together.  Raises DataError.

        Args:
            paths: run folders, data files, folders that were searched.
            found: what lies there.
            options: as they were given.
            one: from one input to what is found of it.
            recall: from what is found of each to what was found of all together; None where it is not known.
            budget: that of all together, which goes with `recall`.
        """
        done, warnings = self._each(found.sources, one)
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
            warnings=(*found.warnings, *warnings, *self.about_inputs(sources, used)),
            remarks=found.remarks,
            origins=tuple(origins),
            budget=budget,
        )
        if recall is not None:
            return found_of_all
        of_all = (origins[0].budget or ()) if len(origins) == 1 else self.budget_of_all(found_of_all)
        return replace(found_of_all, budget=of_all)

    def _each(
        self, sources: Sequence[Source[S]], one: Callable[[Source[S]], tuple[Source[S], R, Origin[Opt]]]
    ) -> tuple[list[tuple[Source[S], R, Origin[Opt]]], list[str]]:
        """Return what is found of each input, and warnings about those that are skipped."""
        if not self.skips or len(sources) == 1:
            return [one(source) for source in sources], []
        done: list[tuple[Source[S], R, Origin[Opt]]] = []
        errors: list[DataError] = []
        for source in sources:
            try:
                done.append(one(source))
            except DataError as error:
                errors.append(error)
        if not done:
            raise errors[-1]
        return done, [str(Skipped(str(error))) for error in errors]

    def about_inputs(self, sources: Sequence[Source[S]], options: Opt) -> Iterable[str]:
        """Return what to know of the inputs before using the numbers."""
        synthetic = sum(source.synthetic for source in sources)
        if self.mixed and 0 < synthetic < len(sources):
            yield f"{synthetic} of {len(sources)} inputs are SYNTHETIC, the others are not known to be: {self.mixed}"
        reading_u = getattr(options, "reading_u", None)
        given = [source.name for source in sources if getattr(source.readings, "u", None) is not None]
        if reading_u is not None and given:
            names = ", ".join(given)
            yield f"the given u of a reading, {reading_u:g} Hz, takes the place of the uncertainties in {names}"
        if options.columns and all(source.run for source in sources):
            yield "names of columns were given, but none of the inputs is a data file"

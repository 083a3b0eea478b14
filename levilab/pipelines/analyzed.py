"""From inputs to what is found of each and of all together: what every analysis does alike."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from analysis.budget import Budget
from levilab.pipelines.inputs.source import Readings, Source
from levilab.pipelines.inputs.unread import NotTaken, noted
from levilab.pipelines.options import InputOptions
from levilab.pipelines.result import Place
from levilab.texts.note import Note, is_doubt, kind_of, reword
from levilab.texts.text import Sentences, Text

#: Readings of an input, what is found of it, of all together; options of the analysis.
S = TypeVar("S", bound=Readings)
R = TypeVar("R")
T = TypeVar("T")
Opt = TypeVar("Opt", bound=InputOptions)

#: Where numbers come from that no result had.
NOW = "analyzed now"
FOR_THIS_PAGE = "analyzed for this page: {why}"


@dataclass(frozen=True)
class Origin(Generic[Opt]):
    """Where the numbers of one input come from.

    Attributes:
        options: how they were made.
        text: for people.
        budget: what the uncertainties of the input's numbers are made of; None: to be worked out from what was found.
    """

    options: Opt
    text: str = NOW
    budget: tuple[Budget, ...] | None = None


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
        skipped: runs and files that the analysis does not take.
        origins: one per source.
        budget: what the uncertainties of the numbers of all together are made of; empty where that is not known.
    """

    sources: tuple[Source[S], ...]
    runs: tuple[R, ...]
    combined: T
    options: Opt
    place: Place
    warnings: tuple[str, ...]
    skipped: tuple[NotTaken, ...]
    origins: tuple[Origin[Opt], ...]
    budget: tuple[Budget, ...] = ()

    @property
    def each(self) -> tuple[tuple[Source[S], R], ...]:
        """Each input with what was found of it."""
        return tuple(zip(self.sources, self.runs, strict=True))

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
        """Warnings that make the numbers worthless where they are right."""
        return [*filter(is_doubt, self.all_warnings)]

    @property
    def all_warnings(self) -> list[str]:
        """Every warning once, doubts first; an input's with its name, unless it says it or is of every input."""
        texts = [*(one.note for one in self.skipped if noted(one)), *self.warnings, *self.about_all()]
        of_runs = [
            [*source.warnings, *(() if source.readings.doubtful else self.about_run(run))] for source, run in self.each
        ]
        of_every = set.intersection(*map(set, of_runs))
        for source, said in zip(self.sources, of_runs, strict=True):
            texts += [text if text in of_every else _with_name(source, text) for text in said]
        return sorted(dict.fromkeys(texts), key=lambda text: not is_doubt(text))

    @property
    def grouped_warnings(self) -> list[list[str]]:
        """Every warning once, those of one kind together."""
        groups: dict[str, list[str]] = {}
        for text in self.all_warnings:
            groups.setdefault(kind_of(text), []).append(text)
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
        """Findings in a few sentences, for each input in a line of its own."""
        if len(self.runs) == 1:
            return self.runs[0].text
        named = (_named(source, run.text) for source, run in self.each)
        return Sentences(*named, between="\n")

    def about_run(self, run: D) -> Iterable[str]:
        """Return what to know of one input."""
        return run.warnings


A = TypeVar("A", bound=Analyzed[Any, Any, Any, Any])


def _with_name(source: Source[Any], text: str) -> str:
    """Put the name of the input before a note that does not name it."""
    named = isinstance(text, Note) and text.names_input
    return text if named else reword(text, _named(source, text), names_input=True)


def _named(source: Source[Any], text: str) -> Text:
    return Text("{name:s}: {text}", name=source.name, text=text)

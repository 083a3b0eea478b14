"""A person's title above a report, and how to make its numbers again: commands, data with hashes, seeds, versions."""

import shlex
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from levilab.errors import LevilabError
from levilab.formats.table import parse_columns
from levilab.pipelines.document import Analysis
from levilab.pipelines.inputs.names import each_once
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import OF_REPORT, OPTIONS, options_of, typed_name
from levilab.present.document.blocks import (
    Block,
    Code,
    Details,
    Document,
    Fact,
    Facts,
    Note,
    Paragraph,
    Section,
    Tabular,
)
from levilab.present.tables import table
from levilab.software import command_text, software_versions, versions_text
from levilab.texts.text import ENGLISH, Text, how_many, spoken, verbatim


@dataclass(frozen=True)
class Heading:
    """The heading of a report, as a person typed it.

    Attributes:
        title: takes the place of the report's own; empty: that stays.
        course, author, date: below the title; empty: not said.
    """

    title: str = ""
    course: str = ""
    author: str = ""
    date: str = ""

    @property
    def typed(self) -> list[str]:
        """The options as one types them."""
        given = ((one.name, getattr(self, one.name)) for one in fields(self))
        return [word for name, text in given if text for word in (f"--{name}", shlex.quote(text))]

    def above(self, document: Document) -> Document:
        """Return the document below this heading; its own title then begins the line below."""
        byline = " · ".join(filter(None, (self.course, self.author, self.date)))
        if not self.title:
            return replace(document, byline=byline)
        lead = Text("{title}: {lead}", document.title, document.lead)
        return replace(document, title=verbatim(self.title), lead=lead, byline=byline)


#: With more inputs the commands of analyses name none.
_MOST_NAMED = 12


@dataclass(frozen=True)
class Asked:
    """What a report was asked for, but for the folder of its file, on which no byte of it depends.

    Attributes:
        paths: as they were typed; empty: those of the inputs.
        name: of the file.
        given: options by their names.
        crosscheck: whether one was asked for where none is stored.
        short: whether result, figure and notes alone were asked for.
        heading: what stands above it.
    """

    paths: Sequence[Path] = ()
    name: str = "report.html"
    given: Mapping[str, Any] = field(default_factory=dict)
    crosscheck: bool = True
    short: bool = False
    heading: Heading = field(default_factory=Heading)

    def command(self, sources: Sequence[Source[Any]]) -> str:
        """Return the command that makes the report again."""
        paths = [shlex.quote(str(path)) for path in self.paths] or paths_in_commands(sources)
        options = [word for name in OF_REPORT for word in _option(name, self.given.get(name))]
        no_crosscheck = [] if self.crosscheck else ["--no-crosscheck"]
        short = ["--short"] if self.short else []
        words = [*paths, *options, *no_crosscheck, *short, *language_option(), *self.heading.typed]
        return " ".join(["levilab", "report", *words, "-o", shlex.quote(self.name)])


def language_option() -> list[str]:
    """Return the option of the language that is spoken, as one types it; nothing for English."""
    return [] if spoken() == ENGLISH else ["--language", spoken()]


def reproduction(results: Sequence[tuple[Analysis[Any], Any]], asked: Asked) -> Block:
    """Return the section at the end of a report of measurements; of a short one the command that made it."""
    sources = each_once(source for _, found in results for source in found.sources)
    if asked.short:
        return Note(Text("Made by: {command:s}", command=asked.command(sources)))
    data = (_data(sources), *_recording(sources))
    return Section(
        "How to reproduce this",
        (
            Paragraph(
                "The last command makes this report again, byte for byte, where the same data and results lie and the "
                "versions are the same; those before it make its numbers."
            ),
            Code("\n".join([*_commands(results, asked.paths), asked.command(sources)])),
            *_others(results),
            Details(
                "The data",
                data,
                more=Text("{inputs}, by hash, command and versions", inputs=how_many(len(sources), "input")),
            ),
            *_versions_here(sources),
        ),
        anchor="reproduce",
    )


def _commands(results: Sequence[tuple[Analysis[Any], Any]], typed: Sequence[Path]) -> Iterator[str]:
    """Return the commands of the analyses."""
    for analysis, found in results:
        options = list(dict.fromkeys(typed_options(origin.options) for origin in found.origins))
        for given in options:
            of = [
                s
                for s, origin in zip(found.sources, found.origins, strict=True)
                if typed_options(origin.options) == given
            ]
            yield " ".join(["levilab", "analyze", analysis.name, *paths_in_commands(of, typed), *given])


def paths_in_commands(sources: Sequence[Source[Any]], typed: Sequence[Path] = ()) -> list[str]:
    """Return the paths as one types them; of many those typed that hold them, or else their folders."""
    paths = [source.path for source in sources]
    if len(paths) > _MOST_NAMED:
        if holding := [path for path in typed if any(one.is_relative_to(path) for one in paths)]:
            return [shlex.quote(str(path)) for path in holding]
        folders = dict.fromkeys(path.parent for path in paths)
        paths = [folder for folder in folders if folders.keys().isdisjoint(folder.parents)]  # each with those below it
    return [shlex.quote(str(path)) for path in paths]


def typed_options(options: Any, without: Container[str] = ()) -> tuple[str, ...]:
    """Return the options that are not at their defaults, as one types them, if they are plain words.

    without: names of others, which are left out.
    """
    usual, typed = type(options)(), []
    for name in (name for name in OPTIONS if _is_plain(name) and name not in without):
        value = getattr(options, name, None)
        if value != getattr(usual, name, None):
            typed += _option(name, value)
    return tuple(typed)


def _option(name: str, value: Any) -> list[str]:
    """Return an option as one types it.

    >>> _option("keep_outliers", True), _option("columns", {"t": "1", "f": "a b"}), _option("rate", None)
    (['--keep-outliers'], ['--columns', "'t=1,f=a b'"], [])
    >>> _option("between", (24.0, 30.0)), _option("laws", ("stokes", "disc")), _option("rim_m", 0.03)
    (['--between', '24:30'], ['--laws', 'stokes,disc'], ['--rim', '30'])
    """
    if value is None or value is False:
        return []
    if isinstance(value, tuple):
        value = ",".join(value) if isinstance(value[0], str) else ":".join(f"{one:g}" for one in value)
    factor = OPTIONS[name].factor
    text = _columns(value) if name == "columns" else str(value) if factor == 1 else f"{value / factor:.12g}"
    return [_flag(name)] if value is True else [_flag(name), shlex.quote(text)] if text else []


def _flag(name: str) -> str:
    return f"--{typed_name(name).replace('_', '-')}"


def _is_plain(name: str) -> bool:
    """Return whether the command line gives an option by its value, and not by a file."""
    return OPTIONS[name].kind is not Path


def _columns(names: Mapping[str, str]) -> str:
    """Names of columns as text; empty where titles with commas and equals signs make that ambiguous."""
    text = ",".join(f"{name}={title}" for name, title in names.items())
    try:
        return text if parse_columns(text) == names else ""
    except LevilabError:
        return ""


def _others(results: Sequence[tuple[Analysis[Any], Any]]) -> tuple[Note, ...]:
    """Return the names of options that are no plain words, such as a file of the top's sizes."""
    options = [origin.options for _, found in results for origin in found.origins]
    names = sorted({_flag(name) for one in options for name in _given_options(one)})
    return (Note(Text("Besides, these options were given: {names}.", names=", ".join(names))),) if names else ()


def _given_options(options: Any) -> Iterator[str]:
    """Yield the names of options that are not at their defaults and do not stand in the commands."""
    usual = type(options)()
    for name in options_of(type(options)):
        value = getattr(options, name)
        if value != getattr(usual, name) and not (_is_plain(name) and _option(name, value)):
            yield name


def _data(sources: Sequence[Source[Any]]) -> Tabular:
    """Return each input with its seed and its hash."""
    rows = [
        (
            source.name,
            source.data.name,
            "—" if source.run is None or source.run.record.seed is None else str(source.run.record.seed),
            source.sha256,
        )
        for source in sources
    ]
    heads = ("input", "file", "seed", "sha256")
    return Tabular("data", table("", heads, rows, numbers=("seed",)), first_column_wraps=True, wraps=("sha256",))


def _recording(sources: Sequence[Source[Any]]) -> tuple[Block, ...]:
    """Return the commands and versions by which the runs were recorded, once if they are the same."""
    facts: list[Fact] = []
    for source in sources:
        record = source.run.record if source.run else None
        texts = [
            *([command_text(record.command_line)] if record and record.command_line else []),
            *([versions_text(record.software)] if record and record.software else []),
        ]
        if texts:
            facts.append(Fact(source.name, tuple(texts), code=True))
    if len(facts) > 1 and len({fact.texts for fact in facts}) == 1:
        facts = [replace(facts[0], name=Text("all {n} runs", n=len(facts)))]
    return (Section("Recorded by", (Facts(tuple(facts)),)),) if facts else ()


def _versions_here(sources: Sequence[Source[Any]]) -> tuple[Facts, ...]:
    """Return the versions that made the report, unless they recorded all inputs, too."""
    here = software_versions()
    if all(source.run and source.run.record.software == here for source in sources):
        return ()
    return (Facts((Fact("Versions here", (versions_text(here),)),)),)

"""How to make the report's numbers again: commands, data with their hashes, seeds, versions."""

from __future__ import annotations

import shlex
from dataclasses import fields
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from levilab.present.document.blocks import Code, Details, Fact, Facts, Note, Paragraph, Section, Tabular
from levilab.present.tables import table
from levilab.software import software_versions

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from levilab.pipelines.catalogue import Analysis
    from levilab.pipelines.sources import Source
    from levilab.present.document.blocks import Block

#: With more inputs the commands name none, and the inputs are folded away.
_MOST_NAMED = 12
#: Options of analyses that the command line gives as they are.
SAME_IN_COMMANDS = (
    "channel", "rate", "reading_u", "uncertainty", "keep_outliers", "tilt", "method", "orthogonal", "clock_u"
)  # fmt: skip


def reproduction(results: Sequence[tuple[Analysis[Any], Any]]) -> Section:
    """The section at the end of a report of measurements."""
    sources = list({source.path.resolve(): source for _, found in results for source in found.sources}.values())
    many = len(sources) > _MOST_NAMED
    data = (_data(sources), *_recorded(sources))
    inputs: tuple[Block, ...] = (Details("The data", data, more=f"{len(sources)} inputs"),) if many else data
    return Section(
        "How to reproduce this",
        (
            Paragraph("The same data, commands and versions give the same numbers, and this report byte for byte."),
            Code("\n".join(_commands(results, sources))),
            *_others(results),
            *inputs,
            Facts((Fact("Versions here", (_versions(software_versions()),)),)),
        ),
        anchor="reproduce",
    )


def _commands(results: Sequence[tuple[Analysis[Any], Any]], sources: Sequence[Source[Any]]) -> Iterator[str]:
    for analysis, found in results:
        options = list(dict.fromkeys(_options(origin.options) for origin in found.origins))
        for given in options:
            of = [
                s for s, origin in zip(found.sources, found.origins, strict=True) if _options(origin.options) == given
            ]
            yield " ".join(["levilab", "analyze", analysis.name, *named_in_commands(of), *given])
    yield " ".join(["levilab", "report", *named_in_commands(sources), "-o", "report.html"])


def named_in_commands(sources: Sequence[Source[Any]]) -> list[str]:
    """As one types them; of many the folder that holds them."""
    paths = [source.path for source in sources]
    if len(paths) > _MOST_NAMED:
        paths = list(dict.fromkeys(path.parent for path in paths))
    return [shlex.quote(str(path)) for path in paths]


def _options(options: Any) -> tuple[str, ...]:
    """The options that are not at their defaults, as one types them; those that are no plain words are left out."""
    usual, typed = type(options)(), []
    for name in SAME_IN_COMMANDS:
        value = getattr(options, name, None)
        if value is None or value == getattr(usual, name):
            continue
        flag = f"--{name.replace('_', '-')}"
        typed += [flag] if value is True else [flag, shlex.quote(str(value))]
    return tuple(typed)


def _others(results: Sequence[tuple[Analysis[Any], Any]]) -> tuple[Note, ...]:
    """The names of options that are no plain words, such as a file of the top's sizes."""
    options = [origin.options for _, found in results for origin in found.origins]
    names = sorted({name for one in options for name in _given(one)} - {*SAME_IN_COMMANDS, "guess"})
    return (Note(f"Besides, these options were given: {', '.join(names)}."),) if names else ()


def _given(options: Any) -> list[str]:
    """Names of the options that are not at their defaults."""
    usual = type(options)()
    return [field.name for field in fields(options) if getattr(options, field.name) != getattr(usual, field.name)]


def _data(sources: Sequence[Source[Any]]) -> Tabular:
    """Each input with its seed and its hash."""
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


def _recorded(sources: Sequence[Source[Any]]) -> tuple[Block, ...]:
    """The commands by which the runs were recorded, and the versions that did."""
    facts = []
    for source in sources:
        record = source.run.record if source.run else None
        texts = [
            *([_typed(record.command_line)] if record and record.command_line else []),
            *([_versions(record.software)] if record and record.software else []),
        ]
        if texts:
            facts.append(Fact(source.name, tuple(texts), code=True))
    return (Section("Recorded by", (Facts(tuple(facts)),)),) if facts else ()


def _typed(words: Sequence[str]) -> str:
    """A recorded command as one types it.

    >>> _typed(["/usr/lib/levilab/__main__.py", "acquire", "spin", "--note", "a b"])
    "levilab acquire spin --note 'a b'"
    """
    name, *arguments = words
    path = PurePath(name.replace("\\", "/"))
    is_levilab = path.stem in {"levilab", "levilab-script"} or path.parts[-2:] == ("levilab", "__main__.py")
    return " ".join(["levilab" if is_levilab else shlex.quote(name), *map(shlex.quote, arguments)])


def _versions(software: dict[str, str]) -> str:
    """Levilab first.

    >>> _versions({"python": "3.11.7", "levilab": "0.1.0"})
    'levilab 0.1.0, python 3.11.7'
    """
    names = sorted(software, key=lambda name: (name != "levilab", name))
    return ", ".join(f"{name} {software[name]}" for name in names)

"""A document as blocks of data, which HTML, PDF and notebooks draw each in their own way.

All text is plain text and never markup: what a person typed stands in it as it was typed.  A renderer escapes it for
its format and typesets it by `levilab.present.document.typesetting.typeset`: superscripts, subscripts, nothing else.

Blocks hold no results and compute nothing.  The only callable is a picture's `draw`, since each format wants the figure
in a form of its own.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, fields, is_dataclass, replace
from itertools import takewhile
from typing import TYPE_CHECKING, Literal, TypeAlias, TypeVar

from levilab.present.tables import Table
from levilab.texts.text import Text, in_language, numbers_in_language

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from datetime import datetime

    from levilab.present.style import Figure


@dataclass(frozen=True)
class Paragraph:
    """A sentence or several, as running text.

    Attributes:
        text: the sentences; a line feed is a blank.
        lead: a few words in bold that stand before the text in the same line, such as "The fall."; empty for none.
    """

    text: str
    lead: str = ""


@dataclass(frozen=True)
class Note:
    """What explains the block before it: smaller and quieter than a paragraph, close below that block, on its page."""

    text: str


@dataclass(frozen=True)
class Verdict:
    """What the data say, in a few sentences.

    It is the first thing that a reader of its section sees: set off by a bar or a tint, never split between pages.
    """

    text: str


@dataclass(frozen=True)
class Banner:
    """A mark that no reader overlooks: what is synthetic, or what mixes synthetic with real.

    Attributes:
        lead: in capitals and bold, such as "SYNTHETIC.".
        text: what that means here; in the same line, after the lead.
    """

    lead: str
    text: str


#: Warnings of a group that are shown like the first.
MOST_ALIKE = 3


@dataclass(frozen=True)
class Warnings:
    """What to know before the numbers are used: a list, set off so that a reader sees it before tables and figures.

    Attributes:
        groups: warnings that are alike stand together.  Of more than `MOST_ALIKE` the first one is shown, and the
            others can be folded away below it ("and 12 more like this one"); on paper they are printed smaller.
            Without any group the block says that there are none.
    """

    groups: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Bullets:
    """A list of short texts."""

    texts: tuple[str, ...]


@dataclass(frozen=True)
class Code:
    """What a person types, such as a command, line by line: in letters of one width.

    Lines that are too long are folded at any character; nothing in it is typeset.
    """

    text: str


#: An option of a command and its value.
_OPTION = re.compile(r'(--[\w-]+ (?:"[^"\n]*"|[^\s"-]\S*))')


def with_options(code: str) -> list[str]:
    """Return the parts of commands, in which an option with its value is one part.

    >>> with_options("levilab acquire limit --mock --seed 2 --out class")
    ['levilab acquire limit --mock ', '--seed 2', ' ', '--out class']
    """
    return [part for part in _OPTION.split(code) if part]


@dataclass(frozen=True)
class Question:
    """A question, and below it the answer, or lines as wide as the text to write one on; on one page.

    Attributes:
        lead: its number, in bold before it.
        text: the question; in bold above an answer.
        lines: how many.
        answer: empty for lines.
    """

    lead: str
    text: str
    lines: int = 2
    answer: str = ""


@dataclass(frozen=True)
class Fact:
    """A name and what is said about it.

    Attributes:
        name: such as "Counter".
        texts: a line each, or more where it is too long.
        code: whether the texts are commands, paths or hashes: in letters of one width, not typeset, folded anywhere.
    """

    name: str
    texts: tuple[str, ...]
    code: bool = False


@dataclass(frozen=True)
class Facts:
    """Facts below each other: names in bold in a narrow column, texts beside them; where it is narrow, below them."""

    facts: tuple[Fact, ...]


@dataclass(frozen=True)
class Tabular:
    """A table in a document.

    Heads are bold above a line; numbers are aligned to the right with digits of one width.  Rows of the kind "best"
    have a green tint, "outlier" is red, the first of the kind "together" has a line above it.  Cells may have several
    lines.  A table that is too wide is moved sideways on a screen, never the page; on paper it is set smaller.  Rows
    are not split between pages, and heads are printed again on each page.

    Attributes:
        name: of files beside the report, such as "spindown-laws"; lower case, digits and hyphens; unique in a document
            together with the anchors of the sections around it.
        table: what is in it; its title stands above it as a caption, where it has one.
        note: explains the columns, small print below it.
        first_column_wraps: whether the first column holds names, which may be long and are folded.
        wraps: heads of columns of sentences, which are folded and take the width that others leave.
        narrow: on a narrow screen: "scroll": it is moved sideways; "stack": each row is a block, and its cells stand
            below each other with their heads before them; "turn": heads of numbers are written upwards.
        mark: what of it is synthetic, for formats that take it out of the document: "SYNTHETIC.", or empty where
            nothing is; None: as the banner of the section or document around it says.
    """

    name: str
    table: Table
    note: str = ""
    first_column_wraps: bool = False
    wraps: tuple[str, ...] = ()
    narrow: Literal["scroll", "stack", "turn"] = "scroll"
    mark: str | None = None


@dataclass(frozen=True)
class Listing:
    """A long narrow table of readings.

    A format folds it into pieces of some ten rows side by side, as many as fit the page's width, each with the heads.

    Attributes:
        name: as that of a `Tabular`.
        table: all its rows.
        note: small print below it; such as "the first 200 of 20000".
        rows_in_a_piece: how many.
    """

    name: str
    table: Table
    note: str = ""
    rows_in_a_piece: int = 10


@dataclass(frozen=True)
class Points:
    """The points of a figure that answer to the pointer and to the keyboard's focus.

    Attributes:
        gid: of the artist in the figure, as given to matplotlib's `set_gid`; such as "readings-disc".
        texts: of its points in their order: value, uncertainty, residual; lines separated by line feeds.
    """

    gid: str
    texts: tuple[str, ...]


@dataclass(frozen=True)
class Picture:
    """A figure.

    It is as wide as the text, its caption below it on the same page; only a tall one is divided between pages, and only
    between two rows of panels.  Figures are drawn in dark on white, and stay on a white card where the page is dark.

    Attributes:
        name: such as "spindown"; lower case, digits and hyphens; the prefix of ids where it is inlined.
        title: in bold at the beginning of the caption.
        caption: what is to be seen, in sentences.
        alt: the same in a few words for readers who do not see it; never empty.
        draw: returns the matplotlib figure, a new one at each call.
        points: what answers to the pointer; a format without a pointer passes over it.
        raster: whether it is so full of lines or points that PNG is smaller than a drawing of lines.
        most_inch: its greatest height on paper; a higher one is made smaller [inch].
    """

    name: str
    title: str
    caption: str
    alt: str
    draw: Callable[[], Figure]
    points: tuple[Points, ...] = ()
    raster: bool = False
    most_inch: float = math.inf


@dataclass(frozen=True)
class Section:
    """A heading and what stands below it.

    How deep it lies in others is how deep its heading is: a section of the document itself is of the second level,
    below the title.  A heading never stands alone at the end of a page.

    Attributes:
        title: the heading.
        blocks: below it.
        anchor: the name by which links find it, such as "result"; lower case, digits and hyphens.  A renderer makes it
            unique by a number where it is used again.  Empty for none.
        lead: a line below the heading, quieter than text; empty for none.
        new_page: whether it begins on a page of its own where there are pages.
    """

    title: str
    blocks: tuple[Block, ...]
    anchor: str = ""
    lead: str = ""
    new_page: bool = False


@dataclass(frozen=True)
class Details:
    """What most readers pass over: on a screen folded below its summary, which opens it.

    Attributes:
        summary: one line.
        more: quieter text after the summary in its line; empty for none.
        blocks: what it opens.
        on_paper: "whole": printed, the summary as a small heading; "summary": the summary alone; "out": nothing is.
    """

    summary: str
    blocks: tuple[Block, ...]
    more: str = ""
    on_paper: Literal["whole", "summary", "out"] = "whole"


Block: TypeAlias = (
    Paragraph
    | Note
    | Verdict
    | Banner
    | Warnings
    | Bullets
    | Code
    | Question
    | Facts
    | Tabular
    | Listing
    | Picture
    | Section
    | Details
)


@dataclass(frozen=True)
class Document:
    """A whole document.

    Attributes:
        title: the largest heading, once, at its beginning.
        lead: a line below it: how much was used, when it was measured.
        blocks: in their order; mostly sections.
        banner: stands directly below title and lead; None where nothing is synthetic.
        contents: whether links to the sections of the first depth stand before the blocks (HTML), or an outline (PDF).
        subject: the name of the file's window or in its metadata; empty for the title.
        byline: a line between title and lead: course, authors, date; empty for none.
        language: of its texts, for hyphens and screen readers.
        date: when the newest of the data were taken, in the file's properties; None where that is not known.
    """

    title: str
    lead: str
    blocks: tuple[Block, ...]
    banner: Banner | None = None
    contents: bool = False
    subject: str = ""
    byline: str = ""
    language: str = "en"
    date: datetime | None = None


T = TypeVar("T")

#: What stands in a document as it is: names of parts, and commands.
_NOT_SAID = frozenset({"name", "anchor", "narrow", "on_paper", "gid", "code", "byline", "kind"})


def in_language_of_reader(part: T, code: str | None = None) -> T:
    """Return a document, or a part of one, in a language, by default that of this process; commands stay."""
    if isinstance(part, str):
        return in_language(part, code)  # type: ignore[return-value]
    if isinstance(part, tuple | list):
        return type(part)(in_language_of_reader(one, code) for one in part)
    if not is_dataclass(part) or isinstance(part, type | Code):
        return part
    if isinstance(part, Fact):
        texts = part.texts if part.code else in_language_of_reader(part.texts, code)
        return replace(part, name=in_language(part.name, code), texts=texts)
    if isinstance(part, Points | Table):
        return _with_numbers(part, code)  # type: ignore[return-value]
    said = {field.name: getattr(part, field.name) for field in fields(part) if field.name not in _NOT_SAID}
    return replace(part, **{name: in_language_of_reader(value, code) for name, value in said.items()})


def _with_numbers(part: Points | Table, code: str | None) -> Points | Table:
    """Return points, or a table with the cells of its columns of numbers, with the decimal sign of a language."""
    if isinstance(part, Points):
        return replace(part, texts=tuple(numbers_in_language(text, code) for text in part.texts))
    say = [numbers_in_language if k in part.numbers else in_language for k in range(len(part.heads))]
    rows = tuple(
        replace(row, cells=tuple(one(cell, code) for one, cell in zip(say, row.cells, strict=True)))
        for row in part.rows
    )
    heads = in_language_of_reader(part.heads, code)
    return replace(part, title=in_language(part.title, code), heads=heads, rows=rows)


B = TypeVar("B", bound="Block")


def with_marks(blocks: Iterable[B], mark: str) -> list[B]:
    """Return the blocks; each table in them that has no mark of its own gets this one.

    Args:
        blocks: of a document.
        mark: what of them is synthetic, see `Tabular`.

    >>> from levilab.present.tables import table
    >>> own, other = (Tabular("laws", table("", ["law"], []), mark=mark) for mark in ("", None))
    >>> (section,) = with_marks([Section("Result", (own, other))], "SYNTHETIC.")
    >>> [block.mark for block in section.blocks]
    ['', 'SYNTHETIC.']
    """
    return [_with_mark(block, mark) for block in blocks]


def _with_mark(block: B, mark: str) -> B:
    if isinstance(block, Tabular):
        return block if block.mark is not None else replace(block, mark=mark)
    if isinstance(block, Section | Details):
        return replace(block, blocks=tuple(with_marks(block.blocks, mark)))
    return block


@dataclass(frozen=True)
class InShort:
    """What a chapter of several found, for the beginning of the document.

    Attributes:
        title, anchor: of the chapter.
        verdict: below the doubts about it; empty for none.
        notes: their number as text; empty for none.
    """

    title: str
    anchor: str
    verdict: str
    notes: str


def in_short(blocks: Iterable[Block]) -> list[InShort]:
    """Return what each chapter found; empty where less than two of them found anything."""
    found = []
    for chapter in blocks:
        if isinstance(chapter, Section):
            inner = [*all_in(chapter)]
            verdict = next((one.text for one in inner if isinstance(one, Verdict)), "")
            before = takewhile(lambda one: not isinstance(one, Verdict), inner)
            doubts = [group[0] for one in before if isinstance(one, Warnings) for group in one.groups if verdict]
            before_use = [" ".join([in_language("Before you use the numbers."), *doubts])] if doubts else []
            verdict = "\n".join([*before_use, verdict])
            count = sum(len(group) for one in inner if isinstance(one, Warnings) for group in one.groups)
            notes = in_language(Text("{n} notes", n=count) if count > 1 else "1 note" if count else "")
            found.append(InShort(chapter.title, chapter.anchor, verdict, notes))
    return found if sum(bool(one.verdict) for one in found) > 1 else []


def all_in(block: Block) -> Iterator[Block]:
    """Yield a block, and those in it if it is a section."""
    yield block
    for inner in block.blocks if isinstance(block, Section) else ():
        yield from all_in(inner)

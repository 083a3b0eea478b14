"""A document → PDF: its blocks as data, which the template report.typ draws.

Texts reach typst as strings of a JSON file and never as markup, so nothing in them has to be escaped.
"""

import json
import math
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import Any

from levilab.errors import LevilabError
from levilab.present.characters import printable
from levilab.present.document.blocks import (
    MOST_ALIKE,
    Banner,
    Block,
    Bullets,
    Code,
    Details,
    Document,
    Fact,
    Facts,
    Listing,
    Note,
    Paragraph,
    Picture,
    Question,
    Section,
    Tabular,
    Verdict,
    Warnings,
    all_in,
    in_short,
    with_options,
)
from levilab.present.document.typesetting import typeset
from levilab.present.tables import Table
from levilab.software import how_to_install
from levilab.texts.text import Text as Said
from levilab.texts.text import in_language

TEMPLATE = "report.typ"
#: Letters of a word that is never divided; a longer one is divided behind what stands between its parts, as in a path.
LONGEST_WORD = 24
#: Characters of the title in the head of each page.
SHORT_TITLE = 90
#: Entries up to which an outline has those of the second depth.
MOST_ENTRIES = 20
#: The file with the size of the letters, and the names of the figures that move.
SETTING = "setting.json"
#: Sizes of the letters [pt]: as a rule, and where a last page that ends above its middle is saved by them.
LARGEST, SMALLER, NEARLY_EMPTY = 10.0, 9.4, 0.5
#: A figure that was made smaller for one page is larger by the first of these factors with which all of it still fits.
ENLARGED = (1.5, 1.35, 1.2)
#: Height over width from which a figure may leave its place in the text for the top of a page.
TALL = 0.4
#: What no PDF may contain: code points that are no characters, and those for private use, which no font has.
_NO_CHARACTERS = re.compile("[\ufdd0-\ufdef\ufffe\uffff\ue000-\uf8ff\U000f0000-\U0010ffff]")

#: A text for the template: a string, or parts of it: strings, (level, string), None where a word may be divided.
Text = Any
Drawn = dict[str, Any]


class NoTypst(LevilabError):
    """The library that sets PDF is not installed."""


def check_typst() -> None:
    """Raise NoTypst if PDF cannot be set here."""
    if find_spec("typst") is None:
        raise NoTypst(
            f"a PDF needs the extra pdf (typst, which is not installed): {how_to_install('pdf')}, "
            "or name the report report.html"
        )


def as_pdf(document: Document) -> bytes:
    """Return a document as PDF; the same bytes for the same document.

    Raises:
        NoTypst: the extra `pdf` is not installed.
    """
    check_typst()
    try:
        import typst
    except ImportError as error:  # installed, but not for this Python or machine
        raise NoTypst(
            f"a PDF is set by typst, which is installed but cannot be loaded ({error}): "
            "pip install --force-reinstall typst, or name the report report.html"
        ) from error

    files: Any = settle(document)  # a dictionary of files is missing in the types that typst declares
    return typst.compile(files, format="pdf", font_paths=fonts(), ignore_system_fonts=True)


def settle(document: Document) -> dict[str, bytes]:
    """Return its files with the places and sizes of the figures, in smaller letters where these save a last page."""
    files = files_of(document)
    size = LARGEST
    settled, pages, end = _place_figures(files, size)
    if pages > 1 and end < NEARLY_EMPTY:
        smaller, fewer, _ = _place_figures(files, SMALLER)
        if fewer < pages:
            settled, pages, size = smaller, fewer, SMALLER
    every = (inner for block in document.blocks for inner in all_in(block))
    if any(isinstance(one, Picture) and math.isfinite(one.most_inch) for one in every):
        larger = (_place_figures(files, size, factor) for factor in ENLARGED)
        return next((enlarged for enlarged, more, _ in larger if more == pages), settled)
    return settled


def _place_figures(files: dict[str, bytes], size: float, enlarged: float = 1.0) -> tuple[dict[str, bytes], int, float]:
    """Return the files, figures that do not fit where they are called at the top of the next page, and the last page.

    The document is set again after each of them, since one that moves makes room for the text behind it.  Where the
    template queries each figure's own place, typst's five attempts do not suffice for several figures.

    Args:
        files: of the document.
        size: of its letters [pt].
        enlarged: factor on the sizes of figures that were made smaller.

    Returns:
        The files, the number of pages, and where the last one ends [parts of its height].
    """
    import typst

    moved: list[str] = []
    while True:
        given: Any = files | {SETTING: json.dumps({"size": size, "moved": moved, "enlarged": enlarged}).encode()}
        found = typst.query(given, "<setting>", field="value", one=True, font_paths=fonts(), ignore_system_fonts=True)
        said = json.loads(found)
        away = [file for file, called, stands in said["figures"] if stands > called and file not in moved]
        if not away:
            return given, said["pages"], said["end"]
        moved.append(away[0])


def fonts() -> list[Path]:
    """Return folders of fonts beside typst's own: those in matplotlib have what these lack."""
    from levilab.present.style import font_folder  # with matplotlib

    return [font_folder()]


def files_of(document: Document) -> dict[str, bytes]:
    """Return the files that typst sets: the template, the document as data, the figures."""
    drawing = _Drawing()
    content = _content(document, drawing)
    template = (resources.files("levilab.report.pdf") / TEMPLATE).read_bytes()
    data = json.dumps(content, allow_nan=False, ensure_ascii=True, sort_keys=True).encode()
    return {"main.typ": template, "document.json": data, **drawing.files}


@dataclass(frozen=True)
class _Drawing:
    """What blocks are drawn into.

    Attributes:
        files: the figures, by their names; typst takes text alone, so that each is a list of its bytes.
    """

    files: dict[str, bytes] = field(default_factory=dict)

    def blocks(self, blocks: Iterable[Block]) -> list[Drawn]:
        """Return blocks as data, without those that are not printed."""
        return [drawn for block in blocks if (drawn := _BLOCKS[type(block)](block, self)) is not None]

    def figure(self, picture: Picture) -> Drawn:
        """Draw a figure: the name of its file, its format, its width, and whether it may leave its place."""
        from levilab.present.style import TALLEST, WIDE, as_png  # with matplotlib
        from levilab.present.style import as_pdf as figure_as_pdf

        drawn = picture.draw()
        kind, data = ("png", as_png(drawn, dpi=200)) if picture.raster else ("pdf", figure_as_pdf(drawn))
        name = f"figure-{len(self.files) + 1}.json"
        self.files[name] = json.dumps([*data], separators=(",", ":")).encode()
        width, height = drawn.get_size_inches()
        shape = float(height / width)
        return {
            "file": name,
            "format": kind,
            "floats": shape > TALL and picture.most_inch > TALLEST,
            "width": min(100.0, 100 * min(TALLEST, picture.most_inch) / WIDE / shape),
            "small": math.isfinite(picture.most_inch),
        }


def _content(document: Document, drawing: _Drawing) -> Drawn:
    title = _plain(document.title)
    count = next((k for k, block in enumerate(document.blocks) if isinstance(block, Section)), len(document.blocks))
    first, rest = document.blocks[:count], document.blocks[count:]
    return {
        "title": title,
        "short": _text(title if len(title) <= SHORT_TITLE else f"{title[: SHORT_TITLE - 1]}…"),
        "heading": _text(document.title),
        "date": None if document.date is None else _date(document.date),
        "byline": _text(document.byline),
        "language": document.language,
        "lead": _text(document.lead),
        "banner": None if document.banner is None else _banner(document.banner, drawing),
        "mark": _text(document.banner.lead.rstrip(".")) if document.banner else "",
        "before": drawing.blocks(first),
        "chapters": [
            {"title": _text(one.title), "verdict": _text(one.verdict), "notes": one.notes} for one in in_short(rest)
        ],
        "outline": _outline_depth(document),
        "blocks": drawing.blocks(rest),
    }


def _outline_depth(document: Document) -> int:
    """Return the depth of the outline; 0 for none.  The template leaves it out of a document of few pages."""
    sections = [block for block in document.blocks if isinstance(block, Section)]
    if not document.contents:
        return 0
    inner = sum(isinstance(block, Section) for section in sections for block in section.blocks)
    return 2 if len(sections) + inner <= MOST_ENTRIES else 1


def _date(date: datetime) -> dict[str, int]:
    return {name: getattr(date, name) for name in ("year", "month", "day", "hour", "minute", "second")}


# --- texts ---------------------------------------------------------------------------------------------


def _plain(text: str) -> str:
    """Return a text of one line, without what no PDF may contain."""
    clean = _NO_CHARACTERS.sub("\N{REPLACEMENT CHARACTER}", printable(text.replace("\t", " ")))
    return " ".join(clean.encode(errors="replace").decode().split("\n"))


def _text(text: str) -> Text:
    r"""Return a text as its parts, with superscripts, subscripts and places where long words may be divided.

    >>> _text("3.2(1)×10⁻³ s⁻¹")
    ['3.2(1)×10', ['high', '−3'], ' s', ['high', '−1']]
    >>> _text("plain")
    'plain'
    >>> _text("one\ntwo")
    ['one', ['line', ''], 'two']
    """
    parts: list[Any] = []
    for k, line in enumerate(text.split("\n")):
        parts += [_BREAK] * bool(k) + _parts(line)
    return parts[0] if len(parts) == 1 and isinstance(parts[0], str) else parts or ""


#: The part of a text at which a line begins.
_BREAK = ["line", ""]


def _parts(line: str) -> list[Any]:
    parts: list[Any] = []
    for run in typeset(_plain(line)):
        if run.level:
            parts.append([run.level, run.text])
        else:
            parts += _divisible(run.text)
    return parts


#: Behind these a path, an address or a list without blanks may be divided.
_JOINT = re.compile(r"(?<=[/\\_.,;:=&?+|-])(?=\w)")
_LONG_WORD = re.compile(rf"\S{{{LONGEST_WORD + 1},}}")


def _divisible(text: str) -> list[str | None]:
    """Return a text with None wherever a word longer than this may be divided.

    >>> _divisible("in runs/20261120T101500Z-spin-7f3a or x.csv")
    ['in runs/', None, '20261120T101500Z-', None, 'spin-', None, '7f3a or x.csv']
    """
    parts: list[str | None] = []
    at = 0
    for word in _LONG_WORD.finditer(text):
        before = text[at : word.start()]
        pieces = [short for piece in _JOINT.split(word[0]) for short in _short(piece)]
        parts += [before + pieces[0], *(part for piece in pieces[1:] for part in (None, piece))]
        at = word.end()
    if not parts:
        return [text]
    rest = text[at:]
    return [*parts[:-1], f"{parts[-1]}{rest}"]


def _short(piece: str) -> list[str]:
    """Return a part of a word in letters one by one where it is long."""
    return [*piece] if len(piece) > LONGEST_WORD else [piece]


def _lines(text: str) -> list[Text]:
    """Return the lines of a cell."""
    return [_text(line) for line in text.split("\n")]


def _monospace(text: str) -> Text:
    """Return a line in letters of one width, divided anywhere; nothing is typeset."""
    parts: list[Any] = []
    for part in with_options(text):
        pieces = _divisible(_plain(part))
        parts += [["whole", part]] if part.startswith("-") and len(pieces) == 1 else pieces
    return parts[0] if len(parts) == 1 else parts


# --- blocks --------------------------------------------------------------------------------------------


def _is_out(block: Block) -> bool:
    """Return whether nothing of a block is printed."""
    if isinstance(block, Section):
        return bool(block.blocks) and all(map(_is_out, block.blocks))
    return isinstance(block, Details) and block.on_paper == "out"


def _section(block: Section, drawing: _Drawing) -> Drawn | None:
    """Return a section; a figure alone stands without a heading, so that text can fill the page before it."""
    if _is_out(block):
        return None
    match block.blocks:
        case (Picture() as picture,):
            return _picture(picture, drawing)
    return {
        "kind": "section",
        "title": _text(block.title),
        "lead": _text(block.lead),
        "page": block.new_page,
        "figures": any(isinstance(one, Picture) for one in all_in(block)),
        "blocks": drawing.blocks(block.blocks),
    }


def _details(block: Details, drawing: _Drawing) -> Drawn | None:
    if _is_out(block):
        return None
    return {
        "kind": "details",
        "summary": _text(block.summary),
        "more": _text(block.more),
        "blocks": drawing.blocks(block.blocks) if block.on_paper == "whole" else [],
    }


def _banner(block: Banner, _: _Drawing) -> Drawn:
    return {"kind": "banner", "lead": _text(block.lead), "text": _text(block.text)}


def _warnings(block: Warnings, _: _Drawing) -> Drawn:
    groups: list[Drawn] = []
    for alike in block.groups:
        if len(alike) > MOST_ALIKE:
            more = in_language(Said("and {n} more like this one", n=len(alike) - 1))
            groups.append({"first": _text(alike[0]), "more": more, "others": [_text(text) for text in alike[1:]]})
        else:
            groups += [{"first": _text(text), "more": "", "others": []} for text in alike]
    return {"kind": "warnings", "groups": groups}


def _facts(block: Facts, _: _Drawing) -> Drawn:
    return {"kind": "facts", "facts": [_fact(fact) for fact in block.facts]}


def _fact(fact: Fact) -> Drawn:
    put = _monospace if fact.code else _text
    return {"name": _text(fact.name), "texts": [put(text) for text in fact.texts], "code": fact.code}


def _tabular(block: Tabular, _: _Drawing) -> Drawn:
    names = block.table.heads[:1] if block.first_column_wraps else ()
    return {"kind": "tabular", **_table(block.table, {*block.wraps, *names}), "note": _text(block.note)}


def _listing(block: Listing, _: _Drawing) -> Drawn:
    return {"kind": "listing", **_table(block.table), "note": _text(block.note), "piece": block.rows_in_a_piece}


def _table(table: Table, wraps: Collection[str] = ()) -> Drawn:
    """Return a table: which of its columns are numbers, and which of the others are folded."""
    return {
        "title": _text(table.title),
        "heads": [_lines(head) for head in table.heads],
        "numbers": [k in table.numbers for k in range(len(table.heads))],
        "wraps": [head in wraps for head in table.heads],
        "rows": [{"kind": row.kind, "cells": [_lines(cell) for cell in row.cells]} for row in table.rows],
    }


def _picture(block: Picture, drawing: _Drawing) -> Drawn:
    return drawing.figure(block) | {
        "kind": "picture",
        "title": _text(block.title),
        "stop": "" if block.title.endswith((".", "?", "!")) else ".",
        "caption": _text(block.caption),
        "alt": _plain(block.alt),
    }


#: Block → what the template gets of it; None: nothing is printed.
_BLOCKS: Mapping[type, Callable[[Any, _Drawing], Drawn | None]] = MappingProxyType(
    {
        Paragraph: lambda it, _: {"kind": "paragraph", "lead": _text(it.lead), "text": _text(it.text)},
        Note: lambda it, _: {"kind": "note", "text": _text(it.text)},
        Verdict: lambda it, _: {"kind": "verdict", "text": _text(it.text)},
        Banner: _banner,
        Warnings: _warnings,
        Bullets: lambda it, _: {"kind": "bullets", "texts": [_text(text) for text in it.texts]},
        Code: lambda it, _: {"kind": "code", "lines": [_monospace(line) for line in it.text.split("\n")]},
        Question: lambda it, _: {
            "kind": "question",
            "lead": _text(it.lead),
            "text": _text(it.text),
            "lines": it.lines,
            "answer": _text(it.answer),
        },
        Facts: _facts,
        Tabular: _tabular,
        Listing: _listing,
        Picture: _picture,
        Section: _section,
        Details: _details,
    }
)

"""Blocks as HTML, built of elements, so that no text can become markup; a table of functions, one a kind of block."""

import base64
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from html import escape
from types import MappingProxyType
from typing import Any, TypeAlias

from levilab.present.document.blocks import (
    MOST_ALIKE,
    Banner,
    Block,
    Bullets,
    Code,
    Details,
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
    with_options,
)
from levilab.present.document.typesetting import typeset
from levilab.present.tables import Row, Table
from levilab.present.words import free_name
from levilab.texts.text import Text, in_language

#: Elements that have no content and no end.
_EMPTY = frozenset({"meta", "br", "img"})
_LEVELS = {"": "", "high": "sup", "low": "sub"}


@dataclass(frozen=True)
class Html:
    """Markup.  Only this module and files of ours make it; all else is text."""

    markup: str


#: What an element holds.
Child: TypeAlias = "str | Html | Iterable[Child]"


def element(name: str, /, *children: Child, **attributes: str | bool | None) -> Html:
    """Return an element.

    Args:
        name: such as "p".
        *children: text, which is escaped, elements, or several of them.
        **attributes: an underscore at the end is dropped (class_), others become hyphens; True stands without a value,
            None and False are left out.

    >>> element("p", "a < b", class_="lead", hidden=True, id=None).markup
    '<p class="lead" hidden>a &lt; b</p>'
    """
    given = "".join(_attribute(key, value) for key, value in attributes.items())
    if name in _EMPTY:
        return Html(f"<{name}{given}>")
    return Html(f"<{name}{given}>{join(children).markup}</{name}>")


def _attribute(key: str, value: str | bool | None) -> str:  # noqa: FBT001 - an attribute's value
    if value is None or value is False:
        return ""
    name = key.removesuffix("_").replace("_", "-")
    return f" {name}" if value is True else f' {name}="{escape(value)}"'


def join(children: Iterable[Child]) -> Html:
    """Return elements and texts one after the other."""
    return Html("".join(_markup(child) for child in children))


def _markup(child: Child) -> str:
    if isinstance(child, Html):
        return child.markup
    return escape(child) if isinstance(child, str) else join(child).markup


def words(text: str) -> Html:
    """Return a text with powers and indices set high and low.

    >>> words("3×10⁻⁴ <b>").markup
    '3×10<sup>−4</sup> &lt;b&gt;'
    """
    return join(element(_LEVELS[run.level], run.text) if run.level else run.text for run in typeset(text))


def lines(text: str) -> Html:
    r"""Return the same of several lines.

    >>> lines("ν₀\n[Hz]").markup
    'ν<sub>0</sub><br>[Hz]'
    """
    first, *others = text.split("\n")
    return join([words(first), *((element("br"), words(line)) for line in others)])


#: No heading is of a deeper level in HTML.
_DEEPEST = 6


@dataclass
class Writer:
    """What is known while blocks are written one after the other.

    Attributes:
        prefix: of all ids, so that pieces of several documents can stand in one notebook.
        taken: all ids, without the prefix.
        points: texts of the points that answer to the pointer, by the id of their element.
        is_alive: whether something in the page wants its script.
    """

    prefix: str = ""
    taken: set[str] = field(default_factory=set)
    points: dict[str, tuple[str, ...]] = field(default_factory=dict)
    is_alive: bool = False

    def new_id(self, name: str) -> str:
        """Return an id that no other element has: the name, and from the second use on a number."""
        plain = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "part"
        return f"{self.prefix}{free_name(plain, self.taken, '-')}"

    def blocks(self, blocks: Iterable[Block], level: int) -> Html:
        """Return blocks below each other; level: of the headings among them."""
        return join((_RENDERERS[type(block)](self, block, level), "\n") for block in blocks)


# --- words ---------------------------------------------------------------------------------------------


def _paragraph(_: Writer, block: Paragraph, __: int) -> Html:
    lead = join([element("strong", words(block.lead)), " "]) if block.lead else ""
    return element("p", lead, lines(block.text))


def _note(_: Writer, block: Note, __: int) -> Html:
    return element("p", words(block.text), class_="note")


def _verdict(_: Writer, block: Verdict, __: int) -> Html:
    return element("p", lines(block.text), class_="verdict")


def _banner(_: Writer, block: Banner, __: int) -> Html:
    return element("div", element("strong", block.lead), " ", words(block.text), class_="synthetic", role="note")


def _bullets(_: Writer, block: Bullets, __: int) -> Html:
    return element("ul", [element("li", words(text)) for text in block.texts])


def _code(_: Writer, block: Code, __: int) -> Html:
    parts = (element("span", part) if part.startswith("-") else part for part in with_options(block.text))
    return element("pre", element("code", *parts))


def _question(_: Writer, block: Question, __: int) -> Html:
    if block.answer:
        asked = element("p", element("strong", block.lead, " ", words(block.text)))
        return element("div", asked, element("p", words(block.answer)), class_="question")
    lines = [element("div", class_="line")] * block.lines
    return element("div", element("p", element("strong", block.lead), " ", words(block.text)), lines, class_="question")


def _warnings(_: Writer, block: Warnings, __: int) -> Html:
    if not block.groups:
        return element("p", in_language("None."), class_="none")
    return element("ul", [_alike(group) for group in block.groups], class_="warnings")


def _alike(group: tuple[str, ...]) -> Html:
    if len(group) <= MOST_ALIKE:
        return join(element("li", words(text)) for text in group)
    others = element("ul", [element("li", words(text)) for text in group[1:]])
    summary = element("summary", in_language(Text("and {n} more like this one", n=len(group) - 1)))
    return element("li", words(group[0]), element("details", summary, others))


def _facts(_: Writer, block: Facts, __: int) -> Html:
    return element("dl", [(element("dt", words(fact.name)), element("dd", _texts(fact))) for fact in block.facts])


def _texts(fact: Fact) -> list[Html]:
    return [element("code", text) if fact.code else element("span", words(text)) for text in fact.texts]


# --- tables --------------------------------------------------------------------------------------------


def _tabular(_: Writer, block: Tabular, __: int) -> Html:
    classes = _classes(block.table, block.wraps, names=block.first_column_wraps)
    drawn = _table(block.table, block.table.rows, classes, block.narrow)
    named = block.table.title or block.name.replace("-", " ")
    return element("div", _scroll_sideways(drawn, named), _small_print(block.note), class_="table")


def _listing(_: Writer, block: Listing, __: int) -> Html:
    size, rows, classes = block.rows_in_a_piece, block.table.rows, _classes(block.table)
    whole = replace(block.table, title="")
    pieces = [_table(whole, rows[k : k + size], classes) for k in range(0, len(rows), size)]
    title = element("strong", words(block.table.title)) if block.table.title else ""
    shown = _scroll_sideways(join(pieces), block.table.title or block.name.replace("-", " "), "scroll pieces")
    return element("div", title, shown, _small_print(block.note), class_="listing")


def _scroll_sideways(drawn: Html, name: str, kind: str = "scroll") -> Html:
    """Return what is too wide is moved sideways, also from the keyboard."""
    return element("div", drawn, class_=kind, tabindex="0", role="region", aria_label=name)


def _classes(table: Table, wraps: Iterable[str] = (), *, names: bool = False) -> tuple[str | None, ...]:
    """Return the class of each column: numbers, sentences, names, or none of these."""
    folded = set(wraps)
    return tuple(
        "n" if k in table.numbers else "words" if head in folded else "name" if names and k == 0 else None
        for k, head in enumerate(table.heads)
    )


def _table(table: Table, rows: Iterable[Row], classes: tuple[str | None, ...], narrow: str = "scroll") -> Html:
    title = element("caption", words(table.title)) if table.title else ""
    heads = [
        element("th", lines(head), class_="n" if kind == "n" else None, scope="col")
        for head, kind in zip(table.heads, classes, strict=True)
    ]
    head = element("thead", element("tr", heads)) if any(table.heads) else ""
    named = table.heads if narrow == "stack" else ("",) * len(table.heads)
    body = [(_row(row, classes, named), "\n") for row in rows]
    return element("table", title, head, element("tbody", body), class_=None if narrow == "scroll" else narrow)


def _row(row: Row, classes: tuple[str | None, ...], heads: Iterable[str]) -> Html:
    cells = [
        element("td", lines(cell), class_=kind, data_head=head or None)
        for cell, kind, head in zip(row.cells, classes, heads, strict=True)
    ]
    return element("tr", cells, class_=row.kind or None)


#: Letters of small print from which on it folds.
_LONG = 250


def _small_print(text: str) -> Html | str:
    """Return small print below a table; a long one opens from a line."""
    said = element("p", words(text), class_="note") if text else ""
    return (
        element("details", element("summary", in_language("About this table"), class_="note"), said)
        if len(text) > _LONG
        else said
    )


# --- figures -------------------------------------------------------------------------------------------


#: Height over width below which a figure shares a printed page with the result above it.
_WIDE = 0.75


def _picture(writer: Writer, block: Picture, _: int) -> Html:
    from levilab.present.style import as_png, as_svg  # with matplotlib

    prefix = writer.new_id(block.name)
    figure = block.draw()
    if block.raster:
        source = f"data:image/png;base64,{base64.b64encode(as_png(figure)).decode()}"
        drawn = element("img", src=source, alt=block.alt)
    else:
        svg = as_svg(figure, prefix, title=block.alt)
        drawn = Html(svg)
        writer.is_alive = True
        writer.points |= {
            f"{prefix}-{points.gid}": points.texts
            for points in block.points
            if _count_marks(svg, f"{prefix}-{points.gid}") == len(points.texts)
        }
    caption = element("figcaption", element("strong", words(block.title)), " ", words(block.caption))
    width, height = figure.get_size_inches()
    size = "card short" if math.isfinite(block.most_inch) else "card wide" if height < _WIDE * width else "card"
    card = element("div", drawn, class_=size, tabindex="0", style=f"--shape: {height / width:.3f}")
    return element("figure", card, caption, id=prefix)


def _count_marks(svg: str, group: str) -> int:
    """Count the points drawn in the only group of that name: a figure may thin them out, and then none answers."""
    _, *after = svg.split(f'<g id="{group}">')
    return after[0].partition("<g id=")[0].count("<use ") if len(after) == 1 else 0


# --- what holds other blocks ---------------------------------------------------------------------------


def _section(writer: Writer, block: Section, level: int) -> Html:
    anchor = writer.new_id(block.anchor) if block.anchor else None
    heading = element(f"h{min(level, _DEEPEST)}", words(block.title))
    lead = element("p", words(block.lead), class_="lead") if block.lead else ""
    kind = "new-page" if block.new_page else None
    return element("section", heading, lead, writer.blocks(block.blocks, level + 1), id=anchor, class_=kind)


def _details(writer: Writer, block: Details, level: int) -> Html:
    more = join([" ", element("small", words(block.more))]) if block.more else ""
    writer.is_alive = True  # browsers print what is folded only where the script opens it
    summary = element("summary", element("strong", words(block.summary)), more)
    body = element("div", writer.blocks(block.blocks, level), class_="body")
    return element("details", summary, body, class_=f"on-paper-{block.on_paper}")


_RENDERERS: Mapping[type, Callable[[Writer, Any, int], Html]] = MappingProxyType({
    Paragraph: _paragraph, Note: _note, Verdict: _verdict, Banner: _banner, Bullets: _bullets, Code: _code,
    Question: _question, Warnings: _warnings, Facts: _facts, Tabular: _tabular, Listing: _listing, Picture: _picture,
    Section: _section, Details: _details,
})  # fmt: skip

"""A document → one HTML page with everything in it: nothing is fetched when it is opened."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

from levilab.present.document.blocks import Section
from levilab.report.html.blocks import Writer
from levilab.report.html.elements import Html, element, joined, words

if TYPE_CHECKING:
    from collections.abc import Iterable

    from levilab.present.document.blocks import Block, Document

#: Nothing is loaded, and no script runs but our own.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


def page_of(document: Document) -> str:
    """The whole page; the same document always has the same text."""
    writer = Writer()
    body = joined(
        [
            element("header", _head(document), class_="title"),
            writer.blocks(document.blocks, level=2),
            element("footer", words(document.footer)) if document.footer else "",
        ]
    )
    head = joined([
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", http_equiv="Content-Security-Policy", content=_POLICY),
        element("title", document.title),
        element("style", Html(style())),
    ])  # fmt: skip
    page = element("html", element("head", head), element("body", element("main", body)), lang="en")
    return f"<!DOCTYPE html>\n{page.markup}\n"


def fragment_of(blocks: Iterable[Block], prefix: str = "") -> str:
    """Blocks as a part of a page that is not ours, such as a notebook: without script, and with a style of its own.

    Args:
        blocks: in their order.
        prefix: of all ids, which differs from that of other fragments in the page.
    """
    scoped = Html(f".levilab-part {{\n{style()}\n}}")
    return element(
        "div", element("style", scoped), Writer(prefix).blocks(blocks, level=2), class_="levilab-part"
    ).markup


def _head(document: Document) -> list[Html]:
    banner = Writer().blocks([document.banner], level=2) if document.banner else joined([])
    lead = element("p", words(document.lead), class_="lead") if document.lead else joined([])
    return [element("h1", words(document.title)), lead, banner, _contents(document)]


def _contents(document: Document) -> Html:
    """Links to the sections of the first depth."""
    sections = [block for block in document.blocks if isinstance(block, Section) and block.anchor]
    if not document.contents or not sections:
        return joined([])
    writer = Writer()
    links = [element("a", words(one.title), href=f"#{writer.new_id(one.anchor)}") for one in sections]
    return element("nav", links, aria_label="Contents")


@cache
def style() -> str:
    """The page's style sheet."""
    return files("levilab.report.html").joinpath("style.css").read_text(encoding="utf-8")

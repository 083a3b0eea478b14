"""A document → one HTML page with everything in it: nothing is fetched when it is opened."""

import base64
import json
from collections.abc import Iterable
from functools import cache
from hashlib import sha256
from importlib.resources import files

from levilab.formats.kinds import TITLE
from levilab.present.document.blocks import Block, Document, InShort, Section, in_short
from levilab.report.html.blocks import Html, Writer, element, join, lines, words


def page_of(document: Document) -> str:
    """Return the whole page; the same document always has the same text."""
    writer = Writer()
    body = join([element("header", _head(document, writer)), "\n", writer.blocks(document.blocks, level=2)])
    head = join([
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", http_equiv="Content-Security-Policy", content=_policy()),
        element("title", f"{TITLE}{document.subject or document.title}"),
        element("style", Html(style())),
    ])  # fmt: skip
    scripts = (_island(writer), element("script", Html(script()))) if writer.is_alive else ()
    body = element("body", element("main", body), *scripts, class_="levilab")
    page = element("html", element("head", head), "\n", body, lang=document.language)
    return f"<!DOCTYPE html>\n{page.markup}\n"


def fragment_of(blocks: Iterable[Block], prefix: str = "") -> str:
    """Return blocks as a part of another page, such as a notebook: without script, with a style of its own.

    Args:
        blocks: in their order.
        prefix: of all ids, which differs from that of other fragments in the page; it begins with a letter.
    """
    scoped = Html(f".levilab-part {{\n{style()}\n}}")  # a sheet inside of a selector reaches nothing else of the page
    body = element("main", Writer(prefix).blocks(blocks, level=2), class_="levilab")
    return element("div", element("style", scoped), body, class_="levilab-part").markup


def _head(document: Document, writer: Writer) -> list[Html]:
    banner = writer.blocks([document.banner], level=2) if document.banner else join([])
    lead = element("p", words(document.lead), class_="lead") if document.lead else join([])
    byline = element("p", words(document.byline), class_="byline") if document.byline else join([])
    return [element("h1", words(document.title)), byline, lead, banner, _contents(document)]


def _contents(document: Document) -> Html:
    """Return links to the sections of the first depth; of several chapters with what each found."""
    sections = [block for block in document.blocks if isinstance(block, Section) and block.anchor]
    if not document.contents or not sections:
        return join([])
    writer = Writer()
    if chapters := in_short(sections):
        return element(
            "nav",
            [_chapter(one, writer.new_id(one.anchor)) for one in chapters],
            class_="chapters",
            aria_label="Contents",
        )
    links = [element("a", words(one.title), href=f"#{writer.new_id(one.anchor)}") for one in sections]
    return element("nav", links, aria_label="Contents")


def _chapter(one: InShort, name: str) -> Html:
    """Return a link to a chapter with the number of its notes, and its verdict."""
    notes = element("small", words(one.notes)) if one.notes else join([])
    verdict = element("p", lines(one.verdict), class_="verdict") if one.verdict else join([])
    return join([element("p", element("a", words(one.title), href=f"#{name}"), notes), verdict])


def _island(writer: Writer) -> Html:
    """Return the texts of the points, as data that no browser takes for markup or runs."""
    text = json.dumps(writer.points, ensure_ascii=False, sort_keys=True).replace("<", "\\u003c").replace("&", "\\u0026")
    return element("script", Html(text), type="application/json", id="points")


@cache
def _policy() -> str:
    """Return a policy by which nothing is loaded, and no script runs but our own, by its hash."""
    hashes = [base64.b64encode(sha256(text.encode()).digest()).decode() for text in (script(), style())]
    return (
        f"default-src 'none'; base-uri 'none'; form-action 'none'; img-src data:; script-src 'sha256-{hashes[0]}'; "
        # attributes alone, which figures have on each line; the second is for browsers that do not know the others
        f"style-src-elem 'sha256-{hashes[1]}'; style-src-attr 'unsafe-inline'; style-src 'unsafe-inline'"
    )


@cache
def style() -> str:
    """Return the page's style sheet."""
    return files("levilab.report.html").joinpath("style.css").read_text(encoding="utf-8")


@cache
def script() -> str:
    """Return the page's script."""
    return files("levilab.report.html").joinpath("script.js").read_text(encoding="utf-8")

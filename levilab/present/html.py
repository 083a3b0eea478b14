"""Facts, tables and parts that fold as HTML, for notebooks: plain elements, which take the notebook's own style."""

from __future__ import annotations

import re
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

#: Texts stand on the left and numbers on the right, with room between columns, whatever a page does with tables.
_LEFT, _RIGHT = "text-align: left; padding: 0 1em 0 0", "text-align: right; padding: 0 1em 0 0"

#: The power in the units of drag laws, (rad/s)^−½/s, for which there are no raised characters.
_POWER = re.compile(r"(?<=\(rad/s\))\^([−-]?[\d½]+(?:/\d+)?|\([^)]*\))")


def facts_as_html(title: str, facts: Iterable[tuple[str, str]], after: str = "") -> str:
    """Return a heading and facts below it, all escaped; a fact without text is left out.

    Args:
        title: the heading.
        facts: (what, in words).
        after: HTML that follows.

    >>> facts_as_html("a run", [("note", "<b>"), ("scene", "")]).count("&lt;b&gt;")
    1
    """
    cells = [(escape(what), escape(text)) for what, text in facts if text]
    rows = "".join(
        f'<tr><td style="{_LEFT}"><b>{what}</b></td><td style="{_LEFT}">{text}</td></tr>' for what, text in cells
    )
    table = f"<table>{rows}</table>" if rows else ""
    return f"<div><p><b>{escape(title)}</b></p>{table}{after}</div>"


def table_as_html(heads: Sequence[str], rows: Iterable[Sequence[str]], texts: int = 1) -> str:
    """Return a table, all escaped.

    Args:
        heads: of its columns; empty: there is no line of heads.
        rows: a text for each column.
        texts: columns at the left that are no numbers.

    >>> table_as_html((), [("c<", "1")]).count("c&lt;")
    1
    """

    def line(cells: Iterable[str], tag: str) -> str:
        styled = (
            (_LEFT if k < texts else _RIGHT, _POWER.sub(r"<sup>\1</sup>", escape(cell))) for k, cell in enumerate(cells)
        )
        return "<tr>" + "".join(f'<{tag} style="{style}">{cell}</{tag}>' for style, cell in styled) + "</tr>"

    head = f"<thead>{line(heads, 'th')}</thead>" if heads else ""
    return f"<table>{head}<tbody>{''.join(line(row, 'td') for row in rows)}</tbody></table>"


def fold(summary: str, inside: str, *, opened: bool = False) -> str:
    """Return HTML that folds below a line; nothing where there is nothing inside.

    >>> fold("two <notes>", "<p>a</p>")
    '<details><summary>two &lt;notes&gt;</summary><p>a</p></details>'
    """
    opening = "<details open>" if opened else "<details>"
    return f"{opening}<summary>{escape(summary)}</summary>{inside}</details>" if inside else ""


def paragraphs(texts: Iterable[str]) -> str:
    """Return a paragraph for each text, escaped."""
    return "".join(f"<p>{escape(text)}</p>" for text in texts)

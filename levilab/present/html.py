"""A few facts and a table as HTML, for notebooks: plain elements, which take the notebook's own style."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

#: Facts stand on the left, whatever the notebook does with tables.
_CELL = '<td style="text-align: left">'


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
    rows = "".join(f"<tr>{_CELL}<b>{what}</b></td>{_CELL}{text}</td></tr>" for what, text in cells)
    return f"<div><p><b>{escape(title)}</b></p><table>{rows}</table>{after}</div>"

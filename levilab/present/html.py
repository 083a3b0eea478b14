"""Facts, tables and parts that fold as HTML, for notebooks: plain elements, which take the notebook's own style."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from levilab.present.document.typesetting import typeset

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import pandas as pd

#: Texts stand on the left and numbers on the right, with room between columns, whatever a page does with tables.
_LEFT, _RIGHT = "text-align: left; padding: 0 1em 0 0", "text-align: right; padding: 0 1em 0 0"

#: Level of a run of text → its element.
_LEVELS = {"high": "sup", "low": "sub"}


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
        styled = ((_LEFT if k < texts else _RIGHT, _set(cell)) for k, cell in enumerate(cells))
        return "<tr>" + "".join(f'<{tag} style="{style}">{cell}</{tag}>' for style, cell in styled) + "</tr>"

    head = f"<thead>{line(heads, 'th')}</thead>" if heads else ""
    return f"<table>{head}<tbody>{''.join(line(row, 'td') for row in rows)}</tbody></table>"


def head_as_html(frame: pd.DataFrame, rows: int, texts: int = 1) -> str:
    """Return the first rows of a table as HTML, numbers with six digits, and a row of dots for the others.

    Args:
        frame: the table.
        rows: their number.
        texts: of the first columns, whose cells are no numbers.
    """
    head = frame.head(rows).map(lambda cell: f"{cell:.6g}" if isinstance(cell, float) else str(cell))
    others = [["…"] * len(head.columns)] if len(frame) > rows else []
    return table_as_html([*map(str, head.columns)], [*head.to_numpy().tolist(), *others], texts=texts)


def fold(summary: str, inside: str, *, opened: bool = False) -> str:
    """Return HTML that folds below a line; nothing where there is nothing inside.

    >>> fold("two <notes>", "<p>a</p>")
    '<details><summary>two &lt;notes&gt;</summary><p>a</p></details>'
    """
    opening = "<details open>" if opened else "<details>"
    return f"{opening}<summary>{escape(summary)}</summary>{inside}</details>" if inside else ""


def paragraphs(texts: Iterable[str]) -> str:
    """Return a paragraph for each text, escaped."""
    return "".join(f"<p>{_set(text)}</p>" for text in texts)


def _set(text: str) -> str:
    """Return a text, escaped, with its powers raised and its indices lowered."""
    runs = ((_LEVELS.get(run.level), escape(run.text)) for run in typeset(text))
    return "".join(f"<{tag}>{run}</{tag}>" if tag else run for tag, run in runs)

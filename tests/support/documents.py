"""Documents with every kind of block."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from levilab.present.document.blocks import (
    Banner,
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
    Section,
    Tabular,
    Verdict,
    Warnings,
)
from levilab.present.tables import table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def drawn() -> Figure:
    """A figure with one line."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 2))
    figure.add_axes((0.1, 0.2, 0.8, 0.7)).plot([0, 1], [1, 0])
    return figure


def of_all_blocks(text: str, **changes: Any) -> Document:
    """A document with every kind of block, all texts of which are this one."""
    shown = table(text, (text, "n"), [(text, "1"), (f"{text}\n{text}", "2")], numbers=["n"])
    blocks = (
        Verdict(text), Banner(text, text), Warnings(((text,), (text,) * 5)), Paragraph(text, text), Note(text),
        Bullets((text,)), Code(f"{text}\n{text}"), Facts((Fact(text, (text, text)), Fact(text, (text,), code=True))),
        Tabular("t", shown, text, wraps=(text,)), Listing("l", shown, text), Picture("p", text, text, text, drawn),
        Details(text, (Paragraph(text),), text), Details(text, (Paragraph("left out"),), on_paper="out"),
    )  # fmt: skip
    whole = Document(text, text, (Section(text, blocks, "a", text),), Banner(text, text))
    return Document(**(vars(whole) | changes))

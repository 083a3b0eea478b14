"""Documents with every kind of block."""

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
    Points,
    Question,
    Section,
    Tabular,
    Verdict,
    Warnings,
)
from levilab.present.tables import Row, table


def drawn():
    """A figure with one line of two points."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 2))
    figure.add_axes((0.1, 0.2, 0.8, 0.7)).plot([0, 1], [1, 0], "o-", gid="readings-0")
    return figure


def all_blocks(text):
    """Every kind of block, with a text wherever one can stand."""
    shown = table(text, (text, "n"), [Row((text, "1"), "best"), Row((f"{text}\n{text}", "2"))], numbers=["n"])
    picture = Picture("figure", text, text, text, drawn, (Points("readings-0", (text, text)),))
    return (
        Verdict(text), Banner(text, text), Warnings(((text,), (text,) * 5)), Paragraph(text, text), Note(text),
        Bullets((text,)), Code(f"{text}\n{text}"), Question(text, text),
        Facts((Fact(text, (text, text)), Fact(text, (text,), code=True))),
        Tabular("t", shown, text, wraps=(text,), narrow="stack"), Listing("l", shown, text), picture,
        Details(text, (Paragraph(text),), text), Details(text, (Paragraph("left out"),), on_paper="out"),
    )  # fmt: skip


def of_all_blocks(text, *, sections=1, **more):
    """A document with every kind of block, all texts of which are this one."""
    found = tuple(Section(text, all_blocks(text), "result", text) for _ in range(sections))
    return Document(text, text, found, Banner(text, text), **more)

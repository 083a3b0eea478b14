"""Docstrings are plain text: what Sphinx would take for markup is written so that it shows what stands there."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx


def as_markup(lines: list[str]) -> list[str]:
    r"""Return the lines of a docstring in reStructuredText.

    An indented block after a colon is code, letters after a backquote do not end the quotation.

    >>> as_markup(["each with `help`:", "", "    run = load()", "", "Those are `Failure`s."])
    ['each with `help`::', '', '    run = load()', '', 'Those are `Failure`\\ s.']
    """
    made = [re.sub(r"(`[^`]+`)(?=\w)", r"\1\\ ", line) for line in lines]
    if "Attributes:" in made:  # a comma would part the names of one field
        names = re.compile(r"^    \w+(, \w+)+(?=: )")
        made = [names.sub(lambda found: found[0].replace(", ", ",\u200b"), line) for line in made]
    for k in range(len(made) - 2):
        here, gap, block = made[k : k + 3]
        indent = len(here) - len(here.lstrip())
        code = block.startswith(" " * (indent + 4)) and not block.strip().startswith(">>>")
        if here.endswith(":") and not here.endswith("::") and not gap.strip() and code:
            made[k] += ":"
    return made


def _process(_app: Sphinx, what: str, _name: str, _thing: Any, _options: Any, lines: list[str]) -> None:
    lines[:] = as_markup(lines)
    if what in {"attribute", "data", "property"}:
        # napoleon takes what stands before a colon in the first line for a type: that line is empty, to docutils, too
        lines.insert(0, "\\")


#: numpy's array of a kind of number, as Sphinx writes it in a signature, and as it shows it.
_ARRAY = re.compile(r"~numpy\.ndarray\[tuple\[~typing\.Any, \.\.\.\], ~numpy\.dtype\[([~\w.]+)\]\]")
_SHOWN = re.compile(r"ndarray\[tuple\[Any, \.\.\.\], dtype\[(\w+)\]\]")


def _shorten_properties(_app: Sphinx, page: Any, _name: str) -> None:
    """Write the type of a property as those of signatures, for which Sphinx has no event."""
    from docutils.nodes import Text
    from sphinx.addnodes import desc_annotation

    for node in page.findall(desc_annotation):
        if _SHOWN.search(node.astext()):
            shown = _SHOWN.sub(r"NDArray[\1]", node.astext()).replace("NDArray[float64]", "Array")
            node.children = [Text(shown)]


def _put_functions_first(_app: Sphinx, page: Any) -> None:
    """Put functions before the classes that they return."""
    from docutils.nodes import section
    from sphinx.addnodes import desc

    for part in page.findall(section):
        part.children.sort(key=lambda node: isinstance(node, desc) and (node["objtype"] != "function") + 1)


def shorten(signature: str, names: dict[str, str]) -> str:
    """Return a signature with the names of types, without their checks, and with ... for a value that a factory makes.

    >>> shorten("(mass_kg: ~typing.Annotated[float, Gt(gt=1e-09)] = 0.1, t: list[int] = <factory>)", {"list[int]": "A"})
    '(mass_kg: float = 0.1, t: A = ...)'
    """
    short = signature.replace("~typing.Annotated", "Annotated").replace("<factory>", "...")
    for text, name in names.items():
        short = short.replace(text, name)
    short = _ARRAY.sub(r"~numpy.typing.NDArray[\1]", short)
    while (start := short.find("Annotated[")) >= 0:
        end = inside = start + len("Annotated[")
        commas, depth = [], 1
        while depth:
            commas += [end] * (short[end] == "," and depth == 1)
            depth += (short[end] in "[(") - (short[end] in "])")
            end += 1
        short = short[:start] + short[inside : commas[0]] + short[end:]
    return short


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    from numpy.typing import ArrayLike
    from sphinx.util.typing import stringify_annotation

    from analysis.arrays import Array

    kinds = {"ArrayLike": ArrayLike, "Array": Array}
    names = {stringify_annotation(kind, "smart"): f"~numpy.typing.{name}" for name, kind in kinds.items()}

    def sign(*of: Any) -> tuple[str | None, ...]:
        if of[1] == "class" and of[2].startswith("levilab.notebook.") and not of[2].endswith(".Quantity"):
            return "", None  # functions return it
        return tuple(text and shorten(text, names) for text in of[-2:])

    app.connect("autodoc-process-signature", sign)
    app.connect("doctree-read", _put_functions_first)
    app.connect("doctree-resolved", _shorten_properties)
    app.connect("autodoc-process-docstring", _process, priority=100)  # before napoleon
    return {"parallel_read_safe": True, "parallel_write_safe": True}

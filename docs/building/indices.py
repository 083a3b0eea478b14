"""Indices and powers of plain text, as ν_d and ω^(3/2), stand in their places on the site."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

#: Code, formulas and tags, which stay; an index of a Greek letter; a power in brackets.
_PARTS = re.compile(r"(<(pre|code|math)\b.*?</\2>|<[^>]*>)|([α-ωΑ-Ω])_([a-z]+)|\^\(([^()<]+)\)", re.DOTALL)


def set_indices(body: str) -> str:
    """Return a page with the indices and powers of its plain text in their places.

    >>> set_indices("<p>ν_d, ω^(3/2)</p> <code>ν_d</code>")
    '<p>ν<sub>d</sub>, ω<sup>3/2</sup></p> <code>ν_d</code>'
    """
    return _PARTS.sub(_place, body)


def _place(found: re.Match[str]) -> str:
    kept, _, letter, index, power = found.groups()
    return kept or (f"{letter}<sub>{index}</sub>" if letter else f"<sup>{power}</sup>")


def _change(_app: Sphinx, _name: str, _template: str, context: dict[str, Any], _tree: object) -> None:
    if "body" in context:
        context["body"] = set_indices(context["body"])


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("html-page-context", _change)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

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
    for k in range(len(made) - 2):
        here, gap, block = made[k : k + 3]
        indent = len(here) - len(here.lstrip())
        code = block.startswith(" " * (indent + 4)) and not block.strip().startswith(">>>")
        if here.endswith(":") and not here.endswith("::") and not gap.strip() and code:
            made[k] += ":"
    return made


def _process(_app: Sphinx, _what: str, _name: str, _thing: Any, _options: Any, lines: list[str]) -> None:
    lines[:] = as_markup(lines)


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("autodoc-process-docstring", _process, priority=100)  # before napoleon
    return {"parallel_read_safe": True, "parallel_write_safe": True}

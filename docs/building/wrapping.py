"""A command that is wider than the page goes on below: no option of it is broken at a hyphen."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

_CODE = re.compile(r"<(pre|code)\b.*?</\1>", re.DOTALL)
_OPTION = re.compile(r"(?<=[\s>])--?[a-z][\w-]*")


def keep_options_whole(body: str) -> str:
    """Return a page with each option in its code in an element that is not broken.

    >>> keep_options_whole("<pre>levilab live --no-open</pre> --x")
    '<pre>levilab live <span class="whole">--no-open</span></pre> --x'
    """
    return _CODE.sub(lambda code: _OPTION.sub(r'<span class="whole">\g<0></span>', code[0]), body)


def _change(_app: Sphinx, _name: str, _template: str, context: dict[str, Any], _tree: object) -> None:
    if "body" in context:
        # Sphinx puts two hyphens behind the name of an argument
        body = re.sub(r"(</\w+>) -- ", r"\1: ", context["body"]).replace(">Variables<", ">Attributes<")
        context["body"] = keep_options_whole(body)


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("html-page-context", _change)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

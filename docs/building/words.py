"""Each page has the words of words.toml in the index: the search finds the page by them, and puts it first."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

from docutils import nodes
from sphinx.addnodes import index
from sphinx.transforms import SphinxTransform

if TYPE_CHECKING:
    from sphinx.application import Sphinx

_FILE = Path(__file__).with_suffix(".toml")
_WORDS: dict[str, str] = tomllib.loads(_FILE.read_text("utf-8"))


class AddWords(SphinxTransform):
    """Add a page's words: as entries of the index, and one by one for its stems."""

    default_priority = 500

    def apply(self, **_: object) -> None:
        """See SphinxTransform."""
        self.env.note_dependency(_FILE)
        if words := _WORDS.get(self.env.docname, "").split():
            entries = " ".join(words).split(", ")
            self.document.append(index(entries=[("single", entry, "", "main", None) for entry in entries]))
            self.document.append(nodes.meta(name="keywords", content=",".join(words).replace(",,", ",")))


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    app.add_transform(AddWords)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

"""Links to pages that lie outside of docs/ lead to the page of the site that includes them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

#: Page in the clone → page of the site, both without ``.md``.
PAGES = {
    "README": "index",
    "CONTRIBUTING": "contributing",
    "CHANGELOG": "changes",
    "sample_data/README": "sample-data",
    "docs/decisions/": "decisions/index",
}
_LINK = re.compile(r"\]\(((?:\.\./)*)([^)#:]*?)(?:\.md)?(#[^)]*)?\)")


def lead_to_site(text: str, page: str) -> str:
    """Return a page's text with its links to outside pages turned to those of the site.

    Args:
        text: in Markdown.
        page: its name below docs/, without ``.md``.

    >>> lead_to_site("see [the README](../../README.md#install)", "experiments/field")
    'see [the README](../index.md#install)'
    >>> lead_to_site("see [speed](speed.md) and [data](../sample_data/device.toml)", "data")
    'see [speed](speed.md) and [data](../sample_data/device.toml)'
    """
    depth = page.count("/")

    def turned(link: re.Match[str]) -> str:
        up, target, anchor = link[1].count("../"), link[2], link[3] or ""
        outside = PAGES.get(target) if up == depth + 1 else None
        return f"]({'../' * depth}{outside}.md{anchor})" if outside else link[0]

    return _LINK.sub(turned, text)


def _read(_: Sphinx, page: str, source: list[str]) -> None:
    source[0] = lead_to_site(source[0], page)


def _include(_app: Sphinx, path: Path, _page: str, source: list[str]) -> None:
    """Include a page of the clone: its links are those of its own folder."""
    folder = Path(path).as_posix().rpartition("/")[0]
    if not folder:
        return
    source[0] = source[0].replace("](docs/decisions/)", "](decisions/index.md)").replace("](docs/", "](")


def setup(app: Sphinx) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("source-read", _read)
    app.connect("include-read", _include)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

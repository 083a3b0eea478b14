"""Check that a page of the site loads nothing from elsewhere: ``python requests.py FOLDER``.  A link may lead there."""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path

#: Attributes whose address the browser loads by itself.
_LOADED = {"src", "srcset", "data", "poster"}
_OUTSIDE = re.compile(r"(https?:)?//[\w.-]+")
_IN_STYLE = re.compile(r"(?:url\(\s*['\"]?|@import\s+['\"])((?:https?:)?//[^'\")]+)")


class _Loads(HTMLParser):
    """Collects the addresses that a page loads from another host."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """See HTMLParser."""
        loaded = _LOADED | ({"href"} if tag == "link" else set())
        relation = dict(attrs).get("rel")
        if relation in {"canonical", "author", "help", "copyright"}:
            return
        self.found += [value for name, value in attrs if name in loaded and value and _OUTSIDE.match(value)]


def loaded_from_elsewhere(folder: Path) -> list[tuple[str, str]]:
    """Return (file, address) of all that pages and style sheets load from another host."""
    found = []
    for path in sorted(folder.rglob("*.html")):
        page = _Loads()
        page.feed(path.read_text(encoding="utf-8"))
        found += [(path.name, address) for address in page.found]
    for path in sorted(folder.rglob("*.css")):
        found += [(path.name, address) for address in _IN_STYLE.findall(path.read_text(encoding="utf-8"))]
    return found


if __name__ == "__main__":
    if outside := loaded_from_elsewhere(Path(sys.argv[1])):
        sys.exit("\n".join(f"{name} loads {address}" for name, address in outside))
    print("no page loads anything from another host")

"""Where the page's graphics library lies: three.js, which comes inside of nicegui.  Nothing of that is imported."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from levilab.errors import LevilabError


class NoThree(LevilabError):
    """The graphics library of the page is not installed."""


def three_js() -> Path:
    """Return the module with three.js, which comes inside of nicegui.  Raises NoThree.  It imports nothing."""
    found = find_spec("nicegui")
    for folder in (found.submodule_search_locations or ()) if found else ():
        path = Path(folder, "elements", "scene", "dist", "index.js")
        if path.is_file():
            return path
    raise NoThree('the live view needs nicegui 3.18 or newer: pip install "levilab[live]"')

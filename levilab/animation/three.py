"""Where three.js lies, which draws in a browser: it comes inside of nicegui, of which nothing is imported."""

from importlib.util import find_spec
from pathlib import Path

from levilab.errors import LevilabError
from levilab.software import how_to_install


class MissingThree(LevilabError):
    """three.js is not there."""


def three_js(what: str, instead: str = "") -> Path:
    """Return the module with three.js.

    Args:
        what: needs it, for the message where it is missing.
        instead: what to do without it.

    Raises:
        MissingThree: nicegui is not installed, or in a version that does not hold it.
    """
    found = find_spec("nicegui")
    for folder in (found.submodule_search_locations or ()) if found else ():
        path = Path(folder, "elements", "scene", "dist", "index.js")
        if path.is_file():
            return path
    seen = "which is not installed" if found is None else "which is installed in a version that does not hold it"
    what += f" needs the extra live (three.js out of nicegui, {seen})"
    raise MissingThree(f"{what}: {how_to_install('live')}{instead}")

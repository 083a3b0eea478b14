"""The versions of what a result may depend on, how an extra is installed, and recorded commands."""

import platform
import shlex
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path, PurePath

from levilab.texts.text import Text

#: The libraries that compute or speak to instruments.
LIBRARIES = ("levilab", "numpy", "numba", "scipy", "pandas", "pyvisa", "pyvisa-py")


#: What uv writes into the environment of an installed tool, and the extras that README installs: uv installs the tool
#: again with the named ones.
_UV_RECEIPT, _USUAL_EXTRAS = "uv-receipt.toml", ("live", "pdf")


def how_to_install(extra: str) -> str:
    """Return how an extra is installed, as levilab itself was: out of its clone, since no package index has it.

    Double quotes are those of every shell, of Windows, too.
    """
    if Path(sys.prefix, _UV_RECEIPT).is_file():
        command = f'uv tool install ".[{",".join(sorted({*_USUAL_EXTRAS, extra}))}]"'
    else:
        command = f'pip install ".[{extra}]"'
    return Text("type {command:s} in the folder of levilab's clone", command)


def software_versions() -> dict[str, str]:
    """Name → version, of Python, the system, and the libraries."""
    return dict(_versions())


@cache
def _versions() -> dict[str, str]:
    """Look them up once: that takes 5 ms, a third of what the analysis of a run does."""
    found = {"python": platform.python_version(), "platform": platform.platform()}
    for name in LIBRARIES:
        with suppress(PackageNotFoundError):  # numba is of an extra
            found[name] = version(name)
    return found


def command_text(words: Sequence[str]) -> str:
    """Return a recorded command as one types it.

    >>> command_text(["/usr/lib/levilab/__main__.py", "acquire", "spin", "--note", "a b"])
    "levilab acquire spin --note 'a b'"
    """
    name, *arguments = words
    path = PurePath(name.replace("\\", "/"))
    is_levilab = path.stem in {"levilab", "levilab-script"} or path.parts[-2:] == ("levilab", "__main__.py")
    return " ".join(["levilab" if is_levilab else shlex.quote(name), *map(shlex.quote, arguments)])


def versions_text(software: Mapping[str, str]) -> str:
    """Return the versions, levilab's first.

    >>> versions_text({"python": "3.11.7", "levilab": "0.1.0"})
    'levilab 0.1.0, python 3.11.7'
    """
    names = sorted(software, key=lambda name: (name != "levilab", name))
    return ", ".join(f"{name} {software[name]}" for name in names)

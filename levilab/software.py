"""The versions of what a result may depend on."""

import platform
from functools import cache
from importlib.metadata import version

#: The libraries that compute or speak to instruments.
LIBRARIES = ("levilab", "numpy", "numba", "scipy", "pandas", "lmfit", "pyvisa", "pyvisa-py")


def software_versions() -> dict[str, str]:
    """Name → version, of Python, the system, and the libraries."""
    return dict(_versions())


@cache
def _versions() -> dict[str, str]:
    """Look them up once: that takes 5 ms, a third of what the analysis of a run does."""
    return {
        "python": platform.python_version(),
        "platform": platform.platform(),
        **{name: version(name) for name in LIBRARIES},
    }

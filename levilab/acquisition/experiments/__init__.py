"""The experiments, a file each.  `levilab.acquisition.table` lists them."""

from importlib import import_module
from typing import Any

#: Their names, which are those of the files; known without the experiments being imported.
NAMES = ("spin", "trace", "field", "limit", "precession", "hold", "sway")


def experiment(name: str) -> Any:
    """Return an experiment; its module alone is imported."""
    return import_module(f"{__name__}.{name}").EXPERIMENT

"""The sources of the house, as syntax trees."""

import ast
import gc
from functools import cache

from support.paths import ROOT

PACKAGES = ("levilab", "instruments", "analysis", "pyvisa_levilab")


def modules():
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts), path


@cache
def sources():
    gc.disable()  # millions of nodes that stay: looking for garbage among them takes longer than making them
    try:
        return {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in modules()}
    finally:
        gc.freeze()
        gc.enable()


@cache
def nodes(*kinds):
    """The nodes of these classes in each module."""
    if kinds == (ast.AST,):
        return {name: [*ast.walk(tree)] for name, tree in sources().items()}
    return {name: [node for node in found if isinstance(node, kinds)] for name, found in nodes(ast.AST).items()}

"""Classes are at most three deep, and no constructor calls what a subclass overrides; docs/decisions/0001-rooms.md."""

import ast
from functools import cache

from support.sources import sources

DEEPEST = 3

#: Trees that may be deeper, by the class at their root, and why.
DEEPER = {
    # an error is known by what it is, not by what it does: each level is one that some caller catches
    "levilab.errors.LevilabError": 6,
    # settings of an experiment: fields and their checks alone, one below the other as the messages name them
    "levilab.settings.Settings": 5,
}


@cache
def classes():
    """Every class at the top of a module, by its full name."""
    return {
        f"{module}.{node.name}": node
        for module, tree in sources().items()
        for node in tree.body
        if isinstance(node, ast.ClassDef)
    }


@cache
def names_in(module):
    """What the names in a module stand for, as far as they are imported, ``if TYPE_CHECKING`` included."""
    top = sources()[module].body
    within = (node for statement in top if isinstance(statement, ast.If) for node in statement.body)
    found = (node for node in (*top, *within) if isinstance(node, ast.ImportFrom))
    return {alias.asname or alias.name: f"{node.module}.{alias.name}" for node in found for alias in node.names}


@cache
def bases(name):
    """The classes of the house that a class is made of directly."""
    module = name.rpartition(".")[0]
    plain = (base.value if isinstance(base, ast.Subscript) else base for base in classes()[name].bases)
    full = (
        names_in(module).get(base.id, f"{module}.{base.id}") if isinstance(base, ast.Name) else "" for base in plain
    )
    return tuple(base for base in full if base in classes())


@cache
def lineage(name):
    """A class and all above it."""
    return name, *(above for base in bases(name) for above in lineage(base))


@cache
def depth(name):
    above = [base for base in bases(name) if not is_protocol(base)]
    return 1 + max(map(depth, above), default=0)


def is_protocol(name):
    return any(isinstance(base, ast.Name) and base.id == "Protocol" for base in classes()[name].bases)


@cache
def methods(name):
    return {node.name: node for node in classes()[name].body if isinstance(node, ast.FunctionDef)}


def is_property(method):
    return any(isinstance(mark, ast.Name) and mark.id.endswith("property") for mark in method.decorator_list)


@cache
def overridden(name):
    """The methods that a class below this one overrides."""
    below = [other for other in classes() if other != name and name in lineage(other)]
    return frozenset(method for other in below for method in methods(other))


def used(name, method, seen):
    """The methods and properties of its own that a method uses, those included that these use."""
    found = next((methods(above)[method] for above in lineage(name) if method in methods(above)), None)
    if found is None or method in seen:
        return
    seen.add(method)
    called = {node.func for node in ast.walk(found) if isinstance(node, ast.Call)}
    for node in ast.walk(found):
        if not (isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "self"):
            continue
        own = next((methods(above)[node.attr] for above in lineage(name) if node.attr in methods(above)), None)
        if own is not None and (node in called or is_property(own)):
            yield node.attr
            yield from used(name, node.attr, seen)


def test_classes_are_at_most_three_deep():
    deep = {name for name in classes() if depth(name) > DEEPEST}
    assert {name: depth(name) for name in deep if not DEEPER.keys() & lineage(name)} == {}
    deepest = {root: max(depth(name) for name in deep if root in lineage(name)) for root in DEEPER}
    assert deepest == DEEPER  # no tree is allowed more than it needs


def test_no_constructor_calls_what_a_subclass_overrides():
    virtual = {
        f"{name}.{method}"
        for name in classes()
        for start in ("__init__", "__post_init__")
        if start in methods(name)
        for method in used(name, start, set())
        if method in overridden(name)
    }
    assert virtual == set()

"""Which tests run which lines: measured once with coverage.py, a context for each test, and kept in .mutants/reach."""

from __future__ import annotations

import ast
import dataclasses
import hashlib
import json
import time
from collections import defaultdict
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any

import trial

KEPT = trial.WORK / "reach"

#: These look at the text of the files or at another environment, not at what the code does.
LEFT_OUT = ("tests/peers", "tests/test_rooms.py", "tests/test_documentation.py")


def groups() -> dict[str, list[str]]:
    """Return the files of tests, a group for each folder, and the doctests of each package; large folders come last."""
    found: dict[str, list[str]] = defaultdict(list)
    for path in sorted((trial.TREE / "tests").rglob("test_*.py")):
        name = path.relative_to(trial.TREE).as_posix()
        if not name.startswith(LEFT_OUT):
            found[str(PurePosixPath(name).parent)].append(name)
    return dict(found) | {name: [name] for name in trial.PACKAGES}


def measure(only: list[str]) -> None:
    """Measure the files of tests that are not known yet, or have changed, group by group."""
    KEPT.mkdir(parents=True, exist_ok=True)
    for group, files in groups().items():
        if only and not any(word in group for word in only):
            continue
        stale = [name for name in files if _known(name).get("digest") != _digest(name)]
        if not stale:
            continue
        start = time.monotonic()
        result = trial.run({"files": stale, "tests": None, "reach": True}, 1200)
        if not result:
            print(f"  {group}: no answer", flush=True)
            continue
        for name in stale:
            _kept(name).write_text(json.dumps(_part(result, name) | {"digest": _digest(name)}), encoding="utf-8")
        print(
            f"  {group}: {len(result['tests'])} tests, {result['cpu_s']:.0f} s of a processor,"
            f" {time.monotonic() - start:.0f} s by the clock, {len(result['failed'])} fail here",
            flush=True,
        )


def _kept(name: str) -> Path:
    return KEPT / f"{name.replace('/', '.')}.json"


def _known(name: str) -> dict[str, Any]:
    return json.loads(_kept(name).read_text(encoding="utf-8")) if _kept(name).exists() else {}


def _part(result: dict[str, Any], name: str) -> dict[str, Any]:
    """Return what is of one file of tests, or of a package's doctests."""
    tests = {test: seconds for test, seconds in result["tests"].items() if test.startswith(name)}
    failed = [test for test in result["failed"] if test.startswith(name)]
    reached = {
        file: {line: part for line, by in lines.items() if (part := [test for test in by if test in tests])}
        for file, lines in result["lines"].items()
    }
    reached = {file: lines for file, lines in reached.items() if lines}
    return {
        "tests": tests,
        "failed": failed,
        "lines": reached,
        "functions": {file: _functions(file) for file in reached},
    }


def _digest(name: str) -> str:
    path = trial.TREE / name
    return hashlib.sha256(path.read_bytes() if path.is_file() else b"doctests").hexdigest()[:16]


@cache
def _functions(name: str) -> dict[str, list[object]]:
    """First and last line of each function, and a digest of its text."""
    source = (trial.TREE / name).read_text(encoding="utf-8")
    lines = source.splitlines()
    return {
        function: [first, last, text_digest("\n".join(lines[first - 1 : last]))]
        for function, first, last in functions(ast.parse(source))
    }


def functions(tree: ast.AST, prefix: str = "") -> list[tuple[str, int, int]]:
    """Name, first and last line of each function in a module, methods as Class.method."""
    found = []
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            name = prefix + node.name
            if not isinstance(node, ast.ClassDef):
                found.append((name, node.lineno, node.end_lineno or node.lineno))
            found += functions(node, f"{name}.")
        else:
            found += functions(node, prefix)
    return found


def text_digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:12]


@dataclasses.dataclass
class Reach:
    """The tests of each line, and how long each takes [s]."""

    seconds: dict[str, float]
    lines: dict[str, dict[int, set[str]]]
    functions: dict[str, dict[str, list[list[object]]]]

    def tests(self, name: str, function: str, line: int) -> set[str]:
        """The tests that reach a line; where the function has changed since, all that reached the function."""
        lines = self.lines.get(name, {})
        known = self.functions.get(name, {}).get(function, [])
        now = _functions(name).get(function)
        for first, last, digest in known:
            if now and digest == now[2]:
                found = lines.get(line - int(now[0]) + int(first), set())
                if found:
                    return found
            return set().union(*(lines.get(number, set()) for number in range(int(first) + 1, int(last) + 1)))
        # a line that runs at import, or a function that is new: all that reach anything of the file
        return set().union(*lines.values())


def load() -> Reach:
    """Return the map, joined from its groups; tests that fail without any change, or are gone, are not in it."""
    reach = Reach({}, defaultdict(lambda: defaultdict(set)), defaultdict(lambda: defaultdict(list)))
    for group in filter(None, (_known(name) for files in groups().values() for name in files)):
        failed = set(group["failed"])
        reach.seconds |= {test: seconds for test, seconds in group["tests"].items() if test not in failed}
        for name, lines in group["lines"].items():
            for line, tests in lines.items():
                reach.lines[name][int(line)] |= set(tests) - failed
        for name, known in group["functions"].items():
            for function, place in known.items():
                if place not in reach.functions[name][function]:
                    reach.functions[name][function].append(place)
    return reach

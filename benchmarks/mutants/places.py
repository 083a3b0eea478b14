"""Where a mutation goes in today's code: by its text for those with a name, by the syntax tree for those at random."""

from __future__ import annotations

import ast
import dataclasses
import hashlib
import operator
import re
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

import trial
from reach import functions

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

HERE = Path(__file__).parent

#: Compiled: numba would compile it again for each change (4 to 15 s), and coverage does not see inside.
COMPILED = (
    "levilab/simulator/kernels/",
    "levilab/benchmark/simulator/motion.py",
    "levilab/benchmark/simulator/kernel.py",
)
#: What draws is looked at as pictures: no number in it is changed.
DRAWS = re.compile(r"/(figure|style|animation|photograph)\.py$")


class Gone(ValueError):
    """The text of a named mutation is nowhere, or at more places than one."""


@dataclasses.dataclass(frozen=True)
class Edit:
    """Bytes of a file from `start` to `end` become `new`."""

    file: str
    start: int
    end: int
    new: bytes


@dataclasses.dataclass(frozen=True)
class Mutation:
    """One change, or several at once.

    Attributes:
        key: what it is known by from run to run: it does not depend on where in a file the code stands.
        room: the package and folder.
        text: what is changed, for people.
        edits: the changes.
        function: in which the first one lies, "" at the level of a module.
        line: of the first one.
        tests: that are meant to catch it; None: those that reach the line.
    """

    key: str
    room: str
    text: str
    edits: tuple[Edit, ...]
    function: str
    line: int
    tests: tuple[str, ...] | None = None

    @property
    def file(self) -> str:
        """Of the first change."""
        return self.edits[0].file


def files() -> list[str]:
    """All files of the packages."""
    return sorted(
        path.relative_to(trial.TREE).as_posix() for name in trial.PACKAGES for path in (trial.TREE / name).rglob("*.py")
    )


def room_of(file: str) -> str:
    """Package and folder: analysis, instruments/virtual, levilab/world and so on."""
    return "/".join(file.split("/")[:-1][:2]) if not file.startswith("analysis/") else "analysis"


def mutated(file: str, edits: tuple[Edit, ...]) -> bytes:
    """Return a file's content with the edits that are its own."""
    source = (trial.TREE / file).read_bytes()
    for edit in sorted(edits, key=lambda edit: -edit.start):
        if edit.file == file:
            source = source[: edit.start] + edit.new + source[edit.end :]
    return source


# --- with a name ---


def named(file: str = "named.toml") -> Iterator[tuple[str, Mutation | None]]:
    """Yield the mutations of a file: name and mutation, or None where the code is gone."""
    with (HERE / file).open("rb") as table:
        rows = tomllib.load(table)["mutation"]
    for row in rows:
        try:
            edits = tuple(_edit(one) for one in (row, *row.get("also", ())))
        except Gone:
            yield row["name"], None
            continue
        source = (trial.TREE / edits[0].file).read_bytes()
        line = source[: edits[0].start].count(b"\n") + 1
        text = f"`{' '.join(row['old'].split())}` → `{' '.join(row['new'].split())}`"
        change = repr([row["old"], row["new"], row.get("also")])
        key = f"named: {row['name']}: {hashlib.sha256(change.encode()).hexdigest()[:8]}"
        place = function_at(edits[0].file, line)
        tests = tuple(row["tests"]) if "tests" in row else None
        mutation = Mutation(key, room_of(edits[0].file), text, edits, place, line, tests)
        yield row["name"], mutation


def _edit(row: dict[str, str]) -> Edit:
    pattern = re.compile(rb"\s+".join(re.escape(word.encode()) for word in row["old"].split()))
    there = [row["file"]] if (trial.TREE / row["file"]).exists() else []
    for candidates in (there, files()):
        found = [
            Edit(file, match.start(), match.end(), row["new"].encode())
            for file in candidates
            for match in pattern.finditer((trial.TREE / file).read_bytes())
        ]
        if len(found) == 1:
            return found[0]
    raise Gone(row["old"])


def function_at(file: str, line: int) -> str:
    """Return the innermost function around a line, "" at the level of the module."""
    tree = ast.parse((trial.TREE / file).read_bytes())
    around = [(last - first, name) for name, first, last in functions(tree) if first <= line <= last]
    return min(around)[1] if around else ""


# --- at random ---

_COMPARE = {
    ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"), ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="), ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"), ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
}  # fmt: skip
_BINARY = {
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.Pow: ("**", "*"),
    ast.FloorDiv: ("//", "/"), ast.Mod: ("%", "*"),
}  # fmt: skip
_CALLS = {
    "min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "argmin": "argmax", "argmax": "argmin",
    "any": "all", "all": "any", "floor": "ceil", "ceil": "floor", "sin": "cos", "cos": "sin",
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class _Place:
    """Where a file can be changed: bytes from start to end become `new`; node: the expression around, as text."""

    operator: str
    node: str
    start: int
    end: int
    new: str
    function: str
    line: int


class _Finder(ast.NodeVisitor):
    """Collects the places of a file."""

    def __init__(self, source: bytes, *, draws: bool) -> None:
        self.source, self.draws = source, draws
        self.starts = [0]
        for line in source.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))
        self.function: list[str] = []
        self.found: list[_Place] = []

    # what is no behaviour: annotations, documentation, messages, what a type checker alone reads

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Python 3.11 does not know where the parts of an f-string stand."""

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value is not None:
            self.visit(node.value)

    def visit_If(self, node: ast.If) -> None:
        if isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
            return
        self._negate(node.test)
        self.generic_visit(node)

    def visit_IfExp(self, node: ast.IfExp) -> None:
        self._negate(node.test)
        self.generic_visit(node)

    def visit_While(self, node: ast.While) -> None:
        self.generic_visit(node)

    def visit_Assert(self, node: ast.Assert) -> None:
        """It states what holds."""

    def visit_FunctionDef(self, node: ast.FunctionDef | ast.AsyncFunctionDef) -> None:
        decorators = {ast.unparse(one).split("(")[0].split(".")[-1] for one in node.decorator_list}
        if decorators & {"overload", "njit", "part", "abstractmethod"} or node.name in {"__repr__", "__str__"}:
            return
        self.function.append(node.name)
        for default in (*node.args.defaults, *node.args.kw_defaults):
            if default is not None:
                self.visit(default)
        for statement in node.body:
            self.visit(statement)
        self.function.pop()

    def visit_AsyncFunctionDef(self, node: ast.AsyncFunctionDef) -> None:
        self.visit_FunctionDef(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        if any(ast.unparse(base) in {"Protocol", "Exception"} for base in node.bases):
            return
        self.function.append(node.name)
        for statement in node.body:
            self.visit(statement)
        self.function.pop()

    # what is changed

    def visit_Compare(self, node: ast.Compare) -> None:
        left = node.left
        for sign, right in zip(node.ops, node.comparators, strict=True):
            self._between("comparison", node, (left, right), *_COMPARE[type(sign)])
            left = right
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        words = (ast.JoinedStr, ast.List, ast.Tuple, ast.Dict)
        text = any(
            isinstance(side, words) or (isinstance(side, ast.Constant) and isinstance(side.value, str | bytes))
            for side in (node.left, node.right)
        )
        if type(node.op) in _BINARY and not text and not self.draws:
            self._between("arithmetic", node, (node.left, node.right), *_BINARY[type(node.op)])
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:
        words = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        self._between("and/or", node, (node.values[0], node.values[1]), *words)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.USub) and not self.draws:
            self._replace("sign", node, self._text(node.operand))
        if isinstance(node.op, ast.Not):
            self._replace("not", node, f"({self._text(node.operand)})")
            return
        if not isinstance(node.operand, ast.Constant):
            self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        value = node.value
        if isinstance(value, bool):
            self._replace("constant", node, str(not value))
        elif isinstance(value, int) and not self.draws:
            self._replace("constant", node, str(value + 1))
        elif isinstance(value, float) and not self.draws:
            self._replace("constant", node, repr(1.0 if value == 0 else value * 1.5))

    def visit_Call(self, node: ast.Call) -> None:
        name = node.func
        if isinstance(name, ast.Name) and name.id in _CALLS and name.id in {"min", "max", "any", "all"}:
            self._replace("call", name, _CALLS[name.id])
        elif isinstance(name, ast.Attribute) and name.attr in _CALLS:
            self._replace("call", name, f"{self._text(name.value)}.{_CALLS[name.attr]}")
        if isinstance(name, ast.Name) and name.id in {"TypeVar", "cast", "Literal"}:
            return
        self.generic_visit(node)

    def visit_Return(self, node: ast.Return) -> None:
        if node.value is not None and not (isinstance(node.value, ast.Constant) and node.value.value is None):
            self._replace("return", node.value, "None")
        self.generic_visit(node)

    # how

    def _negate(self, test: ast.expr) -> None:
        if not isinstance(test, ast.Compare | ast.UnaryOp):  # these are turned round themselves
            self._replace("condition", test, f"not ({self._text(test)})")

    def _place(self, node: ast.expr) -> tuple[int, int]:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        start = self.starts[node.lineno - 1] + node.col_offset
        return start, self.starts[node.end_lineno - 1] + node.end_col_offset

    def _text(self, node: ast.expr) -> str:
        start, end = self._place(node)
        return self.source[start:end].decode()

    def _replace(self, kind: str, node: ast.expr, new: str) -> None:
        self._keep(kind, node, self._place(node), new)

    def _between(self, kind: str, whole: ast.expr, sides: tuple[ast.expr, ast.expr], old: str, new: str) -> None:
        low, high = self._place(sides[0])[1], self._place(sides[1])[0]
        pattern = r"\s+".join(map(re.escape, old.split()))
        pattern = rf"\b{pattern}\b" if old[0].isalpha() else pattern
        gap = re.sub(rb"#[^\n]*", lambda match: b" " * len(match.group()), self.source[low:high])
        match = re.search(pattern.encode(), gap)
        if match:
            self._keep(kind, whole, (low + match.start(), low + match.end()), new)

    def _keep(self, kind: str, node: ast.expr, place: tuple[int, int], new: str) -> None:
        line = self.source[: place[0]].count(b"\n") + 1
        self.found.append(_Place(kind, ast.unparse(node), *place, new, ".".join(self.function), line))


def generated(seed: int) -> dict[str, list[Mutation]]:
    """All mutations of every room, in an order that only the seed and the code of each decide.

    So a change of one function changes no other function's mutations, and the first k of a room are k at random.
    """
    rooms: dict[str, list[tuple[str, Mutation]]] = {}
    for file in files():
        if file.startswith(COMPILED):
            continue
        source = (trial.TREE / file).read_bytes()
        finder = _Finder(source, draws=bool(DRAWS.search(f"/{file}")))
        finder.visit(ast.parse(source))
        seen: dict[str, int] = {}
        for place in finder.found:
            old = source[place.start : place.end].decode()
            name = f"{file}: {place.function}: {place.operator}: {place.node}: {old} → {place.new}"
            seen[name] = seen.get(name, 0) + 1
            key = f"{name}: {seen[name]}"
            edit = Edit(file, place.start, place.end, place.new.encode())
            mutation = Mutation(key, room_of(file), _shown(source, edit), (edit,), place.function, place.line)
            rank = hashlib.sha256(f"{seed} {key}".encode()).hexdigest()
            rooms.setdefault(room_of(file), []).append((rank, mutation))
    return {
        room: [mutation for _, mutation in sorted(ranked, key=operator.itemgetter(0))] for room, ranked in rooms.items()
    }


def _shown(source: bytes, edit: Edit) -> str:
    """Return the first line of a change, before and after."""
    begin = source.rfind(b"\n", 0, edit.start) + 1
    end = source.find(b"\n", edit.end)
    old, new = source[begin:end], source[begin : edit.start] + edit.new + source[edit.end : end]
    return " → ".join(f"`{' '.join(line.decode().split())}`" for line in (old, new))


def chosen(seed: int, number: int, only: Collection[str] = ()) -> list[Mutation]:
    """Return places at random, a room's share by its lines of code, and never two on one line; only: these rooms."""
    rooms = {room: found for room, found in generated(seed).items() if not only or room in only}
    lines = {
        room: sum(
            (trial.TREE / file).read_bytes().count(b"\n")
            for file in files()
            if room_of(file) == room and not file.startswith(COMPILED)
        )
        for room in rooms
    }
    whole = sum(lines.values())
    picked = []
    for room in sorted(rooms):
        wanted, places = max(1, round(number * lines[room] / whole)), set()
        for mutation in rooms[room]:
            if len(places) == wanted:
                break
            place = (mutation.file, mutation.line)
            if place not in places and _parses(mutation):
                places.add(place)
                picked.append(mutation)
    return picked


def _parses(mutation: Mutation) -> bool:
    before = ast.parse((trial.TREE / mutation.file).read_bytes())
    try:
        after = ast.parse(mutated(mutation.file, mutation.edits))
    except SyntaxError:
        return False
    return ast.dump(before) != ast.dump(after)

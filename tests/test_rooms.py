"""The rooms of the house, as docs/decisions/0001-rooms.md has them; which way imports go is import-linter's."""

import ast
from collections import Counter
from functools import cache

from support.paths import ROOT
from support.sources import modules, sources

#: What takes so long to load that it is imported where it is used: at least 10 ms, or not everywhere installed.
HEAVY = {
    "PIL", "RigolWFM", "av", "dask", "distributed", "filelock", "grp", "h5py", "heyoka", "imageio_ffmpeg", "jinja2",
    "llvmlite", "lmfit", "matplotlib", "nicegui", "numba", "pandas", "playwright", "pyarrow", "pyvisa", "rich", "scipy",
    "serial", "sounddevice", "starlette", "typst", "uncertainties", "uvicorn", "xarray", "xlsxwriter",
    "zarr",
}  # fmt: skip


def imported(node):
    """The modules that a statement imports; of ``from a import b`` both a and a.b, whichever there is."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if isinstance(node, ast.ImportFrom) and node.module:
        return [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return []


def top_level(tree):
    """What is loaded together with a module; ``if TYPE_CHECKING`` loads nothing."""
    return [name for statement in tree.body for name in imported(statement)]


@cache
def loads_something_heavy(name):
    """Whether a package is heavy, or a module of ours loads a heavy one at its head or further down."""
    if name.partition(".")[0] in HEAVY:
        return True
    seen, left = set(), [name]
    while left:
        here = left.pop()
        if here in seen or here not in sources():
            continue
        seen.add(here)
        for other in top_level(sources()[here]):
            if other.partition(".")[0] in HEAVY:
                return True
            left.append(other)
    return False


def late_imports(tree):
    definitions = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef
    early = {node for one in tree.body if not isinstance(one, definitions) for node in ast.walk(one)}
    for node in ast.walk(tree):
        if node not in early and (names := imported(node)):
            yield node.lineno, names


def is_a_door(name):
    """Whether a module imports inside of functions, to open at once: front door, command line, their options."""
    return name in {"levilab", "levilab.pipelines.options"} or name.startswith("levilab.cli")


def test_only_what_is_heavy_is_imported_where_it_is_used():
    late = [(name, *found) for name, _ in modules() if not is_a_door(name) for found in late_imports(sources()[name])]
    assert [(name, line, names) for name, line, names in late if not any(map(loads_something_heavy, names))] == []


def rooms(folder):
    return sorted(path.name for path in folder.iterdir() if path.is_dir() and any(path.glob("*.py")))


def files(folder):
    return sorted(path.name for path in folder.glob("*.py"))


def test_the_ground_floor_of_levilab_is_small():
    assert len(files(ROOT / "levilab")) <= 9
    assert len(rooms(ROOT / "levilab")) + len(files(ROOT / "levilab")) <= 30 + 1  # __main__ is no room


def test_virtual_instruments_have_seven_rooms():
    assert len(rooms(ROOT / "instruments/virtual")) <= 7
    assert files(ROOT / "instruments/virtual") == ["__init__.py"]


def test_tests_lie_in_the_room_of_their_subject():
    tests = ROOT / "tests"
    folders = {path.parent.relative_to(tests) for path in tests.rglob("test_*.py")}
    strange = [folder.as_posix() for folder in folders if not (ROOT / folder).is_dir()]
    assert strange == ["peers"]  # of other people's drivers


def test_no_folder_holds_a_family_of_files_with_one_prefix():
    folders = {path.parent for _, path in modules()}
    families = Counter(
        (folder.relative_to(ROOT).as_posix(), name.partition("_")[0])
        for folder in folders
        for name in files(folder)
        if "_" in name.removesuffix(".py").strip("_")
    )
    makers = {"lakeshore", "keysight", "rigol", "agilent", "pendulum"}  # models, which are alike by their makers
    assert [family for family, count in families.items() if count > 2 and family[1] not in makers] == []

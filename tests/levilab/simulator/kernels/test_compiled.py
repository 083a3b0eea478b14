"""The room of the compiled code: what is in it, and that it is compiled again for changes in it alone."""

import ast
import gc
import os
import shutil
import sys
from pathlib import Path

import numba
import pytest

from levilab.simulator.kernels import compiled
from support.parts import callable_part

KERNELS = Path(compiled.__file__).parent
ALLOWED = {"numba", "numpy", "platformdirs", *sys.stdlib_module_names}
#: Of the refusal where the compiler is not installed: no kernel is made of them.
OF_THE_REFUSAL = frozenset({"levilab.errors", "levilab.software"})


@pytest.fixture
def copy(tmp_path):
    """A copy of the simulator's sources, whose kernels have the same key."""
    shutil.copytree(KERNELS.parent, tmp_path / "simulator", ignore=shutil.ignore_patterns("__pycache__"))
    assert key(tmp_path / "simulator") == compiled.cache_key(KERNELS)
    return tmp_path / "simulator"


def key(simulator):
    return compiled.cache_key(simulator / "kernels")


def test_a_change_outside_of_the_room_compiles_nothing_again(copy):
    before = key(copy)
    for source in (*copy.glob("*.py"), *copy.glob("scenes/*")):
        source.write_text(source.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
    (copy / "new.py").write_text("x = 1\n", encoding="utf-8")
    assert key(copy) == before


@pytest.mark.parametrize("name", sorted(source.name for source in KERNELS.glob("*.py")))
def test_a_change_of_any_file_of_the_room_compiles_again(copy, name):
    before, source = key(copy), copy / "kernels" / name
    source.write_text(source.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
    assert key(copy) != before


@pytest.mark.parametrize("make", [compiled.part, compiled.aside])
def test_a_part_that_python_calls_raises_and_says_how_to_call_it(make):
    def twice(x):
        return 2 * x

    part = make(twice)
    with pytest.raises(TypeError, match=r"twice is compiled into kernels and not for Python: call it in a function"):
        part(1.0)
    assert callable_part(part)(1.0) == 2.0


def test_the_code_on_the_disk_lies_under_the_key_of_the_room(monkeypatch, tmp_path):
    monkeypatch.setattr(compiled, "user_cache_path", lambda *_, **__: tmp_path)
    folder = compiled._folder.__wrapped__()
    assert folder == tmp_path / "kernels" / compiled.cache_key(KERNELS)
    assert folder.is_dir()


def test_a_copy_of_the_sources_compiles_nothing_again(monkeypatch, tmp_path):
    # a second environment, or the same version installed again: another place, another time of its files
    monkeypatch.setattr(numba.core.config, "CACHE_DIR", "")
    monkeypatch.setattr(compiled, "_folder", lambda: tmp_path)
    stats = []
    for k, name in enumerate(("one", "two")):
        (tmp_path / name).mkdir()
        source = tmp_path / name / "motion.py"
        source.write_text("def advance(x):\n    return x + 1\n", encoding="utf-8")
        os.utime(source, (1e9 + k, 1e9 + k))
        scope = {"__name__": compiled.__name__}  # numba imports the module of code from the disk
        exec(compile(source.read_text(encoding="utf-8"), source, "exec"), scope)
        kernel = compiled.kernel(scope["advance"])
        assert kernel(1) == 2
        stats.append(kernel.stats)
    assert {str(one.cache_path) for one in stats} == {str(tmp_path)}
    assert [sum(one.cache_hits.values()) for one in stats] == [0, 1]
    assert numba.core.config.CACHE_LOCATOR_CLASSES == ""


def test_two_processes_that_save_at_once_keep_their_code_apart(monkeypatch, tmp_path):
    one, two, later = (compiled.FilesOfTheirOwn(str(tmp_path), "motion.advance-1.py311", "") for _ in range(3))
    monkeypatch.setattr(two, "_load_index", dict)  # it looked before the first one saved
    write = one._save_data

    def be_slow(name, data):
        two.save("of two", "code of two")
        write(name, data)

    monkeypatch.setattr(one, "_save_data", be_slow)
    one.save("of one", "code of one")
    assert later.load("of two") == "code of two"
    assert later.load("of one") is None  # compiled once more
    later.save("of one", "code of one")
    assert (later.load("of one"), later.load("of two")) == ("code of one", "code of two")


def test_a_folder_that_another_process_makes_at_the_same_time_is_used(monkeypatch, tmp_path):
    monkeypatch.setattr(compiled, "user_cache_path", lambda *_, **__: tmp_path)
    monkeypatch.setattr(compiled, "_sweep", lambda kernels: (kernels / compiled.cache_key(KERNELS)).mkdir(parents=True))
    assert compiled._folder.__wrapped__() is not None


@pytest.mark.parametrize("on", [True, False])
def test_the_collector_pauses_while_numba_compiles_and_is_then_as_before(on):
    seen = []

    class Watch(numba.core.event.Listener):
        def on_start(self, event):
            seen.append(gc.isenabled())

        on_end = on_start

    @compiled.part
    def inner(x):
        return x + 1

    @numba.njit
    def outer(x):
        return inner(x)

    was_on = gc.isenabled()
    (gc.enable if on else gc.disable)()
    try:
        with numba.core.event.install_listener("numba:compile", Watch()):
            assert outer(1) == 2
        assert gc.isenabled() == on
    finally:
        (gc.enable if was_on else gc.disable)()
    # outer, inner in it, and the end of inner: the end of outer reaches those that listen in no order that is promised
    assert seen[:3] == [False, False, False]


@pytest.mark.parametrize("source", sorted(KERNELS.glob("*.py")), ids=lambda path: path.name)
def test_the_room_imports_nothing_from_outside_but_what_compiles(source):
    # a module outside that a kernel is made of could change without its being compiled again
    for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [node.module] if isinstance(node, ast.ImportFrom) else []
        for name in {*names} - (OF_THE_REFUSAL if source.name == "__init__.py" else set()):
            own = name.startswith("levilab.simulator.kernels.") or name == "analysis.arrays"  # a type, for readers
            assert own or name.partition(".")[0] in ALLOWED, name

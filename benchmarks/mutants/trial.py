"""Run chosen tests, or laboratories, in a copy of the tree, in a process that has the heavy libraries already.

Importing numpy, scipy, numba, pandas and matplotlib takes some two seconds, most tests take less: so this process
imports them once and forks for each trial.  Where a system cannot fork (Windows), a trial is a new process.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
WORK = Path(os.environ.get("MUTANTS_WORK") or ROOT / ".mutants")
TREE = WORK / "tree"
PACKAGES = ("analysis", "instruments", "levilab")

#: What the tests import of others; nothing of ours, which is what the trials change.
HEAVY = """
    numpy scipy.optimize scipy.stats scipy.signal scipy.linalg scipy.special scipy.integrate scipy.interpolate numba
    pandas matplotlib.pyplot pydantic typer rich.table rich.progress jinja2 lmfit uncertainties pyvisa pyvisa_py serial
    filelock platformdirs mpmath
"""

#: A trial may use this multiple of the processor's time that its tests took without a change, and this time more [s]
#: for imports, kernels that are compiled again, and a busy machine.
FACTOR, EXTRA_S = 5.0, 25.0
#: … and this multiple of it by the clock, for tests that wait for ever use no time of a processor.
CLOCK = 6.0


def copy_tree() -> None:
    """Copy what git knows into TREE; a file that has not changed stays, and so does what was compiled of it."""
    names = subprocess.run(
        ["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, encoding="utf-8"
    ).stdout
    wanted = {name for name in names.split("\0") if name and (ROOT / name).is_file()}
    for name in wanted:
        source, target = ROOT / name, TREE / name
        if not target.exists() or target.read_bytes() != source.read_bytes():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(source, target)
    for path in TREE.rglob("*.py"):
        if path.relative_to(TREE).as_posix() not in wanted:
            path.unlink()


@contextlib.contextmanager
def changed(name: str, source: bytes) -> Any:
    """Let a file of TREE have another content for a while; its time changes with it, so that no old .pyc is used."""
    path = TREE / name
    before, stat = path.read_bytes(), path.stat()
    path.write_bytes(source)
    os.utime(path, (stat.st_atime, stat.st_mtime + 1000))
    try:
        yield
    finally:
        path.write_bytes(before)
        os.utime(path, (stat.st_atime, stat.st_mtime))


def load_libraries() -> None:
    """Import the heavy libraries into this process, for all trials."""
    for name in HEAVY.split():
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    importlib.import_module("pytest")


def run(order: dict[str, Any], seconds: float) -> dict[str, Any]:
    """Carry out an order (see `_obey`) in a process of its own that may use this number of seconds of a processor.

    Returns:
        What `_obey` returns; {} if the process came to its end otherwise: its time was up, or it crashed.
    """
    answer = WORK / f"answer{os.getpid()}.json"
    answer.unlink(missing_ok=True)
    order = order | {"answer": str(answer), "seconds": seconds}
    if hasattr(os, "fork"):
        child = os.fork()
        if not child:
            os.setsid()
            try:
                _obey(order)
            finally:
                os._exit(0)
        _await(child, seconds * CLOCK + 30)
    else:
        with contextlib.suppress(subprocess.TimeoutExpired):
            words = [sys.executable, __file__, json.dumps(order)]
            subprocess.run(words, timeout=seconds * CLOCK + 30, check=False, env=_environment())
    return json.loads(answer.read_text(encoding="utf-8")) if answer.exists() else {}


def _await(child: int, limit_s: float) -> None:
    """Wait for a process of ours, and end it with all that it started when the limit is over."""
    end = time.monotonic() + limit_s
    while os.waitpid(child, os.WNOHANG) == (0, 0):
        if time.monotonic() > end:
            os.killpg(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return
        time.sleep(0.02)
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(child, signal.SIGKILL)


def _environment() -> dict[str, str]:
    path = os.pathsep.join(str(TREE / folder) for folder in ("", "tests", "fuzz", "benchmarks"))
    return os.environ | {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1", "MPLBACKEND": "agg"}


def _obey(order: dict[str, Any]) -> None:
    """Carry out an order in TREE and write the outcome.

    The order has the number of `laboratories`; or the files of tests to collect (`files`), the tests to keep of them in
    the order in which they run (`tests`; None for all), and whether to note the lines that each reaches (`reach`).
    """
    os.chdir(TREE)
    os.environ.update(_environment())
    sys.path[:] = [str(TREE), *(entry for entry in sys.path if Path(entry or ".").resolve() != ROOT)]
    with open(WORK / "trial.log", "w", encoding="utf-8") as log:  # noqa: PTH123
        os.dup2(log.fileno(), 1)
        os.dup2(log.fileno(), 2)
    if not order.get("reach"):
        sys.dont_write_bytecode = True
        with contextlib.suppress(ImportError):
            import resource

            limit = int(order["seconds"] + time.process_time()) + 1
            resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
    if "laboratories" in order:
        from laboratory import carry_out

        result = carry_out(order)
    else:
        result = _run_tests(order)
    with open(order["answer"], "w", encoding="utf-8") as out:  # noqa: PTH123
        json.dump(result, out)


def _run_tests(order: dict[str, Any]) -> dict[str, Any]:
    import pytest

    plugin = _Chosen(order["tests"])
    plugins: list[object] = [plugin]
    coverage = None
    if order["reach"]:
        from coverage import Coverage

        coverage = Coverage(data_file=None, source=[str(TREE / name) for name in PACKAGES], branch=False)
        coverage.start()
        plugins.append(_Contexts(coverage))
    options = ["-o", "addopts=", "--import-mode=importlib", "--doctest-modules", "-q", "-p", "no:cacheprovider"]
    options += ["-p", "no:xdist", "--tb=no", f"--basetemp={WORK / 'tmp'}"]
    if not order["reach"]:
        options.append("-x")
    started = time.process_time()
    status = int(pytest.main([*options, *order["files"]], plugins=plugins))
    result: dict[str, Any] = {"status": status, "failed": plugin.failed, "cpu_s": time.process_time() - started}
    result["tests"] = plugin.seconds
    if coverage is not None:
        coverage.stop()
        data = coverage.get_data()
        result["lines"] = {
            Path(name).relative_to(TREE).as_posix(): {
                line: sorted(filter(None, tests)) for line, tests in data.contexts_by_lineno(name).items() if any(tests)
            }
            for name in data.measured_files()
            if name.endswith(".py")  # templates are compiled to code, too
        }
    return result


class _Chosen:
    """Keeps the tests that were chosen, in their order, and notes the time of each and what failed."""

    def __init__(self, tests: list[str] | None) -> None:
        self._rank = None if tests is None else {test: rank for rank, test in enumerate(tests)}
        self.seconds: dict[str, float] = {}
        self.failed: list[str] = []

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        if self._rank is not None:
            items[:] = [item for item in items if item.nodeid in self._rank]

    def pytest_collection_finish(self, session: Any) -> None:
        if self._rank is not None:
            session.items.sort(key=lambda item: self._rank[item.nodeid])

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.seconds[nodeid] = -time.process_time()

    def pytest_runtest_logfinish(self, nodeid: str) -> None:
        self.seconds[nodeid] = round(self.seconds[nodeid] + time.process_time(), 4)

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed:
            self.failed.append(report.nodeid)

    def pytest_collectreport(self, report: Any) -> None:
        if report.failed:
            self.failed.append(report.nodeid or "collection")


class _Contexts:
    """Names the test that runs to coverage."""

    def __init__(self, coverage: Any) -> None:
        self._coverage = coverage

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self._coverage.switch_context(nodeid)

    def pytest_runtest_logfinish(self) -> None:
        self._coverage.switch_context("")


if __name__ == "__main__":
    _obey(json.loads(sys.argv[1]))

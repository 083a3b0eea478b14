"""What all tests share."""

import functools
import gc
import os
import signal
import sys
from pathlib import Path

# before numpy is loaded, for this process, those of xdist and those that tests start: OpenBLAS has a thread for each
# processor otherwise, and these wait for each other busily (docs/speed.md)
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from filelock import FileLock
from hypothesis import settings

from support.one_compiler import compile_each_kernel_once

#: The fixtures of tests of pages, and a hook for all folders.
pytest_plugins = ["support.browser", "support.doctests"]

#: Makes the golden data, with a package that the tests do not need.
collect_ignore = ["golden/make_trajectories.py"]

#: Files and folders that take more than two seconds of a processor, or compile the simulator: `make quick` leaves them
#: out.  A test is slow, too, where it is marked so itself.
SLOW = """
    analysis/precession/test_gates.py  analysis/precession/test_sweep.py  analysis/pulses/test_times.py
    analysis/pulses/test_trace.py  analysis/rotation/test_track.py  analysis/spindown/test_fit.py
    analysis/spindown/test_tilt.py  analysis/sway/test_sway.py  analysis/test_comparison.py
    instruments/drivers/counter/test_phyphox.py  instruments/drivers/oscilloscope/test_on_the_bench.py
    instruments/virtual/bench/test_fuzz.py  instruments/virtual/core/test_long_lines.py
    instruments/virtual/servers/test_at_work.py
    levilab/acquisition/experiments/test_hold.py  levilab/acquisition/experiments/test_limit.py
    levilab/acquisition/experiments/test_precession.py  levilab/acquisition/experiments/test_sway.py
    levilab/acquisition/experiments/test_trace.py  levilab/acquisition/test_loop.py  levilab/acquisition/test_losses.py
    levilab/acquisition/test_sound.py  levilab/acquisition/test_triggering.py  levilab/benchmark
    levilab/cli/test_main.py  levilab/cli/test_sweep.py  levilab/crosscheck  levilab/formats/waveforms/test_memory.py
    levilab/laboratory/test_laboratory.py  levilab/live  levilab/motion  levilab/notebook  levilab/pipelines/many
    levilab/pipelines/spin  levilab/pipelines/spindown  levilab/pipelines/sway/test_sway.py
    levilab/pipelines/test_result.py  levilab/pipelines/video/test_analysis.py  levilab/report/groups/test_class.py
    levilab/report/test_language.py  levilab/report/test_many.py  levilab/report/test_page.py
    levilab/report/test_pdf.py  levilab/report/test_same_bytes.py  levilab/report/worksheets/test_worksheets.py
    levilab/reproduce/test_chapters.py  levilab/runs/test_hostile.py  levilab/runs/test_kill.py  levilab/simulator
    levilab/stability  levilab/sweeps  levilab/workers  levilab/world/test_base.py  levilab/world/test_motion_world.py
    levilab/world/test_serve.py  levilab/world/test_spin_world.py  ../levilab/simulator  test_browser.py
    test_documentation.py  test_study.py
"""
#: Rooms of processes, sockets and types, whose slow tests a version of Python may change: `make all-pythons` leaves out
#: all other slow ones, and .github/workflows/tests.yml carries out every test on each version.
VERSIONED = """
    instruments/links  instruments/virtual/servers  levilab/cli  levilab/live/practice/test_bench.py
    levilab/live/test_doors.py  levilab/live/test_serve.py
    levilab/notebook/test_front_door.py  levilab/notebook/test_guesses.py  levilab/runs  levilab/sweeps
    levilab/workers  levilab/world/test_serve.py
"""
#: Files with tests of ten seconds and more: they go first of all, so that at the end no worker waits for another's.
LONGEST = """
    levilab/reproduce/test_run.py  test_documentation.py  levilab/notebook/test_jupyterlab.py
"""


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Look for no garbage until all tests are collected: there is none, and that took a fifth of the time.

    In a fresh clone no file of tests is compiled yet.  One process of xdist does it, for five seconds, and the others
    wait and read what it has written.
    """
    gc.disable()
    compiled = Path(__file__).parent / "__pycache__"
    if "PYTEST_XDIST_WORKER" in os.environ and compiled.is_dir() and not sys.dont_write_bytecode:
        with FileLock(compiled / "first.lock"):
            if not any(compiled.glob("test_*.pyc")):
                return (yield)
    return (yield)


def pytest_collection_modifyitems(items):
    """Mark what is slow or of pages, and let the slow tests go first, the longest before the others."""
    tests = Path(__file__).parent
    slow, versioned, longest = (
        [(tests / name).resolve() for name in names.split()] for names in (SLOW, VERSIONED, LONGEST)
    )
    assert all(path.exists() for path in slow + versioned + longest), "tests/conftest.py names a file that is gone"
    is_slow, is_versioned = (
        functools.cache(lambda file, paths=frozenset(paths): not paths.isdisjoint((file, *file.parents)))
        for paths in (slow, versioned)
    )
    for item in items:
        if "browser" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.pages)
        if is_slow(item.path):
            item.add_marker(pytest.mark.slow)
        if item.get_closest_marker("slow") and not is_versioned(item.path):
            item.add_marker(pytest.mark.any_python)
    items.sort(key=lambda item: (item.path not in longest, item.get_closest_marker("slow") is None))


def pytest_collection_finish():
    """Thousands of tests and all that they import stay: the collection of garbage need not look at them each time.

    Nor every 700 objects: that took a twentieth of the processor's time.
    """
    gc.freeze()
    gc.set_threshold(20_000, 10, 10)
    gc.enable()


# What is green stays green: the same few examples each time, however busy the machine. `make explore` looks for others.
settings.register_profile("repeat", max_examples=40, derandomize=True, deadline=None)
settings.register_profile("explore", max_examples=1000, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeat"))


@pytest.fixture(autouse=True, scope="session")
def signals_as_at_a_terminal():
    """Started by nohup or in the background, a process inherits signals that are ignored: the tests send some."""
    for name in ("SIGINT", "SIGHUP", "SIGTERM"):
        number = getattr(signal, name, None)
        if number and signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler if name == "SIGINT" else signal.SIG_DFL)


@pytest.fixture(autouse=True, scope="session")
def each_kernel_is_compiled_once(tmp_path_factory):
    """The processes of xdist have folders of their own in one folder."""
    is_one_of_several = "PYTEST_XDIST_WORKER" in os.environ
    if is_one_of_several:
        with pytest.MonkeyPatch.context() as patch:
            compile_each_kernel_once(tmp_path_factory.getbasetemp().parent, patch)
            yield
    else:
        yield


@pytest.fixture(autouse=True, scope="session")
def no_test_waits_for_the_disk():
    """Files are not forced onto the disk, which matters after a loss of power alone and takes a millisecond each time.

    Processes that the tests start force theirs.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda _: None)
        yield


@pytest.fixture(autouse=True)
def practice_bench_is_fresh():
    """PyVISA keeps one library of a name: without this a test would find the top as the one before has left it."""
    if "pyvisa_levilab" in sys.modules:
        import pyvisa

        for name in ("@levilab", "realtime@levilab"):
            pyvisa.ResourceManager(name).visalib.bench = None

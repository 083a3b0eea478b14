"""What all tests share."""

import os
import signal
import sys

import pytest
from hypothesis import settings

#: Makes the golden data, with a package that the tests do not need.
collect_ignore = ["golden/make_trajectories.py"]

# What is green stays green: the same examples each time, however busy the machine. `make explore` looks for others.
settings.register_profile("repeat", derandomize=True, deadline=None)
settings.register_profile("explore", max_examples=1000, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeat"))


@pytest.fixture(autouse=True, scope="session")
def signals_as_at_a_terminal():
    """Started by nohup or in the background, a process inherits signals that are ignored: the tests send some."""
    for name in ("SIGINT", "SIGHUP", "SIGTERM"):
        number = getattr(signal, name, None)
        if number and signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler if name == "SIGINT" else signal.SIG_DFL)


@pytest.fixture(autouse=True)
def practice_bench_is_fresh():
    """PyVISA keeps one library of a name: without this a test would find the top as the one before has left it."""
    if "pyvisa_levilab" in sys.modules:
        import pyvisa

        for name in ("@levilab", "realtime@levilab"):
            pyvisa.ResourceManager(name).visalib.bus = None

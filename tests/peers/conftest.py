"""The ways by which other people's drivers reach a virtual instrument.

PyMeasure and PyMoDAQ have requirements of their own: these tests run in environments of their own (`make peers`,
`nox --session pymodaq`).  A module whose program is not installed is not collected.
"""

import contextlib
from importlib.util import find_spec
from pathlib import Path

import pytest
import pyvisa

from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.protocol_levilab import plug_in
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.servers.server import BenchServer

#: The modules that need another program than PyMeasure.
PROGRAMS = {"test_pymodaq.py": "pymodaq"}

collect_ignore = [
    module.name
    for module in Path(__file__).parent.glob("test_*.py")
    if not find_spec(PROGRAMS.get(module.name, "pymeasure"))
]

#: Where an instrument is plugged in unless a test says otherwise, and where one on a serial line is.
ADDRESS, LINE = "TCPIP0::there.levilab::inst0::INSTR", "ASRLthere::INSTR"

#: PyVISA's backend in the process, and the servers with pyvisa-py.  Tests of serial lines name others: over TCP
#: ("socket", too), and pyserial's URL.
WAYS = ["@levilab", "socket", "hislip", "vxi11"]

#: A bare socket does not mark ends of messages: both sides need the terminator.
_ENDS = {"read_termination": "\n", "write_termination": "\n"}


def pytest_configure(config):
    """PyMeasure says so of each driver that does not declare its dialect."""
    config.addinivalue_line("filterwarnings", "ignore:It is not known whether this device support SCPI:FutureWarning")


@pytest.fixture(params=WAYS)
def way(request):
    return request.param


@pytest.fixture
def opened(way):
    """Plugs an instrument in and opens a foreign driver for it; unplugs it after the test."""
    with contextlib.ExitStack() as stack:

        def open_driver(driver, device, **options):
            address = LINE if hasattr(device, "serial_settings") else ADDRESS
            name, how = stack.enter_context(_reached(VirtualBench({address: device}), way))
            there = driver(name, **how, **options)
            stack.callback(there.adapter.close)
            return there

        yield open_driver


@contextlib.contextmanager
def _reached(bench, way):
    """The resource name of the one instrument of a bench, and the other arguments that PyMeasure needs."""
    (address,) = bench.instruments
    if way == "@levilab":
        library = library_for(bench)
        yield address, {"visa_library": library}
        pyvisa.ResourceManager(library).close()
    elif way == "pyserial":
        plug_in(bench)
        yield "ASRLlevilab://there::INSTR", {"visa_library": "@py"}
    else:
        with BenchServer(bench) as server:
            bare = way == "socket" and not address.startswith("ASRL")
            yield server.endpoints[0].resources[way], {"visa_library": "@py"} | (_ENDS if bare else {})

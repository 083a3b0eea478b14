"""PyMeasure's own device suite for the Agilent 33500, run against the virtual one.

    python tests/peers/run_pymeasure_suite.py pymeasure-0.16.0/ [--server hislip | --device-address TCPIP0::...::INSTR]

In an environment with PyMeasure and levilab; the argument is PyMeasure's unpacked source distribution.  Without
options the virtual instrument is in this process, by "@levilab"; with --server pyvisa-py reaches it through a server.

The suite's files stay as they are, byte for byte.  As published the suite skips itself ("only works with connected
hardware") and knows one address, its author's, whatever ``--device-address`` says: so while it runs `pytest.skip` does
not skip whole modules, and a resource opened at the author's address is the one at ours.

Ends with 0 if every case passes but for those excused in agilent33500_excuses.toml, which must not pass.
"""

import argparse
import contextlib
import os
import sys
import tomllib
from pathlib import Path

import pytest

SUITE = Path("tests/instruments/agilent/test_agilent33500_with_device.py")
CASES = 395
AUTHORS_ADDRESS = "TCPIP::192.168.225.208::inst0::INSTR"
OURS = "TCPIP0::generator.levilab::inst0::INSTR"
EXCUSES = Path(__file__).with_name("agilent33500_excuses.toml")


class Bench:
    """A pytest plugin: lets the suite begin, brings it to the device, and notes how each case ends."""

    def __init__(self, address):
        self.address = address
        self.outcomes = {}

    @pytest.hookimpl(wrapper=True)
    def pytest_runtestloop(self):
        with pytest.MonkeyPatch.context() as patch:
            self._lead_to_the_device(patch)
            return (yield)

    @pytest.hookimpl(wrapper=True)
    def pytest_collection(self):
        skip = pytest.skip

        def only_cases(reason="", *, allow_module_level=False):
            if not allow_module_level:
                skip(reason)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(pytest, "skip", only_cases)
            return (yield)

    def _lead_to_the_device(self, patch):
        import pyvisa

        open_resource = pyvisa.ResourceManager.open_resource

        def at_our_address(manager, name, *args, **options):
            return open_resource(manager, self.address if name == AUTHORS_ADDRESS else name, *args, **options)

        patch.setattr(pyvisa.ResourceManager, "open_resource", at_our_address)

    def pytest_runtest_logreport(self, report):
        case = report.nodeid.partition("::")[2]
        if report.failed:
            self.outcomes[case] = f"{report.outcome} ({report.when})"
        elif report.when == "call" or report.skipped:
            self.outcomes.setdefault(case, report.outcome)


def excuses(path=EXCUSES):
    """Which case need not pass, and why: what the real instrument does."""
    return {excuse["test"]: excuse["reason"] for excuse in tomllib.loads(path.read_text("utf-8")).get("excuse", [])}


def complaints(outcomes, excused):
    """What keeps the run from being a proof.

    >>> complaints({f"case {k}": "passed" for k in range(395)}, {})
    []
    """
    wrong = [] if len(outcomes) == CASES else [f"{len(outcomes)} cases ran, not {CASES}"]
    wrong += [f"{case}: {how}" for case, how in outcomes.items() if how != "passed" and case not in excused]
    wrong += [f"{case} is excused and passes" for case in excused if outcomes.get(case) == "passed"]
    return wrong + [f"{case} is excused and unknown" for case in excused if case not in outcomes]


def run(source, address):
    """How each case of the suite ends."""
    bench = Bench(address)
    settings = ["-c", str(source / "pyproject.toml"), f"--rootdir={source}"]  # PyMeasure's, wherever it was unpacked
    options = ["-q", "-p", "no:cacheprovider", "--tb=short", "--no-header"]
    pytest.main([str(source / SUITE), *settings, f"--device-address={address}", *options], plugins=[bench])
    return bench.outcomes


@contextlib.contextmanager
def reached(way, address):
    """The address to use while this lasts, and PyVISA's library set for it.  way: of a server's of our own, if any."""
    if way is None:
        os.environ.setdefault("PYVISA_LIBRARY", "@levilab")
        yield address
        return
    from instruments.virtual.servers.server import BenchServer
    from levilab.world.bench import virtual_bus

    os.environ["PYVISA_LIBRARY"] = "@py"
    with BenchServer(virtual_bus()) as server:
        (offer,) = (offer for offer in server.endpoints if offer.address == OURS)
        yield offer.resources[way]


def main():
    """Run the suite, compare, and print the result."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("source", type=Path, help="PyMeasure's unpacked source distribution")
    parser.add_argument("--device-address", default=OURS)
    parser.add_argument("--server", choices=["hislip", "vxi11"], help="reach a server of our own by this protocol")
    wanted = parser.parse_args()
    with reached(wanted.server, wanted.device_address) as address:
        outcomes, excused = run(wanted.source.resolve(), address), excuses()
    wrong = complaints(outcomes, excused)
    passed = sum(how == "passed" for how in outcomes.values())
    summary = [f"{passed} of {len(outcomes)} cases pass, {len(excused)} are excused", *wrong]
    sys.stdout.write("\n".join(summary) + "\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

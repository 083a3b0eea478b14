"""PyMeasure's classes at `levilab bench serve`, as a user runs it: a process, by the resource names that it prints."""

import contextlib
import json
import subprocess
import sys
import time

import pytest

pytest.importorskip("pymeasure")

from pymeasure.instruments.agilent import Agilent33220A, Agilent33500
from pymeasure.instruments.keysight import KeysightDSOX1102G
from pymeasure.instruments.lakeshore import LakeShore425
from pymeasure.instruments.pendulum import CNT91

#: Seconds of the bench per second; how long something is waited for [s], reached by a failure only.
SPEED, AT_MOST = 20, 20.0

#: The models that a bench has which are not the first of their kind.
OTHERS = {"counter": "CNT-91", "generator": "33220A", "oscilloscope": "DSOX1000"}

WAYS = pytest.mark.parametrize("way", ["socket", "hislip", "vxi11"])
ENDS = {"read_termination": "\n", "write_termination": "\n"}


@contextlib.contextmanager
def serving(folder, *words):
    """The resource names of a server, by kind and by way."""
    command = [sys.executable, "-m", "levilab", "bench", "serve", "--json", "--speed", str(SPEED), *words]
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
    try:
        offers = json.loads(process.stdout.readline())["instruments"]
        yield {kind: offer["resources"] for kind, offer in offers.items()}
        process.terminate()
        process.wait(AT_MOST)
    finally:
        process.kill()
        process.communicate()


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A bench with the second model of each kind."""
    models = [f"--model={kind}={model}" for kind, model in OTHERS.items()]
    with serving(tmp_path_factory.mktemp("serve"), *models) as names:
        yield names


@pytest.fixture(scope="module")
def first_models(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("serve")) as names:
        yield names


@contextlib.contextmanager
def opened(driver, names, way):
    """A foreign driver at one of these names."""
    bare = names[way].endswith("::SOCKET")
    there = driver(names[way], visa_library="@py", **(ENDS if bare else {}))
    with contextlib.closing(there.adapter):
        yield there


@WAYS
def test_the_33500_drives(first_models, way):
    with opened(Agilent33500, first_models["generator"], way) as generator:
        assert "33522B" in generator.id
        generator.shape, generator.frequency, generator.amplitude, generator.output = "SIN", 25.0, 2.5, True
        assert (generator.shape, generator.frequency, generator.amplitude, generator.output) == ("SIN", 25.0, 2.5, True)
        generator.ch_2.frequency = 12.5
        assert generator.ch_2.frequency == 12.5
        generator.output = False
        assert generator.check_errors() == []


@WAYS
def test_the_33220a_drives(bench, way):
    with opened(Agilent33220A, bench["generator"], way) as generator:
        assert "33220A" in generator.id
        generator.shape, generator.frequency, generator.amplitude, generator.output = "SIN", 25.0, 2.5, True
        assert (generator.shape, generator.frequency, generator.amplitude, generator.output) == ("SIN", 25.0, 2.5, True)
        generator.output = False
        assert generator.output is False


@WAYS
def test_the_cnt91_counts_the_spin_of_the_top(bench, way):
    with opened(CNT91, bench["counter"], way) as counter:
        assert "CNT-91" in counter.id
        counter.reset()
        counter.write("INP1:COUP DC;LEV:AUTO OFF;:INP1:LEV 0.6")
        counter.write("SYST:TOUT 1;:SYST:TOUT:TIME 2")  # the top may just have fallen
        begun = time.monotonic()
        while True:
            counter.buffer_frequency_time_series("A", 4, gate_time=0.5)
            found = counter.read_buffer()
            if max(found) < 1e3 or time.monotonic() - begun > AT_MOST:
                break
        assert len(found) == 4
        assert all(15 < frequency < 60 for frequency in found), found
        assert counter.check_errors() == []


@WAYS
def test_the_dsox1102g_sees_the_pulses(bench, way):
    with opened(KeysightDSOX1102G, bench["oscilloscope"], way) as scope:
        assert "DSO" in scope.id
        scope.reset()
        scope.ch1.setup(probe_attenuation=1, vertical_range=2.0, offset=0.6)
        scope.timebase_setup(horizontal_range=0.5)
        scope.write(":TRIG:SWE AUTO")
        scope.digitize("channel1")
        volts, preamble = scope.download_data("channel1", 1000)
        assert len(volts) == preamble["points"]
        assert volts.min() == pytest.approx(0.1, abs=0.1)
        assert volts.max() < 2.0
        assert scope.check_errors() == []


# over TCP; there are pseudo-terminals too, but not with the 7 data bits that the class asks for
@pytest.mark.parametrize("way", ["socket"])
def test_the_425_reads_the_field_of_the_base(bench, way):
    with opened(LakeShore425, bench["magnetometer"], way) as meter:
        meter.unit = "T"
        assert meter.unit == "T"
        assert meter.field == pytest.approx(0.019, abs=0.003)


def test_two_programs_at_once(bench):
    with (
        opened(Agilent33220A, bench["generator"], "hislip") as one,
        opened(Agilent33220A, bench["generator"], "socket") as other,
    ):
        for frequency in (11.0, 22.0):
            one.frequency = frequency
            assert one.frequency == frequency
            assert other.frequency == frequency

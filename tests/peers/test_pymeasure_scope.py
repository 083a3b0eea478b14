"""PyMeasure's KeysightDSOX1102G class, unmodified, on the virtual scope, by each of the ways that lead there."""

import numpy as np
import pytest

pytest.importorskip("pymeasure")

from pymeasure.instruments.keysight import KeysightDSOX1102G

from instruments.clock import VirtualClock
from instruments.virtual.oscilloscope.keysight_dsox import VirtualDSOX1000


def square(start, step, n):
    """The terminal for compensating probes, 1 kHz, 0 to 2.5 V, through a 10:1 probe."""
    return 0.25 * (((start + step * np.arange(n)) * 1e3) % 1.0 < 0.5)


def sine(start, step, n):
    return np.sin(2 * np.pi * 4321.0 * (start + step * np.arange(n)))


@pytest.fixture
def scope(opened):
    there = opened(KeysightDSOX1102G, VirtualDSOX1000(VirtualClock(), signals={1: square, 2: sine}))
    yield there
    assert there.check_errors() == []


#: Of one input: each with what can be set.
OF_AN_INPUT = [
    ("bwlimit", [True, False]),
    ("coupling", ["ac", "dc"]),
    ("display", [False, True]),
    ("invert", [True, False]),
    ("offset", [1.0, -0.5]),
    ("probe_attenuation", [1.0, 10.0]),
    ("range", [10.0, 1.6]),
    ("scale", [0.1, 1.0]),
]
OF_THE_SCOPE = [
    ("timebase_mode", ["window", "xy", "roll", "main"]),
    ("timebase_offset", [1.0, 0.0]),
    ("timebase_range", [10.0, 5e-3]),
    ("timebase_scale", [0.1, 5e-4]),
    ("acquisition_type", ["average", "hresolution", "peak", "normal"]),
    ("acquisition_mode", ["segmented", "realtime"]),
    ("waveform_points_mode", ["maximum", "raw", "normal"]),
    ("waveform_source", ["channel2", "function", "fft", "wmemory1", "wmemory2", "ext", "channel1"]),
    ("waveform_format", ["word", "byte", "ascii"]),
]


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize(("name", "values"), OF_AN_INPUT, ids=[name for name, _ in OF_AN_INPUT])
def test_a_property_of_an_input(scope, name, values, number):
    channel = scope.ch(number)
    for value in values:
        setattr(channel, name, value)
        assert getattr(channel, name) == value


@pytest.mark.parametrize(("name", "values"), OF_THE_SCOPE, ids=[name for name, _ in OF_THE_SCOPE])
def test_a_property_of_the_scope(scope, name, values):
    for value in values:
        setattr(scope, name, value)
        assert getattr(scope, name) == value


def test_a_whole_setting_at_once(scope):
    scope.ch1.setup(
        probe_attenuation=1, coupling="dc", vertical_range=1.6, offset=0.2, bwlimit=True, display=True, label="photo"
    )
    scope.timebase_setup(mode="main", offset=0.0, horizontal_range=5e-3)
    of_the_input = scope.ch1.current_configuration
    assert of_the_input.items() >= {"CHAN": 1, "RANG": 1.6, "OFFS": 0.2, "COUP": "DC", "BWL": True, "PROB": 1}.items()
    assert scope.ch1.label == '"PHOTO"'
    assert scope.timebase == {"MODE": "MAIN", "REF": "CENT", "MAIN:RANG": 5e-3, "POS": 0.0}


@pytest.mark.parametrize("points", [100, 1000, 62500])
def test_a_trace_of_the_square_wave(scope, points):
    scope.ch1.setup(probe_attenuation=1, vertical_range=1.6, offset=0.2)
    scope.timebase_setup(horizontal_range=5e-3)
    scope.write(":TRIG:EDGE:SOUR CHAN1;LEV 0.125;SLOP POS;:TRIG:SWE NORM")
    scope.digitize("channel1")
    volts, preamble = scope.download_data("channel1", points)
    assert preamble["points"] == len(volts)
    assert preamble["xincrement"] * len(volts) == pytest.approx(5e-3)
    step = preamble["yincrement"] + 1.6 / 200  # of the samples behind the record: eight bits
    assert volts.min() == pytest.approx(0.0, abs=step)
    assert volts.max() == pytest.approx(0.25, abs=step)
    times = preamble["xorigin"] + preamble["xincrement"] * np.arange(len(volts))
    high = times % 1e-3 < 0.5e-3
    at_an_edge = (times + 2 * preamble["xincrement"]) % 0.5e-3 < 4 * preamble["xincrement"]
    assert ((volts > 0.125) == high)[~at_an_edge].all()


def test_two_inputs(scope):
    scope.ch2.setup(probe_attenuation=1, vertical_range=3.2, offset=0.0)
    scope.timebase_setup(horizontal_range=1e-3)
    scope.write(":TRIG:EDGE:SOUR CHAN2;LEV 0;SLOP POS;:TRIG:SWE NORM")
    scope.digitize("channel2")
    volts, _ = scope.download_data("channel2", 1000)
    assert np.ptp(volts) == pytest.approx(2.0, abs=2 * 3.2 / 200)


def test_running_and_stopping(scope):
    running = 1 << 3  # of the operation status condition register
    for act, runs in ((scope.run, True), (scope.stop, False)):
        act()
        assert bool(int(scope.ask(":OPER:COND?")) & running) is runs
    scope.single()
    scope.autoscale()
    scope.default_setup()


# not on a bare socket: the block has line feeds in it, and PyMeasure reads up to the first
@pytest.mark.parametrize("way", ["@levilab", "hislip", "vxi11"])
def test_a_setup_is_kept_and_put_back(scope):
    kept = scope.system_setup
    scope.ch1.display = False
    assert scope.system_setup != kept
    scope.system_setup = kept
    assert scope.ch1.display is True
    assert scope.system_setup == kept


def picture(scope, form):
    """PyMeasure reads byte by byte up to a time-out, 6 s if it is not cut: on a server they are the wall's."""
    scope.adapter.connection.timeout = 500
    found = bytes(scope.download_image(form))
    scope.clear_status()  # to read where nothing is left is an error (-420)
    return found


# not by HiSLIP: at the end of an answer pyvisa-py 0.8.1 gives nothing for ever, and never a time-out
@pytest.mark.parametrize("way", ["@levilab", "socket", "vxi11"])
def test_a_picture_of_the_screen(scope):
    assert picture(scope, "png").startswith(b"\x89PNG\r\n")


@pytest.mark.parametrize("way", ["@levilab"])  # too much, byte by byte, for a server
@pytest.mark.parametrize("form", ["bmp8bit"])
def test_a_large_picture_of_the_screen(scope, form):
    assert picture(scope, form).startswith(b"BM")

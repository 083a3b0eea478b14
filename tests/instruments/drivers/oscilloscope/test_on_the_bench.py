"""The drivers of the oscilloscopes at the virtual ones."""

import contextlib
import tracemalloc

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.oscilloscope import NeverTriggered, NothingAcquired
from instruments.drivers.oscilloscope.keysight_dsox import KeysightDSOX
from instruments.drivers.oscilloscope.rigol_ds1000z import RigolDS1000Z
from instruments.drivers.oscilloscope.siglent_sds1000xe import SiglentSDS1000XE
from instruments.drivers.oscilloscope.tektronix_tds2000 import TektronixTDS2000
from instruments.errors import BadAnswer, SettingsLost
from instruments.links.opening import open_link
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.faults import Fault
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.oscilloscope.keysight_dsox import VirtualDSOX1000
from instruments.virtual.oscilloscope.record import PIECE
from instruments.virtual.oscilloscope.rigol_ds1000z import VirtualDS1000Z
from instruments.virtual.oscilloscope.siglent_sds1000xe import VirtualSDS1000XE
from instruments.virtual.oscilloscope.tektronix_tds2000 import VirtualTDS2000
from support.scopes import cheap, constant, pulses


def bench(make, signal):
    clock = VirtualClock()
    name = "TCPIP0::scope.levilab::inst0::INSTR"
    device = make(clock, signals={1: signal})
    library = library_for(VirtualBench({name: device}))
    return device, open_link(name, library=library), clock


PAIRS = [
    *((RigolDS1000Z, VirtualDS1000Z), (KeysightDSOX, VirtualDSOX1000)),
    *((SiglentSDS1000XE, VirtualSDS1000XE), (TektronixTDS2000, VirtualTDS2000)),
]
BOTH = pytest.mark.parametrize(("driver", "make"), PAIRS[:2], ids=["rigol", "keysight"])
ALL = pytest.mark.parametrize(("driver", "make"), PAIRS, ids=["rigol", "keysight", "siglent", "tektronix"])
PULSES = {"duration_s": 0.1, "points": 10_000, "volts_per_division": 0.2, "offset_v": 0.6}


@BOTH
@pytest.mark.parametrize("slope", ["rising", "falling", "either"])
def test_the_driver_sees_the_pulse_where_and_as_it_was(driver, make, slope):
    device, transport, clock = bench(make, pulses)
    scope = driver(transport, clock=clock)
    scope.prepare(**PULSES, trigger_level_v=0.65, trigger_slope=slope)
    scope.acquire(timeout_s=1.0)
    trace = scope.trace(1)
    true = pulses(device.record().trigger + trace.t0_s, trace.dt_s, trace.codes.size)
    # half a code, and the digits of the preamble
    assert np.abs(trace.volts - true).max() <= 0.5 * trace.volts_per_code + 1e-5
    assert trace.codes.size >= 10_000
    assert trace.codes.size * trace.dt_s >= 0.1 * (1 - 1e-9)
    middle = round(-trace.t0_s / trace.dt_s)
    assert abs(trace.volts[middle] - 0.65) <= 2 * trace.volts_per_code
    np.testing.assert_array_equal(np.concatenate(list(scope.blocks(1))), trace.codes)
    transport.close()


@ALL
def test_the_driver_says_when_the_scope_never_triggers(driver, make):
    device, transport, clock = bench(make, pulses)
    scope = driver(transport, clock=clock)
    scope.prepare(**PULSES, trigger_level_v=1.25)
    before = clock.now()
    with pytest.raises(NeverTriggered) as never:
        scope.acquire(timeout_s=5.0)
    assert (never.value.level_v, never.value.source) == (pytest.approx(1.25, abs=0.01), scope.SOURCE.format(1))
    assert clock.now() - before == pytest.approx(5.1, abs=0.3)
    assert not device.running()
    scope.prepare(**PULSES, trigger_level_v=0.65)  # and goes on
    scope.acquire(timeout_s=1.0)
    transport.close()


@ALL
def test_with_sweep_auto_the_driver_shows_what_there_is(driver, make):
    _, transport, clock = bench(make, constant(0.5))
    scope = driver(transport, clock=clock)
    scope.prepare(**PULSES, trigger_level_v=1.25, sweep="auto")
    scope.acquire(timeout_s=1.0)
    assert scope.trace(1).volts == pytest.approx(0.5, abs=0.005)
    transport.close()


def test_24_million_points_stream_through_the_memory_of_a_few_pieces():
    _, transport, clock = bench(VirtualDS1000Z, cheap)
    scope = RigolDS1000Z(transport, clock=clock)
    scope.prepare(**PULSES | {"points": 24_000_000}, trigger_level_v=0.65)
    scope.acquire(timeout_s=1.0)
    tracemalloc.start()
    try:
        sizes = [piece.size for piece in scope.blocks(1)]
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert sizes == [250_000] * 96
    # of a piece: volts, scaled volts, their codes in floating point, and the bytes on their way
    assert peak < 60 * PIECE
    transport.close()


# --- a scope that is changed under way ---


@contextlib.contextmanager
def prepared(driver, make, address="TCPIP0::scope.levilab::inst0::INSTR"):
    """A scope that waits for pulses at 0.65 V, its driver, and the bus for faults."""
    clock = VirtualClock()
    device = make(clock, signals={1: pulses})
    bus = VirtualBench({address: device})
    scope = driver(open_link(address, library=library_for(bus)), clock=clock)
    scope.prepare(**PULSES, trigger_level_v=0.65)
    yield device, scope, bus
    scope.close()


def read(scope, how):
    scope.acquire(timeout_s=1.0)
    return scope.trace(1).codes if how == "trace" else np.concatenate(list(scope.blocks(1)))


READING = pytest.mark.parametrize("how", ["trace", "blocks"])


@BOTH
@READING
def test_a_reset_after_the_preparation_gives_no_trace(driver, make, how):
    with prepared(driver, make) as (device, scope, _):
        device.reset()
        with pytest.raises(SettingsLost, match="probe_factor") as lost:
            read(scope, how)
        assert {"channel1_scale_v", "channel1_offset_v", "trigger_level_v"} <= set(lost.value.changed)
        with pytest.raises(NothingAcquired):
            scope.trace(1)
        scope.prepare(**PULSES, trigger_level_v=0.65)
        assert read(scope, how).size >= 10_000


@BOTH
@READING
@pytest.mark.parametrize(
    "question", [r":TRIG:STAT\?|:OPER:COND\?|:AER\?", r":WAV:PRE\?", r":WAV:DATA\?", r"SYST:ERR\?"]
)
@pytest.mark.parametrize("after", [0, 1, 3])
def test_a_reset_at_any_time_gives_no_trace(driver, make, how, question, after):
    with prepared(driver, make) as (_, scope, bus):
        bus.faults.append(fault := Fault("reset", question=question, after=after))
        with contextlib.suppress(SettingsLost):
            read(scope, how)
            assert fault.seen <= after  # it was not asked so often


@BOTH
def test_a_reset_during_the_preparation_is_raised_by_it(driver, make):
    with prepared(driver, make) as (_, scope, bus):
        bus.faults.append(Fault("reset", question=r"SYST:ERR\?", after=10))
        with pytest.raises(SettingsLost):
            scope.prepare(**PULSES, trigger_level_v=0.65)


@BOTH
@pytest.mark.parametrize(
    ("setting", "value", "name"),
    [
        ("chan1_probe", 10.0, "channel1_probe_factor"),
        ("chan1_scale", 0.5, "channel1_scale_v"),
        ("chan1_offset", 0.572, "channel1_offset_v"),  # a seventh of a division: scopes round to less than a tenth
        ("chan1_coupling", "AC", "channel1_coupling"),
        ("chan1_invert", True, "channel1_inverted"),
        ("chan1_display", False, "channel1_display"),
        ("time_scale", 0.001, None),
        ("time_offset", 0.03, None),
        ("time_mode", "ROLL", "time_mode"),
        ("trigger_level", 1.3, "trigger_level_v"),
        ("trigger_source", "CHAN2", "trigger_source"),
        ("trigger_slope", "NEG", "trigger_slope"),
        ("trigger_sweep", "AUTO", "sweep"),
    ],
)
def test_a_key_of_the_front_panel_raises_instead_of_giving_a_trace(driver, make, setting, value, name):
    with prepared(driver, make) as (device, scope, _):
        start = scope._start

        def start_and_be_changed():
            start()
            device.settings[setting] = value
            device.on_change(setting)  # what was begun begins again

        scope._start = start_and_be_changed
        with pytest.raises(SettingsLost) as lost:
            read(scope, "trace")
        assert len(lost.value.changed) == 1
        assert name is None or name in lost.value.changed


@BOTH
@pytest.mark.parametrize("address", ["TCPIP0::scope.levilab::inst0::INSTR", "TCPIP0::scope.levilab::5025::SOCKET"])
@pytest.mark.parametrize("question", [r":WAV:PRE\?", r":TRIG:STAT\?|:OPER:COND\?"])
def test_after_an_answer_that_makes_no_sense_the_link_is_in_step_and_the_scope_stopped(driver, make, address, question):
    with prepared(driver, make, address) as (device, scope, bus):
        bus.faults.append(Fault("garbage before", question=question))
        with pytest.raises(BadAnswer):
            read(scope, "trace")
        assert not scope.transport._out_of_step
        assert not device.running()
        assert scope.identity().startswith(device.identity)
        assert read(scope, "trace").size >= 10_000


@BOTH
def test_an_interruption_stops_the_scope(driver, make):
    with prepared(driver, make) as (device, scope, _):

        def interrupted(_):
            raise KeyboardInterrupt

        scope.clock.sleep, sleep = interrupted, scope.clock.sleep
        with pytest.raises(KeyboardInterrupt):
            scope.acquire(timeout_s=1.0)
        scope.clock.sleep = sleep
        assert not device.running()

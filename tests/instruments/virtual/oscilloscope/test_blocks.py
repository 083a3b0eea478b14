"""The virtual oscilloscopes against signals that are known at every instant."""

import contextlib
import io
import json
import math
import struct
import tracemalloc
import zlib

import numpy as np
import pytest
import pyvisa
from hypothesis import given
from hypothesis import strategies as st

from instruments.clock import VirtualClock
from instruments.drivers.oscilloscope import NeverTriggered, NothingAcquired
from instruments.drivers.oscilloscope.keysight_dsox import KeysightDSOX
from instruments.drivers.oscilloscope.rigol_ds1000z import RigolDS1000Z
from instruments.errors import BadAnswer, SettingsLost
from instruments.links.visa import VisaTransport
from instruments.virtual.bench.bus import Bus
from instruments.virtual.bench.faults import Fault
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.oscilloscope.acquisition import AUTO_AFTER
from instruments.virtual.oscilloscope.keysight_dsox import VirtualDSOX1000
from instruments.virtual.oscilloscope.measure import MEASUREMENTS, Measured, measure
from instruments.virtual.oscilloscope.record import PIECE, Edge
from instruments.virtual.oscilloscope.rigol_ds1000z import VirtualDS1000Z
from instruments.virtual.oscilloscope.scope import one_two_five
from support.wire import ask, cable, errors, received, send

DARK, BRIGHT, DUTY = 0.1, 1.2, 0.03


def at(start, step, n):
    return start + step * np.arange(n)


def pulses(start, step, n):
    """Light of a top that turns 25 times a second: Gaussian pulses of 3 % of a turn, in the middle of it."""
    sigma = DUTY / math.sqrt(8 * math.log(2))
    return DARK + (BRIGHT - DARK) * np.exp(-0.5 * ((25.0 * at(start, step, n) % 1.0 - 0.5) / sigma) ** 2)


def ramp(start, step, n):
    """A triangle between −1 V and 1 V, 50 Hz: its slope is 200 V/s everywhere."""
    return 4 * np.abs((50.0 * at(start, step, n) + 0.75) % 1.0 - 0.5) - 1


def sine(start, step, n):
    return np.sin(2 * np.pi * 1000.0 * at(start, step, n))


def constant(volts):
    return lambda _start, _step, n: np.full(n, volts)


def slow(start, step, n):
    """The same pulses, ten a second."""
    return pulses(0.4 * start, 0.4 * step, n)


def once(start, step, n):
    """One flash, five seconds after the bench was switched on."""
    return np.where(np.abs(at(start, step, n) - 5.0) < 0.001, 1.0, 0.1)


def noisy(start, _step, n):
    """Noise that depends on where the piece begins, as of a world that seeds it so."""
    return np.random.default_rng(round(start * 1e7)).standard_normal(n) * 0.1


def cheap(start, step, n):
    """Pulses for the trigger, something quick for the record."""
    return np.full(n, 0.3) if n > 10_000 else pulses(start, step, n)


def rigol(signal=pulses, *messages, **more):
    return told(VirtualDS1000Z(VirtualClock(), signals={1: signal} | more), *messages)


def keysight(signal=pulses, *messages, **more):
    return told(VirtualDSOX1000(VirtualClock(), signals={1: signal} | more), *messages)


def told(device, *messages):
    for message in messages:
        send(device, message.encode() + b"\n")
    assert errors(device) == []
    return device


def block(device, question, timeout=100.0):
    """The bytes of the block that answers, its head and its end checked, and the head."""
    send(device, question.encode() + b"\n")
    answer = received(device, timeout)
    digits = int(answer[1:2])
    head, data = answer[: 2 + digits], answer[2 + digits :]
    assert answer[:1] == b"#"
    assert data[-1:] == b"\n"
    assert int(head[2:]) == len(data) - 1
    return head, data[:-1]


RIGOL_READY = (
    "CHAN1:PROB 1;SCAL 0.2;OFFS -0.6",
    ":TIM:SCAL 0.01",
    ":ACQ:MDEP 120000",
    ":TRIG:EDGE:LEV 0.65",
    ":TRIG:SWE NORM",
)
KEYSIGHT_READY = ("CHAN1:PROB 1;SCAL 0.2;OFFS 0.6", ":TIM:RANG 0.12", ":TRIG:EDGE:LEV 0.65", ":TRIG:SWE NORM")


def rigol_stopped(signal=pulses, *messages):
    device = rigol(signal, *RIGOL_READY, *messages, ":SING")
    device.clock.sleep(3.0)
    assert ask(device, ":TRIG:STAT?") == "STOP"
    return device


def rigol_volts(device, mode="RAW"):
    """The whole record, as a program reads it: times from the trigger, volts."""
    told(device, ":WAV:SOUR CHAN1", ":WAV:FORM BYTE", f":WAV:MODE {mode}")
    fields = ask(device, ":WAV:PRE?").split(",")
    points, dt, t0, per_code, origin, reference = (float(fields[k]) for k in (2, 4, 5, 7, 8, 9))
    codes = b""
    for first in range(1, int(points) + 1, 250_000):
        told(device, f":WAV:STAR {first}", f":WAV:STOP {min(int(points), first + 249_999)}")
        codes += block(device, ":WAV:DATA?")[1]
    codes = np.frombuffer(codes, np.uint8).astype(float)
    return t0 + dt * np.arange(int(points)), (codes - origin - reference) * per_code


# --- the trigger ---


@pytest.mark.parametrize("level", [-0.5, 0.0, 0.37])
@pytest.mark.parametrize(("slope", "sign"), [("POS", 1), ("NEG", -1)])
def test_the_trigger_stands_at_time_nought_to_a_sample(level, slope, sign):
    device = rigol_stopped(ramp, "CHAN1:OFFS 0", f":TRIG:EDGE:LEV {level};SLOP {slope}")
    times, volts = rigol_volts(device)
    middle = np.searchsorted(times, 0.0)
    # the triangle goes 200 V/s: a code of 8 mV is four samples of 10 µs wide
    nearest = volts[middle - 1 : middle + 2]
    assert np.abs(nearest - level).max() <= 0.004 + 200 * 2e-6
    assert sign * (volts[middle + 100] - volts[middle - 100]) > 0


@pytest.mark.parametrize("scale", [1e-7, 1e-5, 1e-3, 0.01, 0.1])
def test_the_edge_is_found_as_well_at_every_time_base(scale):
    device = rigol_stopped(ramp, "CHAN1:OFFS 0;SCAL 0.001", ":TRIG:EDGE:LEV 0.002;SLOP POS", f":TIM:SCAL {scale}")
    record = device.record()
    # the triangle rises through 2 mV 10 µs after each of its zeros at 0, 20, 40 … ms
    assert (record.trigger % 0.02) == pytest.approx(1e-5, abs=0.02 / record.rate)


@given(level=st.floats(-0.9, 0.9), start=st.floats(0.0, 1.0), step=st.sampled_from([1e-6, 5e-5]), rising=st.booleans())
def test_the_first_edge_behind_the_start_is_found(level, start, step, rising):
    edge = Edge(ramp, level, 0.05, (1.0 if rising else -1.0,), step, 1e-9, start)
    found = edge.until(start + 0.1)
    # where the triangle crosses the level, in every period of 20 ms
    place = (level / 200 if rising else 0.01 - level / 200) % 0.02
    assert (found - place) % 0.02 == pytest.approx(0.0, abs=1e-8) or (found - place) % 0.02 == pytest.approx(0.02)
    # armed on the way: never more than two periods
    assert start <= found <= start + 0.04


def test_looking_on_gives_the_same_edge_as_looking_once():
    once = Edge(pulses, 0.65, 0.1, (1.0,), 5e-5, 1e-9, 0.0).until(1.0)
    again = Edge(pulses, 0.65, 0.1, (1.0,), 5e-5, 1e-9, 0.0)
    stops = np.arange(0.0005, 0.1, 0.0005)
    found = [again.until(stop) for stop in stops]
    assert [f is not None for f in found] == [stop > once for stop in stops]
    assert next(f for f in found if f is not None) == pytest.approx(once, abs=1e-8)


def test_an_edge_of_either_slope_is_found_first_come_first_served():
    both = Edge(pulses, 0.65, 0.1, (1.0, -1.0), 5e-5, 1e-9, 0.0185)
    up = Edge(pulses, 0.65, 0.1, (1.0,), 5e-5, 1e-9, 0.0)
    falling = Edge(pulses, 0.65, 0.1, (-1.0,), 5e-5, 1e-9, 0.0)
    assert up.until(1.0) < falling.until(1.0)
    assert both.until(1.0) == pytest.approx(up.until(1.0), abs=1e-8)


def test_the_part_before_the_trigger_is_filled_first():
    device = rigol(ramp, *RIGOL_READY, "CHAN1:OFFS 0", ":TRIG:EDGE:LEV 0", ":TIM:SCAL 0.1", ":SING")
    assert ask(device, ":TRIG:STAT?") == "RUN"
    armed = device.acquisition.armed
    device.clock.sleep(2.0)
    assert device.record().trigger >= armed + 0.6


@pytest.mark.parametrize("level", [1.3, 0.05])
def test_a_level_that_is_not_crossed_never_triggers(level):
    device = rigol(pulses, *RIGOL_READY, f":TRIG:EDGE:LEV {level}", ":SING")
    for _ in range(20):
        device.clock.sleep(5.0)
        assert ask(device, ":TRIG:STAT?") == "WAIT"


def test_with_sweep_auto_a_record_comes_without_a_trigger():
    device = rigol(pulses, *RIGOL_READY, ":TRIG:EDGE:LEV 1.3", ":TRIG:SWE AUTO")
    device.clock.sleep(1.0)
    assert ask(device, ":TRIG:STAT?") == "AUTO"
    assert device.record().forced


def test_sweep_auto_loses_pulses_that_come_more_rarely_than_it_waits():
    """The trap for a slow top: below 1/AUTO_AFTER the trace runs away although the level is right."""
    device = rigol(slow, *RIGOL_READY, ":TRIG:SWE AUTO", ":TIM:SCAL 0.0001")
    forced = []
    for _ in range(20):
        device.clock.sleep(0.517)
        forced.append(device.record().forced)
    assert AUTO_AFTER < 0.1
    assert any(forced)


def test_a_forced_trigger_ends_the_waiting():
    device = rigol(pulses, *RIGOL_READY, ":TRIG:EDGE:LEV 1.3", ":SING")
    device.clock.sleep(1.0)
    send(device, b":TFOR\n")
    device.clock.sleep(0.5)
    assert ask(device, ":TRIG:STAT?") == "STOP"
    assert device.record().forced


def test_alternating_coupling_takes_the_mean_away_so_that_a_fixed_level_finds_nothing():
    device = rigol(constant(0.9), *RIGOL_READY, "CHAN1:COUP AC", ":TRIG:SWE AUTO", ":STOP")
    assert abs(rigol_volts(device)[1]).max() <= 0.004


def test_grounded_shows_nothing_and_inverted_the_negative():
    for setting, expected in (("COUP GND", 0.0), ("INV ON", -0.3)):
        device = rigol(constant(0.3), "CHAN1:PROB 1;SCAL 0.2;OFFS 0", f"CHAN1:{setting}", ":STOP")
        assert rigol_volts(device)[1] == pytest.approx(expected, abs=0.0041)


# --- scaling ---


@pytest.mark.parametrize("offset", [-0.6, 0.0, 0.123])
@pytest.mark.parametrize("scale", [0.05, 0.2, 1.0])
def test_volts_are_right_to_half_a_code(scale, offset):
    device = rigol_stopped(ramp, f"CHAN1:SCAL {scale};OFFS {offset}", f":TRIG:EDGE:LEV {-offset}", ":TIM:SCAL 0.01")
    times, volts = rigol_volts(device)
    true = ramp(device.record().trigger + times[0], times[1] - times[0], times.size)
    low, high = (0 - 127) * scale / 25 - offset, (255 - 127) * scale / 25 - offset
    inside = (true > low + scale / 25) & (true < high - scale / 25)
    # the offset is set to whole codes; 1e-6: the six digits of the preamble
    assert np.abs(volts - true)[inside].max() <= 0.5 * scale / 25 + 1e-5
    assert volts.min() >= low - scale / 25
    assert volts.max() <= high + scale / 25


@pytest.mark.parametrize(("volts", "code"), [(-100.0, 0), (100.0, 255), (0.0, 127), (0.2, 152), (0.004001, 128)])
def test_codes_are_25_to_a_division_and_clipped(volts, code):
    device = rigol(constant(volts), "CHAN1:PROB 1;SCAL 0.2;OFFS 0")
    assert set(block(device, ":WAV:DATA?")[1]) == {code}


@pytest.mark.parametrize(("volts", "code"), [(-100.0, 1), (100.0, 255), (0.0, 128), (0.2, 128 + 25)])
def test_codes_of_the_keysight_are_199_to_the_screen_and_never_0(volts, code):
    device = keysight(constant(volts), "CHAN1:PROB 1;RANG 1.6;OFFS 0")
    assert set(block(device, ":WAV:DATA?")[1]) == {code}


@pytest.mark.parametrize("make", [rigol, keysight])
def test_a_probe_makes_the_same_volts_at_the_input_ten_times_as_many(make):
    device = make(constant(0.2), "CHAN1:PROB 1", "CHAN1:SCAL 0.2", "CHAN1:PROB 10")
    assert float(ask(device, "CHAN1:SCAL?")) == pytest.approx(2.0)
    assert float(ask(device, ":MEAS:VMAX? CHAN1")) == pytest.approx(2.0, abs=0.05)


def test_the_state_after_power_on_takes_a_probe_for_granted():
    assert float(ask(rigol(), "CHAN1:PROB?")) == 10.0
    assert float(ask(keysight(), "CHAN1:PROB?")) == 10.0


# --- blocks ---


def test_a_block_of_the_rigol_byte_for_byte():
    device = rigol(constant(-0.936), "CHAN1:PROB 1;SCAL 0.2;OFFS 0")  # code 10: a line feed
    told(device, ":WAV:STAR 1", ":WAV:STOP 5")
    send(device, b":WAV:DATA?\n")
    assert received(device, 1.0) == b"#9000000005\n\n\n\n\n\n"


def test_words_of_the_rigol_have_an_empty_upper_byte():
    device = rigol(constant(0.0), "CHAN1:PROB 1;SCAL 0.2;OFFS 0", ":WAV:FORM WORD", ":WAV:STOP 2")
    assert block(device, ":WAV:DATA?") == (b"#9000000004", b"\x7f\x00\x7f\x00")


def test_text_of_the_rigol_has_a_head_too():
    device = rigol(constant(0.2), "CHAN1:PROB 1;SCAL 0.2;OFFS 0", ":WAV:FORM ASC", ":WAV:STOP 2")
    assert block(device, ":WAV:DATA?") == (b"#9000000025", b"2.000000e-01,2.000000e-01")


def test_the_preamble_of_the_rigol_is_the_one_of_the_guide():
    device = rigol(pulses, "CHAN1:PROB 1;SCAL 1;OFFS -3", ":TIM:SCAL 0.002;OFFS -0.00256")
    assert ask(device, ":WAV:PRE?") == "0,0,1200,1,2.000000e-05,-1.456000e-02,0,4.000000e-02,-75,127"
    parts = ["XINC", "XOR", "XREF", "YINC", "YOR", "YREF"]
    assert [ask(device, f":WAV:{p}?") for p in parts] == ask(device, ":WAV:PRE?").split(",")[4:]


def test_the_preamble_of_the_keysight_is_the_one_of_a_real_one_after_reset():
    device = keysight(pulses, "*RST", ":WAV:FORM ASC")
    got = [float(field) for field in ask(device, ":WAV:PRE?").split(",")]
    assert got == [4, 0, 62500, 1, 1.6e-8, -5e-4, 0, 0.0007851759, 0, 32768]


@pytest.mark.parametrize(
    ("unsigned", "order", "expected"),
    [(1, "MSBF", b"\x99\x00"), (1, "LSBF", b"\x00\x99"), (0, "MSBF", b"\x19\x00"), (0, "LSBF", b"\x00\x19")],
)
def test_words_of_the_keysight(unsigned, order, expected):
    device = keysight(constant(0.2), "CHAN1:PROB 1;RANG 1.6;OFFS 0", ":WAV:FORM WORD", ":WAV:POIN 100")
    told(device, f":WAV:UNS {unsigned}", f":WAV:BYT {order}")
    head, data = block(device, ":WAV:DATA?")
    assert head == b"#800000200"
    assert data == 100 * expected
    assert float(ask(device, ":WAV:PRE?").split(",")[9]) == (32768 if unsigned else 0)


def test_signed_bytes_of_the_keysight():
    device = keysight(constant(-0.2), "CHAN1:PROB 1;RANG 1.6;OFFS 0", ":WAV:UNS 0", ":WAV:POIN 100")
    assert block(device, ":WAV:DATA?") == (b"#800000100", 100 * struct.pack("b", -25))


def test_text_of_the_keysight():
    device = keysight(constant(0.0), "CHAN1:PROB 1;RANG 1.6;OFFS 0", ":WAV:FORM ASC", ":WAV:POIN 100")
    head, data = block(device, ":WAV:DATA?")
    assert data.split(b",") == [b"+0.00000E+00"] * 100
    assert head == b"#800001299"


@pytest.mark.parametrize("points", [100, 250, 500, 1000, 2000, 5000, 10000, 20000, 50000, 62500])
@pytest.mark.parametrize("mode", ["NORM", "MAX", "RAW"])
def test_the_keysight_gives_as_many_points_as_it_was_asked_for(mode, points):
    device = keysight(pulses, f":WAV:POIN:MODE {mode}", f":WAV:POIN {points}")
    assert len(block(device, ":WAV:DATA?")[1]) == points == int(ask(device, ":WAV:POIN?"))


@pytest.mark.parametrize(
    ("set_", "told_"), [("MAX", "24000000"), ("min", "12000"), ("1.2e6", "1200000"), ("auto", "AUTO")]
)
def test_the_memory_depth_is_told_as_a_whole_number(set_, told_):
    assert ask(rigol(pulses, f":ACQ:MDEP {set_}"), ":ACQ:MDEP?") == told_


@pytest.mark.parametrize(("form", "most"), [("BYTE", 250_000), ("WORD", 125_000), ("ASC", 15_625)])
def test_a_block_of_the_rigol_has_a_limit(form, most):
    device = rigol_stopped(pulses, ":ACQ:MDEP 1200000")
    told(device, ":WAV:MODE RAW", f":WAV:FORM {form}", ":WAV:STAR 1", f":WAV:STOP {most}")
    assert len(block(device, ":WAV:DATA?")[1]) > most - 1
    told(device, f":WAV:STOP {most + 1}")
    assert ask(device, ":WAV:DATA?", 1.0) is None
    assert errors(device) == [-222]


def test_the_memory_of_the_rigol_cannot_be_read_while_it_runs():
    device = rigol(pulses, ":WAV:MODE RAW")
    assert ask(device, ":WAV:DATA?", 1.0) is None
    assert errors(device) == [-221]
    told(device, ":STOP")
    assert ask(device, ":WAV:PRE?").split(",")[:3] == ["0", "2", "12000"]


def test_normal_reading_always_gives_1200_points():
    device = rigol_stopped(pulses)
    told(device, ":WAV:MODE NORM")
    assert len(block(device, ":WAV:DATA?")[1]) == 1200
    assert ask(device, ":WAV:PRE?").split(",")[2] == "1200"


def test_a_record_reads_the_same_whichever_way_it_is_cut():
    device = rigol_stopped(noisy, "CHAN1:OFFS 0", ":TRIG:EDGE:LEV 0", ":ACQ:MDEP 1200000")
    whole = rigol_volts(device)[1]
    told(device, ":WAV:STAR 249990", ":WAV:STOP 250020")
    _, across = block(device, ":WAV:DATA?")
    told(device, ":WAV:STAR 1", ":WAV:STOP 10")
    _, first = block(device, ":WAV:DATA?")
    per_code = float(ask(device, ":WAV:YINC?"))
    np.testing.assert_allclose((np.frombuffer(across, np.uint8) - 127.0) * per_code, whole[249_989:250_020])
    np.testing.assert_allclose((np.frombuffer(first, np.uint8) - 127.0) * per_code, whole[:10])


# --- old data ---


def test_a_record_stays_as_it_was_when_the_settings_change_after_the_stop():
    device = rigol_stopped(pulses)
    before = rigol_volts(device)
    told(device, "CHAN1:SCAL 1", ":TIM:SCAL 0.1", ":TRIG:EDGE:LEV 0.2")
    np.testing.assert_array_equal(rigol_volts(device), before)


def test_the_rigol_keeps_the_old_record_until_a_new_one_is_complete():
    device = rigol_stopped(pulses)
    old = device.record()
    told(device, ":TRIG:EDGE:LEV 1.35", ":SING")
    device.clock.sleep(3.0)
    assert device.record() is old


def test_the_keysight_forgets_the_old_record_when_it_is_armed():
    device = keysight(pulses, *KEYSIGHT_READY, ":SING")
    device.clock.sleep(1.0)
    assert len(block(device, ":WAV:DATA?")[1]) > 0
    told(device, ":TRIG:EDGE:LEV 1.3", ":SING")
    device.clock.sleep(1.0)
    assert ask(device, ":WAV:DATA?", 1.0) is None
    assert errors(device) == [-230]


def test_a_running_scope_shows_late_records_even_after_an_hour():
    device = rigol(pulses, *RIGOL_READY)
    for pause in (0.5, 3600.0, 0.5):
        device.clock.sleep(pause)
        assert device.clock.now() - device.record().done < 0.5


def test_a_short_record_does_not_make_the_trigger_look_at_every_nanosecond():
    looks = []

    def watched(start, step, n):
        looks.append(n)
        return pulses(start, step, n)

    device = rigol(watched, *RIGOL_READY, ":TIM:SCAL 0.0000001")
    for level in (0.65, 1.3):
        told(device, f":TRIG:EDGE:LEV {level}", ":SING")
        device.clock.sleep(20.0)
        assert ask(device, ":TRIG:STAT?") == ("STOP" if level < 1 else "WAIT")
    # twenty seconds at 20 kHz, and some finer looks in the beginning; the first level is met at once
    assert sum(looks) < 1_500_000
    assert max(looks) <= 1_000_000


def test_a_scope_that_ran_for_an_hour_in_vain_does_not_look_twice():
    looks = []

    def watched(start, step, n):
        looks.append(n)
        return np.zeros(n)

    device = rigol(watched, *RIGOL_READY)
    device.clock.sleep(3600.0)
    assert ask(device, ":TRIG:STAT?") == "WAIT"
    looks.clear()
    device.clock.sleep(1.0)
    assert ask(device, ":TRIG:STAT?") == "WAIT"
    assert sum(looks) < 100_000


def test_a_running_scope_keeps_the_last_record_when_triggers_are_rare():
    device = rigol(once, *RIGOL_READY, ":TIM:SCAL 0.0001")
    device.clock.sleep(600.0)
    assert device.record().trigger == pytest.approx(4.999, abs=1e-4)


# --- the keysight's ways to wait ---


def test_digitize_is_complete_when_the_record_is():
    device = keysight(pulses, *KEYSIGHT_READY)
    before = device.clock.now()
    send(device, b":DIG CHAN1\n")
    assert ask(device, "*OPC?") == "1"
    record = device.record()
    assert not record.forced
    assert device.clock.now() == pytest.approx(record.done, abs=3 * device.pace)
    assert device.clock.now() - before >= 0.1


def test_digitize_without_a_trigger_blocks_until_a_device_clear():
    device = keysight(pulses, *KEYSIGHT_READY, ":TRIG:EDGE:LEV 1.3")
    send(device, b":DIG CHAN1\n*OPC?\n")
    assert received(device, 1000.0) is None
    assert ask(device, "*IDN?", 10.0) is None
    cable(device).clear()
    assert ask(device, "*IDN?").startswith("KEYSIGHT")
    assert ask(device, ":OPER:COND?") == "+0"


def test_the_operation_register_tells_running_and_waiting():
    device = keysight(pulses, *KEYSIGHT_READY, ":TRIG:EDGE:LEV 1.3", ":SING")
    assert ask(device, ":OPER:COND?") == "+8"  # it fills the part before the trigger
    device.clock.sleep(1.0)
    assert ask(device, ":OPER:COND?") == "+40"
    assert [ask(device, ":AER?"), ask(device, ":AER?")] == ["+1", "+0"]
    told(device, ":STOP")
    assert ask(device, ":OPER:COND?") == "+0"


def test_the_trigger_event_is_told_once():
    device = keysight(pulses, *KEYSIGHT_READY, ":SING")
    assert ask(device, ":TER?") == "+0"
    device.clock.sleep(1.0)
    assert [ask(device, ":TER?"), ask(device, ":TER?")] == ["+1", "+0"]


@pytest.mark.parametrize("mode", ["ROLL", "XY"])
def test_there_is_no_record_in_roll_and_xy(mode):
    device = keysight(pulses, f":TIM:MODE {mode}")
    send(device, b":DIG CHAN1\n")
    assert ask(device, ":WAV:DATA?", 1.0) is None
    assert errors(device) == [-221, -221]


def test_whole_settings_of_the_keysight():
    device = keysight(pulses, "*RST")
    assert ask(device, ":TIM?") == ":TIM:MODE MAIN;REF CENT;MAIN:RANG +1.00000E-03;POS +0.000000E+00"
    assert ask(device, ":CHAN1?") == (
        ":CHAN1:RANG +4.00000E+01;OFFS +0.00000E+00;COUP DC;IMP ONEM;DISP 1;BWL 0;INV 0;"
        'LAB "1";UNIT VOLT;PROB +1.00000E+01;PROB:SKEW +0.00E+00;STYP SING'
    )


# --- measurements ---


@pytest.mark.parametrize(
    ("item", "expected", "within"),
    [
        ("FREQuency", 1000.0, 1.0),
        ("PERiod", 1e-3, 1e-6),
        ("VPP", 2.0, 0.02),
        ("VMAX", 1.0, 0.01),
        ("VMIN", -1.0, 0.01),
        ("VAVG", 0.0, 0.01),
        ("VRMS", math.sqrt(0.5), 0.01),
        ("PDUTy", 0.5, 0.005),
        ("PWIDth", 5e-4, 5e-6),
        # from 10 % to 90 % of a sine: 2·asin(0.8)/2π of a period; top and base lie a little inside the extremes
        ("RTIMe", 2 * math.asin(0.8) / (2 * math.pi) * 1e-3, 1.5e-5),
    ],
)
def test_what_the_rigol_measures_in_a_sine(item, expected, within):
    device = rigol(sine, "CHAN1:PROB 1;SCAL 0.3;OFFS 0", ":TIM:SCAL 0.0005", ":TRIG:EDGE:LEV 0")
    assert float(ask(device, f":MEAS:ITEM? {item},CHAN1")) == pytest.approx(expected, abs=within)
    assert float(ask(device, f":MEAS:STAT:ITEM? CURR,{item},CHAN1")) == pytest.approx(expected, abs=within)


@pytest.mark.parametrize(
    ("item", "expected", "within"),
    [("FREQ", 25.0, 0.01), ("PER", 0.04, 1e-5), ("VPP", 1.1, 0.016), ("PWID", 0.03 / 25, 2e-5), ("DUTY", 3.0, 0.1)],
)
def test_what_the_keysight_measures_in_pulses_of_25_hz(item, expected, within):
    device = keysight(pulses, *KEYSIGHT_READY)
    assert float(ask(device, f":MEAS:{item}? CHAN1")) == pytest.approx(expected, abs=within)
    assert float(ask(device, f":MEAS:SOUR CHAN1;:MEAS:{item}?")) == pytest.approx(expected, abs=within)


@pytest.mark.parametrize(("make", "question"), [(rigol, ":MEAS:ITEM? FREQ,CHAN1"), (keysight, ":MEAS:FREQ? CHAN1")])
def test_what_a_trace_does_not_show_is_told_as_99e36(make, question):
    assert float(ask(make(constant(0.0)), question)) == 9.9e37


@given(
    volts=st.lists(st.integers(-4, 4).map(float), min_size=1, max_size=50), name=st.sampled_from(sorted(MEASUREMENTS))
)
def test_every_trace_is_measured_or_not(volts, name):
    value = measure(name, Measured(np.array(volts), 1e-3, 0.0))
    assert value is None or math.isfinite(value)


# --- pictures and setups ---


def png_size(data):
    """Width and height; every part's sum is checked and the pixels unpacked."""
    stream = io.BytesIO(data)
    assert stream.read(8) == b"\x89PNG\r\n\x1a\n"
    parts = {}
    while head := stream.read(8):
        length, kind = struct.unpack(">I4s", head)
        content = stream.read(length)
        assert stream.read(4) == struct.pack(">I", zlib.crc32(kind + content))
        parts[kind] = content
    width, height = struct.unpack(">II", parts[b"IHDR"][:8])
    assert len(zlib.decompress(parts[b"IDAT"])) == height * (1 + 3 * width)
    return width, height


@pytest.mark.parametrize(("make", "question"), [(rigol, ":DISP:DATA? ON,OFF,PNG"), (keysight, ":DISP:DATA? PNG, COL")])
def test_the_picture_is_a_png(make, question):
    assert png_size(block(make(pulses), question)[1]) == (800, 480)


def test_the_picture_of_the_rigol_is_by_default_a_bmp_of_the_size_that_public_drivers_expect():
    send(device := rigol(pulses), b":DISP:DATA?\n")
    assert len(received(device, 10.0)) == 1_152_068


@pytest.mark.parametrize("make", [rigol, keysight])
def test_a_setup_comes_back(make):
    device = make(pulses, "CHAN1:PROB 1;SCAL 0.2", ":TIM:SCAL 0.02", ":TRIG:EDGE:LEV 0.3")
    _, setup = block(device, ":SYST:SET?")
    told(device, "*RST")
    assert float(ask(device, "CHAN1:SCAL?")) != 0.2
    told(device, f":SYST:SET #8{len(setup):08d}" + setup.decode())
    assert [float(ask(device, q)) for q in ("CHAN1:SCAL?", ":TIM:SCAL?", ":TRIG:EDGE:LEV?")] == [0.2, 0.02, 0.3]
    assert block(device, ":SYST:SET?")[1] == setup


@pytest.mark.parametrize(
    "setup", ["#10", "#15hello", "#512", "hello", "#224:SYST:SET #212:SYST:SET #", "#216:CHAN1:SCAL 1e999"]
)
@pytest.mark.parametrize("make", [rigol, keysight])
def test_a_setup_that_is_none_is_an_error(make, setup):
    device = make(pulses)
    send(device, f":SYST:SET {setup}\n".encode())
    assert ask(device, "*IDN?").count(",") == 3
    assert errors(device) != []


def test_measurements_that_were_installed_can_be_cleared():
    device = keysight(pulses, *KEYSIGHT_READY, ":MEAS:VMAX", ":MEAS:VMIN")
    assert len(ask(device, ":MEAS:RES?").split(",")) == 2
    told(device, ":MEAS:CLE")
    assert ask(device, ":MEAS:RES?") == "NONE"


# --- limits ---


@pytest.mark.parametrize(
    "message",
    [
        ":TIM:SCAL 100",
        "CHAN1:PROB 1;SCAL 20",
        "CHAN5:SCAL 1",
        ":TRIG:EDGE:LEV 1e6",
        ":TRIG:EDGE:SOUR CHAN9",
        ":ACQ:MDEP 13000",
        ":WAV:FORM FLOAT",
        ":MEAS:ITEM? NOTHING,CHAN1",
        ":MEAS:ITEM? VPP,CHAN9",
        ":MEAS:ITEM?",
        ":DISP:DATA? ON,OFF,PNG,1",
    ],
)
def test_what_is_wrong_has_no_answer_but_an_entry_in_the_queue(message):
    device = rigol(pulses)
    send(device, message.encode() + b"\n")
    assert received(device, 1.0) is None
    assert len(errors(device)) == 1


@given(messages=st.lists(st.text(st.sampled_from(":CHANTIMWAVSEDIGORUPQL?1 ;,.#-"), max_size=30), max_size=5))
def test_no_message_makes_a_scope_hang_or_crash(messages):
    for device in (rigol(constant(0.0)), keysight(constant(0.0))):
        for message in messages:
            send(device, message.encode() + b"\n")
            received(device, 0.1)
        cable(device).clear()
        assert ask(device, "*IDN?") is not None


@given(value=st.floats(1e-9, 1e9))
def test_the_series_of_scales_goes_up_and_has_only_1_2_and_5(value):
    up, near = one_two_five(value, up=True), one_two_five(value)
    assert value * (1 - 1e-8) <= up <= 2.5000001 * value
    assert near in {up, one_two_five(up / 2.4999, up=True), one_two_five(up / 2.0001, up=True)} or near < up
    assert f"{up:.0e}"[0] in "125"


# --- the time base of the rigol ---


def time_base(device, **wanted):
    """Set what is wanted and read everything back, as public drivers do (rigol-ds1000z 0.2.1, timebase.py)."""
    headers = {"mode": "MODE", "main_scale": "SCAL", "main_offset": "OFFS"}
    headers |= {"delay_enable": "DEL:ENAB", "delay_scale": "DEL:SCAL", "delay_offset": "DEL:OFFS"}
    for name, value in wanted.items():
        text = value if isinstance(value, str) else f"{value:0.10f}"
        send(device, f":TIM:{headers[name]} {text};*WAI\n".encode())
    return {name: ask(device, f":TIM:{header}?;*WAI") for name, header in headers.items()}


def test_a_public_driver_sets_the_time_base_of_the_rigol_and_reads_it_back():
    device = rigol()
    assert time_base(device) == {
        "mode": "MAIN",
        "main_scale": "1.000000e-06",
        "main_offset": "0.000000e+00",
        "delay_enable": "0",
        "delay_scale": "5.000000e-07",
        "delay_offset": "0.000000e+00",
    }
    wanted = {"main_scale": 0.01, "main_offset": 0.02, "delay_enable": "1", "delay_scale": 0.002, "delay_offset": 0.06}
    told_ = time_base(device, mode="MAIN", **wanted)
    assert {name: float(told_[name]) for name in wanted} == {name: float(value) for name, value in wanted.items()}
    assert errors(device) == []


@pytest.mark.parametrize(
    ("message", "scale", "offset"),
    [
        (":TIM:DEL:SCAL 0.02", 0.005, 0.0),  # no coarser than the main time base
        (":TIM:DEL:SCAL 1e-9", 0.005, 0.0),  # finer than (50/sample rate)/40
        (":TIM:DEL:OFFS 0.0301", 0.005, 0.0),  # 6 main divisions less 6 of the delayed sweep: 0.03 s
        (":TIM:DEL:OFFS -0.0301", 0.005, 0.0),
    ],
)
def test_the_delayed_sweep_stays_within_the_main_one(message, scale, offset):
    device = rigol(pulses, ":TIM:SCAL 0.01", ":TIM:DEL:SCAL 0.005")
    send(device, message.encode() + b"\n")
    assert errors(device) == [-222]
    told_ = time_base(device)
    assert (float(told_["delay_scale"]), float(told_["delay_offset"])) == (scale, offset)


def test_the_delayed_sweep_follows_a_shorter_main_one():
    device = rigol(pulses, ":TIM:SCAL 0.01", ":TIM:DEL:SCAL 0.005", ":TIM:DEL:OFFS 0.03", ":TIM:SCAL 0.002")
    told_ = time_base(device)
    assert (float(told_["delay_scale"]), float(told_["delay_offset"])) == (0.002, 0.0)


def test_a_setup_with_a_fine_delayed_sweep_comes_back():
    fine = (":TIM:SCAL 0.001", ":ACQ:MDEP 12000000", ":TIM:DEL:SCAL 2e-8")
    setup = block(rigol(pulses, *fine), ":SYST:SET?")
    other = rigol(pulses, ":TIM:SCAL 0.001", ":ACQ:MDEP 12000")
    send(other, b":SYST:SET " + setup[0] + setup[1] + b"\n")
    assert errors(other) == []
    assert float(ask(other, ":TIM:DEL:SCAL?")) == 2e-8


# --- with the drivers ---


def bench(make, signal):
    clock = VirtualClock()
    name = "TCPIP0::scope.levilab::inst0::INSTR"
    device = make(clock, signals={1: signal})
    library = library_for(Bus({name: device}))
    return device, VisaTransport(name, library=library), clock


BOTH = pytest.mark.parametrize(
    ("driver", "make"), [(RigolDS1000Z, VirtualDS1000Z), (KeysightDSOX, VirtualDSOX1000)], ids=["rigol", "keysight"]
)
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


@BOTH
def test_the_driver_says_when_the_scope_never_triggers(driver, make):
    device, transport, clock = bench(make, pulses)
    scope = driver(transport, clock=clock)
    scope.prepare(**PULSES, trigger_level_v=1.25)
    before = clock.now()
    with pytest.raises(NeverTriggered, match=r"1\.25 V on CHAN1"):
        scope.acquire(timeout_s=5.0)
    assert clock.now() - before == pytest.approx(5.1, abs=0.3)
    assert not device.running()
    scope.prepare(**PULSES, trigger_level_v=0.65)  # and goes on
    scope.acquire(timeout_s=1.0)
    transport.close()


@BOTH
def test_with_sweep_auto_the_driver_shows_what_there_is(driver, make):
    _, transport, clock = bench(make, constant(0.5))
    scope = driver(transport, clock=clock)
    scope.prepare(**PULSES, trigger_level_v=1.25, sweep="auto")
    scope.acquire(timeout_s=1.0)
    assert scope.trace(1).volts == pytest.approx(0.5, abs=0.005)
    transport.close()


@BOTH
def test_the_settings_are_told_with_their_units(driver, make):
    _, transport, clock = bench(make, pulses)
    scope = driver(transport, clock=clock)
    scope.prepare(**PULSES, trigger_level_v=0.65)
    settings = scope.settings()
    assert settings["trigger_level_v"] == pytest.approx(0.65)
    assert settings["channel1_scale_v"] == pytest.approx(0.2)
    assert settings["channel1_probe_factor"] == 1.0
    json.dumps(settings)
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


def test_pyvisa_reads_the_block_as_of_any_scope():
    device, transport, _ = bench(VirtualDSOX1000, constant(0.2))
    transport.close()
    manager = pyvisa.ResourceManager(library_for(Bus({"GPIB0::7::INSTR": device})))
    scope = manager.open_resource("GPIB0::7::INSTR")
    scope.write(":WAV:FORM WORD;UNS 1;POIN 1000")
    codes = scope.query_binary_values(":WAV:DATA?", datatype="H", is_big_endian=True, container=np.array)
    assert codes.size == 1000
    scope.close()


# --- a scope that is changed under way ---


@contextlib.contextmanager
def prepared(driver, make, address="TCPIP0::scope.levilab::inst0::INSTR"):
    """A scope that waits for pulses at 0.65 V, its driver, and the bus for faults."""
    clock = VirtualClock()
    device = make(clock, signals={1: pulses})
    bus = Bus({address: device})
    scope = driver(VisaTransport(address, library=library_for(bus)), clock=clock)
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
        with pytest.raises(SettingsLost, match=r"probe_factor = 10\.0 instead of 1\.0") as lost:
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
def test_a_reset_during_the_preparation_is_told_by_it(driver, make):
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
        ("chan1_offset", 0.0, "channel1_offset_v"),
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
def test_a_key_of_the_front_panel_is_told_instead_of_a_trace_or_of_a_dark_signal(driver, make, setting, value, name):
    with prepared(driver, make) as (device, scope, _):
        start = scope._start

        def start_and_be_changed():
            start()
            device.settings[setting] = value
            device.changed(setting)  # what was begun begins anew

        scope._start = start_and_be_changed
        with pytest.raises(SettingsLost) as lost:
            read(scope, "trace")
        assert len(lost.value.changed) == 1
        assert name is None or name in lost.value.changed


@BOTH
def test_what_is_rounded_is_not_changed(driver, make):
    with prepared(driver, make) as (device, scope, _):
        device.settings |= {"chan1_offset": 1.005 * device.settings["chan1_offset"], "trigger_level": 0.66}
        assert read(scope, "trace").size >= 10_000


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

        scope._clock.sleep, sleep = interrupted, scope._clock.sleep
        with pytest.raises(KeyboardInterrupt):
            scope.acquire(timeout_s=1.0)
        scope._clock.sleep = sleep
        assert not device.running()

"""The virtual gaussmeters on the wire, and the drivers at them."""

import math

import pytest
import pyvisa
from hypothesis import given
from hypothesis import strategies as st
from pyvisa.constants import Parity, StatusCode, StopBits

from instruments.clock import VirtualClock
from instruments.drivers.magnetometer.lakeshore_425 import LakeShore425
from instruments.drivers.magnetometer.lakeshore_475 import LakeShore475
from instruments.errors import NoAnswer
from instruments.links.visa import VisaTransport
from instruments.virtual.bench.bus import Bus
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.magnetometer.lakeshore import field_text
from instruments.virtual.magnetometer.lakeshore_425 import Virtual425
from instruments.virtual.magnetometer.lakeshore_475 import Virtual475
from support.wire import ask, received, send

PORT = "ASRL1::INSTR"
EACH = pytest.mark.parametrize("kind", [Virtual425, Virtual475])


def meter(kind=Virtual425, field=0.0123, **options):
    """A meter without noise of its own probe; field: a number or a function of time [T]."""
    density = field if callable(field) else lambda _: field
    return kind(VirtualClock(), flux_density=density, **({"zero_error": 0.0} | options))


def value(answer):
    return float(answer)


# --- what all of them do ---


@pytest.mark.parametrize(
    ("device", "identity"),
    [
        (meter(), "LSCI,MODEL425,VIRTUAL,1.0"),
        (meter(Virtual475), "LSCI,MODEL475,VIRTUAL,01012020"),
        (meter(Virtual475, model="455"), "LSCI,MODEL455,VIRTUAL,01012020"),
    ],
)
def test_who_they_are(device, identity):
    send(device, b"*IDN?\n")
    assert received(device) == identity.encode() + b"\r\n"


@EACH
@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_a_message_may_end_with_or_without_a_carriage_return(kind, end):
    device = meter(kind)
    send(device, b"UNIT?" + end)
    assert received(device) == b"1\r\n"


@EACH
@pytest.mark.parametrize("message", ["FOO?", "RDGFIELD", "SYST:ERR?", "UNIT", "UNIT 5;UNIT?", "UNIT x;UNIT?", "?"])
def test_what_is_not_understood_is_ignored(kind, message):
    device = meter(kind)
    assert ask(device, message, timeout=5.0) is None
    assert ask(device, "UNIT?") == "1"


@EACH
@pytest.mark.parametrize("message", ["UNIT 0", "UNIT 5", "UNIT 1.5", "RANGE 0", "RANGE 9", "AUTO 2", "RDGMODE 9,1,1"])
def test_a_number_that_is_none_of_them_changes_nothing(kind, message):
    device = meter(kind)
    before = dict(device.settings)
    send(device, message.encode() + b"\n")
    assert device.settings == before


@EACH
@pytest.mark.parametrize(("unit", "per_tesla"), [(1, 1e4), (2, 1.0), (3, 1e4), (4, 1 / (4e-7 * math.pi))])
def test_the_field_in_each_unit(kind, unit, per_tesla):
    device = meter(kind)
    send(device, f"UNIT {unit}\n".encode())
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(0.0123 * per_tesla, rel=1e-3)
    assert ask(device, "UNIT?") == str(unit)


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (12.3456, "+123.456E-01"),  # the manual's
        (-0.0001, "-100.000E-06"),
        (99.99996, "+100.000E+00"),
        (999.99999, "+100.000E+01"),
        (350e3, "+350.000E+03"),
        (0.0, "+000.000E+00"),
    ],
)
def test_numbers_are_printed_as_in_the_manual(number, text):
    assert field_text(number) == text


@given(st.floats(min_value=1e-12, max_value=1e12) | st.floats(min_value=-1e12, max_value=-1e-12))
def test_a_printed_number_has_six_digits_and_is_the_number(number):
    text = field_text(number)
    assert len(text) == len("+123.456E-01")
    assert float(text) == pytest.approx(number, rel=5.1e-6)


def test_the_answer_begins_after_ten_milliseconds():
    device = meter()
    send(device, b"UNIT?\n")
    assert received(device, timeout=9e-3) is None
    assert received(device, timeout=2e-3) == b"1\r\n"


@pytest.mark.parametrize("message", [b"\0RDGFIELD? \r\n", b"  UNIT? \r\n", b"\x0bUNIT?\x0c\n", b"UNIT?;\x85\n"])
def test_what_is_no_character_is_a_blank(message):
    device = meter()
    send(device, message)
    assert received(device)


def test_several_questions_in_one_message_are_answered_in_one():
    assert ask(meter(), "UNIT 2;UNIT?;RANGE 3;RANGE?") == "2;3"


def test_a_question_mark_alone_asks_again():
    device = meter()
    assert [ask(device, message) for message in ("UNIT?", "?", "AUTO?", "?")] == ["1", "1", "1", "1"]
    send(device, b"UNIT 2\n")
    assert [ask(device, "UNIT?"), ask(device, "?")] == ["2", "2"]


# --- ranges, resolution, noise ---


@pytest.mark.parametrize(
    ("kind", "probe", "ranges_g"),
    [
        (Virtual425, "HSE", [35, 350, 3500, 35_000]),
        (Virtual425, "HST", [350, 3500, 35_000, 350_000]),
        (Virtual425, "UHS", [0.35, 3.5, 35]),
        (Virtual475, "HSE", [3.5, 35, 350, 3500, 35_000]),
        (Virtual475, "HST", [35, 350, 3500, 35_000, 350_000]),
        (Virtual475, "UHS", [0.035, 0.35, 3.5, 35]),
    ],
)
def test_each_range_holds_what_it_says_and_no_more(kind, probe, ranges_g):
    field = [0.0]
    device = meter(kind, lambda _: field[0], probe=probe)
    for number, full in enumerate(ranges_g, start=1):
        send(device, f"RANGE {number}\n".encode())
        for factor, beyond in ((0.99, False), (1.01, True), (-1.01, True)):
            field[0] = factor * full * 1e-4
            device.clock.sleep(2.0)
            assert (ask(device, "RDGFIELD?") == "OL") is beyond
            assert bool(int(ask(device, "OPST?")) & 2) is beyond
    send(device, f"RANGE {len(ranges_g) + 1}\n".encode())
    assert ask(device, "RANGE?") == str(len(ranges_g))


@EACH
def test_the_automatic_range_follows_the_field_and_does_not_flutter(kind):
    field = [0.0]
    device = meter(kind, lambda _: field[0])
    lowest = {Virtual425: 3.5e-3, Virtual475: 350e-6}[kind]
    seen = []
    for size in (0.5, 0.95, 1.05, 0.95, 0.85, 20.0):
        field[0] = size * lowest
        device.clock.sleep(2.0)
        seen.append((int(ask(device, "RANGE?")), ask(device, "RDGFIELD?") == "OL"))
    assert seen == [(1, False), (1, False), (2, False), (2, False), (1, False), (3, False)]


@EACH
def test_a_range_chosen_by_hand_ends_the_automatic_choice(kind):
    device = meter(kind)
    assert ask(device, "AUTO?") == "1"
    assert ask(device, "RANGE 4;AUTO?;RANGE?") == "0;4"
    assert ask(device, "AUTO;AUTO?") == "1"  # as PyMeasure sends it


@pytest.mark.parametrize(
    ("kind", "mode", "step_t"),
    [
        (Virtual425, "1,1,1", 35e-3 / 35_000),
        (Virtual425, "1,0,1", 35e-3 / 3500),
        (Virtual475, "1,1,1,1,1", 35e-3 / 3500),
        (Virtual475, "1,2,1,1,1", 35e-3 / 35_000),
        (Virtual475, "1,3,1,1,1", 35e-3 / 350_000),
    ],
)
def test_the_last_digit_and_the_noise_in_it(kind, mode, step_t):
    device = meter(kind)
    ask(device, f"UNIT 2;RDGMODE {mode};RDGMODE?")
    readings = []
    for _ in range(200):
        device.clock.sleep(0.2)
        readings.append(value(ask(device, "RDGFIELD?")))
    steps = [reading / step_t for reading in readings]
    # six digits on the wire are no finer than the display
    assert all(step == pytest.approx(round(step), abs=0.06 if "1,3" in mode else 2e-3) for step in steps)
    mean = sum(steps) / len(steps)
    spread = math.sqrt(sum((step - mean) ** 2 for step in steps) / len(steps))
    assert mean == pytest.approx(0.0123 / step_t, abs=0.2)
    assert 0.4 < spread < 0.8  # half a step, and the rounding


def test_the_same_seed_makes_the_same_noise_and_another_another():
    def some(seed):
        device = meter(seed=seed)
        return [ask(device, "RDGFIELD?") for _ in range(50)]

    assert some(1) == some(1) != some(2)


@pytest.mark.parametrize(
    ("kind", "mode", "rate"),
    [(Virtual425, "1,1,1", 30), (Virtual475, "1,1,1,1,1", 30), (Virtual475, "1,3,1,1,1", 10)],
)
def test_there_are_so_many_readings_a_second_and_asking_more_often_gives_the_same_again(kind, mode, rate):
    device = meter(kind, lambda time: 1e-4 * time)
    ask(device, f"RDGMODE {mode};RDGMODE?")
    start = device.clock.now()
    answers = [ask(device, "RDGFIELD?") for _ in range(1000)]
    assert len(set(answers)) == pytest.approx(rate * (device.clock.now() - start), abs=2)


def test_a_new_reading_is_told_once():
    device = meter()
    device.clock.sleep(1.0)
    assert int(ask(device, "OPST?")) & 4
    ask(device, "RDGFIELD?")
    # the next reading is due within a thirtieth of a second
    seen = [int(ask(device, "OPST?")) & 4 for _ in range(4)]
    assert seen == sorted(seen)
    assert seen[-1] == 4


# --- modes ---


def alternating(amplitude, frequency, offset=0.0):
    return lambda time: offset + amplitude * math.sin(2 * math.pi * frequency * time)


@EACH
def test_an_alternating_field_is_read_as_its_rms_without_the_steady_part(kind):
    device = meter(kind, alternating(2e-3, 50.0, offset=0.01))
    mode = {Virtual425: "2,1,1", Virtual475: "2,2,1,1,1"}[kind]
    ask(device, f"UNIT 2;RDGMODE {mode};RDGMODE?")
    device.clock.sleep(1.0)
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(2e-3 / math.sqrt(2), rel=3e-3)


@EACH
def test_a_steady_reading_is_a_mean_over_the_filter(kind):
    device = meter(kind, alternating(2e-3, 50.0, offset=0.01))
    device.clock.sleep(2.0)
    assert value(ask(device, "UNIT 2;RDGFIELD?")) == pytest.approx(0.01, rel=2e-2)


def test_the_475_reads_peaks_and_frequency():
    device = meter(Virtual475, alternating(2e-3, 47.0, offset=1e-3))
    ask(device, "UNIT 2;RDGMODE 3,2,1,1,1;RDGMODE?")
    device.clock.sleep(1.0)
    negative, positive = map(float, ask(device, "RDGPEAK?").split(","))
    assert (negative, positive) == (pytest.approx(-1e-3, abs=1e-5), pytest.approx(3e-3, abs=1e-5))
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(3e-3, abs=1e-5)
    assert value(ask(device, "RDGFRQ?")) == pytest.approx(47.0, rel=1e-2)
    ask(device, "RDGMODE 3,2,1,1,2;RDGMODE?")
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(-1e-3, abs=1e-5)


def test_a_mode_set_in_part_keeps_the_rest():
    # so does a driver of fsc2 with the 455
    assert ask(meter(Virtual475), "RDGMODE 2, 3;RDGMODE?") == "2,3,1,1,1"


# --- zero, relative, extremes, alarms ---


@EACH
def test_zeroing_takes_its_time_and_then_the_present_field_is_zero(kind):
    device = meter(kind, 20e-6, zero_error=5e-6)
    ask(device, "UNIT 2;RDGMODE?")
    device.clock.sleep(2.0)
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(25e-6, rel=0.1)
    send(device, b"ZPROBE\n")
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(25e-6, rel=0.1)
    assert not int(ask(device, "OPST?")) & 128
    device.clock.sleep(6.0)
    assert int(ask(device, "OPST?")) & 128
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(0.0, abs=5e-7)
    send(device, b"ZCLEAR\n")
    device.clock.sleep(1.0)
    assert value(ask(device, "RDGFIELD?")) == pytest.approx(25e-6, rel=0.1)


def test_the_475_holds_its_answer_until_it_is_zeroed():
    device = meter(Virtual475)
    before = device.clock.now()
    assert ask(device, "ZPROBE;*OPC?") == "1"
    assert device.clock.now() - before == pytest.approx(5.0, abs=0.1)
    assert int(ask(device, "OPST?")) & 128


@EACH
def test_relative_readings(kind):
    device = meter(kind)
    assert ask(device, "UNIT 2;RELSP 0.01;RELSP?") == "+100.000E-04"
    assert value(ask(device, "RDGREL?")) == pytest.approx(0.0023, abs=1e-5)
    assert value(ask(device, "UNIT 1;RELSP?")) == pytest.approx(100.0)


def test_the_475_takes_the_present_field_as_what_is_relative_to():
    device = meter(Virtual475)
    device.clock.sleep(2.0)
    assert ask(device, "REL 1,2;REL?") == "1,2"
    assert value(ask(device, "RELSP?")) == pytest.approx(123.0, rel=1e-3)


def test_extremes_are_kept_until_they_are_reset():
    field = [0.01]
    device = meter(Virtual475, lambda _: field[0])
    for size in (0.01, 0.03, -0.02, 0.0):
        field[0] = size
        device.clock.sleep(2.0)
        ask(device, "RDGFIELD?")
    lowest, highest = map(float, ask(device, "UNIT 2;RDGMNMX?").split(","))
    assert (lowest, highest) == (pytest.approx(-0.02, rel=1e-3), pytest.approx(0.03, rel=1e-3))
    lowest, highest = map(float, ask(device, "MXRST;RDGMNMX?").split(","))
    assert lowest == pytest.approx(0.0, abs=1e-6)
    assert highest == pytest.approx(0.0, abs=1e-6)


def test_the_425_keeps_the_greatest_only():
    device = meter()
    device.clock.sleep(2.0)
    assert float(ask(device, "RDGMX?")) == pytest.approx(123.0, rel=1e-3)
    assert ask(device, "RDGMNMX?").startswith("+000.000E+00,+12")


@pytest.mark.parametrize(
    ("alarm", "on"),
    [
        ("0,1,100,120,1,0,0", "0,0"),
        ("1,1,100,120,1,0,0", "0,1"),
        ("1,1,130,200,1,0,0", "1,0"),
        ("1,1,100,200,1,0,0", "0,0"),
        ("1,1,100,200,2,0,0", "1,1"),
    ],
)
def test_alarms_and_the_relay(alarm, on):
    device = meter()  # 123 G
    assert ask(device, f"ALARM {alarm};RELAY 2,3;ALARMST?;RELAYST?") == f"{on};{int('1' in on)}"
    assert bool(int(ask(device, "OPST?")) & 8) is ("1" in on)


def test_an_alarm_is_told_as_it_was_set():
    assert ask(meter(), "ALARM 1,1,100,300,1,0,0;ALARM?") == "1,1,+100.000E+00,+300.000E+00,1,0,0"


@EACH
def test_without_a_probe_there_is_no_field(kind):
    device = meter(kind, probe=None)
    assert ask(device, "RDGFIELD?") == "NO PROBE"
    assert ask(device, "OPST?;TYPE?") == "001;00"


@EACH
def test_the_factory_settings_come_back_only_when_meant(kind):
    device = meter(kind)
    assert ask(device, "UNIT 3;DFLT;UNIT?") == "3"
    assert ask(device, "DFLT 99;UNIT?;AUTO?") == "1;1"


# --- status of the 475 ---


def test_the_425_has_no_status_registers():
    device = meter()
    assert [ask(device, question, 1.0) for question in ("*ESR?", "*STB?", "*OPC?", "*TST?")] == [None] * 4


def test_the_475_tells_what_it_did_not_understand_in_its_event_register():
    device = meter(Virtual475)
    assert ask(device, "*ESR?") == "128"
    send(device, b"FOO?\n")
    send(device, b"UNIT 9\n")
    assert ask(device, "*ESR?;*ESR?") == "048;000"


def test_the_475_latches_operation_events_for_a_service_request():
    device = meter(Virtual475)
    send(device, b"OPSTE 2;*SRE 128;RANGE 1\n")
    assert int(ask(device, "OPST?")) & 2
    assert ask(device, "*STB?") == "192"
    assert int(ask(device, "OPSTR?")) & 2
    send(device, b"*CLS;AUTO 1\n")
    assert ask(device, "*STB?") == "000"


def test_the_475_keeps_what_other_programs_set():
    # InstrumentKit's Lakeshore475 uses these
    device = meter(Virtual475)
    assert ask(device, "TUNIT 2;TUNIT?;CMODE 1;CMODE?") == "2;1"
    assert [float(part) for part in ask(device, "CPARAM 2,3,4.5,6;CPARAM?").split(",")] == [2.0, 3.0, 4.5, 6.0]
    assert float(ask(device, "CSETP 12.5;CSETP?")) == 12.5


# --- the serial line ---


def resource(device, **settings):
    line = {"baud_rate": 57600, "data_bits": 7, "parity": Parity.odd, "stop_bits": StopBits.one} | settings
    manager = pyvisa.ResourceManager(library_for(Bus({PORT: device})))
    return manager.open_resource(PORT, read_termination="\r\n", write_termination="\n", **line)


def test_a_program_with_the_right_settings_is_understood():
    line = resource(meter())
    assert line.query("*IDN?") == "LSCI,MODEL425,VIRTUAL,1.0"
    assert line.query_ascii_values("RDGFIELD?") == [pytest.approx(123.0, rel=1e-3)]


def test_stop_bits_do_not_matter_to_who_listens():
    assert resource(meter(), stop_bits=StopBits.two).query("UNIT?") == "1"


@pytest.mark.parametrize(
    "wrong",
    [
        {"baud_rate": 9600},
        {"baud_rate": 115200},
        {"parity": Parity.even},
        {"parity": Parity.none, "data_bits": 8},
        {"parity": Parity.none},
        {"data_bits": 8},
    ],
)
def test_a_program_with_wrong_settings_hears_nothing_that_it_could_take_for_an_answer(wrong):
    line = resource(meter(), **wrong)
    with pytest.raises((pyvisa.VisaIOError, UnicodeDecodeError)):
        line.query("*IDN?")


def test_settings_may_be_put_right_while_the_port_is_open():
    line = resource(meter(), parity=Parity.none, data_bits=8)
    with pytest.raises(pyvisa.VisaIOError) as silence:
        line.query("*IDN?")
    assert silence.value.error_code == StatusCode.error_timeout
    line.data_bits, line.parity = 7, Parity.odd
    line.flush(pyvisa.constants.BufferOperation.discard_read_buffer)
    assert line.query("*IDN?") == "LSCI,MODEL425,VIRTUAL,1.0"


def test_the_475_changes_its_baud_rate_when_told():
    device = meter(Virtual475)
    line = resource(device, baud_rate=9600)
    line.write("BAUD 3")
    with pytest.raises(pyvisa.VisaIOError):
        line.query("*IDN?")
    line.baud_rate = 57600
    line.write("")  # ends what it heard of the last question
    assert line.query("*IDN?") == "LSCI,MODEL475,VIRTUAL,01012020"


def test_bytes_take_their_time_on_the_line():
    device = meter(Virtual475, pace=0.0)
    line = resource(device, baud_rate=9600)
    line.query("UNIT?")
    # six characters there, three back, ten bits each
    assert device.clock.now() == pytest.approx(9 * 10 / 9600, abs=1e-9)


def test_pymeasures_way_to_open_the_port_and_to_read_it():
    # what LakeShore425 of PyMeasure 0.16 asks of the library
    line = resource(meter(), parity=1, timeout=500)
    line.read_termination = "\n"
    assert float(line.query("RDGFIELD?")) == pytest.approx(123.0, rel=1e-3)


# --- the drivers at the models ---

DRIVERS = [(LakeShore425, Virtual425, "425"), (LakeShore475, Virtual475, "475"), (LakeShore475, Virtual475, "455")]


@pytest.mark.parametrize(("driver", "kind", "model"), DRIVERS)
def test_the_drivers_measure_zero_and_tell_an_overload(driver, kind, model):
    field = [0.0]
    options = {} if kind is Virtual425 else {"model": model}
    device = kind(VirtualClock(), flux_density=lambda _: field[0], zero_error=5e-6, **options)
    # GPIB has no line settings to get wrong
    address = "GPIB0::12::INSTR"
    magnetometer = driver(VisaTransport(address, library=library_for(Bus({address: device}))))
    assert f"MODEL{model}" in magnetometer.identity()
    magnetometer.forget_errors()
    magnetometer.prepare(range_t=None)
    magnetometer.zero()
    field[0] = 0.02
    device.clock.sleep(2.0)
    assert magnetometer.flux_density() == pytest.approx(0.02, rel=2e-4)
    magnetometer.prepare(range_t=0.01)
    assert magnetometer.settings()["range_t"] == pytest.approx(0.035)
    field[0] = 0.04
    device.clock.sleep(2.0)
    assert magnetometer.flux_density() is None
    field[0] = -0.03
    device.clock.sleep(2.0)
    assert magnetometer.flux_density() == pytest.approx(-0.03, rel=2e-4)


def test_a_meter_that_does_not_answer_costs_its_time_out_and_no_more():
    device = meter()
    address = "GPIB0::12::INSTR"
    transport = VisaTransport(address, library=library_for(Bus({address: device})), timeout=3.0)
    with pytest.raises(NoAnswer):
        transport.query("NOSUCH?")
    assert device.clock.now() == pytest.approx(3.0, abs=0.1)


# --- whatever is sent ---

HEADERS = [
    "UNIT",
    "RANGE",
    "AUTO",
    "RDGMODE",
    "RDGFIELD",
    "OPST",
    "ALARM",
    "RELSP",
    "ZPROBE",
    "REL",
    "*IDN",
    "?",
    "DFLT",
]
MESSAGES = st.lists(
    # these instruments have no blocks, but the bench's one reader of messages knows them, and would wait for their end
    st.binary(max_size=40).filter(lambda message: b"#" not in message)
    | st.builds(
        lambda header, mark, rest: f"{header}{mark} {rest}".encode("latin-1", "replace"),
        st.sampled_from(HEADERS),
        st.sampled_from(["", "?"]),
        st.text(alphabet="0123456789+-.,;eE ", max_size=12),
    ),
    max_size=12,
)


@EACH
@given(messages=MESSAGES)
def test_no_message_hangs_it_or_breaks_it_or_makes_it_grow(kind, messages):
    device = meter(kind, probe="HSE")
    for message in messages:
        send(device, message + b"\n")
        while received(device, 0.2) is not None:
            pass
    send(device, b"\"\n'\n\n")
    while received(device, 10.0) is not None:
        pass
    assert ask(device, "*IDN?").startswith("LSCI,MODEL4")
    assert len(device.parser.errors) <= device.queue_size

"""What student labs have beside the first models: the bytes of their manuals, and what is theirs alone.

Sources: Agilent Truevolt Series Operating and Service Guide, pages 168 and 198; 34401A User's Guide; DG800 Programming
Guide, pages 2-43 and 2-72; TDS2000 Programmer Manual, with a preamble that a user read from a TDS2024C.
"""

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.counter.keysight_34461a import Keysight34461A
from instruments.drivers.generator.rigol_dg1000z import RigolDG1000Z
from instruments.drivers.oscilloscope.tektronix_tds2000 import TektronixTDS2000
from instruments.errors import BadAnswer, CommandRefused, OutOfRange, SettingsLost
from instruments.virtual.counter.keysight_34461a import Virtual34461A
from instruments.virtual.generator.rigol_dg1000z import DG832, VirtualDG1000Z
from instruments.virtual.oscilloscope.tektronix_tds2000 import VirtualTDS2000
from support.conversation import CLEAR, NO_ERROR, SILENCE, accepted, conversation
from support.scopes import constant, pulses
from support.talks import connected
from support.wire import ask, errors, received, send

# --- multimeters as counters ---

METER = ("*IDN?", "Keysight Technologies,34461A,MY53220594,A.02.14-02.40-02.14-00.49-01-01")
OLD_METER = ("*IDN?", "HEWLETT-PACKARD,34401A,0,11-5-2")


def meter(signal=pulses, **model):
    device = Virtual34461A(VirtualClock(), signal=signal, **model)
    return device, connected(Keysight34461A, device)


@pytest.mark.parametrize(("identity", "filter_"), [(METER, "FREQ:RANG:LOW 3.0"), (OLD_METER, "DET:BAND 3.0")])
def test_a_meter_is_prepared_for_slow_signals_in_its_dialect(identity, filter_):
    settings = accepted("CONF:FREQ", "FREQ:APER 1.0", filter_, "FREQ:VOLT:RANG 1.0")
    with conversation(Keysight34461A, identity, *settings) as it:
        it.prepare(gate_s=1.25, trigger_level_v=0.6)


def test_a_meter_answers_with_nine_digits_and_with_0_where_there_is_no_signal():
    lines = [NO_ERROR, ("READ?", "+1.32130000E+03"), NO_ERROR, ("READ?", "+0.00000000E+00")]
    with conversation(Keysight34461A, *lines, NO_ERROR, ("READ?", "+9.90000000E+37")) as it:
        assert [it.frequency(), it.frequency(), it.frequency()] == [1321.3, None, None]


def test_a_meter_that_is_silent_is_cleared_without_the_command_ABORt():
    lines = [NO_ERROR, ("READ?", SILENCE), (CLEAR, None), ("*CLS", None)]  # a 34401A has no ABORt
    with conversation(Keysight34461A, *lines) as it:
        assert it.frequency() is None


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"gate_s": 0.005}, "gate"),
        ({"gate_s": 10.0}, "gate"),
        ({"channel": 2}, "channel"),
        ({"trigger_level_v": 800.0}, "trigger_level"),
    ],
)
def test_what_a_meter_does_not_have_is_refused_before_anything_is_sent(wrong, name):
    with conversation(Keysight34461A) as it, pytest.raises(OutOfRange) as refused:
        it.prepare(**{"gate_s": 1.0, "trigger_level_v": 0.6} | wrong)
    assert refused.value.name == name


def test_a_meter_counts_where_the_signal_crosses_its_mean():
    _, it = meter()
    it.prepare(gate_s=1.0, trigger_level_v=0.6)
    assert it.frequency() == pytest.approx(25.0, rel=1e-5)  # edges are interpolated between samples of 50 µs
    assert it.readings(3) == pytest.approx(25.0, rel=1e-5)


def test_a_slow_top_reads_0_with_the_filter_that_a_meter_has_after_CONF():
    slow = lambda start, step, n: pulses(start / 5, step / 5, n)  # noqa: E731 - 5 Hz
    device, it = meter(slow)
    assert float(ask(device, "CONF:FREQ;:FREQ:VOLT:RANG 1;:READ?")) == 0.0
    it.prepare(gate_s=1.0, trigger_level_v=0.6)
    assert it.frequency() == pytest.approx(5.0, rel=1e-5)


def test_darkness_reads_0_and_too_large_a_signal_is_an_overload():
    device, it = meter(constant(0.4))
    it.prepare(gate_s=0.1, trigger_level_v=0.6)
    assert it.frequency() is None
    device, _ = meter(lambda start, step, n: 50 * pulses(start, step, n))
    assert ask(device, "CONF:FREQ;:FREQ:RANG:LOW 3;:FREQ:VOLT:RANG 1;:READ?") == "+9.90000000E+37"


def test_noise_in_the_dark_is_no_signal():
    noise = np.random.default_rng(1).normal(0.1, 0.01, 1_000_000)  # 10 mV, as on the virtual bench
    _, it = meter(lambda start, step, n: noise[np.round((start + step * np.arange(n)) * 20_000).astype(int)])
    it.prepare(gate_s=1.0, trigger_level_v=0.6)
    assert it.frequency() is None


@pytest.mark.parametrize(
    ("sent", "gate"), [("FREQ 100,0.01", 0.01), ("FREQ 100,0.001", 0.1), ("FREQ 100,1E-4", 1.0), ("PER", 0.1)]
)
def test_the_resolution_that_is_asked_for_sets_the_gate(sent, gate):
    device, _ = meter()
    assert float(ask(device, f"CONF:{sent};:FREQ:APER?")) == gate
    assert errors(device) == []


def test_each_model_has_the_words_of_its_own():
    newer, _ = meter(lacks=("DETector",))
    older, _ = meter(lacks=("LOWer", "ABORt"))
    for device, unknown in ((newer, b"DET:BAND 3\n"), (older, b"FREQ:RANG:LOW 3\n"), (older, b"ABOR\n")):
        send(device, unknown)
        assert errors(device) == [-113]


# --- Rigol's generators ---


def test_a_rigol_prints_seven_digits_and_a_switch_as_a_word():
    device = VirtualDG1000Z(VirtualClock())
    assert ask(device, ":SOUR1:FREQ 30.5;:SOUR1:FREQ?") == "3.050000E+01"
    assert ask(device, ":OUTP2?") == "OFF"
    assert ask(device, ":OUTP1:LOAD?") == "9.900000E+37"
    assert ask(device, ":SOUR1:APPL?") == '"SIN,3.050000E+01,5.000000E+00,0.000000E+00,0.000000E+00"'
    assert ask(device, ":SYST:ERR?") == '0,"No error"'


APPLIED = [  # PyMeasure's tests of its DG800
    ("SQU 500,1,0,0", "SQU,5.000000E+02,1.000000E+00,0.000000E+00,0.000000E+00"),
    ("PULS 50,1,0,0", "PULSE,5.000000E+01,1.000000E+00,0.000000E+00,0.000000E+00"),
    ("NOIS 2,0", "NOISE,DEF,2.000000E+00,0.000000E+00,DEF"),
    ("DC 1,1,1", "DC,DEF,DEF,1.000000E+00"),
    ("SIN 500,1,0,90", "SIN,5.000000E+02,1.000000E+00,0.000000E+00,9.000000E+01"),
]


@pytest.mark.parametrize(("sent", "answer"), APPLIED)
def test_a_waveform_is_applied_and_asked_for_in_one_command(sent, answer):
    device = VirtualDG1000Z(VirtualClock(), family=DG832)
    assert ask(device, f":SOUR1:APPL:{sent};:SOUR1:APPL?") == f'"{answer}"'
    assert (ask(device, ":OUTP1?"), errors(device)) == ("OFF", [])


def test_a_rigol_is_prepared_as_the_drive_and_its_triangle_is_a_ramp():
    device = VirtualDG1000Z(VirtualClock())
    driver = connected(RigolDG1000Z, device)
    driver.prepare(waveform="TRI", frequency_hz=30.5, amplitude_vpp=4.0, offset_v=-1.0)
    driver.output = True
    put_out = device.signal()
    assert (put_out.waveform, put_out.symmetry, put_out.frequency) == ("RAMP", 0.5, 30.5)
    assert (put_out.amplitude, put_out.offset) == (2.0, -1.0)
    driver.off()
    assert (driver.output, device.signal(2).amplitude) == (False, 0.0)


@pytest.mark.parametrize(("model", "outputs"), [("DG811", ("OUTP1",)), ("DG832", ("OUTP1", "OUTP2"))])
def test_a_rigol_of_one_channel_is_asked_for_no_other(model, outputs):
    with conversation(RigolDG1000Z, ("*IDN?", f"Rigol Technologies,{model},DG8A1,00.02.06")) as it:
        assert it.outputs() == outputs


# --- Tektronix's oscilloscopes ---

ASKED = {"duration_s": 0.1, "points": 1000, "volts_per_division": 0.2, "offset_v": 0.65, "trigger_level_v": 0.65}


def scope(signal=pulses):
    device = VirtualTDS2000(VirtualClock(), signals={1: signal, 2: signal})
    return device, connected(TektronixTDS2000, device, clock=device.clock)


def recorded(*messages):
    """A scope that has taken a record with these settings, without headers in its answers."""
    device, _ = scope()
    for message in ("HEAD OFF", "CH1:PRO 1", *messages, "TRIG:MAI:LEV 0.65", "ACQ:STOPA SEQ", "ACQ:STATE RUN"):
        send(device, message.encode() + b"\n")
    device.clock.sleep(5.0)
    assert ask(device, "ACQ:STATE?") == "0"
    return device


def test_a_preamble_is_that_of_a_real_scope():
    # read from a TDS2024C at 200 mV and 500 ns a division, its trace two divisions up
    device = recorded("CH1:SCA 0.2", "CH1:POS 2", "HOR:MAI:SCA 5E-7", "DAT:ENC RIB")
    assert ask(device, "WFMP?") == (
        '1;8;BIN;RI;MSB;2500;"Ch1, DC coupling, 2.0E-1 V/div, 5.0E-7 s/div, 2500 points, Sample mode";Y;'
        '2.0E-9;0;-2.5E-6;"s";8.0E-3;0.0E0;5.0E1;"Volts"'
    )


def test_an_answer_has_its_header_until_a_program_wants_none():
    device, _ = scope()
    assert ask(device, "CH1:SCA?") == ":CH1:SCALE 1.0E0"
    assert ask(device, "VERB OFF;:CH1:SCA?") == ":CH1:SCA 1.0E0"
    assert ask(device, "HEAD OFF;:CH1:SCA?") == "1.0E0"


@pytest.mark.parametrize("encoding", ["ASCI", "RIB", "RPB", "SRI", "SRP"])
@pytest.mark.parametrize("width", [1, 2])
def test_a_record_is_the_same_in_every_encoding(encoding, width):
    device = recorded("CH1:SCA 0.2", "CH1:POS -3.25", "HOR:MAI:SCA 0.01", f"DAT:ENC {encoding}", f"DAT:WID {width}")
    offset, per_code = (float(ask(device, f"WFMP:CH1:{word}?")) for word in ("YOF", "YMU"))
    send(device, b"CURV?\n")
    answer = received(device, 10.0)
    if encoding == "ASCI":
        codes = np.array([int(code) for code in answer.decode().split(",")])
    else:
        order = "<" if encoding.startswith("S") else ">"
        kind = "u" if encoding.endswith("P") or encoding == "RPB" else "i"
        codes = np.frombuffer(answer[len(f"#{len(str(2500 * width))}{2500 * width}") : -1], f"{order}{kind}{width}")
    volts = (codes - offset) * per_code
    assert (volts.min(), volts.max()) == pytest.approx((0.1, 1.2), abs=0.01)  # a code is 8 mV


def test_the_driver_reads_the_volts_and_times_of_a_trace():
    _, driver = scope()
    driver.prepare(**ASKED)
    driver.acquire(timeout_s=1.0)
    trace = driver.trace(1)
    assert (trace.codes.size, trace.dt_s, trace.t0_s) == (2500, 4e-5, -0.05)
    assert (trace.volts.min(), trace.volts.max()) == pytest.approx((0.1, 1.2), abs=0.01)
    middle = trace.volts[1250 + np.array([-20, 20])]
    assert middle[0] < 0.65 < middle[1]  # the trigger is there


def test_an_error_is_seen_in_the_register_and_named_by_the_events():
    lines = [("CH1:FOO 1", None), ("*ESR?", "32"), ("ALLEV?", '113,"Undefined header; CH1:FOO"')]
    with conversation(TektronixTDS2000, *lines) as it, pytest.raises(CommandRefused, match="Undefined header"):
        it.command("CH1:FOO 1")
    device, _ = scope()
    assert ask(device, "HEAD OFF;:ALLE?") == '0,"No events to report - queue empty"'
    send(device, b"CH1:FOO 1\n")
    assert int(ask(device, "*ESR?")) & 32
    assert ask(device, "ALLE?").startswith('113,"Undefined header')


def test_a_trace_of_another_setup_is_refused():
    device, driver = scope()
    driver.prepare(**ASKED)
    driver.acquire(timeout_s=1.0)
    send(device, b"CH1:SCA 0.5\n")
    with pytest.raises(SettingsLost):
        driver.trace(1)


def test_a_preamble_with_another_scale_is_no_answer():
    device, driver = scope()
    driver.prepare(**ASKED)
    driver.acquire(timeout_s=1.0)
    honest = device.preamble
    device.preamble = lambda channel=None: [*honest(channel)[:12], "8.0E-2", *honest(channel)[13:]]
    with pytest.raises(BadAnswer):
        driver.preamble(1)


def test_both_slopes_are_more_than_its_trigger_knows():
    _, driver = scope()
    with pytest.raises(OutOfRange) as refused:
        driver.prepare(**ASKED, trigger_slope="either")
    assert refused.value.name == "trigger_slope"

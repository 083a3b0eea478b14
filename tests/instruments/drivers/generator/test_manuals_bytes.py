"""The generators' drivers: the manual's bytes.

Source: Keysight 33500 Series Operating and Service Guide; Agilent 33220A User's Guide; public drivers of both.
"""

import pytest

from instruments.clock import VirtualClock
from instruments.drivers.generator import Limits
from instruments.drivers.generator.agilent_33220a import Agilent33220A
from instruments.drivers.generator.keysight_33500b import Keysight33500B
from instruments.errors import BadAnswer, CommandRefused, NoAnswer, OutOfRange
from instruments.links.visa import VisaTransport
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.generator.agilent_33220a import Virtual33220A
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from support.conversation import CLEAR, SILENCE, accepted, conversation


def test_the_signal_is_set_for_a_coil_from_a_clean_state_with_the_offset_gone_before_the_amplitude_comes():
    lines = accepted("*RST", "OUTP1:LOAD INF", "VOLT:UNIT VPP", "FUNC SIN", "FREQ 30.5", "VOLT:OFFS 0.0", "VOLT 10.0")
    with conversation(Keysight33500B, *lines) as generator:
        generator.prepare(waveform="SIN", frequency_hz=30.5, amplitude_vpp=10.0)


def test_an_offset_is_set_once_there_is_room_for_it():
    signal = ("FUNC SIN", "FREQ 30.5", "VOLT:OFFS 0.0", "VOLT 4.0", "VOLT:OFFS -1.5")
    with conversation(Keysight33500B, *accepted("*RST", "OUTP1:LOAD INF", "VOLT:UNIT VPP", *signal)) as generator:
        generator.prepare(waveform="SIN", frequency_hz=30.5, amplitude_vpp=4.0, offset_v=-1.5)


# --- off ---

#: The messages before the first question, and the identity question, where it was not asked before.
OFF = (("*CLS", None), ("OUTP1 OFF", None))
ONE, TWO = (("*IDN?", f"Agilent Technologies,{model},MY52812345,3.05") for model in ("33521A", "33522B"))


def test_off_is_sent_and_seen():
    with conversation(Keysight33500B, *OFF, ONE, ("OUTP1?", "0")) as generator:
        generator.off()


def test_both_outputs_of_two_are_switched_off_and_seen_to_be_off():
    both = (*OFF, ("OUTP2 OFF", None), ("OUTP1?", "0"), ("OUTP2?", "0"))
    with conversation(Keysight33500B, TWO, *both) as generator:
        generator.identity()  # then it need not be asked again
        generator.off()


@pytest.mark.parametrize("answers", [("1", None), ("0", "1")])
def test_an_output_that_stays_on_is_an_error(answers):
    seen = [(f"OUTP{k}?", answer) for k, answer in enumerate(answers, start=1) if answer]
    with (
        conversation(Keysight33500B, *OFF, TWO, ("OUTP2 OFF", None), *seen) as generator,
        pytest.raises(CommandRefused, match="still on") as caught,
    ):
        generator.off()
    assert caught.value.command == f"OUTP{len(seen)} OFF"


def test_an_answer_that_makes_no_sense_is_not_taken_for_off():
    lines = (*OFF, TWO, ("OUTP2 OFF", None), ("OUTP1?", "0"), ("OUTP2?", "+3.0E+01"), (CLEAR, None))
    with conversation(Keysight33500B, *lines) as generator, pytest.raises(BadAnswer):
        generator.off()


def test_a_silent_generator_is_not_taken_for_one_that_is_off():
    with conversation(Keysight33500B, *OFF, ONE, ("OUTP1?", SILENCE)) as generator, pytest.raises(NoAnswer):
        generator.off()


# --- limits ---


def test_a_signal_beyond_the_terminals_is_refused_before_anything_is_sent():
    with conversation(Keysight33500B) as generator:
        for amplitude, offset in ((20.5, 0.0), (20.0, -0.1), (12.0, 4.1), (float("nan"), 0.0), (1.0, float("nan"))):
            with pytest.raises(OutOfRange) as refused:
                generator.prepare(waveform="SIN", frequency_hz=30.5, amplitude_vpp=amplitude, offset_v=offset)
            assert "10 V" in refused.value.allowed


def test_an_amplitude_that_is_too_small_stops_the_preparation_before_it_is_sent():
    lines = accepted("*RST", "OUTP1:LOAD INF", "VOLT:UNIT VPP", "FUNC SIN", "FREQ 30.5", "VOLT:OFFS 0.0")
    with conversation(Keysight33500B, *lines) as generator, pytest.raises(OutOfRange) as refused:
        generator.prepare(waveform="SIN", frequency_hz=30.5, amplitude_vpp=0.001)
    assert (refused.value.name, refused.value.value) == ("amplitude", 0.001)


LIMITS = Limits(drive_amplitude_vpp=4.0, drive_offset_v=1.0, drive_frequency_hz=50.0, drive_lowest_hz=5.0)
FORBIDDEN = [
    ("amplitude", 4.01, "drive_amplitude_vpp"),
    ("amplitude", float("nan"), "drive_amplitude_vpp"),
    ("amplitude", -1.0, "drive_amplitude_vpp"),
    ("offset", 1.01, "drive_offset_v"),
    ("offset", -1.01, "drive_offset_v"),
    ("offset", float("nan"), "drive_offset_v"),
    ("frequency", 50.1, "drive_frequency_hz"),
    ("frequency", 4.9, "drive_lowest_hz"),
    ("frequency", float("nan"), "drive_frequency_hz"),
    ("load", 50.0, "drive_amplitude_vpp"),  # twice the voltage that is displayed would be there
    ("load", float("nan"), "drive_amplitude_vpp"),
    ("output", True, "drive_amplitude_vpp"),  # its value is not known
]


@pytest.mark.parametrize("driver", [Keysight33500B, Agilent33220A])
@pytest.mark.parametrize(("name", "value", "limit"), FORBIDDEN)
def test_no_setting_gets_around_the_limits_of_the_bench(driver, name, value, limit):
    with conversation(driver) as generator:  # nothing is sent
        generator.limits = LIMITS
        with pytest.raises(OutOfRange) as refused:
            setattr(generator, name, value)
        assert f"limits.{limit}" in refused.value.allowed


@pytest.mark.parametrize("driver", [Keysight33500B, Agilent33220A])
@pytest.mark.parametrize(("name", "value", "limit"), [row for row in FORBIDDEN if row[0] not in {"load", "output"}])
def test_no_preparation_gets_around_them_either(driver, name, value, limit):
    names = {"amplitude": "amplitude_vpp", "offset": "offset_v", "frequency": "frequency_hz"}
    signal = {"frequency_hz": 30.0, "amplitude_vpp": 4.0, "offset_v": 1.0} | {names[name]: value}
    with conversation(driver) as generator:
        generator.limits = LIMITS
        with pytest.raises(OutOfRange, match=limit):
            generator.prepare(waveform="SIN", **signal)


def test_after_a_reset_the_output_stays_off_until_a_signal_is_prepared():
    lines = ("*RST", "OUTP:LOAD INF", "VOLT:UNIT VPP", "FUNC SIN", "FREQ 30.0", "VOLT:OFFS 0.0", "VOLT 4.0", "OUTP ON")
    with conversation(Agilent33220A, *accepted(*lines), *accepted("*RST")) as generator:
        generator.limits = LIMITS
        generator.prepare(waveform="SIN", frequency_hz=30.0, amplitude_vpp=4.0)
        generator.output = True
        generator.command("*RST")
        with pytest.raises(OutOfRange, match=r"prepare\(\) first"):
            generator.output = True


@pytest.mark.parametrize("driver", [Keysight33500B, Agilent33220A])
def test_limits_bind_what_was_prepared_before_they_were_set(driver):
    output = driver.OUTPUT
    signal = ("FUNC SIN", "FREQ 30.0", "VOLT:OFFS 0.0", "VOLT 20.0")
    lines = accepted("*RST", f"{output}:LOAD INF", "VOLT:UNIT VPP", *signal)
    with conversation(driver, *lines) as generator:
        generator.prepare(waveform="SIN", frequency_hz=30.0, amplitude_vpp=20.0)
        generator.limits = Limits(drive_amplitude_vpp=1.0)
        with pytest.raises(OutOfRange, match=r"prepare\(\) first.*limits\.drive_amplitude_vpp"):
            generator.output = True  # nothing is sent
        assert generator.limits == Limits(drive_amplitude_vpp=1.0)


def test_without_new_limits_what_was_prepared_goes_on():
    signal = ("FUNC SIN", "FREQ 30.0", "VOLT:OFFS 0.0", "VOLT 4.0", "OUTP ON")
    with conversation(Agilent33220A, *accepted("*RST", "OUTP:LOAD INF", "VOLT:UNIT VPP", *signal)) as generator:
        generator.limits = LIMITS
        generator.prepare(waveform="SIN", frequency_hz=30.0, amplitude_vpp=4.0)
        generator.output = True


# --- the older family ---


def test_the_older_generator_is_set_up_in_its_dialect():
    lines = accepted("*RST", "OUTP:LOAD INF", "VOLT:UNIT VPP", "FUNC SQU", "FREQ 30.5", "VOLT:OFFS 0.0", "VOLT 10.0")
    with conversation(Agilent33220A, *lines) as generator:
        generator.prepare(waveform="SQU", frequency_hz=30.5, amplitude_vpp=10.0)


def test_its_triangle_is_a_symmetric_ramp():
    signal = ("FUNC RAMP", "FUNC:RAMP:SYMM 50.0", "FREQ 30.5", "VOLT:OFFS 0.0", "VOLT 10.0")
    with conversation(Agilent33220A, *accepted("*RST", "OUTP:LOAD INF", "VOLT:UNIT VPP", *signal)) as generator:
        generator.prepare(waveform="TRI", frequency_hz=30.5, amplitude_vpp=10.0)


#: Headers as in the User's Guide, numbers as it prints them: fourteen digits.
WIRE_33220A = [
    ("waveform", "RAMP", "FUNC RAMP", "RAMP"),
    ("symmetry", 50.0, "FUNC:RAMP:SYMM 50.0", "+5.0000000000000E+01"),
    ("frequency", 38.25, "FREQ 38.25", "+3.8250000000000E+01"),
    ("amplitude", 10.0, "VOLT 10.0", "+1.0000000000000E+01"),
    ("offset", 0.5, "VOLT:OFFS 0.5", "+5.0000000000000E-01"),
    ("load", 50.0, "OUTP:LOAD 50.0", "+5.0000000000000E+01"),
    ("output", True, "OUTP ON", "1"),
]


@pytest.mark.parametrize(("name", "value", "sent", "answer"), WIRE_33220A)
def test_a_setting_of_the_older_generator_is_sent_and_asked_for(name, value, sent, answer):
    with conversation(Agilent33220A, *accepted(sent), (sent.split()[0] + "?", answer)) as generator:
        setattr(generator, name, value)
        assert getattr(generator, name) == value


@pytest.mark.parametrize(
    ("name", "value"), [("waveform", "TRI"), ("frequency", 21e6), ("amplitude", 0.01), ("offset", 11.0)]
)
def test_what_the_older_generator_cannot_do_is_refused_before_it_is_sent(name, value):
    with conversation(Agilent33220A) as generator, pytest.raises(OutOfRange):
        setattr(generator, name, value)


# --- the same experiment, whatever the model ---


@pytest.mark.parametrize(("driver", "device"), [(Keysight33500B, Virtual33500B), (Agilent33220A, Virtual33220A)])
@pytest.mark.parametrize("waveform", ["SIN", "SQU", "TRI", "RAMP"])
def test_both_families_put_the_same_signal_on_the_coil(driver, device, waveform):
    address = "TCPIP0::generator.levilab::inst0::INSTR"
    virtual = device(VirtualClock())
    transport = VisaTransport(address, library=library_for(VirtualBench({address: virtual})))
    generator = driver(transport)
    generator.identity()
    generator.prepare(waveform=waveform, frequency_hz=30.5, amplitude_vpp=12.0)
    assert virtual.signal().amplitude == 0.0
    generator.output = True
    signal = virtual.signal()
    assert (signal.frequency, signal.amplitude, signal.offset) == (30.5, 6.0, 0.0)
    generator.frequency, generator.offset = 31.0, 1.5
    assert (generator.frequency, generator.offset) == (31.0, 1.5)
    with pytest.raises(OutOfRange):
        generator.offset = 8.0  # 6 V are there already
    assert virtual.signal().offset == 1.5  # refused, not clipped
    generator.off()
    assert virtual.signal().amplitude == 0.0
    generator.close()

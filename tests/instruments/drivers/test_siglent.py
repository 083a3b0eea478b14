"""Siglent's own dialect: answers with headers, settings asked back, a descriptor before the data.

The bytes are those that users of an SDS1204X-E and of SDG generators wrote down; see the drivers.
"""

import re
import struct

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.generator.siglent_sdg1000x import SiglentSDG1000X
from instruments.drivers.oscilloscope.siglent_sds1000xe import SiglentSDS1000XE
from instruments.errors import BadAnswer, CommandRefused, OutOfRange
from instruments.ieee488 import BlockForm, BrokenBlock, block_of
from instruments.virtual.generator.siglent_sdg1000x import VirtualSDG1000X
from instruments.virtual.oscilloscope.siglent_sds1000xe import VirtualSDS1000XE
from support.conversation import CLEAR, conversation
from support.exchanges import carry_out, exchanges
from support.scopes import pulses
from support.talks import connected
from support.wire import ask, errors, received, send

AFTER_RESET = "C1:BSWV WVTP,SINE,FRQ,1000HZ,PERI,0.001S,AMP,4V,AMPVRMS,1.414Vrms,OFST,0V,HLEV,2V,LLEV,-2V,PHSE,0"


def scope(*messages, signal=pulses):
    device = VirtualSDS1000XE(VirtualClock(), signals={1: signal, 2: signal})
    for message in messages:
        send(device, message.encode() + b"\n")
    return device


def test_a_field_is_read_by_its_name_and_the_state_by_its_place():
    with conversation(SiglentSDG1000X, ("C1:BSWV?", AFTER_RESET), ("C1:OUTP?", "C1:OUTP ON,LOAD,HZ,PLRT,NOR")) as it:
        assert it.amplitude == 4.0
        assert it.output is True


NO_FREQUENCIES = {
    "another channel's": "C2:BSWV WVTP,SINE,FRQ,1000HZ",
    "none": "C1:BSWV WVTP,SINE,PERI,0.001S",
    "no header": "1000HZ",
    "twice": "C1:BSWV WVTP,SINE,FRQ,1000HZ,FRQ,1900HZ",
    "volts": "C1:BSWV WVTP,SINE,FRQ,1000V",
    "no unit": "C1:BSWV WVTP,SINE,FRQ,1000",
    "a zero that is not printed": "C1:BSWV WVTP,SINE,FRQ,0100HZ",
}


@pytest.mark.parametrize("answer", NO_FREQUENCIES.values(), ids=NO_FREQUENCIES)
def test_what_is_no_frequency_is_refused(answer):
    with conversation(SiglentSDG1000X, ("C1:BSWV?", answer), (CLEAR, None)) as generator, pytest.raises(BadAnswer):
        _ = generator.frequency


def test_an_amplitude_that_the_generator_clips_is_refused():
    lines = (("C1:BSWV AMP,12.0", None), ("C1:BSWV?", AFTER_RESET.replace("AMP,4V", "AMP,10V")))
    with (
        conversation(SiglentSDG1000X, *lines) as generator,
        pytest.raises(OutOfRange, match=r"12\.0 is refused.*10\.0"),
    ):
        generator.amplitude = 12.0


def shows(question, *parts):
    """These parts stand in the answer to a question."""
    return lambda device: all(part in ask(device, question) for part in parts)


GENERATOR = (VirtualSDG1000X,)
EXCHANGES = {
    "the answers after a reset are those of a real one": (
        *(GENERATOR, ("C1:BSWV?", AFTER_RESET), ("C2:OUTP?", "C2:OUTP OFF,LOAD,HZ,PLRT,NOR")),
        *("C1:OUTP LOAD,50", shows("C1:BSWV?", "AMP,2V")),  # at the load half of the open voltage
    ),
    "six digits are printed, and ten of a frequency": (
        *(GENERATOR, "C1:BSWV FRQ,12345678.123456,AMP,1.23456789", "C1:OUTP LOAD,1234.5", "C1:OUTP LOAD,HZ"),
        shows("C1:BSWV?", "FRQ,12345678.12HZ,PERI,8.1e-08S,AMP,1.23457V,AMPVRMS,0.43642Vrms,"),
        *("C1:OUTP LOAD,1234.5", "C1:BSWV FRQ,1e-6", ("C1:OUTP?", "C1:OUTP OFF,LOAD,1234,PLRT,NOR")),
        shows("C1:BSWV?", "FRQ,1e-06HZ,PERI,1e+06S"),
    ),
    **{
        f"{name} of C{n} is set, asked and reset": (  # two values, and what is there after a reset
            GENERATOR,
            *(f"C{n}:BSWV WVTP,{waveform},{name},{first}", shows(f"C{n}:BSWV?", f",{name},{first}")),
            *(f"C{n}:BSWV WVTP,{waveform},{name},{value}", shows(f"C{n}:BSWV?", f",{name},{value}")),
            lambda device, n=3 - n, waveform=waveform, field=f",{name},{value}": (
                field not in ask(device, f"C{n}:BSWV WVTP,{waveform};C{n}:BSWV?")
            ),
            *("*RST", shows(f"C{n}:BSWV WVTP,{waveform};C{n}:BSWV?", f",{name},{default}")),
        )
        for waveform, name, first, value, default in (
            ("SINE", "FRQ", "25HZ", "1e-06HZ", "1000HZ"),
            ("SINE", "PERI", "0.04S", "1000S", "0.001S"),
            ("SINE", "AMP", "3V", "0.002V", "4V"),
            ("SINE", "OFST", "-1.5V", "8V", "0V"),
            ("SINE", "PHSE", "90", "360", "0"),
            ("SQUARE", "DUTY", "20", "99", "50"),
            ("RAMP", "SYM", "0", "100", "50"),
        )
        for n in (1, 2)
    },
    **{
        f"the voltages set by {sent}": (
            *(GENERATOR, f"C1:BSWV {sent}", shows("C1:BSWV?", f",AMP,{amplitude}V,", f",OFST,{offset}V,")),
        )
        for sent, amplitude, offset in (
            ("HLEV,4", 6, 1),  # the low level stays
            ("LLEV,0", 2, 1),
            ("HLEV,4,LLEV,1", 3, 2.5),
            ("AMPVRMS,1", 2.82885, 0),  # six digits of 1/0.3535
            ("MAX_OUTPUT_AMP,3", 3, 0),
            ("MAX_OUTPUT_AMP,3,AMP,9", 3, 0),
        )
    },
    "the buzzer is switched and asked for": (
        *((VirtualSDG1000X, lambda _: scope()), ("BUZZ OFF;BUZZ?", "BUZZ OFF"), shows("CHDR?", "SHORT")),
    ),
    **{
        f"{header}, which it lacks, is off": (
            *(GENERATOR, (f"C1:{header} STATE,OFF;C1:{header}?", f"C1:{header} STATE,OFF")),
            *(f"C1:{header} STATE,ON", [-224]),
        )
        for header in ("MDWV", "SWWV")
    },
    # Programming Guide, STL? and ARWV?: places and names; the third is selected after a reset
    "the waveforms that it is made with are listed": (
        *(GENERATOR, shows("STL?", "STL M0, Sine, M1, Noise, M2, StairUp, "), ("STL? USER", "STL ")),
        ("C1:ARWV?", "C1:ARWV INDEX,2,NAME,StairUp"),
    ),
    "an inverted output is one of inverted polarity": (
        *(GENERATOR, shows("C1:INVT ON;C1:OUTP?", "PLRT,INVT"), ("C1:OUTP PLRT,NOR;C1:INVT?", "C1:INVT OFF")),
        ("C2:SYNC ON;C2:SYNC?", "C2:SYNC ON"),
    ),
    **{
        f"{question} has parameters, which no question has": (GENERATOR, (question, None), [-108])
        for question in ("C1:BSWV? FRQ", "C1:OUTP? (@1)")
    },
}


@exchanges(EXCHANGES)
def test_an_exchange_goes_as_users_wrote_it_down(make, steps):
    carry_out(make, steps)


def test_a_power_is_one_of_a_load():
    device = VirtualSDG1000X(VirtualClock())
    send(device, b"C1:BSWV AMPDBM,10\n")
    assert errors(device) == [-221]  # at open terminals there is none
    send(device, b"C1:OUTP LOAD,50;C1:BSWV AMPDBM,10\n")
    volts = float(re.search(r"AMPVRMS,([\d.]+)Vrms", ask(device, "C1:BSWV?"))[1])
    assert volts**2 / 50 == pytest.approx(10e-3, rel=1e-5)  # six digits


def test_a_generator_answers_without_headers_where_a_program_wants_none():
    device = VirtualSDG1000X(VirtualClock())
    send(device, b"CHDR OFF\n")
    assert ask(device, "C2:OUTP?") == "OFF,LOAD,HZ,PLRT,NOR"
    assert ask(device, "C1:BSWV?") == AFTER_RESET.removeprefix("C1:BSWV ")
    driver = connected(SiglentSDG1000X, device)
    driver.off()  # it asks for headers again
    assert driver.frequency == 1000.0


def test_a_screen_dump_is_a_command_that_is_answered():
    device = scope("STOP")
    send(device, b"SCDP\n")
    assert received(device, 10.0)[:2] == b"BM"


@pytest.mark.parametrize("wrong", ["FRQ,30,XYZ,1", "WVTP,RAMP,FRQ,30,AMP,x"])
def test_what_is_shown_is_put_out_where_a_field_is_wrong(wrong):
    put_out = []
    device = VirtualSDG1000X(VirtualClock(), listener=lambda _, output: put_out.append(output))
    send(device, f"C1:OUTP ON\nC1:BSWV {wrong}\n".encode())
    assert len(errors(device)) == 1
    assert "WVTP,SINE,FRQ,1000HZ," in ask(device, "C1:BSWV?")
    assert (put_out[-1].waveform, put_out[-1].frequency) == ("SIN", 1000.0)


def test_a_switch_that_did_not_move_is_refused():
    lines = (("C1:OUTP ON", None), ("C1:OUTP?", "C1:OUTP OFF,LOAD,HZ,PLRT,NOR"))
    with conversation(SiglentSDG1000X, *lines) as generator, pytest.raises(CommandRefused, match="is False afterwards"):
        generator.output = True


@pytest.mark.parametrize(
    ("setting", "answers"), [("SHORT", ("C1:VDIV 1.00E+00V", "TDIV 1.00E-06S")), ("OFF", ("1.00E+00", "1.00E-06"))]
)
def test_a_scope_answers_with_header_and_unit_unless_CHDR_is_OFF(setting, answers):
    device = scope(f"CHDR {setting}")
    assert (ask(device, "C1:VDIV?"), ask(device, "TIME_DIV?")) == answers
    # a header stands for itself: there is no path memory
    assert ask(device, "C1:TRA?;C1:TRA?") is not None


@pytest.mark.parametrize("answer", ["TDIV 0.000100S", "TDIV 1.00E-03V", "TDIV 1.00E-03", "TDIV 1.00E-3S"])
def test_a_time_that_no_scope_prints_so_is_refused(answer):
    with conversation(SiglentSDS1000XE, ("TDIV?", answer), (CLEAR, None)) as it, pytest.raises(BadAnswer):
        _ = it.time_scale


def test_the_descriptor_says_how_the_codes_are_read():
    device = scope("C1:ATTN 1", "C1:VDIV 0.2V;C1:OFST -0.6V;C1:TRLV 0.65V", "TDIV 10MS", "TRMD STOP", "MSIZ 14K", "ARM")
    device.clock.sleep(3.0)
    assert int(ask(device, "INR?").split()[1]) & 1
    send(device, b"CHDR OFF\n")
    send(device, b"C1:WF? DESC\n")
    descriptor = block_of(received(device, 100.0), BlockForm(longest_head=16, ends=2))
    assert descriptor[:8] == b"WAVEDESC"
    assert len(descriptor) == 346
    assert struct.unpack_from("<i", descriptor, 116) == (14_000,)
    assert struct.unpack_from("<ff", descriptor, 156) == pytest.approx((0.2, -0.6))
    send(device, b"C1:WF? DAT2\n")
    codes = np.frombuffer(block_of(received(device, 100.0), BlockForm(longest_head=16, ends=2)), np.int8)
    volts = codes * 0.2 / 25 + 0.6
    assert (volts.min(), volts.max()) == pytest.approx((0.1, 1.2), abs=0.01)


def test_a_block_behind_a_header_that_never_ends_is_no_block():
    form = BlockForm(longest_head=16, ends=2)
    assert block_of(b"C1:WF DAT2,#15ab#\n1\n\n", form) == b"ab#\n1"
    for broken in (b"C1:WF DAT2,and so on without a block\n", b"C1:WF DAT2,#15abcde\n", b"\n#15abcde\n\n", b""):
        with pytest.raises(BrokenBlock):
            block_of(broken, form)


def test_the_points_that_are_sent_are_sampled_and_no_others():
    sampled = []

    def counted(start, step, n):
        sampled.append(n)
        return pulses(start, step, n)

    device = scope("C1:ATTN 1", "C1:TRLV 0.65V", "TDIV 10MS", "TRMD STOP", "MSIZ 140K", "ARM", signal=counted)
    device.clock.sleep(3.0)
    whole = ask_codes(device, "C1:WF? DAT2")
    sampled.clear()
    send(device, b"WFSU SP,1000,FP,5\n")
    assert (ask_codes(device, "C1:WF? DAT2") == whole[5::1000]).all()
    assert sum(sampled) == 140


def ask_codes(device, question):
    send(device, question.encode() + b"\n")
    return np.frombuffer(block_of(received(device, 100.0), BlockForm(longest_head=16, ends=2)), np.int8)


class KeepsItsMemory(VirtualSDS1000XE):
    """As the measured firmware: MSIZ is ignored without a word."""

    def set_depth(self, parameters):
        pass


def test_a_scope_that_keeps_its_memory_gives_all_its_points():
    device = KeepsItsMemory(VirtualClock(), signals={1: pulses, 2: pulses})
    device.settings["depth"] = "140K"
    driver = connected(SiglentSDS1000XE, device, clock=device.clock)
    wanted = {"duration_s": 0.1, "points": 1000, "volts_per_division": 0.2, "offset_v": 0.65, "trigger_level_v": 0.65}
    driver.prepare(channels=(1, 2), **wanted)
    driver.acquire(timeout_s=1.0)
    trace = driver.trace(2)
    assert trace.codes.size == 70_000  # 1 and 2 share it
    assert trace.dt_s == 2e-6
    # the trigger is in the middle, where the light rises through the level
    middle = trace.volts[trace.codes.size // 2 + np.array([-100, 100])]
    assert middle[0] < 0.65 < middle[1]

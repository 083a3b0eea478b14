"""The virtual generator: what it puts out is told, and it is off unless somebody switched it on."""

import pytest
from wire import received, send

from instruments.virtual.generator import Output, Virtual33500B
from levilab.clock import VirtualClock


@pytest.fixture
def told():
    return []


@pytest.fixture
def generator(told):
    return Virtual33500B(VirtualClock(), listener=lambda time, output: told.append((time, output)))


def test_the_output_is_off_at_power_on(generator, told):
    send(generator, b"OUTP?\n")
    assert received(generator, 1.0) == b"0\n"
    assert generator.signal() == Output("SIN", 1000.0, 0.0, 0.0)
    assert told == []


def test_the_listener_is_told_at_each_change_and_when(generator, told):
    send(generator, b"FUNC SQU;FREQ 40;VOLT 10;VOLT:OFFS 0.5\n")
    generator.clock.sleep(2.5)
    send(generator, b"OUTP ON\n")
    generator.clock.sleep(1.0)
    send(generator, b"FREQ 41\n")
    send(generator, b"OUTP OFF\n")
    off = Output("SQU", 40.0, 0.0, 0.0)
    assert [output for _, output in told[:3]] == [Output("SQU", 1e3, 0.0, 0.0), off, off]
    assert told[-3:] == [
        (2.5, Output("SQU", 40.0, 5.0, 0.5)),  # 10 V from peak to peak are an amplitude of 5 V
        (3.5, Output("SQU", 41.0, 5.0, 0.5)),
        (3.5, Output("SQU", 41.0, 0.0, 0.0)),
    ]


def test_a_refused_change_is_no_change(generator, told):
    send(generator, b"OUTP MAYBE\nFREQ 31 MHZ\nFOO\nFREQ?\n")
    assert told == []


def test_the_output_is_off_after_reset(generator, told):
    send(generator, b"FREQ 40\nVOLT 10\nOUTP ON\n*RST\n")
    assert told[-1][1] == Output("SIN", 1000.0, 0.0, 0.0)
    assert generator.signal().amplitude == 0.0


def test_nobody_need_listen():
    send(Virtual33500B(VirtualClock()), b"OUTP ON\n")

"""Lines of 50 000 signs, of every kind that a pattern looks for: the work grows with the length, not with its square.

Nothing is timed.  Work that grew with the square would last for half a minute here, and the guard below would end it.
"""

import faulthandler

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.virtual.core.parameters import MOST_DIGITS, boolean, number
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.steps import Work
from instruments.virtual.counter.keysight_53230a import Virtual53230A
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from support.wire import ask, errors, send

MANY = 50_000

#: What stands behind a header, by what it is made of.
LONG = {
    "digits and a sign": "1" * MANY + "!",
    "digits": "1" * MANY,
    "digits behind a point": "1." + "1" * MANY + "!",
    "zeros": "0." + "0" * MANY + "!",
    "points": "1." * (MANY // 2),
    "digits of an exponent": "1e" + "1" * MANY,
    "blanks before a unit": "1" + " " * MANY + "!",
    "letters of a unit": "1" + "k" * MANY + "!",
    "a word": "A" * MANY,
    "a channel list": "(@" + "1" * MANY,
    "blanks in a channel list": "(@" + " " * MANY + "!",
    "blanks in brackets": "(" + " " * MANY + "!",
    "opening brackets": "(" * MANY,
    "closing brackets": ")" * MANY,
    "a string": '"' + "x" * MANY,
    "quotes": "'\"" * (MANY // 2),
    "blocks' heads": ",#1" * (MANY // 3),
    "parameters": "1," * (MANY // 2),
    "nodes": "A:" * (MANY // 2),
    "units": "*CLS;" * (MANY // 5),
    "nothing": ";" * MANY,
}


def no_light(_start, _step, n):
    """A dark room, and no more of it than a test needs."""
    return np.zeros(min(n, 1000))


@pytest.fixture(autouse=True)
def hang_guard():
    """A quarter of a minute, reached by work that grows with the square alone."""
    faulthandler.dump_traceback_later(15, exit=True)
    yield
    faulthandler.cancel_dump_traceback_later()


@pytest.mark.parametrize("text", LONG.values(), ids=LONG)
def test_a_long_line_is_worked_on_and_the_next_is_answered(text):
    counter = Virtual53230A(VirtualClock(), signal=no_light)
    for header in ("*ESE ", "CONF:FREQ ", "FUNC ", ""):
        send(counter, f"{header}{text}\n".encode())
        send(counter, b"*CLS\n")
    assert "53230A" in ask(counter, "*IDN?", timeout=1e9)


def test_a_long_list_of_channels_is_none_and_is_not_read():
    counter = Virtual53230A(VirtualClock(), signal=no_light)
    send(counter, b"CONF:FREQ (@" + b"1," * MANY + b"1)\n")
    assert errors(counter) == [-224]


def test_a_mantissa_has_no_more_digits_than_the_standard_allows():
    digits = "1" * MOST_DIGITS
    assert number(digits, low=0, high=1e300, default=0) == pytest.approx(float(digits))
    assert number(f"-000.0{digits[1:]}", low=-1, high=1, default=0) == pytest.approx(-1 / 90)
    assert boolean("0" * 1000 + "1")
    for text in (digits + "1", f"0.{digits}1", f"+{digits}.1e-3"):
        for read in (lambda text: number(text, low=0, high=1e300, default=0), boolean):
            with pytest.raises(ScpiError, match="Too many digits") as refused:
                read(text)
            assert refused.value.number == -124


def test_too_many_digits_are_in_the_error_queue_and_change_nothing():
    generator = Virtual33500B(VirtualClock())
    send(generator, b"FREQ 40\n")
    send(generator, b"FREQ " + b"1" * 256 + b"\n")
    assert errors(generator) == [-124]
    assert float(ask(generator, "FREQ?")) == 40.0


@pytest.mark.parametrize(
    ("message", "least"),
    [("*RST;" * 5000, 5000), (";" * MANY, MANY // 1000), ("*ESE " + "(" * MANY, MANY // 1000)],
    ids=["units", "nothing", "one parameter"],
)
def test_work_on_one_line_can_be_interrupted(message, least):
    counter = Virtual53230A(VirtualClock(), signal=no_light)
    work, steps = Work(counter.steps(message)), 1
    while work.step():
        steps += 1
    assert least <= steps <= 2 * least + 10

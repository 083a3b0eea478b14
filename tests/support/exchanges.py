"""Exchanges with virtual instruments as rows: what is sent, what comes back, and what the error queue says then.

A row of a table is the instruments that it is for, and its steps:

- a text is sent, CLEAR as a device clear;
- a tuple is a question, perhaps behind commands, and its answer: a text, the number or numbers in it, or None;
- a list is the error queue, which is empty afterwards: numbers, or whole entries;
- a number is time that passes [s];
- a function gets the device, and returns whether something holds.

In the end the error queue is empty, where there is one.
"""

import re

import pytest

from instruments.clock import VirtualClock
from support.conversation import CLEAR
from support.wire import ask, cable, send

#: Numbers are compared to this part: an instrument prints more digits, and products are rounded.
_REL = 1e-9
#: An answer is waited for so long [s].
_PATIENCE_S = 60.0


def exchanges(rows):
    """Parametrize a test with the instruments and steps of a table: sentence → (instruments, step, …)."""
    found = [
        pytest.param(make, steps, id=f"{getattr(make, '__name__', 'device')}-{sentence}")
        for sentence, (makes, *steps) in rows.items()
        for make in makes
    ]
    return pytest.mark.parametrize(("make", "steps"), found)


def took(low, high):
    """The bench's time is between these [s]."""
    return lambda device: low <= device.clock.now() <= high


def about(value, tolerance):
    """A number, or numbers, within a tolerance."""
    return pytest.approx(value, abs=tolerance)


def carry_out(make, steps):
    """Go through an exchange with a new instrument."""
    device = make(VirtualClock())
    for step in (*steps, []):
        take(device, step)


def take(device, step):
    """Go through one step."""
    match step:
        case str():
            cable(device).clear() if step == CLEAR else send(device, step.encode("latin-1") + b"\n")
        case list():
            queue = list(iter(lambda: ask(device, "SYST:ERR?"), device.no_error)) if device.takes_blocks else []
            whole = any(isinstance(wanted, str) for wanted in step)
            found = queue if whole else [int(entry.partition(",")[0]) for entry in queue]
            assert found == step, f"the error queue has {found}, not {step}"
        case (question, answer):
            got = ask(device, question, _PATIENCE_S)
            found = got if isinstance(answer, str | None) else numbers_in(got)
            assert found == _expected(answer), f"{question} is answered with {got}, not {answer}"
        case float() | int():
            device.clock.sleep(step)
        case _:
            assert step(device)


def numbers_in(answer):
    """The numbers of an answer, between commas, semicolons and quotes; one alone is not in a list."""
    found = [float(word) for word in re.split("[,;]", answer)]
    return found[0] if len(found) == 1 else found


def _expected(answer):
    return pytest.approx(answer, rel=_REL) if isinstance(answer, float | int | list) else answer

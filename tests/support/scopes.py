"""Virtual oscilloscopes for the tests, and signals that are known at every instant."""

import math

import numpy as np

from instruments.clock import VirtualClock
from instruments.virtual.oscilloscope.keysight_dsox import VirtualDSOX1000
from instruments.virtual.oscilloscope.rigol_ds1000z import VirtualDS1000Z
from support.wire import ask, errors, received, send

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
    return configure(VirtualDS1000Z(VirtualClock(), signals={1: signal} | more), *messages)


def keysight(signal=pulses, *messages, **more):
    return configure(VirtualDSOX1000(VirtualClock(), signals={1: signal} | more), *messages)


def configure(device, *messages):
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
    configure(device, ":WAV:SOUR CHAN1", ":WAV:FORM BYTE", f":WAV:MODE {mode}")
    fields = ask(device, ":WAV:PRE?").split(",")
    points, dt, t0, per_code, origin, reference = (float(fields[k]) for k in (2, 4, 5, 7, 8, 9))
    codes = b""
    for first in range(1, int(points) + 1, 250_000):
        configure(device, f":WAV:STAR {first}", f":WAV:STOP {min(int(points), first + 249_999)}")
        codes += block(device, ":WAV:DATA?")[1]
    codes = np.frombuffer(codes, np.uint8).astype(float)
    return t0 + dt * np.arange(int(points)), (codes - origin - reference) * per_code

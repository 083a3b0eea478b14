"""Which record a virtual oscilloscope shows: old ones, late ones, the last one."""

import numpy as np
import pytest

from support.scopes import (
    KEYSIGHT_READY,
    RIGOL_READY,
    block,
    configure,
    keysight,
    once,
    pulses,
    rigol,
    rigol_stopped,
    rigol_volts,
)
from support.wire import ask, errors


def test_a_record_stays_as_it_was_when_the_settings_change_after_the_stop():
    device = rigol_stopped(pulses)
    before = rigol_volts(device)
    configure(device, "CHAN1:SCAL 1", ":TIM:SCAL 0.1", ":TRIG:EDGE:LEV 0.2")
    np.testing.assert_array_equal(rigol_volts(device), before)


def test_the_rigol_keeps_the_old_record_until_a_new_one_is_complete():
    device = rigol_stopped(pulses)
    old = device.record()
    configure(device, ":TRIG:EDGE:LEV 1.35", ":SING")
    device.clock.sleep(3.0)
    assert device.record() is old


def test_the_keysight_forgets_the_old_record_when_it_is_armed():
    device = keysight(pulses, *KEYSIGHT_READY, ":SING")
    device.clock.sleep(1.0)
    assert len(block(device, ":WAV:DATA?")[1]) > 0
    configure(device, ":TRIG:EDGE:LEV 1.3", ":SING")
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
        configure(device, f":TRIG:EDGE:LEV {level}", ":SING")
        device.clock.sleep(20.0)
        assert ask(device, ":TRIG:STAT?") == ("STOP" if level < 1 else "WAIT")
    # twenty seconds at 20 kHz, and some finer looks in the beginning; the first level is met at once
    assert sum(looks) < 1_500_000
    assert max(looks) <= 1_000_000


def test_a_scope_that_ran_for_an_hour_without_a_trigger_does_not_look_twice():
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

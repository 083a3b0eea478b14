"""Which record a virtual oscilloscope shows, and how it and the settings are read and restored."""

import numpy as np
import pytest

from support.scopes import (
    KEYSIGHT_READY,
    RIGOL_READY,
    block,
    configure,
    keysight,
    noisy,
    once,
    pulses,
    ramp,
    rigol,
    rigol_stopped,
    rigol_volts,
)
from support.wire import ask, errors, send


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


def test_a_record_reads_the_same_whichever_way_it_is_cut():
    device = rigol_stopped(noisy, "CHAN1:OFFS 0", ":TRIG:EDGE:LEV 0", ":ACQ:MDEP 1200000")
    whole = rigol_volts(device)[1]
    configure(device, ":WAV:STAR 249990", ":WAV:STOP 250020")
    _, across = block(device, ":WAV:DATA?")
    configure(device, ":WAV:STAR 1", ":WAV:STOP 10")
    _, first = block(device, ":WAV:DATA?")
    per_code = float(ask(device, ":WAV:YINC?"))
    np.testing.assert_allclose((np.frombuffer(across, np.uint8) - 127.0) * per_code, whole[249_989:250_020])
    np.testing.assert_allclose((np.frombuffer(first, np.uint8) - 127.0) * per_code, whole[:10])


def test_digitize_is_complete_when_the_record_is():
    device = keysight(pulses, *KEYSIGHT_READY)
    before = device.clock.now()
    send(device, b":DIG CHAN1\n")
    assert ask(device, "*OPC?") == "1"
    record = device.record()
    assert not record.forced
    assert device.clock.now() == pytest.approx(record.done, abs=3 * device.pace)
    assert device.clock.now() - before >= 0.1


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


@pytest.mark.parametrize("make", [rigol, keysight])
def test_a_setup_comes_back(make):
    device = make(pulses, "CHAN1:PROB 1;SCAL 0.2", ":TIM:SCAL 0.02", ":TRIG:EDGE:LEV 0.3")
    _, setup = block(device, ":SYST:SET?")
    configure(device, "*RST")
    assert float(ask(device, "CHAN1:SCAL?")) != 0.2
    configure(device, f":SYST:SET #8{len(setup):08d}" + setup.decode())
    assert [float(ask(device, q)) for q in ("CHAN1:SCAL?", ":TIM:SCAL?", ":TRIG:EDGE:LEV?")] == [0.2, 0.02, 0.3]
    assert block(device, ":SYST:SET?")[1] == setup


def test_a_setup_with_a_fine_delayed_sweep_comes_back():
    fine = (":TIM:SCAL 0.001", ":ACQ:MDEP 12000000", ":TIM:DEL:SCAL 2e-8")
    setup = block(rigol(pulses, *fine), ":SYST:SET?")
    other = rigol(pulses, ":TIM:SCAL 0.001", ":ACQ:MDEP 12000")
    send(other, b":SYST:SET " + setup[0] + setup[1] + b"\n")
    assert errors(other) == []
    assert float(ask(other, ":TIM:DEL:SCAL?")) == 2e-8

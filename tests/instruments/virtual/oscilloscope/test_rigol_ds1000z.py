"""The time base of the virtual DS1000Z, and its delayed sweep."""

import pytest

from support.scopes import pulses, rigol
from support.wire import ask, errors, send


def time_base(device, **wanted):
    """Set what is wanted and read everything back, as public drivers do (rigol-ds1000z 0.2.1, timebase.py)."""
    headers = {"mode": "MODE", "main_scale": "SCAL", "main_offset": "OFFS"}
    headers |= {"delay_enable": "DEL:ENAB", "delay_scale": "DEL:SCAL", "delay_offset": "DEL:OFFS"}
    for name, value in wanted.items():
        text = value if isinstance(value, str) else f"{value:0.10f}"
        send(device, f":TIM:{headers[name]} {text};*WAI\n".encode())
    return {name: ask(device, f":TIM:{header}?;*WAI") for name, header in headers.items()}


def test_a_public_driver_sets_the_time_base_of_the_rigol_and_reads_it_back():
    device = rigol()
    assert time_base(device) == {
        "mode": "MAIN",
        "main_scale": "1.000000e-06",
        "main_offset": "0.000000e+00",
        "delay_enable": "0",
        "delay_scale": "5.000000e-07",
        "delay_offset": "0.000000e+00",
    }
    wanted = {"main_scale": 0.01, "main_offset": 0.02, "delay_enable": "1", "delay_scale": 0.002, "delay_offset": 0.06}
    answers = time_base(device, mode="MAIN", **wanted)
    assert {name: float(answers[name]) for name in wanted} == {name: float(value) for name, value in wanted.items()}
    assert errors(device) == []


@pytest.mark.parametrize(
    ("message", "scale", "offset"),
    [
        (":TIM:DEL:SCAL 0.02", 0.005, 0.0),  # no coarser than the main time base
        (":TIM:DEL:SCAL 1e-9", 0.005, 0.0),  # finer than (50/sample rate)/40
        (":TIM:DEL:OFFS 0.0301", 0.005, 0.0),  # 6 main divisions less 6 of the delayed sweep: 0.03 s
        (":TIM:DEL:OFFS -0.0301", 0.005, 0.0),
    ],
)
def test_the_delayed_sweep_stays_within_the_main_one(message, scale, offset):
    device = rigol(pulses, ":TIM:SCAL 0.01", ":TIM:DEL:SCAL 0.005")
    send(device, message.encode() + b"\n")
    assert errors(device) == [-222]
    answers = time_base(device)
    assert (float(answers["delay_scale"]), float(answers["delay_offset"])) == (scale, offset)


def test_the_delayed_sweep_follows_a_shorter_main_one():
    device = rigol(pulses, ":TIM:SCAL 0.01", ":TIM:DEL:SCAL 0.005", ":TIM:DEL:OFFS 0.03", ":TIM:SCAL 0.002")
    answers = time_base(device)
    assert (float(answers["delay_scale"]), float(answers["delay_offset"])) == (0.002, 0.0)

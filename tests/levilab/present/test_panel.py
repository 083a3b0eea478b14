"""The bench in a few lines: what stands there, and that it fits."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from levilab.present.panel import Piece, Trend, bench_lines
from levilab.telemetry.messages import Counting, Drive, State

LOCKED = State(
    130.0,
    elapsed_s=60.0,
    time_left_s=95.0,
    readings=12,
    last={"spin_frequency_hz": 31.2, "precession_frequency_hz": 31.1998, "flux_density_t": -0.0123},
    drive=Drive("SIN", 31.2, 10.0, 0.0, output=True),
    counting=Counting(1.0, 0.6),
)


def texts(state, width=80, *, plain=False):
    trend = Trend()
    for k in range(10):
        spin = state.last.get("spin_frequency_hz")
        last = state.last | ({"spin_frequency_hz": spin + 0.05 * (9 - k)} if spin else {})
        trend.take(replace(state, time_s=state.time_s + k - 9, last=last))
    return ["".join(piece.text for piece in line) for line in bench_lines(state, trend, width, plain=plain)]


def test_a_person_sees_value_trend_instruments_and_time_left():
    assert texts(LOCKED, 84) == [
        "spin 31.200 Hz  −0.050 Hz/s  █▇▆▆▅▄▃▃▂▁  field −12.3000 mT  precession 31.200 Hz",
        "12 readings",
        "drive ON  31.20 Hz  10 Vpp SIN  gate 1 s  level 0.6 V",
        "━━━━━━━━━━━━━━━─────────────────────────  1:00 min done, about 1:35 min left",
    ]


def test_a_top_that_may_fall_earlier_has_the_least_time_left_beside_the_most():
    *_, bar = texts(replace(LOCKED, least_left_s=42.0), 84)
    assert bar.endswith("  1:00 min done, about 42 s to 1:35 min left")
    *_, bar = texts(replace(LOCKED, least_left_s=0.0), 84)
    assert bar.endswith("  1:00 min done, at most 1:35 min left")


def test_the_time_left_of_a_bench_that_jumps_is_bench_time_and_of_others_is_not():
    *_, bar = texts(replace(LOCKED, virtual=True, speed=None), 84)
    assert bar.endswith("1:00 min done, about 1:35 min of bench time left")
    for state in (LOCKED, replace(LOCKED, virtual=True, speed=1.0)):
        assert texts(state, 84)[-1].endswith("1:00 min done, about 1:35 min left")


def test_a_value_that_is_old_has_its_age():
    trend = Trend()
    shown = []
    for time_s, spin in ((0.0, 29.9), (4.0, 29.9), (12.0, 29.9), (13.0, 30.0)):
        state = State(time_s, last={"spin_frequency_hz": spin})
        trend.take(state)
        shown.append(bench_lines(state, trend, 84, plain=True)[0][1:])
    assert shown == [(), (), (Piece("  12 s ago", "off"),), ()]


def test_a_drive_that_is_switched_makes_no_value_younger():
    trend = Trend()
    trend.take(replace(LOCKED, time_s=0.0))
    trend.take(replace(LOCKED, time_s=9.0, drive=Drive()))
    assert trend.changed_s == 0.0


def test_noise_stays_flat_in_the_spark_line_and_a_spin_down_fills_it():
    """0.05 Hz of noise at 30 Hz is a sixth of the least span, one of eight heights."""
    noise, fall = Trend("spin_frequency_hz"), Trend("spin_frequency_hz")
    for k in range(10):
        noise.answers.append((float(k), 30.0 + 0.025 * (-1) ** k))
        fall.answers.append((float(k), 30.0 - 0.1 * k))
    assert len(set(noise.spark)) <= 2
    assert (fall.spark[0], fall.spark[-1]) == ("█", "▁")
    noise.answers.extend((float(k), 0.0) for k in range(30))
    assert len(set(noise.spark)) == 1  # of values that are all zero


def test_a_field_of_zero_has_no_sign():
    assert "field 0.0000 mT" in texts(replace(LOCKED, last={"flux_density_t": -1e-9}))[0]


def test_without_the_characters_there_is_no_spark_line():
    first, *_, last = texts(LOCKED, plain=True)
    assert "▁" not in first
    assert last.startswith("###")


def test_while_the_bench_is_prepared_its_step_stands_beside_the_bar():
    state = State(5.0, text="drive at 30.50 Hz", share=0.5, drive=Drive())
    assert texts(state) == ["nothing counted yet", "drive off", "━" * 20 + "─" * 20 + "  drive at 30.50 Hz"]


def test_an_instrument_that_is_lost_is_an_alarm_and_its_settings_are_gone():
    line = bench_lines(replace(LOCKED, lost=("counter",)), Trend(), 80, plain=False)[-2]
    assert [piece.text for piece in line] == ["counter LOST", "  drive ON", "  31.20 Hz", "  10 Vpp SIN"]
    assert line[0].style == "alarm"


def test_a_drive_that_is_switched_off_begins_a_new_trend():
    trend = Trend()
    for k in range(5):
        trend.take(replace(LOCKED, time_s=float(k), last={"spin_frequency_hz": 30.0 + k}))
    assert trend.rate == pytest.approx(1.0)
    trend.take(replace(LOCKED, drive=Drive(), last={"spin_frequency_hz": 33.0}))
    assert (trend.rate, trend.spark) == (None, "")


def test_nothing_that_an_instrument_says_steers_the_terminal():
    state = replace(LOCKED, drive=Drive("\x1b[31m", 1.0, 1.0, 0.0, output=True), text="\x1b]0;x", share=0.2)
    assert "\x1b" not in "".join(texts(state))


@given(
    st.integers(10, 200),
    st.builds(
        State,
        time_s=st.floats(0, 1e6),
        elapsed_s=st.none() | st.floats(0, 1e6),
        time_left_s=st.none() | st.floats(0, 1e6),
        share=st.none() | st.floats(-1, 2),
        text=st.text(max_size=100),
        readings=st.integers(0, 10**7),
        last=st.dictionaries(st.sampled_from(["spin_frequency_hz", "flux_density_t"]), st.floats(-1e6, 1e6)),
        lost=st.lists(st.sampled_from(["counter", "oscilloscope"])).map(tuple),
        drive=st.none() | st.just(LOCKED.drive),
    ),
)
def test_no_line_is_wider_than_the_terminal(width, state):
    assert max(map(len, texts(state, width))) <= width

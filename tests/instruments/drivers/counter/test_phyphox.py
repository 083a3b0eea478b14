"""The phone as a counter: what it reads of its twin, and that no wrong answer becomes a number."""

import json
import re

import numpy as np
import pytest

from instruments.drivers.counter.phyphox import Phyphox, Saturated, TooFewSamples
from instruments.errors import (
    BadAnswer,
    CommandRefused,
    InstrumentError,
    NoAnswer,
    NotConnected,
    OutOfRange,
    SettingsLost,
    WrongInstrument,
)
from instruments.virtual.bench import faults
from instruments.virtual.bench.faults import Fault
from instruments.virtual.counter.phyphox import Sensor
from support.phones import Phone, turning

#: What an iPhone answers to /meta and /config: no sensors, the order of names is free.
IPHONE = {
    "deviceModel": "iPhone14,5",
    "deviceRelease": "18.6.2",
    "build": "17272",
    "version": "1.2.0",
    "deviceBrand": "Apple",
    "deviceManufacturer": None,
    "fileFormat": "1.19",
}


def test_a_phone_counts_the_top_beside_it():
    phone = Phone().prepared()
    assert phone.driver.frequency() == pytest.approx(30.0, abs=0.02)  # the step of the estimator
    found = phone.driver.last
    assert found.u == 0.01
    # three seconds of samples up to the last look, and looks each 0.1 s
    assert found.time == pytest.approx(phone.clock.now() - 1.55, abs=0.05)
    assert phone.driver.readings(2) == pytest.approx([30.0, 30.0], abs=0.02)


def test_a_count_has_the_benchs_time_to_the_age_of_a_sample():
    phone = Phone(sensor=Sensor(drift=0.0))
    phone.clock.sleep(5.0)
    phone.twin.start()
    began = phone.clock.now()
    phone.prepared().driver.frequency()
    # a sample is sent when it is 5 to 15 ms old, and half a message of 15 ms is not known
    assert 0 < phone.driver.clocks().offset - began < 0.02


def test_a_longer_gate_is_the_window():
    phone = Phone().prepared(gate_s=8.0)
    began = phone.clock.now()
    phone.driver.frequency()
    assert phone.clock.now() - began == pytest.approx(8.0, abs=0.2)  # messages of 15 ms, looks each 0.1 s
    assert phone.driver.last.time == pytest.approx(began + 4.0, abs=0.1)


def test_no_sample_from_before_it_was_prepared_is_used():
    phone = Phone().prepared()
    phone.clock.sleep(20.0)
    phone.prepared()
    began = phone.clock.now()
    phone.driver.frequency()
    assert phone.driver.last.time > began + 1.4


def test_where_no_moment_turns_there_is_no_reading():
    phone = Phone(turning(amplitude_t=0.0)).prepared()
    assert phone.driver.frequency() is None
    assert phone.driver.last is None


def test_an_app_that_a_hand_pauses_is_noticed_and_started_again():
    phone = Phone().prepared()
    phone.driver.frequency()
    phone.twin.pause()
    with pytest.raises(SettingsLost, match="measuring = False instead of True"):
        phone.driver.frequency()
    assert phone.driver.changed_settings() == {"measuring": (True, False)}
    assert phone.prepared().driver.frequency() == pytest.approx(30.0, abs=0.02)
    assert [event["event"] for event in phone.twin._time({})] == ["START", "PAUSE", "START"]


def test_another_experiment_in_the_app_is_noticed():
    phone = Phone().prepared()
    phone.driver.frequency()
    phone.twin.open_another("facade")
    with pytest.raises(SettingsLost, match="session = facade instead of c0ffee"):
        phone.driver.frequency()
    assert phone.prepared().driver.frequency() == pytest.approx(30.0, abs=0.02)


def test_a_gap_in_the_samples_is_told_and_a_long_one_is_no_reading():
    phone = Phone(lost=((1.0, 1.4), (10.0, 14.0))).prepared()
    assert phone.driver.frequency() == pytest.approx(30.0, abs=0.02)
    assert phone.driver.last.gaps == pytest.approx([0.4], abs=0.03)  # three samples
    phone.clock.sleep(13.0 - phone.clock.now())
    with pytest.raises(TooFewSamples, match=r"only \d+ samples .* keep phyphox in front and the screen on"):
        phone.driver.frequency()


def test_a_field_at_the_end_of_the_range_is_no_reading():
    phone = Phone(turning(base_t=5e-3))
    phone.driver.identity()
    with pytest.raises(Saturated, match=r"the end of the sensor's range, 4\.91 mT: move the phone away"):
        phone.prepared().driver.frequency()


def test_the_clocks_are_compared():
    phone = Phone(sensor=Sensor(drift=3e-4)).prepared()
    for _ in range(30):
        phone.driver.frequency()
        phone.clock.sleep(9.0)
    clocks = phone.driver.clocks()
    assert clocks.drift == pytest.approx(3e-4, abs=3 * clocks.drift_u)
    assert clocks.drift_u < 5e-5  # some 3 ms over 360 s, √12 times
    assert phone.driver.settings()["clock_drift"] == pytest.approx(clocks.drift, rel=0.2)


def test_folds_that_cannot_be_told_lengthen_the_first_window():
    windows = []

    def doubtful(times, field, *, near):
        windows.append(times[-1] - times[0])
        return type("Line", (), {"frequency": 30.0, "u": 0.01, "time": times.mean(), "folds": (70.0,)})

    phone = Phone(estimator=doubtful).prepared()
    phone.driver.frequency()
    assert windows == pytest.approx([3.0, 10.0], abs=0.2)
    assert phone.driver.last.folds == (70.0,)
    phone.driver.frequency()
    assert windows[2:] == pytest.approx([3.0], abs=0.2)


def test_only_a_magnetometer_with_all_axes_will_do():
    phone = Phone()
    phone.twin.open_another("1", {"localTitle": "Acceleration", "inputs": [{"source": "accelerometer"}]})
    with pytest.raises(BadAnswer, match=r"'Acceleration'.*open Magnetometer or levilab\.phyphox in the app"):
        phone.prepared()
    with pytest.raises(OutOfRange, match="channel = 2"):
        phone.driver.prepare(gate_s=1.0, trigger_level_v=0.6, channel=2)
    with pytest.raises(OutOfRange, match="gate_s = 0"):
        phone.driver.prepare(gate_s=0.0, trigger_level_v=0.6)


def test_the_app_is_stopped_at_the_end_where_this_program_has_started_it():
    phone = Phone().prepared()
    phone.driver.close()
    assert not phone.twin.measuring
    begun_by_hand = Phone()
    begun_by_hand.twin.start()
    begun_by_hand.prepared().driver.close()
    assert begun_by_hand.twin.measuring


# --- answers that are wrong ---


class Line:
    """A link that answers a question of this pattern with this text, others as the twin does."""

    def __init__(self, phone, pattern, text):
        self._inner, self._pattern, self._text = phone.driver.transport, pattern, text
        self.address, self.timeout = self._inner.address, 2.0

    def query(self, message, *, patience=0.0):
        true = self._inner.query(message, patience=patience)
        if not re.match(self._pattern, message):
            return true
        return self._text(true) if callable(self._text) else self._text

    def close(self):
        self._inner.close()


def changed(change):
    """A change of the JSON of an answer, as text → text."""

    def change_text(text):
        answer = json.loads(text)
        change(answer)
        return json.dumps(answer)

    return change_text


def with_buffer(name, change):
    """A change of the numbers of one buffer."""
    return changed(lambda answer: answer["buffer"][name].update(buffer=change(answer["buffer"][name]["buffer"])))


WRONG = {
    "cut": lambda text: text[: len(text) // 2],
    "nothing": "",
    "a page": "<!DOCTYPE html><title>A router</title>",
    "a list": "[]",
    "deep": "[" * 100_000,
    "words": with_buffer("magY", lambda old: [*old[:3], "12", *old[4:]]),
    "a number beyond": with_buffer("magZ", lambda old: [*old[:3], 10**400, *old[4:]]),
    "one value less": with_buffer("magX", lambda old: old[1:]),
    "times that go back": with_buffer("mag_time", lambda old: old[::-1]),
    "an axis of nulls": with_buffer("magZ", lambda old: [None] * len(old)),
    "no status": changed(lambda answer: answer.pop("status")),
    "no buffer": changed(lambda answer: answer.pop("buffer")),
    "no measuring": changed(lambda answer: answer["status"].update(measuring="yes")),
}


@pytest.mark.parametrize("kind", WRONG)
def test_no_wrong_answer_becomes_a_reading(kind):
    phone = Phone().prepared()
    phone.driver.transport = Line(phone, r".*magX=", WRONG[kind])
    began = phone.clock.now()
    with pytest.raises(InstrumentError):
        phone.driver.frequency()
    assert phone.clock.now() - began < 1.0 + 3.0 + 3.5  # gate, window, patience


@pytest.mark.parametrize("text", ["<html>", "[]", "{}", '{"version": 3, "deviceModel": "x", "fileFormat": "1"}'])
def test_another_server_is_no_phone(text):
    phone = Phone()
    phone.driver.transport = Line(phone, "/meta", text)
    with pytest.raises((WrongInstrument, BadAnswer), match="phyphox"):
        phone.driver.identity()


def test_an_iphone_says_less_of_itself():
    phone = Phone()
    phone.driver.transport = Line(phone, "/meta", json.dumps(IPHONE))
    assert phone.driver.identity() == "RWTH Aachen,phyphox,Apple iPhone14 5,1.2.0"


def test_an_app_that_does_not_start_refuses():
    phone = Phone()
    phone.driver.transport = Line(phone, "/control", '{"result": false}')
    with pytest.raises(CommandRefused, match="look at its screen"):
        phone.driver.prepare(gate_s=1.0, trigger_level_v=0.6)


@pytest.mark.parametrize(
    ("fault", "error"),
    [
        ("no answer", NoAnswer),
        ("late answer", NoAnswer),
        ("garbage before", BadAnswer),
        ("bytes that are no text before", BadAnswer),
        ("cut in the middle", NoAnswer),
        ("disconnected", NotConnected),
        ("away for 5 s", NotConnected),
    ],
)
def test_a_fault_of_the_link_costs_one_reading(fault, error):
    phone = Phone().prepared()
    phone.bench.faults.append(Fault(fault, question=r".*magX=.*"))
    with pytest.raises(error):
        phone.driver.frequency()
    phone.clock.sleep(5.0)
    assert phone.driver.frequency() == pytest.approx(30.0, abs=0.02)


@pytest.mark.parametrize("question", ["/meta", "/config", "/control"])
def test_a_phone_that_saves_power_answers_the_first_questions_late(question, monkeypatch):
    monkeypatch.setattr(faults, "LATE", 5.0)
    phone = Phone()
    phone.bench.faults.append(Fault("late answer", question=f".*{question}.*"))
    assert "phyphox" in phone.driver.identity()
    phone.driver.prepare(gate_s=1.0, trigger_level_v=0.6)
    assert phone.driver.frequency() == pytest.approx(30.0, abs=0.02)


@pytest.mark.parametrize("fault", ["garbage after", "two answers at once", "single bytes"])
def test_what_the_stated_length_sorts_out_costs_nothing(fault):
    phone = Phone().prepared()
    phone.bench.faults.append(Fault(fault, question=r".*magX=.*"))
    assert phone.driver.frequency() == pytest.approx(30.0, abs=0.02)


def test_without_an_estimator_there_is_no_frequency():
    with pytest.raises(TypeError, match="no estimator"):
        Phone(estimator=None).prepared().driver.frequency()


def test_the_numbers_are_in_tesla():
    seen = []

    def keep(_, field, *, near):
        seen.append(field)

    Phone(turning(amplitude_t=0.0), estimator=keep).prepared().driver.frequency()
    around = np.array([18.0, -31.0, -52.0]) * 1e-6
    # 0.5 µT over √300 samples, 5 s.d.
    np.testing.assert_allclose(seen[0].mean(axis=0), np.array([1e-3, 0.0, 1e-3]) + around, atol=2e-7)
    assert Phyphox.ESTIMATES

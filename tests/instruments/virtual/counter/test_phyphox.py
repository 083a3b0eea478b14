"""The virtual phone answers as the app's documentation says (remote interface, openapi.yaml 1.1.0)."""

import csv
import io
import json
import zipfile

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.virtual.counter.phyphox import Sensor, VirtualPhyphox
from support.phones import turning


class App:
    """A phone, and what a browser gets of it."""

    def __init__(self, seconds=2.0, **options):
        self.clock = VirtualClock()
        self.phone = VirtualPhyphox(self.clock, magnetic_field=turning(), **options)
        if seconds:
            self.get("/control?cmd=start")
            self.clock.sleep(seconds)

    def answer(self, target):
        head, _, body = self.phone.execute(f"GET {target} HTTP/1.1").data.partition(b"\r\n\r\n")
        return int(head.split()[1]), head.decode(), body

    def get(self, target):
        status, head, body = self.answer(target)
        assert status == 200
        assert f"Content-Length: {len(body)}" in head
        return json.loads(body)

    def buffer(self, query, name):
        return self.get(f"/get?{query}")["buffer"][name]


def test_an_empty_value_gives_the_last_one_full_gives_all():
    app = App()
    last, full = app.buffer("mag_time", "mag_time"), app.buffer("mag_time=full", "mag_time")
    assert (last["updateMode"], full["updateMode"]) == ("single", "full")
    assert last["buffer"] == full["buffer"][-1:]
    assert len(full["buffer"]) == pytest.approx(200, abs=2)
    assert last["size"] == 0  # as the experiment defines it: without a limit


def test_a_threshold_gives_what_is_newer_in_every_buffer_at_the_same_samples():
    app = App()
    times = app.buffer("mag_time=full", "mag_time")["buffer"]
    seen = times[49]
    answer = app.get(f"/get?mag_time={seen}&magX={seen}%7Cmag_time&nothing=full")
    assert answer["buffer"]["mag_time"] == {"size": 0, "updateMode": "partial", "buffer": times[50:]}
    assert len(answer["buffer"]["magX"]["buffer"]) == len(times) - 50
    assert set(answer["buffer"]) == {"mag_time", "magX"}  # one that does not exist is skipped


def test_a_threshold_may_be_above_the_values_of_the_buffer_itself():
    app = App()
    field = np.array(app.buffer("magX=full", "magX")["buffer"])
    assert len(app.buffer("magX=1020", "magX")["buffer"]) == np.sum(field > 1020.0001)


@pytest.mark.parametrize("query", ["mag_time=soon", "magX=1%7Cnothing"])
def test_a_request_that_makes_no_sense_is_answered_with_400(query):
    status, _, body = App().answer(f"/get?{query}")
    assert status == 400
    assert "error" in json.loads(body)


def test_the_status_says_whether_it_measures():
    app = App(seconds=0.0)
    assert app.get("/get?mag_time")["buffer"]["mag_time"]["buffer"] == [None]
    expected = {"session": "c0ffee", "measuring": False, "timedRun": False, "countDown": 0}
    assert app.get("/get?")["status"] == expected
    assert app.get("/control?cmd=start") == {"result": True}
    assert app.get("/get?")["status"]["measuring"] is True
    assert app.get("/control?cmd=dance") == {"result": False}


def test_clear_stops_and_drops_everything():
    app = App()
    assert app.get("/control?cmd=clear") == {"result": True}
    answer = app.get("/get?mag_time=full")
    assert answer["buffer"]["mag_time"]["buffer"] == []
    assert answer["status"]["measuring"] is False


def test_experiment_time_leaves_pauses_out_and_time_maps_it_to_the_clock():
    app = App()
    app.get("/control?cmd=stop")
    app.clock.sleep(100.0)
    app.get("/control?cmd=start")
    app.clock.sleep(1.0)
    times = np.array(app.buffer("mag_time=full", "mag_time")["buffer"])
    assert np.diff(times).max() < 0.05
    assert times[-1] == pytest.approx(3.0, abs=0.05)
    events = app.get("/time")
    assert [one["event"] for one in events] == ["START", "PAUSE", "START"]
    assert events[2]["experimentTime"] == events[1]["experimentTime"]
    assert events[2]["systemTime"] - events[1]["systemTime"] == pytest.approx(100.0, abs=0.05)


def test_numbers_have_eight_digits_as_the_app_prints_them():
    app = App()
    _, _, body = app.answer("/get?mag_time=full")
    assert b"E-1" in body
    assert b"e" not in body.partition(b"[")[2].partition(b"]")[0]


@pytest.mark.parametrize(
    ("number", "separator", "point"), [(1, ",", "."), (2, "\t", "."), (3, ";", "."), (4, "\t", ","), (5, ";", ",")]
)
def test_an_export_is_a_zip_of_tables(number, separator, point):
    _, head, body = App().answer(f"/export?format={number}")
    assert "application/zip" in head
    text = zipfile.ZipFile(io.BytesIO(body)).read("Raw Data.csv").decode()
    assert text.startswith('"Time (s)"' + separator + '"Magnetic Field x (µT)"')
    first, *rows = csv.reader(io.StringIO(text), delimiter=separator)
    assert len(first) == 5
    assert float(rows[99][0].replace(point, ".")) == pytest.approx(1.0, abs=0.01)


def test_what_it_does_not_have_is_not_found():
    app = App()
    assert app.get("/export?format=9") == {"error": "Format out of range."}
    assert app.answer("/elsewhere")[0] == 404
    assert b"405" in app.phone.execute("POST /set HTTP/1.1").data
    assert app.answer("/get?" + "&".join(f"b{k}" for k in range(200)))[0] == 400


def test_samples_are_those_of_a_sensor():
    sensor = Sensor()
    app = App(10.0)
    app.phone.start()  # it runs already
    rows = app.phone.samples(-1.0)
    steps = np.diff(rows[:, 0])
    assert steps.mean() == pytest.approx(0.01, rel=1e-3)
    assert steps.std() == pytest.approx(2**0.5 * sensor.jitter_s, rel=0.1)  # of 1000: 2 % is 1 s.d.
    clean = 1e6 * turning()(rows[:, 0] / (1 + sensor.drift)) + sensor.around_ut
    scatter = (rows[:, 1:4] - clean)[:, :2].std(axis=0)
    np.testing.assert_allclose(scatter, sensor.noise_ut, rtol=0.1)
    np.testing.assert_allclose(rows[:, 1:4] / sensor.resolution_ut, np.round(rows[:, 1:4] / sensor.resolution_ut))


def test_the_same_samples_come_however_they_are_asked_for():
    one, other = App(0.0), App(0.0)
    for app in (one, other):
        app.get("/control?cmd=start")
    got = []
    for _ in range(20):
        one.clock.sleep(0.37)
        answer = one.get(f"/get?mag_time={got[-1] if got else 0}")
        got += answer["buffer"]["mag_time"]["buffer"]
    other.clock.sleep(one.clock.now() - other.clock.now())
    assert got == other.buffer("mag_time=full", "mag_time")["buffer"]

"""Films of simulated tops, through a codec: place and spin against the simulator, and what is refused."""

import json
from dataclasses import replace
from importlib import util
from itertools import islice
from runpy import run_path

import numpy as np
import pytest

from analysis.uncertainty import Estimate
from levilab.animation.camera import (
    BASE,
    BESIDE,
    RIM,
    THICK,
    Camera,
    Pictures,
    film,
    flight_of,
    phone_times,
    write_film,
)
from levilab.errors import DataError, UsageError
from levilab.formats.film import open_film, pictures
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.inputs.files import data_files
from levilab.pipelines.options import VideoOptions
from levilab.pipelines.suits import save
from levilab.pipelines.video.leaning import rising_of
from levilab.simulator.scene import preset
from support.commands import command
from support.equal import differences
from support.flights import level_flight
from support.paths import SAMPLE_DATA

pytestmark = pytest.mark.skipif(util.find_spec("av") is None, reason="pip install 'levilab[video]'")

CAMERA = Camera()
LEVEL = level_flight(2.0, 31.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("films")


@pytest.fixture(scope="module")
def path(folder):
    """A second of a phone."""
    return film(folder / "IMG_0042.mp4", CAMERA, LEVEL, phone_times(1.0))


@pytest.fixture(scope="module")
def found(path):
    """What the analysis finds of that second."""
    return analyze_film(path, VideoOptions(rim_m=2 * RIM))


def analyze_film(path, options):
    """What the analysis finds of one film."""
    return ANALYSES["video"].analyze([path], options).runs[0]


def filmed(folder, name, take, times, **more):
    """A film of what is taken at each time."""
    shown = Pictures(CAMERA, LEVEL)
    return write_film(folder / name, (shown.noisy(take(shown, time)) for time in times), times, **more)


def compare(found, flight):
    """Errors of place [m], shape (2, n), less their means; and pulls of the readings of the spin."""
    x, y, _, _ = flight.at(found.time)
    errors = np.array([found.x - x, found.y - y])
    pulls = []
    for time, spin, u in zip(found.turning.time, found.turning.spin, found.turning.u, strict=True):
        near = np.abs(flight.times - time) < 0.5
        truth = np.polyfit(flight.times[near] - time, flight.yaw[near] / (2 * np.pi), 2)[1]
        pulls += [(abs(spin) - abs(truth)) / u]
    return errors - errors.mean(axis=1, keepdims=True), np.array(pulls)


def test_a_dot_on_the_stem_shows_the_precession_and_the_size_of_the_rim_the_rise(folder, path):
    level = level_flight(1.7, 31.0)
    lean = 0.02 * np.exp(2j * np.pi * 7.3 * level.times) + 0.01 * np.exp(2j * np.pi * 1.1 * level.times)
    rise = 2e-3 * np.sin(2 * np.pi * 1.3 * level.times)
    flight = replace(level, lean=np.stack([lean.real, lean.imag], axis=1), rise=rise)
    camera = Camera(stem=0.02, distance=0.4)
    stem = film(folder / "stem.mp4", camera, flight, phone_times(1.6)[::2])
    options = VideoOptions(rim_m=2 * RIM, stem_m=0.02, camera_m=0.47, height_m=0.07)
    video = ANALYSES["video"]
    analysis = video.analyze([stem], options)
    leaning, rising = analysis.runs[0].leaning, analysis.runs[0].rising
    assert leaning.precession == pytest.approx(7.3, abs=3 * leaning.u.max())
    assert leaning.middle.value == pytest.approx(7.3, abs=3 * leaning.middle.u)
    assert leaning.tilt.value == pytest.approx(0.02, rel=0.05)  # an edge is off by 0.3 pixels, the dot by a twentieth
    assert rising.swing.value == pytest.approx(1.3, abs=3 * rising.swing.u)
    assert rising.amplitude.value == pytest.approx(2e-3, abs=3 * rising.amplitude.u)
    assert np.std(rising.z - np.interp(analysis.runs[0].time, flight.times, rise)) < 4e-4  # 0.03 of 30 pixels at 0.4 m
    save(video, analysis)
    tracks = np.genfromtxt(folder / "stem.tracks.csv", delimiter=",", names=True)
    assert {"z_m", "axis_x", "axis_y"} <= set(tracks.dtype.names)
    without = analyze_film(path, VideoOptions(rim_m=2 * RIM, stem_m=0.02, stop_s=0.5))
    assert without.leaning is None
    assert "no dot is seen on the stem" in without.warnings[0]


def test_a_camera_beside_the_top_shows_place_height_lean_and_spin(folder):
    scene = run_path(str(SAMPLE_DATA / "make.py"))["TRACK_SCENE"]
    flight = flight_of(preset("undriven").changed({**scene, "start.spin_hz": 32.0}), 1.3)
    camera = Camera(pose=BESIDE, away=(5.3, -45), distance=0.4, blur=2.2)  # a mark near an end is in the edge there
    path = film(folder / "side.mp4", camera, flight, phone_times(1.2))
    video = ANALYSES["video"]
    analysis = video.analyze([path], VideoOptions(rim_m=2 * RIM, beside=True))
    (found,) = analysis.runs
    centre, body = flight.pose_at(found.time)
    middle = centre - THICK / 2 * body[:, :, 2]
    errors = np.array([found.x - middle[:, 0], found.y - middle[:, 2]])
    errors -= errors.mean(axis=1, keepdims=True)
    assert np.quantile(np.abs(errors), 0.99) < 1e-4
    assert (pulls := np.abs(errors / found.u.T)).max() < 4
    assert np.mean(pulls**2) == pytest.approx(1, abs=0.25)
    turns = np.abs(flight.yaw) / (2 * np.pi)
    truth = np.polyfit(flight.times - found.turning.middle, turns, 4)[3]
    assert found.spin.value == pytest.approx(truth, abs=min(4 * found.spin.u, 8e-3))
    assert "counter-clockwise seen from above" in found.text
    assert np.std(found.leaning.x - body[:, 0, 2] + body[:, 0, 2].mean()) < 2.5e-3  # rad: 0.1 of 30 pixels
    assert (lean := found.leaning.middle).value == pytest.approx(7.0, abs=3 * lean.u)  # from above 7.066 at 31.5 Hz
    save(video, analysis)
    columns = np.genfromtxt(folder / "side.tracks.csv", delimiter=",", names=True).dtype.names
    assert columns == ("time_s", "x_m", "x_u_m", "z_m", "z_u_m", "axis_x", "spin_frequency_hz")
    with pytest.raises(UsageError, match="goes with a camera above the top"):
        analyze_film(path, VideoOptions(rim_m=0.03, beside=True, stem_m=0.02))


def test_pictures_of_mjpeg_give_places_with_their_own_uncertainty(folder):
    path = film(folder / "camera.avi", CAMERA, LEVEL, phone_times(0.6), codec="mjpeg")
    found = analyze_film(path, VideoOptions(rim_m=2 * RIM))
    errors, _ = compare(found, LEVEL)
    assert np.abs(errors).max() < 3e-5  # a sixteenth of a pixel
    assert np.std(errors / found.u.T) == pytest.approx(1, abs=0.3)  # one factor serves all quantisers to 20 %


@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # of trackpy 0.7 with pandas 3
def test_opencv_and_trackpy_see_the_top_at_the_same_place(path, found):
    cv2, trackpy = (pytest.importorskip(name) for name in ("cv2", "trackpy"))
    scale, middle = found.scale.value, np.array(found.origin)
    places = scale * middle + np.array([found.x, -found.y]).T
    others = []
    for _, picture in islice(pictures(open_film(path)), 0, None, 6):
        _, bright = cv2.threshold(picture, 100, 255, cv2.THRESH_BINARY)
        edges, _ = cv2.findContours(bright, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        rim = max((edge for edge in edges if cv2.boundingRect(edge)[2] < 80), key=len)  # the base is wider
        of_rim = np.array(cv2.fitEllipse(rim)[0])
        left, up = corner = of_rim.astype(int) - 20
        hub = np.clip(110 - picture[up : up + 40, left : left + 40].astype(int), 0, 255).astype(np.uint8)
        others += [(of_rim, corner + trackpy.locate(hub, 17, topn=1)[["x", "y"]].to_numpy()[0])]
    off = scale * np.array(others) - places[::6, None]
    assert np.abs(off).max() < 1e-4  # 0.2 pixels; each of the three is within 0.07 mm of the truth


def test_the_base_and_the_rim_give_the_scale(path):
    for options in (
        VideoOptions(rim_m=2 * RIM, stop_s=0.45),
        VideoOptions(base_m=2 * BASE, stop_s=0.45),
        VideoOptions(base_m=2 * BASE / 0.95, camera_m=0.6, height_m=0.03, stop_s=0.45),
    ):
        scale = analyze_film(path, options).scale
        assert scale.value == pytest.approx(CAMERA.scale, abs=2 * scale.u)
        assert 0 < scale.u < 0.011 * scale.value
    (note,) = analyze_film(path, VideoOptions(base_m=0.1, stop_s=0.45)).warnings
    assert "nearer to the camera" in note


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"rim_m": 0.03, "scale_m": 1e-4}, "scale and rim are given"),
        ({"base_m": 0.1, "camera_m": 0.5}, "goes with `height`"),
        ({"rim_m": 0.03, "start_s": 2.0, "stop_s": 1.0}, "a time after `start` = 2"),
    ],
)
def test_options_that_do_not_go_together_are_refused(path, options, text):
    with pytest.raises(UsageError, match=text):
        analyze_film(path, VideoOptions(**options))


def hand(shown, time):
    picture = shown.take(time)
    if time > 0.6:
        picture[50:180, : int((time - 0.55) * 400)] = 150
    return picture


def moved(shown, time):
    return np.roll(shown.take(time), int(time > 0.5), axis=1)


def gone(shown, time):
    return shown.background if 0.3 < time < 0.34 or time > 0.6 else shown.take(time)


def test_a_hand_and_a_lost_top_end_the_track_where_they_are_seen(folder):
    for name, take, text in (("hand.mp4", hand, "as by a hand, after 0.51 s"), ("gone.mp4", gone, "lost after 0.59 s")):
        found = analyze_film(filmed(folder, name, take, phone_times(1.0)[::2]), VideoOptions(rim_m=0.03))
        assert text in found.warnings[0]
        assert found.time[-1] == pytest.approx(0.6, abs=0.11)  # a hand is looked for each 0.1 s
        assert found.spin.value == pytest.approx(31 - 0.05 * found.turning.middle, abs=5e-3)
    assert "no rim is seen in 5 pictures in between" in found.warnings[1]


@pytest.mark.parametrize(
    ("take", "text"),
    [
        (moved, r"background is shifted by \d\.\d pixels at 0\.[56]\d s .* the camera moved: put it on a stand"),
        (lambda shown, _: shown.background, "no top was found at the beginning: nothing changes"),
        (lambda shown, time: hand(shown, time + 0.35), "the top fills the picture|changes, and no circle|as by a hand"),
    ],
)
def test_a_film_that_shows_no_lone_top_is_refused(folder, take, text):
    with pytest.raises(DataError, match=rf"bad\.mp4: .*({text})"):
        analyze_film(filmed(folder, "bad.mp4", take, phone_times(0.7)[::2]), VideoOptions(rim_m=0.03))


def test_a_film_in_slow_motion_asks_for_its_rate(folder):
    def slowly(shown, time):
        return shown.take(time / 8)

    times = 8 * phone_times(0.45)
    said = filmed(folder, "slow.mp4", slowly, times, metadata={"com.android.capture.fps": "240.000000"})
    with pytest.raises(DataError, match=r"slow motion: its 30\.\d+ pictures .* taken at 240, .* say the true number"):
        analyze_film(said, VideoOptions(rim_m=0.03))
    found = analyze_film(said, VideoOptions(rim_m=0.03, rate=240.0))
    assert found.spin.value == pytest.approx(31 - 0.05 * found.turning.middle, rel=2e-3)  # mean rate of a piece
    again = write_film(folder / "unsaid.mp4", (picture for _, picture in pictures(open_film(said))), times)
    unsaid = analyze_film(again, VideoOptions(rim_m=0.03))
    assert unsaid.spin is None
    assert "if the film is in slow motion, the true `rate`" in unsaid.warnings[0]


def test_even_times_that_fold_the_spin_are_named_and_near_chooses(folder):
    path = filmed(folder, "thirty.mp4", Pictures.take, np.arange(30) / 30)
    analysis = ANALYSES["video"].analyze([path], VideoOptions(rim_m=0.03))
    (doubtful,) = analysis.runs
    assert doubtful.spin is None
    assert "30.97" in doubtful.warnings[0]
    assert pytest.approx(30.975, abs=0.01) in ANALYSES["video"].document(analysis, folder)["choices_hz"]
    assert analyze_film(path, VideoOptions(rim_m=0.03, near=31.0)).spin.value == pytest.approx(30.975, abs=5e-3)


def test_of_spins_that_look_the_same_the_one_that_slows_down_is_taken(folder):
    flight = level_flight(1.2, 31.0, chirp=-0.6)
    path = film(folder / "sixty.mp4", CAMERA, flight, np.arange(72) / 60)
    found = analyze_film(path, VideoOptions(rim_m=0.03))
    assert found.spin.value == pytest.approx(31 - 0.6 * found.turning.middle, abs=5e-3)
    (note,) = (note for note in found.warnings if "slows down" in note)
    assert "30.6" in note


@pytest.mark.usefixtures("drawn_figures")
def test_the_command_writes_tables_that_other_analyses_read(path, tmp_path):
    ended = command("analyze", "video", path, "--rim", 2000 * RIM, "--out", tmp_path, "--json", cwd=tmp_path)
    assert ended.status == 0, ended.err
    document = json.loads(ended.out)
    assert document["values"]["frequency"]["value"] == pytest.approx(30.975, abs=1e-3)
    assert document["values"]["pictures"]["value"] == 240
    tracks = np.genfromtxt(tmp_path / "IMG_0042.tracks.csv", delimiter=",", names=True)
    assert tracks.dtype.names == ("time_s", "x_m", "x_u_m", "y_m", "y_u_m", "spin_frequency_hz")
    assert np.diff(tracks["time_s"]) == pytest.approx(np.tile([1 / 300, 1 / 200], 120)[:-1], abs=2e-5)  # of the file
    assert (tmp_path / "IMG_0042.mp4.video.png").read_bytes()[:4] == b"\x89PNG"
    ended = command("analyze", "video", path, "--rim", 30, "--stop", 0.5, "--no-save", cwd=tmp_path)
    assert "30.987" in ended.out
    assert "121 pictures in 0.50 s, 3.33 to 5.00 ms apart" in " ".join(ended.out.split())


@pytest.mark.usefixtures("drawn_figures")
def test_a_film_is_recalled_from_its_result_and_reported_with_its_still(path, tmp_path):
    video, copy = ANALYSES["video"], tmp_path / path.name
    copy.write_bytes(path.read_bytes())
    found = video.analyze([copy], VideoOptions(rim_m=2 * RIM))
    assert {file.name.removeprefix("IMG_0042.") for file in save(video, found)} == {
        "mp4.result.video.json", "mp4.video.png", "tracks.csv", "spin.csv",
    }  # fmt: skip
    again = video.recall([copy])
    assert again.origins[0].text.startswith("as levilab analyze found it")
    assert differences(found.runs, again.runs) == []
    assert video.document(again, tmp_path) == video.document(found, tmp_path)
    ended = command("report", tmp_path, "-o", "page.html", cwd=tmp_path)
    assert ended.status == 0, ended.err
    assert "no sound" not in ended.err
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "A floating top, filmed" in page
    assert "Uncertainty budget" in page
    assert "levilab crosscheck video" in page
    assert 'xlink:href="data:image/png;base64' in page
    assert "Report of" not in page  # its tables are no further inputs


@pytest.mark.slow
def test_a_top_that_falls_has_its_spin_then_as_a_limit_that_others_read(folder):
    flight = level_flight(3.0, 22.0, chirp=-0.06)
    flight = replace(flight, yaw=flight.yaw + 0.06 * np.sin(np.pi * flight.times))  # its spin swings by 0.03 Hz
    shown, times = Pictures(CAMERA, flight), phone_times(2.9)[::2]
    path = write_film(
        folder / "falls.mp4", (shown.noisy(shown.take(t) if t < 2.6 else shown.background) for t in times), times
    )
    video = ANALYSES["video"]
    analysis = video.analyze([path], VideoOptions(rim_m=2 * RIM))
    fall, spin = analysis.runs[0].fall, analysis.runs[0].spin_at_fall
    assert fall.value == pytest.approx(2.6, abs=2 * fall.u)
    assert spin.value == pytest.approx(22 - 0.06 * 2.6, abs=3 * spin.u)
    assert max(fall.u, spin.u) < 0.04  # three readings of a spin that swings by 0.03 Hz
    turning = analysis.runs[0].turning
    swung = 22 - 0.06 * turning.time + 0.03 * np.cos(np.pi * turning.time)
    assert np.abs(turning.spin) == pytest.approx(swung, abs=2e-3)
    save(video, analysis)
    (limit,) = ANALYSES["limit"].analyze([folder / "falls.limit.csv"]).runs
    assert limit.statistics.mean.value == pytest.approx(spin.value)
    ANALYSES["spindown"].analyze([folder / "falls.spin.csv"])


def test_films_of_a_driven_top_are_a_sweep_of_the_drive(path, found, tmp_path):
    video, films = ANALYSES["video"], []
    for spin in (30.0, 32.0, 34.0, 37.0):
        turning = replace(found.turning, frequency=-spin, smooth=np.full_like(found.time, -spin))
        films += [replace(found, turning=turning, precession=Estimate(14.0 - 0.2 * spin, 0.01, "Hz"))]
    one = video.analyze([path], VideoOptions(rim_m=2 * RIM))
    names = {"films.precession.csv"}
    assert not names & video.files(replace(one, sources=4 * one.sources, runs=4 * one.runs)).keys()  # it slows down
    table = video.files(replace(one, sources=4 * one.sources, runs=tuple(films)))["films.precession.csv"]
    (tmp_path / "films.precession.csv").write_text(table)
    (tmp_path / "IMG_0042.spin.csv").write_text("")
    assert len(data_files(tmp_path)) == 2
    for name in ("IMG_0042.mp4", "result.video.json"):  # of several films
        (tmp_path / name).touch()
    assert [file.name for file in data_files(tmp_path)] == ["IMG_0042.mp4"]
    sweep = ANALYSES["precession"].analyze([tmp_path / "films.precession.csv"]).combined
    assert sweep.line.slope == pytest.approx(-0.2)
    assert sweep.column("drive") == pytest.approx([30, 32, 34, 37])


@pytest.mark.slow
def test_the_sample_film_has_the_places_and_spins_of_its_simulation():
    scene = run_path(str(SAMPLE_DATA / "make.py"))["TRACK_SCENE"]
    flight = flight_of(preset("undriven").changed({**scene, "start.spin_hz": 32.0}), 10.0)
    found = analyze_film(SAMPLE_DATA / "video" / "top.mp4", VideoOptions(rim_m=2 * RIM, line_time_s=10e-6))
    errors, pulls = compare(found, flight)
    assert np.abs(errors).max() < 1e-4
    assert np.mean(errors / found.u.T) == pytest.approx(0, abs=0.1)
    assert np.std(errors / found.u.T) == pytest.approx(1, abs=0.5)  # what a codec adds to a place is a constant of u
    assert np.abs(pulls.mean()) < 1.3  # 4 standard errors of a mean of 10
    assert np.std(pulls) < 1.9  # 4 of a standard deviation
    assert np.abs(pulls * found.turning.u).max() < 5e-3
    assert found.spin.value == pytest.approx(31.476264, abs=4 * found.spin.u)
    assert found.chirp.value == pytest.approx(-0.103583, abs=4 * found.chirp.u)
    assert found.precession.value == pytest.approx(7.0660, abs=4 * found.precession.u)
    assert "x stays within 1.07 mm and y within 1.06 mm" in found.text  # docs/video.md


def test_what_is_no_film_is_refused_in_one_line(path, tmp_path):
    (tmp_path / "a.csv").write_text("t,f\n1,2\n", encoding="utf-8")
    (tmp_path / "cut.mp4").write_bytes(path.read_bytes()[:3000])
    for name, text in (
        ("none.mp4", "there is no such file"),
        ("a.csv", "holds no film that can be read"),
        ("cut.mp4", "holds no film that can be read"),
    ):
        ended = command("analyze", "video", name, "--rim", 30, cwd=tmp_path)
        assert (ended.status, text in ended.err, ended.err.count("\n")) == (1, True, 1), ended.err


def test_the_beat_of_the_slow_swings_is_in_the_u_of_the_vertical_swing():
    random, times, pulls = np.random.default_rng(3), phone_times(3.0), []
    for _ in range(60):
        swing, beat = (np.cos(2 * np.pi * (hz * times + random.uniform())) for hz in (1.2, 1.45))
        found = rising_of(times, 3e-4 * swing + 8e-5 * beat + random.normal(0, 4e-5, times.size)).swing
        pulls.append((found.value - 1.2) / found.u)
    assert 0.5 < np.std(pulls) < 1.4  # 6.2 by the noise alone


def test_the_extra_is_asked_for_before_the_scale(path, monkeypatch):
    monkeypatch.setattr("levilab.formats.film.find_spec", lambda _: None)
    with pytest.raises(DataError, match="films need the extra video"):
        ANALYSES["video"].analyze([path])

"""`levilab simulate --animate` as a user runs it: what it writes, and what it refuses."""

import importlib.util
from pathlib import Path

import pytest
from PIL import Image

from levilab.animation import request
from support.commands import command

#: A twentieth of a second, in 20 pictures.
SHORT = ("simulate", "undriven", "--duration", "0.2", "--animate-to", "0.05")


def test_a_film_of_the_chosen_span_is_written(tmp_path):
    ended = command(*SHORT, "--animate", "films/top.gif", cwd=tmp_path)
    assert ended.status == 0
    shown = "the motion from 0 s to 0.05 s, at 1/20 of real speed"
    assert ended.err.splitlines()[-1] == f"wrote {Path('films/top.gif')}: {shown}"
    with Image.open(tmp_path / "films/top.gif") as film:
        assert film.n_frames == 21


def test_a_fall_is_what_is_shown_unless_a_span_is_given(tmp_path):
    words = ("simulate", "undriven", "--duration", "2", "--set", "start.spin_hz=20", "--json")
    ended = command(*words, "--animate", "fall.html", cwd=tmp_path)
    assert ended.status == 0
    assert '"animation": "fall.html"' in ended.out
    assert "to 0.2571 s, where it is lost" in (tmp_path / "fall.html").read_text(encoding="utf-8")
    long = ("simulate", "undriven", "--duration", "90", "--set", "start.spin_hz=20", "--animate-from", "0")
    ended = command(*long, "--animate-to", "90", "--animate", "fall.html", cwd=tmp_path)
    assert ended.status == 0  # the span up to the fall is short enough
    late = command(*words, "--animate", "late.html", "--animate-from", "1", cwd=tmp_path)
    assert late.status == 2
    assert "--animate-from 1: the top was lost after 0.2571 s already" in late.err
    assert [path.name for path in tmp_path.iterdir()] == ["fall.html"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--animate", "top.avi"), "--animate top.avi: the name of an animation ends in .html"),
        (("--animate-speed", "1"), "--animate-speed: it is of an animation: give --animate, too"),
        (("--animate", "a.gif", "--animate-from", "7"), "below the duration of 5 s is expected"),
        (("--animate", "a.gif", "--animate-from", "2", "--animate-to", "1"), "--animate-to 1: a time above 2 s"),
        (("--animate", "a.gif", "--animate-speed", "0"), "as 0.05 for a twentieth"),
        (("--animate", "a.html", "--set", "observed=spin"), "take observed = motion"),
    ],
)
def test_what_makes_no_sense_is_refused_before_anything_is_simulated(words, said, tmp_path, monkeypatch):
    monkeypatch.setattr("levilab.motion.simulation.simulate", None)
    ended = command("simulate", "undriven", "--duration", "5", *words, cwd=tmp_path)
    assert ended.status == 2
    assert said in " ".join(ended.err.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "longest"),
    [(("a.html", "--animate-to", "90"), "6"), (("a.gif", "--animate-to", "5", "--animate-speed", "0.01"), "1.5 s")],
)
def test_a_span_that_is_too_long_for_the_file_names_the_longest_one(words, longest, tmp_path):
    start = ("--duration", "90", "--animate-from", "0", "--animate")
    ended = command("simulate", "undriven", *start, *words, cwd=tmp_path)
    assert ended.status == 2
    assert f"choose a span of at most {longest}" in " ".join(ended.err.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "library", "extra"), [("a.html", "nicegui", ".[live]"), ("a.mp4", "imageio_ffmpeg", ".[video]")]
)
def test_a_missing_library_is_named_before_anything_is_simulated(name, library, extra, tmp_path, monkeypatch):
    found = importlib.util.find_spec
    for module in ("three", "film"):
        monkeypatch.setattr(
            f"levilab.animation.{module}.find_spec", lambda name: None if name == library else found(name)
        )
    monkeypatch.setattr("levilab.motion.simulation.simulate", None)
    ended = command("simulate", "undriven", "--animate", name, cwd=tmp_path)
    assert ended.status not in {0, 2}
    assert "pip install" in ended.err
    assert extra in ended.err
    assert "Traceback" not in ended.err


def test_ctrl_c_leaves_nothing(tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    film = request.FORMATS[".gif"]
    monkeypatch.setitem(request.FORMATS, ".gif", type(film)(**(vars(film) | {"encode": interrupted})))
    ended = command(*SHORT, "--animate", "top.gif", cwd=tmp_path)
    assert ended.status == 130
    assert "interrupted, no animation was written" in ended.err
    assert not list(tmp_path.iterdir())


def test_a_place_that_cannot_be_written_is_said_in_one_line(tmp_path):
    (tmp_path / "file").write_text("here", encoding="utf-8")
    ended = command(*SHORT, "--animate", "file/top.gif", cwd=tmp_path)
    assert ended.status not in {0, 2}
    assert "could not be written" in ended.err
    assert "--animate" in ended.err


def test_a_film_that_shows_a_turn_in_few_pictures_says_so(tmp_path):
    ended = command(*SHORT, "--animate", "top.gif", "--animate-speed", "1", cwd=tmp_path)
    assert ended.status == 0
    assert "0.7 pictures of each turn" in ended.err
    assert "with --animate-speed 0.1 it does not" in ended.err

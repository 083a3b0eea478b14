"""Sound of phones: every codec gives the WAV's frequency; what is no sound, or damaged, is refused in one line."""

import importlib.util
import subprocess
import sys

import numpy as np
import pytest

from analysis.pulses import spin_of_trace
from levilab.errors import DataError, DoesNotSuit
from levilab.formats.waveforms.record import read_record
from support.detector import coasting_turns, pulses, write_wav

ffmpeg = pytest.importorskip("imageio_ffmpeg", reason="pip install 'levilab[video]'").get_ffmpeg_exe()
RATE = 48_000
FILM = "-f lavfi -i testsrc=size=64x48:rate=10:duration=6"
#: Name of the file → how it is encoded.
CODECS = {
    "a.flac": "",
    "a.m4a": "-c:a aac -b:a 128k",
    "a.mp3": "-b:a 128k",
    "a.ogg": "-c:a libvorbis",
    "a.mp4": "-c:v mpeg4 -c:a aac",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("sound")


@pytest.fixture(scope="module")
def recording(folder):
    time = np.arange(6 * RATE) / RATE
    return write_wav(folder / "a.wav", 0.8 * pulses(coasting_turns(time)) - 0.1, RATE)


def encode(source, name, options, *, film=""):
    made = source.with_name(name)
    words = [ffmpeg, "-y", "-v", "error", *film.split(), "-i", str(source), *options.split(), "-shortest", str(made)]
    subprocess.run(words, check=True)
    return made


def spin(path):
    record = read_record(path)
    assert record.rate == RATE
    return spin_of_trace(record.samples(), record.rate)


@pytest.mark.parametrize("name", CODECS)
def test_a_codec_gives_the_frequency_of_the_wav(name, recording):
    found = spin(encode(recording, name, CODECS[name], film=FILM * name.endswith("mp4"))).at(3.0)
    truth = spin(recording).at(3.0)
    if name == "a.flac":  # the same samples
        assert found.value == truth.value
    assert abs(found.value - truth.value) < 4 * found.u  # benchmarks/sound_codecs.py has 40 records of each
    assert found.u < 1e-4


def test_channels_of_a_sound_are_left_and_right(recording):
    record = read_record(encode(recording, "two.flac", "-af aeval=val(0)|0.5*val(0)"))
    assert [signal.name for signal in record.signals] == ["left", "right"]
    assert record.samples("right") == pytest.approx(0.5 * record.samples("left"), abs=2 / 32768)
    assert record.count == 6 * RATE


def test_a_sound_may_end_before_the_reader_does_and_the_reader_before_it(recording):
    blocks = read_record(encode(recording, "a.flac", "")).blocks()
    assert len(next(blocks)) > 0
    blocks.close()  # FFmpeg is ended, not waited for: the test would hang


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"OggS" + bytes(500), "holds no sound that FFmpeg reads"),
        (b"\0\0\0\x20ftypM4A " + bytes(500), "holds no sound that FFmpeg reads"),
        (b"ID3\x04" + b"#EXTM3U\nhttp://127.0.0.1:9/a.mp3\n", "holds no sound that FFmpeg reads"),
    ],
)
def test_what_is_no_sound_is_refused_in_one_line(tmp_path, content, says):
    path = tmp_path / "a.m4a"
    path.write_bytes(content)
    with pytest.raises(DataError, match=says) as caught:
        read_record(path)
    assert "\n" not in str(caught.value)


def test_a_list_of_other_files_is_not_followed(tmp_path, recording):
    path = tmp_path / "list.m4a"
    path.write_text(f"ffconcat version 1.0\nfile {recording}\n", encoding="utf-8")
    with pytest.raises(DataError):
        read_record(path)


def test_a_film_without_sound_says_so(tmp_path):
    path = tmp_path / "film.mp4"
    subprocess.run([ffmpeg, "-v", "error", *FILM.split(), "-c:v", "mpeg4", str(path)], check=True)
    with pytest.raises(DoesNotSuit, match=r"film\.mp4: holds no sound: levilab analyze video"):
        read_record(path)


def test_a_sound_that_was_cut_short_says_what_ffmpeg_found(recording, tmp_path):
    whole = encode(recording, "a.flac", "").read_bytes()
    path = tmp_path / "cut.flac"
    path.write_bytes(whole[: len(whole) // 2] + bytes(1000) + whole[len(whole) // 2 + 1000 :])
    assert "FFmpeg found damage" in read_record(path).warnings[0]


def test_sound_without_the_extra_is_refused_with_what_to_do(recording, monkeypatch):
    made = encode(recording, "a.flac", "")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(DoesNotSuit, match=r"is a sound file or film: the extra video .*\[video\].* or make it a WAV"):
        read_record(made)

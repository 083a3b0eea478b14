"""Sound of phones and recorders, m4a, mp3, ogg, flac and the sound track of a film, through FFmpeg, an extra."""

import contextlib
import os
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from importlib import util
from pathlib import Path
from typing import IO

import numpy as np

from analysis.arrays import Array
from levilab.formats.columns import NoTable, TableError, shorten
from levilab.formats.film import NoFilm, open_film
from levilab.formats.kinds import AUDIO
from levilab.formats.waveforms.wav import signals_of
from levilab.formats.waveforms.waveform import BLOCK, Waveform, check_count
from levilab.software import how_to_install
from levilab.texts.text import Text

#: What a file may be, in FFmpeg's names: no list of other files, no address, no script.
_FORMATS = "mov,mp4,m4a,3gp,3g2,mj2,mp3,ogg,flac,aac,amr,aiff,caf,matroska,webm,asf,avi"
#: Sun's .au begins with marks, place of the samples, their bytes, kind, rate and channels, each of four bytes: a head
#: that needs no length, so that it goes through a pipe.
_AU_HEAD = 24
#: Problem with a film without a sound track, and what to do.
_SILENT = "holds no sound: levilab analyze video, with the `rim` of the top, follows it in the pictures of a film"
#: Bytes of a sample.
_FLOAT = 4


def read_audio(path: Path) -> Waveform:
    """Read a sound file in parts of full scale, each channel by itself, at its own rate.

    It is decoded once for its length, and again for the samples of a channel, in memory that does not grow with it.

    Raises:
        NoTable: the extra is not installed, or it is a film without sound.
        TableError: it is damaged.
    """
    if not _is_installed():
        kind = replace(AUDIO, advice=advice_on_sound())
        raise NoTable(path, "is {kind}: {advice}", kind.name, kind.advice, kind=kind)
    errors: list[str] = []
    count, rate = 0, 0
    with _decoded(path, errors) as stream:
        head = _read_whole(stream, _AU_HEAD)
        if head[:4] == b".snd":
            offset, rate, channels = (int.from_bytes(head[k : k + 4], "big") for k in (4, 16, 20))
            size = _FLOAT * channels
            count = (sum(map(len, iter(lambda: stream.read(BLOCK), b""))) - (offset - _AU_HEAD)) // size
    if not rate:
        raise NoTable(path, _SILENT)
    check_count(path, count)

    def read(signal: int) -> Iterator[Array]:
        with _decoded(path, []) as stream:
            _read_whole(stream, offset)
            while block := _read_whole(stream, BLOCK * size):
                whole = np.frombuffer(block[: len(block) // size * size], ">f4").reshape(-1, channels)
                yield whole[:, signal].astype(np.float64)

    said = "{name:s}: FFmpeg found damage ({what:s}): if a piece is missing, frequencies are wrong"
    damage = tuple(Text(said, path.name, text) for text in errors)
    return Waveform(path, "sound file", 0.0, 1 / rate, count, signals_of(channels), read, damage)


def _is_installed() -> bool:
    return util.find_spec("imageio_ffmpeg") is not None


def advice_on_sound() -> str:
    """Return what to do with a sound file, with the extra and without."""
    if _is_installed():
        return AUDIO.advice
    said = (
        "the extra video (imageio-ffmpeg, which is not installed) reads it: {how}; or make it a WAV with Audacity "
        "(File, Export Audio) or by ffmpeg -i sound.m4a sound.wav"
    )
    return Text(said, how_to_install("video"))


def _read_whole(stream: IO[bytes], size: int) -> bytes:
    """Return the given number of bytes of a pipe, fewer at its end alone."""
    parts, left = [], size
    while left and (part := stream.read(left)):
        parts.append(part)
        left -= len(part)
    return b"".join(parts)


@contextlib.contextmanager
def _decoded(path: Path, errors: list[str]) -> Iterator[IO[bytes]]:
    """Give the first sound track as .au of 32-bit floats.

    Args:
        path: the file.
        errors: where the first error in a file that was read to its end goes.

    Raises:
        NoTable: it is a film without sound.
        TableError: it is damaged, or FFmpeg cannot be started.
    """
    import imageio_ffmpeg

    before = f"-nostdin -v error -protocol_whitelist file,pipe -format_whitelist {_FORMATS} -i"
    after = "-map 0:a:0 -vn -sn -dn -c:a pcm_f32be -f au pipe:1"
    with tempfile.TemporaryFile() as said:  # a pipe that fills up would stop FFmpeg
        try:
            command = [imageio_ffmpeg.get_ffmpeg_exe(), *before.split(), f"file:{os.fspath(path)}", *after.split()]
            decoder = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=said)  # noqa: S603
        except (OSError, RuntimeError) as error:
            raise TableError(path, "needs FFmpeg, which does not start: convert it to WAV") from error
        assert decoder.stdout
        whole = False
        try:
            yield decoder.stdout
            whole = not decoder.stdout.read(1)
        finally:
            decoder.stdout.close()
            if not whole:  # the reader has enough, or failed
                decoder.kill()
            decoder.wait()
        said.seek(0)
        lines = said.read(2000).decode(errors="replace").strip().splitlines()
    if whole and decoder.returncode:
        with contextlib.suppress(NoFilm):
            open_film(path)
            raise NoTable(path, _SILENT)
        raise TableError(path, "holds no sound that FFmpeg reads: convert it to WAV with Audacity")
    errors += [shorten(line, 100) for line in lines[:1]] if whole else []

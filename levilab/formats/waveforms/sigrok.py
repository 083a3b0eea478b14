"""Captures of sigrok and PulseView (.sr): a ZIP of levels and voltages of 200 kinds of logic analysers and scopes.

The format: https://sigrok.org/wiki/File_format:Sigrok/v2.  Levels are bits of `unitsize` bytes a sample, in logic-1-1,
logic-1-2 and so on; voltages are floats, in analog-1-N-1 and so on, N the number of the channel.
"""

import configparser
import re
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.arrays import Array
from levilab.formats.columns import TableError, shorten
from levilab.formats.waveforms.waveform import BLOCK, Signal, Waveform, check_count, check_step

#: Name of the files that each capture has, and how large the second may be [bytes].
_MEMBERS, _LARGEST_METADATA = {"version", "metadata"}, 1 << 20
#: A capture that unpacks to more is refused [bytes]: at 1 MS/s that is an hour of eight levels.
MOST_BYTES = 1 << 32
_AGAIN = "save it again with PulseView, or export CSV"
_RATE = re.compile(r"([\d.]+) ?([kMG]?)(?:Hz)?")


@dataclass(frozen=True)
class _Channel:
    """Members of the ZIP in order, bytes of a sample in them, and the number of its bit; None: they are floats."""

    signal: Signal
    members: tuple[str, ...]
    size: int
    bit: int | None = None


def is_sigrok(path: Path) -> bool:
    """Return whether a ZIP is a capture of sigrok's.  Raises OSError."""
    try:
        with zipfile.ZipFile(path) as archive:
            return set(archive.namelist()) >= _MEMBERS
    except (zipfile.BadZipFile, ValueError, NotImplementedError):
        return False


def read_sigrok(path: Path) -> Waveform:
    """Read a capture.  It is unpacked in pieces, a channel at a time.

    Raises:
        TableError: it is damaged, or unpacks to more than 4 GiB.
        OSError: it cannot be read.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            sizes = {info.filename: info.file_size for info in archive.infolist()}
            if sizes["metadata"] > _LARGEST_METADATA:
                raise TableError(path, "its metadata has {n} bytes: {again}", sizes["metadata"], _AGAIN)
            device = _device(archive.read("metadata").decode("utf-8", errors="replace"))
        if sum(sizes.values()) > MOST_BYTES:
            what = "unpacks to {size:.1f} GB, at most {most:.1f} GB are read: record at 20 kHz, plenty for a top"
            raise TableError(path, what, sum(sizes.values()) / 1e9, MOST_BYTES / 1e9)
        channels = _channels(device, sizes)
        rate = _RATE.fullmatch(device.get("samplerate", ""))
    except (zipfile.BadZipFile, zlib.error, configparser.Error, ValueError, NotImplementedError, RuntimeError) as error:
        raise TableError(path, "is no capture that can be read: {again}", _AGAIN) from error
    if not channels:
        raise TableError(path, "holds no channel with samples: {again}", _AGAIN)
    if rate is None:
        said = shorten(device.get("samplerate", ""))
        raise TableError(path, "says a sample rate of '{rate:s}': {again}", said, _AGAIN)
    step = 1 / (max(float(rate[1]), 1e-99) * {"": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}[rate[2]])
    count = min(sum(sizes[name] for name in channel.members) // channel.size for channel in channels)
    check_count(path, count)
    check_step(path, step)

    def read(signal: int) -> Iterator[Array]:
        left = count
        for block in _unpack(path, channels[signal]):
            yield block[:left]
            left -= min(block.size, left)

    return Waveform(path, "sigrok capture", 0.0, step, count, tuple(channel.signal for channel in channels), read)


def _device(metadata: str) -> Mapping[str, str]:
    """Return what the metadata say of the first device."""
    parser = configparser.ConfigParser(interpolation=None, strict=False)
    parser.read_string(metadata)
    return parser["device 1"] if parser.has_section("device 1") else {}


def _channels(device: Mapping[str, str], sizes: Mapping[str, int]) -> list[_Channel]:
    """Return the channels that have samples, levels first."""
    channels = []
    levels = _in_order(device.get("capturefile", "logic-1"), sizes)
    size = max(int(device.get("unitsize", "1")), 1)
    for key, name in device.items():
        found = re.fullmatch(r"(probe|analog)(\d{1,6})", key)
        kind, number = found.groups() if found else ("", "0")
        if kind == "probe" and levels and 0 < int(number) <= 8 * size:
            channels.append(_Channel(Signal(shorten(name), "logic"), levels, size, int(number) - 1))
        elif kind == "analog" and (members := _in_order(f"analog-1-{number}", sizes)):
            channels.append(_Channel(Signal(shorten(name)), members, 4))
    return channels


def _in_order(stem: str, names: Mapping[str, int]) -> tuple[str, ...]:
    """Return the pieces of a channel: logic-1-1, logic-1-2, …, or logic-1 alone."""
    numbers = sorted(
        int(name[len(stem) + 1 :]) for name in names if re.fullmatch(rf"{re.escape(stem)}-\d{{1,9}}", name)
    )
    return tuple(f"{stem}-{n}" for n in numbers) or ((stem,) if stem in names else ())


def _unpack(path: Path, channel: _Channel) -> Iterator[Array]:
    """Yield the samples of a channel in blocks; a sample may go on in the next member.  Raises TableError."""
    rest = b""
    try:
        with zipfile.ZipFile(path) as archive:
            for member in channel.members:
                with archive.open(member) as stream:
                    while piece := stream.read(BLOCK * channel.size):
                        piece = rest + piece
                        whole = len(piece) // channel.size * channel.size
                        rest = piece[whole:]
                        if whole:
                            yield _numbers(path, piece[:whole], channel)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise TableError(path, "is damaged: {again}", _AGAIN) from error


def _numbers(path: Path, piece: bytes, channel: _Channel) -> Array:
    if channel.bit is not None:
        of_bit = np.frombuffer(piece, np.uint8).reshape(-1, channel.size)[:, channel.bit // 8]
        return (of_bit >> (channel.bit % 8) & 1).astype(np.float64)
    volts = np.frombuffer(piece, "<f4").astype(np.float64)
    if not bool(np.isfinite(volts).all()):
        raise TableError(path, "has samples of {name:s} that are no numbers: {again}", channel.signal.name, _AGAIN)
    return volts

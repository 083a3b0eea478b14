"""The way to a sound card by PortAudio, through sounddevice: samples as they come.

An address is ``sound://``, the system's default input, or ``sound://NAME?rate=48000``, where NAME is a part of the
input's name, or its number in the list of `levilab bench check`.
"""

import contextlib
import queue
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol
from urllib.parse import parse_qsl, unquote

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock, WallClock
from instruments.errors import NoAnswer, NotConnected, OutOfRange
from instruments.ieee488 import BlockForm
from instruments.links.advice import CLOSED, one_line
from instruments.links.transport import TrafficLog

Samples = NDArray[np.int16]
#: Samples that came together, shape (n, channels); when they came, on the clock of the bench [s]; and whether samples
#: just before these were lost, as far as the library knows.
Block = tuple[Samples, float, bool]

#: Two channels are left and right of a stereo jack; and the rate that is taken unless another is named [1/s].
MOST_CHANNELS, USUAL_RATE = 2, 48_000.0
_EXTRA = "sound cards need the extra `sound`: pip install 'levilab[sound]'"
_PORTAUDIO = "PortAudio is missing (on Debian and Ubuntu: sudo apt install libportaudio2)"
#: PortAudio's numbers for a sample rate that the input does not have, and for an input that another program holds.
_INVALID_RATE, _UNAVAILABLE = -9997, -9985


class SoundInput(Protocol):
    """An input that is open: the end of a sound card that faces the program.

    Attributes:
        identity: its answer to ``*IDN?``.
        rate: nominal samples per second [1/s].
        channels: their number.
    """

    identity: str
    rate: float
    channels: int

    def start(self) -> None:
        """Begin to sample."""

    def read(self, within: float) -> Block | None:
        """Return the next samples; None where none come within this time [s]."""

    def stop(self) -> None:
        """End sampling, and drop what was not read."""

    def close(self) -> None:
        """Give the input back."""


@dataclass(frozen=True)
class InputDevice:
    """An input that the system has.

    Attributes:
        number: by which it can be named.
        name: as the system has it.
        host: the system's interface through which it is reached.
        channels: their number.
        rate: samples per second that are its own [1/s].
        is_default: whether the system takes it unless another is named.
    """

    number: int
    name: str
    host: str
    channels: int
    rate: float
    is_default: bool


def _name_and_rate(address: str) -> tuple[str, float | None]:
    """Return the name or number that an address asks for, and the rate [1/s], None for the input's own.

    Raises NotConnected.
    """
    name, _, query = address.partition("://")[2].partition("?")
    keys = dict(parse_qsl(query, keep_blank_values=True))
    rate = keys.pop("rate", None)
    if keys or not re.fullmatch(r"\d{4,6}", rate or "48000"):
        raise NotConnected(address, "expected sound://NAME?rate=48000, with a rate from 1000 to 999999 Hz")
    return unquote(name).strip("/").strip(), None if rate is None else float(rate)


class SoundLink:
    """The link to a sound card; see :class:`instruments.links.transport.Transport`.

    It carries samples, by its `input`, and no messages but ``*IDN?``.
    """

    def __init__(
        self,
        address: str,
        *,
        library: Any = "@py",
        timeout: float = 2.0,
        clock: Clock | None = None,
        log: TrafficLog | None = None,
    ) -> None:
        """Open the input; library: that of a virtual bench, any other has no meaning.  Raises NotConnected."""
        self.address, self.timeout = address, timeout
        self._clock: Clock = clock or WallClock()
        self._bench = getattr(library, "bench", None)
        self._closed = False
        self.input = self._open()

    def _open(self) -> SoundInput:
        if self._bench is None:
            return _Microphone(self.address, self._clock)
        twin = next((one for name, one in self._bench.instruments.items() if name == self.address), None)
        if twin is None or not self._bench.reachable(twin):
            raise NotConnected(self.address, "the virtual bench has no such input")
        found: SoundInput = twin.open_input()
        return found

    def query(self, message: str, *, patience: float = 0.0) -> str:
        """Return the identity.  Raises NoAnswer for any other question."""
        if self._closed:
            raise NotConnected(self.address, CLOSED)
        if message != "*IDN?":
            raise NoAnswer(self.address, message, 0.0)
        return self.input.identity

    def query_block(self, message: str, *, patience: float = 0.0, form: BlockForm | None = None) -> bytes:
        """Raise NoAnswer: a sound card takes no messages."""
        raise NoAnswer(self.address, message, 0.0)

    def write(self, message: str) -> None:
        """Drop a message: a sound card takes none."""

    def clear(self) -> None:
        """Drop what is under way."""
        self.input.stop()

    def reopen(self) -> None:
        """Open the input again, where it may have been plugged in again.  Raises NotConnected."""
        if self._closed:
            raise NotConnected(self.address, CLOSED)
        with contextlib.suppress(Exception):
            self.input.close()
        if self._bench is None:
            _look_again()
        self.input = self._open()

    def lock(self) -> None:
        """Do nothing: several programs can listen to an input."""

    def close(self) -> None:
        """Close the input."""
        if not self._closed:
            self._closed = True
            with contextlib.suppress(Exception):  # it may be gone
                self.input.close()


class _Microphone:
    """An input of this computer, by PortAudio; see :class:`SoundInput`."""

    def __init__(self, address: str, clock: Clock) -> None:
        sd = _sounddevice(address)
        name, rate = _name_and_rate(address)
        device = choose_input(address, name, inputs(address))
        self._address, self._clock, self._came = address, clock, queue.SimpleQueue[Block]()
        self.channels = min(device.channels, MOST_CHANNELS)
        self.rate = rate or self._usual_rate(device)
        text = re.sub(r"[,\s]+", " ", f"{device.host},{device.name}".replace(",", "\0")).split("\0", 1)
        version = sd.get_portaudio_version()[1].partition(",")[0]
        self.identity = f"{text[0]},sound,{text[1]},{version}"
        try:
            self._stream = sd.RawInputStream(
                samplerate=self.rate,
                device=device.number,
                channels=self.channels,
                dtype="int16",
                latency="high",
                callback=self._take,
            )
        except sd.PortAudioError as error:
            number = error.args[1] if len(error.args) > 1 else None
            if number == _INVALID_RATE:
                raise OutOfRange(address, "rate", self.rate, f"{device.rate:g}, the input's own") from error
            why = "another program has it, or it is gone" if number == _UNAVAILABLE else one_line(error)
            raise NotConnected(address, f"{device.name} cannot be opened ({why}): {_LOOK}") from error

    def _usual_rate(self, device: InputDevice) -> float:
        """Return 48 kHz, the rate of most converters, or the one that the system names where it does not have that."""
        sd = _sounddevice(self._address)
        with contextlib.suppress(sd.PortAudioError):
            sd.check_input_settings(device.number, self.channels, "int16", samplerate=USUAL_RATE)
            return USUAL_RATE
        return device.rate

    def _take(self, data: Any, frames: int, _times: Any, status: Any) -> None:
        """Keep what the sound card gives; PortAudio calls this from a thread of its own."""
        samples = np.frombuffer(bytes(data), dtype=np.int16).reshape(frames, self.channels)
        self._came.put((samples, self._clock.now(), bool(status.input_overflow)))

    def start(self) -> None:
        """Begin to sample; see :class:`SoundInput`.  Raises NotConnected."""
        try:
            self._stream.start()
        except Exception as error:
            raise NotConnected(self._address, f"does not begin to sample ({one_line(error)}): {_LOOK}") from error

    def read(self, within: float) -> Block | None:
        """Return the next samples; see :class:`SoundInput`."""
        try:
            return self._came.get(timeout=within)
        except queue.Empty:
            return None

    def stop(self) -> None:
        """End sampling; see :class:`SoundInput`."""
        with contextlib.suppress(Exception):  # the input may be gone
            self._stream.abort()
        with contextlib.suppress(queue.Empty):
            while True:
                self._came.get_nowait()

    def close(self) -> None:
        """Give the input back; see :class:`SoundInput`."""
        self._stream.close(ignore_errors=True)


_LOOK = "`levilab bench check --scope sound` lists the inputs"


def inputs(address: str = "sound://") -> tuple[InputDevice, ...]:
    """Return the inputs of this computer.  Raises NotConnected where PortAudio or its Python library is missing."""
    sd = _sounddevice(address)
    hosts, default = sd.query_hostapis(), sd.default.device[0]
    if default < 0:
        default = next((host["default_input_device"] for host in hosts if host["default_input_device"] >= 0), -1)
    return tuple(
        InputDevice(
            number,
            device["name"],
            hosts[device["hostapi"]]["name"],
            device["max_input_channels"],
            device["default_samplerate"],
            number == default,
        )
        for number, device in enumerate(sd.query_devices())
        if device["max_input_channels"] > 0
    )


def choose_input(address: str, name: str, there: Sequence[InputDevice]) -> InputDevice:
    """Return the input that a name means: a number, or a part of a name in any case; empty: the default.

    Of several the one of the default's interface is taken, as Windows lists each input once an interface.
    Raises NotConnected.
    """
    if not there:
        raise NotConnected(address, "this computer has no sound input: plug a microphone or a USB sound card in")
    found = [one for one in there if (one.is_default if not name else str(one.number) == name)]
    found = found or [one for one in there if name.casefold() in one.name.casefold()]
    hosts = {one.host for one in there if one.is_default}
    same = [one for one in found if one.name.casefold() == name.casefold()] or found
    same = [one for one in same if one.host in hosts] or same
    if name and len(same) != 1:
        listed = "; ".join(f"{one.number}: {one.name} ({one.host})" for one in found or there)
        what = f"several inputs have {name!r} in their name" if found else f"no input has {name!r} in its name"
        raise NotConnected(address, f"{what}: name one of {listed}")
    return same[0]


def _sounddevice(address: str) -> Any:
    """Return the library.  Raises NotConnected."""
    try:
        import sounddevice
    except ImportError as error:
        raise NotConnected(address, _EXTRA) from error
    except OSError as error:
        raise NotConnected(address, _PORTAUDIO) from error
    return sounddevice


def _look_again() -> None:
    """Let PortAudio list the devices again, as it keeps the list that it made at first."""
    import sounddevice

    sounddevice._terminate()
    sounddevice._initialize()

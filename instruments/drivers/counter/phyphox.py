"""The driver of phyphox, an app that reads a phone's magnetometer: the top's tilted moment turns past the phone."""

import contextlib
import json
import math
import re
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock, WallClock
from instruments.drivers import Value
from instruments.drivers.counter import Count, Signal
from instruments.errors import BadAnswer, CommandRefused, InstrumentError, OutOfRange, SettingsLost, WrongInstrument
from instruments.links.transport import Transport

Array = NDArray[np.float64]

#: The app measures in µT.
_T_PER_UT = 1e-6
#: The components of the magnetometer, the time first.
_COMPONENTS = ("t", "x", "y", "z")
#: The settings that stay as they are, while the comparison of the clocks goes on.
_STEADY = ("experiment", "session", "measuring", "gate_s")
#: Time between two looks at samples that still have to come [s], and how much longer than the gate they may take.
_LOOK_EVERY_S, _PATIENCE_S = 0.1, 3.0
#: How much longer than other answers those at the start may take: a phone that saves power answers late at first [s].
_ASLEEP_S = 6.0
#: Shortest window of samples [s]: 20 cm beside the base the line's 0.2 to 0.4 µT stand out of 0.5 µT of noise then, and
#: its frequency is known to 15 mHz; the window where its folds at the sampling rate cannot be told from each other.
_WINDOW_S, _LONGER_S = 3.0, 10.0
#: Fewest samples that can be analyzed.
_FEWEST = 64
#: A pause in the samples is a gap where it is this multiple of the usual interval; samples must fill this share of the
#: window.
_GAP, _LEAST_FILLED = 5.0, 0.5
#: Number of answers that are compared for the difference of the clocks, and for the difference of their rates.
_RECENT, _COMPARED = 6, 4096
#: Share of its range from which a sensor is at its end.
_END_OF_RANGE = 0.999

_OPEN = "open Magnetometer or levilab.phyphox in the app, and allow the remote access again"
_WAKE = "keep phyphox in front and the screen on, and the phone near the Wi-Fi"


@dataclass(frozen=True)
class FieldLine:
    """The line that a turning moment makes in the field.

    Attributes:
        frequency: [Hz].
        u: its standard uncertainty [Hz].
        time: at which it holds [s].
        folds: other frequencies that it may have, as samples at this rate cannot tell [Hz].
    """

    frequency: float
    u: float
    time: float
    folds: tuple[float, ...] = ()


class Estimator(Protocol):
    """What finds the spin in a field; an analysis, which drivers do not know."""

    def __call__(self, times: Array, field: Array, *, near: float | None) -> FieldLine | None:
        """Return the line; None where there is none.

        Args:
            times: of the samples, shape (n,) [s].
            field: shape (n, 3) [T].
            near: the last frequency [Hz].
        """


class TooFewSamples(InstrumentError):
    """The phone sends no samples, or too few.  seen: number; within: time that was waited [s]."""

    def __init__(self, address: str, seen: int, within: float) -> None:
        self.seen, self.within = seen, within
        super().__init__(address, f"only {seen} samples of the magnetometer in {within:.2g} s: {_WAKE}")


class Saturated(InstrumentError):
    """The field is beyond the sensor's range.  range_t: its end [T]."""

    def __init__(self, address: str, range_t: float) -> None:
        self.range_t = range_t
        super().__init__(
            address, f"the field is at the end of the sensor's range, {1e3 * range_t:.3g} mT: move the phone away"
        )


@dataclass(frozen=True)
class ClockComparison:
    """The phone's clock beside the bench's.

    Attributes:
        offset: bench time − experiment time of the app [s]; too large by the age of a sample that is sent, some 10 ms.
        drift: by which the phone's clock goes faster, relative; None before there is enough to compare.
        drift_u: its standard uncertainty.
    """

    offset: float
    drift: float | None
    drift_u: float | None


class Phyphox:
    """phyphox 1.1.8 or newer with the remote access allowed and an experiment with the magnetometer open.

    Sources: the app's documentation, remote-interface communication (openapi.yaml, 1.1.0) and file format; the server
    of its Android version, RemoteServer.java; phyphox-py 0.0.  What decides whether a spin is counted right:

    - Numbers have eight significant digits: after 1000 s the times have steps of 0.1 ms.
    - The times are the app's, from the first start of the experiment, pauses left out; so a pause is another start.
    - A question for what is newer than a time gets all buffers from the same samples.
    """

    MODELS: ClassVar[str] = "phyphox"
    SERIAL: ClassVar[Mapping[str, Any]] = {}
    SIGNAL: ClassVar[Signal] = Signal(
        "line of a turning moment in the magnetic field",
        "is the top floating, the phone 20 cm beside the base, and its magnetometer the uncalibrated one",
    )
    ESTIMATES: ClassVar[bool] = True

    def __init__(self, transport: Transport, *, clock: Clock | None = None, estimator: Estimator | None = None) -> None:
        """Read the phone at this link.

        Args:
            transport: the link.
            clock: of the bench, for what is waited for; by default the wall's.
            estimator: finds the frequency.
        """
        self.transport, self.clock = transport, clock or WallClock()
        self.last_set: dict[str, Value] = {}
        self.last: Count | None = None
        self._estimator = estimator
        self._gate, self._since = 1.0, 0.0
        self._buffers: tuple[str, ...] = ()
        self._title, self._range_t = "", math.inf
        self._near: float | None = None
        self._started = False
        self._status: dict[str, Any] = {}
        # bench time half-way between question and answer [s], and its difference to the newest sample's time
        self._lags: deque[tuple[float, float]] = deque(maxlen=_COMPARED)

    # --- what every instrument offers ---

    def identity(self) -> str:
        """Return maker, app, phone and version of the app.  Raises WrongInstrument where another server answers."""
        meta = self._object("/meta", patience=_ASLEEP_S)
        version = meta.get("version")
        if not (isinstance(version, str) and "deviceModel" in meta and "fileFormat" in meta):
            raise WrongInstrument(self.transport.address, str(meta)[:60], "phyphox 1.1.8 or newer on a phone")
        sensors = meta.get("sensors")
        about = sensors.get("magnetic_field") if isinstance(sensors, dict) else None
        found = _number(about.get("Range")) if isinstance(about, dict) else None  # an iPhone does not say it
        self._range_t = found * _T_PER_UT if found and found > 0 else math.inf
        phone = " ".join(str(meta[key]) for key in ("deviceBrand", "deviceModel") if meta.get(key))
        return ",".join(re.sub(r"[^ -~]|,", " ", field) for field in ("RWTH Aachen", "phyphox", phone, version))

    def settings(self) -> dict[str, Value]:
        """Return experiment and session of the app, and whether it measures."""
        self._newest()
        clocks = self.clocks()
        found: dict[str, Value] = {
            "experiment": self._title,
            "session": str(self._status["session"]),
            "measuring": self._status["measuring"] is True,
            "gate_s": self._gate,
        }
        if clocks.drift is not None and clocks.drift_u is not None:
            found |= {"clock_drift": clocks.drift, "clock_drift_u": clocks.drift_u}
        return found

    def changed_settings(
        self, now: Mapping[str, Value] | None = None, *, since: Mapping[str, Value] | None = None
    ) -> dict[str, tuple[object, object]]:
        """Return the settings that have changed; see :class:`instruments.drivers.Instrument`."""
        now = now or self.settings()
        then = dict(since or self.last_set)
        return {name: (then[name], now[name]) for name in _STEADY if name in then and now[name] != then[name]}

    def forget_errors(self) -> None:
        """Do nothing: the app has no error queue."""

    def close(self) -> None:
        """Stop the app, if this program has started it, and give the phone back."""
        if self._started:
            with contextlib.suppress(InstrumentError):  # it may be gone already
                self._control("stop")
        self.transport.close()

    # --- what every counter offers ---

    def prepare(self, *, gate_s: float, trigger_level_v: float, channel: int = 1) -> None:
        """Let the app measure, and read its samples from now on; see :class:`Counter`.

        There is no trigger level.  Data that the app holds stay there.

        Raises:
            OutOfRange: another channel than 1, or a gate of less than 0.1 s.
            BadAnswer: the open experiment has no magnetometer with all axes and the time.
            CommandRefused: the app does not start.
        """
        if channel != 1:
            raise OutOfRange(self.transport.address, "channel", channel, "1: a phone sees the spin alone")
        if not 0.1 <= gate_s <= 1000.0:
            raise OutOfRange(self.transport.address, "gate_s", gate_s, "0.1 to 1000 s")
        self._buffers, self._status = (), {}
        self._gate, self.last = gate_s, None
        self._lags.clear()
        self._since = self._newest()
        if not self._status["measuring"]:
            self._control("start")
            self._started = True
        self.last_set = {"measuring": True}

    def frequency(self) -> float | None:
        """Return the frequency of the line [Hz]; see :class:`Counter`.

        It is that of the samples of the next gate, and where this is shorter than 3 s of earlier ones, too.

        Raises:
            SettingsLost: the app was paused by hand, or another experiment was opened.
            TooFewSamples: they come too slowly, or with gaps.
            Saturated: the field is beyond the sensor's range.
        """
        self.last = None
        samples = self._samples(_WINDOW_S)
        line = self._line(samples)
        if line and line.folds and self._near is None:
            samples = self._samples(_LONGER_S)
            line = self._line(samples)
        if line is None:
            self._near = None
            return None
        steps = np.diff(samples[:, 0])
        gaps = steps[steps > _GAP * float(np.median(steps))]
        time = line.time + self.clocks().offset
        self.last = Count(line.frequency, line.u, time, tuple(gaps.tolist()), line.folds)
        self._near = line.frequency
        return line.frequency

    def readings(self, count: int) -> Array:
        """Take readings; see :class:`Counter`."""
        if count < 1:
            raise OutOfRange(self.transport.address, "count", count, "1 or more")
        found = (self.frequency() for _ in range(count))
        return np.array([np.nan if one is None else one for one in found])

    def clocks(self) -> ClockComparison:
        """Compare the app's clock with the bench's, by the answers since `prepare`.

        The offset is that of the quickest of the latest answers, the drift the slope of all of them.
        """
        now, lag = np.array(self._lags).reshape(-1, 2).T
        offset = float(lag[-_RECENT:].min(initial=math.inf))
        if now.size < 2 * _RECENT or now[-1] <= now[0]:
            return ClockComparison(offset, None, None)
        since = now - now.mean()
        drift = -float(since @ lag) / float(since @ since)
        # the lags follow the samples' times in beats, so more of them make the slope no better
        left = lag - lag.mean() + drift * since
        u = math.sqrt(12 * float(left @ left) / (now.size - 2)) / float(now[-1] - now[0])
        return ClockComparison(offset, drift, u)

    # --- samples ---

    def _line(self, samples: Array) -> FieldLine | None:
        """Return the line in samples; looked for near the last one at first.  Raises Saturated."""
        if self._estimator is None:
            raise TypeError("no estimator was given, such as levilab.bench.bench.line_in_field")
        times, field = samples[:, 0], samples[:, 1:] * _T_PER_UT
        if (np.abs(field) > _END_OF_RANGE * self._range_t).any():
            raise Saturated(self.transport.address, self._range_t)
        found = self._estimator(times, field, near=self._near) if self._near else None
        return found or self._estimator(times, field, near=None)

    def _samples(self, window: float) -> Array:
        """Return samples up to the end of the next gate, shape (n, 4) [s, µT], increasing in time, all of them numbers.

        Args:
            window: their least duration [s]; where the gate is shorter, they begin before it, but not before `prepare`.
        """
        length = max(self._gate, window)
        start = max(self._since, self._newest() + self._gate - length)
        began, wait = self.clock.now(), self._gate
        while True:
            self.clock.sleep(wait)
            found = self._newer_than(start)
            found = found[np.isfinite(found).all(axis=1)]
            if found.shape[0] >= _FEWEST:
                times = found[:, 0]
                step = float(np.median(np.diff(times)))
                if times[-1] - start >= length - step:
                    span = float(times[-1] - times[0])
                    if found.shape[0] * step < _LEAST_FILLED * max(span, length):
                        raise TooFewSamples(self.transport.address, found.shape[0], span)
                    return found[times - start <= length + _PATIENCE_S]  # a closed lid leaves many more
            if not self._status["measuring"]:
                raise SettingsLost(self.transport.address, {"measuring": (True, False)})
            waited = self.clock.now() - began
            if waited > length + _PATIENCE_S:
                raise TooFewSamples(self.transport.address, found.shape[0], waited)
            wait = _LOOK_EVERY_S

    def _newest(self) -> float:
        """Return the time of the newest sample [s], 0 where there is none yet."""
        if not self._buffers:
            self._find_buffers()
        name = self._buffers[0]
        times = self._ask(f"/get?{quote(name)}", name)[name]
        return float(times[-1]) if times.size and math.isfinite(times[-1]) else 0.0

    def _newer_than(self, start: float) -> Array:
        """Return the samples after a time [s], shape (n, 4).  Raises BadAnswer where their times do not increase."""
        time, *rest = self._buffers
        others = "".join(f"&{quote(name)}={start:.8g}%7C{quote(time)}" for name in rest)
        question = f"/get?{quote(time)}={start:.8g}{others}"
        asked = self.clock.now()
        buffers = self._ask(question, *self._buffers)
        now = (asked + self.clock.now()) / 2  # half-way, as question and answer take about as long
        if len({buffers[name].size for name in self._buffers}) > 1:
            sizes = ", ".join(f"{buffers[name].size} of {name}" for name in self._buffers)
            raise BadAnswer(self.transport.address, question, sizes, "as many numbers in each buffer")
        found = np.column_stack([buffers[name] for name in self._buffers])
        times = found[np.isfinite(found[:, 0]), 0]
        if (np.diff(times) <= 0).any() or (times <= start).any():
            raise BadAnswer(self.transport.address, question, "times that go back", "times that increase")
        if times.size:
            self._lags.append((now, now - float(times[-1])))
        return found

    # --- questions ---

    def _find_buffers(self) -> None:
        """Find the buffers of the magnetometer in the open experiment.  Raises BadAnswer."""
        config = self._object("/config", patience=_ASLEEP_S)
        self._title = str(config.get("localTitle") or config.get("title") or "")
        inputs = config.get("inputs")
        for one in inputs if isinstance(inputs, list) else []:
            if isinstance(one, dict) and one.get("source") == "magnetic_field":
                pairs = [pair for pair in one.get("outputs") or [] if isinstance(pair, dict)]
                names = {key: str(name) for pair in pairs for key, name in pair.items()}
                if all(key in names for key in _COMPONENTS):
                    self._buffers = tuple(names[key] for key in _COMPONENTS)
                    return
        expected = "an experiment with time, x, y and z of the magnetometer"
        raise BadAnswer(self.transport.address, "/config", self._title, expected, _OPEN)

    def _control(self, command: str) -> None:
        """Send a command.  Raises CommandRefused."""
        question = f"/control?cmd={command}"
        if self._object(question, patience=_ASLEEP_S).get("result") is not True:
            raise CommandRefused(self.transport.address, question, ("the app does not do it: look at its screen",))

    def _ask(self, question: str, *names: str) -> dict[str, Array]:
        """Return the buffers of these names, which the question asks for, NaN for a missing value; note the status.

        Raises:
            SettingsLost: the session is another one, and these buffers may be others.
            BadAnswer: the answer is none of `/get`.
        """
        answer = self._object(question)
        status, buffers = answer.get("status"), answer.get("buffer")
        known = isinstance(status, dict) and isinstance(status.get("measuring"), bool) and "session" in status
        if not known or not isinstance(buffers, dict):
            raise self._unexpected(question, answer)
        before, self._status = self._status.get("session"), dict(status or {})
        if before not in {None, self._status["session"]}:
            self._buffers = ()
            raise SettingsLost(self.transport.address, {"session": (before, self._status["session"])})
        found = {name: _numbers(buffers.get(name)) for name in names}
        if bad := [name for name, numbers in found.items() if numbers is None]:
            raise BadAnswer(self.transport.address, question, str(answer), f"numbers in the buffer {bad[0]}")
        return {name: numbers for name, numbers in found.items() if numbers is not None}

    def _object(self, question: str, patience: float = 0.0) -> dict[str, Any]:
        """Return the JSON object of a document.  Raises BadAnswer."""
        text = self.transport.query(question, patience=patience)
        try:
            found = json.loads(text)
        except (ValueError, RecursionError):
            found = None
        if not isinstance(found, dict):
            raise self._unexpected(question, text)
        return found

    def _unexpected(self, question: str, answer: object) -> BadAnswer:
        advice = "is phyphox at this address and port?  The app shows them at the bottom of the screen"
        return BadAnswer(self.transport.address, question, str(answer), "an answer of phyphox", advice)


def _number(value: object) -> float | None:
    """Return a number of JSON or of the texts of /meta; None for anything else."""
    try:
        number = float(value) if isinstance(value, int | float | str) and not isinstance(value, bool) else math.nan
    except (ValueError, OverflowError):
        return None
    return number if math.isfinite(number) else None


def _numbers(buffer: object) -> Array | None:
    """Return the numbers of a buffer in an answer, NaN for null; None where it holds anything else."""
    values = buffer.get("buffer") if isinstance(buffer, dict) else None
    plain = isinstance(values, list) and all(one is None or type(one) in {int, float} for one in values)
    if not plain:
        return None
    try:
        return np.array([np.nan if one is None else one for one in values or []], dtype=np.float64)
    except (OverflowError, ValueError):
        return None

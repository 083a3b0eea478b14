"""The virtual twin of phyphox: what the app on a phone answers over HTTP while its magnetometer measures.

A message is a request, ``GET /get?mag_time=full HTTP/1.1``, without its head; the answer is the whole one on the wire.
Sources: as of the driver.  Left out: bodies of POST, other experiments, Excel, the web page, countdowns.
"""

import io
import json
import math
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qsl, urlsplit

import numpy as np

from instruments.clock import Clock
from instruments.virtual.core.device import Answer, VirtualInstrument
from instruments.virtual.core.signal import Array
from instruments.virtual.core.steps import Steps

#: Buffers of the app's own magnetometer experiment → column of its samples, and their names in an export.
_BUFFERS = {"mag_time": 0, "magX": 1, "magY": 2, "magZ": 3, "mag": 4, "magAccuracy": 5}
_LABELS = {
    "mag_time": "Time (s)",
    "magX": "Magnetic Field x (µT)",
    "magY": "Magnetic Field y (µT)",
    "magZ": "Magnetic Field z (µT)",
    "mag": "Absolute field (µT)",
}
#: Separator and decimal point of the formats of an export from 1 on; 0 is Excel's.
_FORMATS = ((",", "."), ("\t", "."), (";", "."), ("\t", ","), (";", ","))
#: The same → their names in the sensor's input.
_AXES = dict(zip(_BUFFERS, ("t", "x", "y", "z", "abs", "accuracy"), strict=True))
_CONFIG: dict[str, Any] = {
    "crc32": "e04c0bfa",
    "title": "Magnetometer",
    "localTitle": "Magnetometer",
    "category": "Raw Sensors",
    "localCategory": "Raw Sensors",
    "buffers": [{"name": name, "size": 0} for name in _BUFFERS],
    "inputs": [{"source": "magnetic_field", "outputs": [{axis: name} for name, axis in _AXES.items()]}],
    "export": [{"set": "Raw Data", "sources": [{"label": _LABELS[name], "buffer": name} for name in _LABELS]}],
}
#: Seconds since 1970 at the start of the bench's clock; samples that are kept [s]; parameters of one request.
_EPOCH_S, _KEPT_S, _MOST_PARAMETERS = 1.79e9, 10_000.0, 100
#: Length of the tables of random numbers, after which noise and jitter repeat.
_RANDOM = 1 << 16


@dataclass(frozen=True)
class Sensor:
    """A phone's magnetometer, uncalibrated.

    Attributes:
        rate_hz: of its samples.
        jitter_s: of their times, 1σ.
        noise_ut: of each axis, 1σ [µT].
        resolution_ut: [µT]; range_ut: the greatest field of an axis [µT].
        around_ut: the field of the earth and of the phone itself [µT].
        mains_ut: amplitude of the mains' field along z [µT]; mains_hz: its frequency.
        drift: by which the phone's clock goes faster, relative.
    """

    rate_hz: float = 100.0
    jitter_s: float = 3e-4
    noise_ut: float = 0.5
    resolution_ut: float = 0.15
    range_ut: float = 4912.0
    around_ut: tuple[float, float, float] = (18.0, -31.0, -52.0)
    mains_ut: float = 0.2
    mains_hz: float = 50.0
    drift: float = 2e-5


@dataclass(frozen=True)
class _Stretch:
    """Measuring without a pause.

    Attributes:
        begin, end: [s on the bench's clock].
        experiment_time: at the begin [s].
        number: of samples before it.
    """

    begin: float
    experiment_time: float
    number: int
    end: float = math.inf


@dataclass
class _Request:
    """A buffer that is asked for: values where the reference is above a threshold; NaN: the last one."""

    name: str
    threshold: float
    reference: str


class VirtualPhyphox(VirtualInstrument):
    """phyphox on a phone, its remote access allowed, with the app's own magnetometer experiment.

    Args:
        clock: of the bench.
        magnetic_field: times, shape (n,) [s] → field at the phone, shape (n, 3) [T].
        sensor: of the phone.
        seed: of its noise.
        lost: bench times between which samples were lost [s].
    """

    identity = "RWTH Aachen,phyphox,levilab VIRTUAL,1.2.0"
    takes_blocks = False

    def __init__(
        self,
        clock: Clock,
        *,
        magnetic_field: Callable[[Array], Array],
        sensor: Sensor | None = None,
        seed: int = 0,
        lost: tuple[tuple[float, float], ...] = (),
    ) -> None:
        super().__init__(clock, pace=0.015)  # Wi-Fi
        self.sensor, self.lost, self.session, self.config = sensor or Sensor(), lost, "c0ffee", _CONFIG
        self._field = magnetic_field
        random = np.random.default_rng((seed, 7))
        self._jitter = random.standard_normal(_RANDOM).clip(-4, 4) * self.sensor.jitter_s
        self._noise = random.standard_normal((_RANDOM, 3)) * self.sensor.noise_ut
        self._stretches: list[_Stretch] = []

    # --- the app in a hand ---

    @property
    def measuring(self) -> bool:
        """Whether the experiment runs."""
        return bool(self._stretches) and math.isinf(self._stretches[-1].end)

    def start(self) -> None:
        """Press start."""
        if self.measuring:
            return
        number, time = 0, 0.0
        if self._stretches:
            last = self._stretches[-1]
            number, time = last.number + self._count(last), self._experiment_time(last, last.end)
        self._stretches.append(_Stretch(self.clock.now(), time, number))

    def pause(self) -> None:
        """Press pause."""
        if self.measuring:
            self._stretches[-1] = replace(self._stretches[-1], end=self.clock.now())

    def open_another(self, session: str, config: dict[str, Any] | None = None) -> None:
        """Open an experiment, the same one or another: its session is another one, and it does not run yet."""
        self.session, self.config = session, config or self.config
        self._stretches.clear()

    # --- samples ---

    def _experiment_time(self, stretch: _Stretch, time: float) -> float:
        return stretch.experiment_time + (time - stretch.begin) * (1 + self.sensor.drift)

    def _count(self, stretch: _Stretch) -> int:
        """Return the number of samples of a stretch up to now."""
        until = min(stretch.end, self.clock.now())
        # a sample that comes late must not come after one that was given already
        return max(0, math.floor((until - stretch.begin) * self.sensor.rate_hz - 0.5))

    def samples(self, after: float) -> Array:
        """Return the samples that may be newer than an experiment time [s], and all behind them: a row each.

        Columns as in _BUFFERS.
        """
        rate, now = self.sensor.rate_hz, self.clock.now()
        found = [np.empty((0, len(_BUFFERS)))]
        for one in self._stretches:
            oldest = max(after - one.experiment_time, (now - _KEPT_S - one.begin))
            first = max(0, math.floor(min(oldest, 1e9) * rate) - 2) if oldest > 0 else 0
            numbers = np.arange(first, self._count(one), dtype=np.int64)
            random = (one.number + numbers) % _RANDOM
            times = one.begin + (numbers + 1) / rate + self._jitter[random]
            for start, stop in self.lost:
                kept = (times < start) | (times > stop)
                numbers, random, times = numbers[kept], random[kept], times[kept]
            if times.size:
                field = self._measured(times, self._noise[random])
                time = one.experiment_time + (times - one.begin) * (1 + self.sensor.drift)
                found.append(np.column_stack([time, field, np.linalg.norm(field, axis=1), np.zeros_like(time)]))
        return np.concatenate(found)

    def _measured(self, times: Array, noise: Array) -> Array:
        """Return what the sensor says of the field, shape (n, 3) [µT]."""
        sensor = self.sensor
        field = 1e6 * self._field(times) + sensor.around_ut + noise
        field[:, 2] += sensor.mains_ut * np.sin(2 * np.pi * sensor.mains_hz * times)
        field = np.round(field / sensor.resolution_ut) * sensor.resolution_ut
        return np.asarray(np.clip(field, -sensor.range_ut, sensor.range_ut))

    # --- requests ---

    def steps(self, message: str) -> Steps[Answer | None]:
        """Answer one request; see the base."""
        self.begun = max(self._ready, self.clock.now())
        self._ready = self.begun + self.pace
        yield from ()
        return Answer(self._respond(message), self._ready, self.epoch, self.begun)

    def _respond(self, message: str) -> bytes:
        method, _, rest = message.strip().partition(" ")
        if method != "GET":
            return _answer({"error": "This model answers GET alone."}, HTTPStatus.METHOD_NOT_ALLOWED)
        parts = urlsplit(rest.partition(" ")[0])
        given: dict[str, str] = {}
        try:
            for name, value in parse_qsl(parts.query, keep_blank_values=True, max_num_fields=_MOST_PARAMETERS):
                given.setdefault(name, value)
        except ValueError:
            return _answer({"error": "Malformed request."}, HTTPStatus.BAD_REQUEST)
        handler = _HANDLERS.get(parts.path)
        if handler is None:
            return _wrap(b"<html><body><h1>404 Not Found</h1></body></html>", "text/html", HTTPStatus.NOT_FOUND)
        found = handler(self, given)
        return found if isinstance(found, bytes) else _answer(found)

    def _get(self, given: dict[str, str]) -> Any:
        asked = []
        for name, value in given.items():
            threshold, _, reference = value.partition("|")
            try:
                number = math.nan if not value else -math.inf if value == "full" else float(threshold)
            except ValueError:
                return _answer({"error": "Invalid threshold."}, HTTPStatus.BAD_REQUEST)
            if reference and reference not in _BUFFERS and name in _BUFFERS:
                return _answer({"error": "Unknown reference buffer."}, HTTPStatus.BAD_REQUEST)
            if math.isfinite(number) and number:  # the numbers that were given are rounded
                number += 10 ** math.floor(math.log10(abs(number) / 1e7))
            if name in _BUFFERS:
                asked.append(_Request(name, number, reference or name))
        by_time = [one.threshold if one.reference == "mag_time" else -math.inf for one in asked]
        by_time = [by for by, one in zip(by_time, asked, strict=True) if not math.isnan(one.threshold)]
        rows = self.samples(min(by_time) if by_time else self._latest())
        if not by_time and not rows.size:  # the latest ones were lost
            rows = self.samples(-math.inf)
        status = {"session": self.session, "measuring": self.measuring, "timedRun": False, "countDown": 0}
        buffers = ",\n".join(_buffer(one, rows) for one in asked)
        return _wrap(f'{{"buffer":{{\n{buffers}\n}},\n"status":{json.dumps(status)}}}\n'.encode(), "application/json")

    def _latest(self) -> float:
        """Return an experiment time shortly before the last sample [s]."""
        if not self._stretches:
            return 0.0
        last = self._stretches[-1]
        return self._experiment_time(last, min(last.end, self.clock.now())) - 0.1 - 5 / self.sensor.rate_hz

    def _control(self, given: dict[str, str]) -> Any:
        command = given.get("cmd")
        if command == "start":
            self.start()
        elif command in {"stop", "clear"}:
            self.pause()
            if command == "clear":
                self._stretches.clear()
        return {"result": command in {"start", "stop", "clear"}}

    def _meta(self, _: dict[str, str]) -> Any:
        sensor = {
            "Name": "AK0991X, virtual",
            "Vendor": "levilab",
            "Range": f"{self.sensor.range_ut:.1f}",
            "Resolution": f"{self.sensor.resolution_ut:g}",
            "MinDelay": f"{1e6 / self.sensor.rate_hz:.0f}",
            "MaxDelay": "1000000",
            "Power": "1.1",
            "Version": "1",
        }
        about = {"version": "1.2.0", "build": "1020009", "fileFormat": "1.19", "deviceModel": "VIRTUAL"}
        return about | {
            "deviceBrand": "levilab",
            "deviceManufacturer": "levilab",
            "sensors": {"magnetic_field": sensor},
        }

    def _time(self, _: dict[str, str]) -> Any:
        events = []
        for one in self._stretches:
            for event, time in (("START", one.begin), ("PAUSE", one.end)):
                if math.isfinite(time):
                    experiment = self._experiment_time(one, time)
                    events.append({"event": event, "experimentTime": experiment, "systemTime": _EPOCH_S + time})
        return events

    def _export(self, given: dict[str, str]) -> Any:
        number = given.get("format", "")
        if not number.isdecimal() or not 1 <= int(number) <= len(_FORMATS):
            return {"error": "Format out of range."}
        separator, point = _FORMATS[int(number) - 1]
        lines = [separator.join(f'"{label}"' for label in _LABELS.values())]
        rows = self.samples(-math.inf)[:, : len(_LABELS)].tolist()
        lines += (separator.join(_spell(value, 9).replace(".", point) for value in row) for row in rows)
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as files:
            files.writestr("Raw Data.csv", "\n".join(lines) + "\n")
        return _wrap(packed.getvalue(), "application/zip")


_HANDLERS: dict[str, Callable[[VirtualPhyphox, dict[str, str]], Any]] = {
    "/": lambda *_: _wrap(b"<!DOCTYPE html><title>phyphox, virtual</title>", "text/html"),
    "/get": VirtualPhyphox._get,
    "/control": VirtualPhyphox._control,
    "/meta": VirtualPhyphox._meta,
    "/config": lambda phone, _: phone.config,
    "/time": VirtualPhyphox._time,
    "/export": VirtualPhyphox._export,
}


def _buffer(asked: _Request, rows: Array) -> str:
    """Return a buffer as it stands in the answer to /get."""
    values = rows[:, _BUFFERS[asked.name]]
    mode = "full" if math.isinf(asked.threshold) else "partial"
    if math.isnan(asked.threshold):
        mode, values = "single", values[-1:] if values.size else np.array([math.nan])
    else:
        values = values[rows[:, _BUFFERS[asked.reference]] > asked.threshold]
    texts = ",".join(_spell(value, 7) if math.isfinite(value) else "null" for value in values.tolist())
    return f'"{asked.name}":{{"size":0,"updateMode":"{mode}", "buffer":[{texts}]}}'


def _spell(value: float, digits: int) -> str:
    """Return a number as the app prints it, of 1 + digits significant digits at most.

    >>> _spell(12.3456789, 7), _spell(-0.5, 7), _spell(0.0, 7)
    ('1.2345679E1', '-5E-1', '0E0')
    """
    mantissa, exponent = f"{value:.{digits}E}".split("E")
    return f"{mantissa.rstrip('0').rstrip('.')}E{int(exponent)}"


def _answer(document: Any, status: HTTPStatus = HTTPStatus.OK) -> bytes:
    return _wrap(json.dumps(document, ensure_ascii=False).encode(), "application/json", status)


def _wrap(body: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK) -> bytes:
    head = (
        f"HTTP/1.1 {status.value} {status.phrase}\r\nAccess-Control-Allow-Origin: *\r\nContent-Type: {kind}\r\n"
        f"Content-Length: {len(body)}\r\nConnection: close\r\n\r\n"
    )
    return head.encode("ascii") + body

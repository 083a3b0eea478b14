"""One run, or one bench, as the page sees it: the run folder, what the bench publishes, and the running fit."""

import contextlib
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from levilab.live.envelope import by_columns
from levilab.live.follow import Followed
from levilab.live.running import Running, fit_so_far
from levilab.live.views import view_of
from levilab.present.units import shown_unit, u_of
from levilab.telemetry.address import Address, read_address
from levilab.telemetry.codec import pack
from levilab.telemetry.messages import Message, Poses, Record, State
from levilab.telemetry.subscriber import Subscriber
from levilab.texts.text import ENGLISH, Text, in_language

#: A bench that has published nothing for so long is silent [s].
SILENT_AFTER_S = 4.0
#: Messages with poses that are kept for pages that ask late: a second of them.
_MOST_POSES = 24
#: Between two fits at least, and at most, though a fit is to take no more than this share of the time [s].
_FIT_EVERY_S, _FIT_PAUSE_S, _FIT_SHARE = 1.5, 10.0, 0.05
#: Columns of a picture, at most and at least, whatever a page asks for.
_FEWEST_COLUMNS, _MOST_COLUMNS = 50, 2000
#: The latest readings alone, where the page asks for them.
LATEST = 200
#: Longest description of a failure that is sent to the page.
_LONGEST_FAILURE = 300
_INSTRUMENT = {"identity", "driver", "address"}
_SETTINGS = {"frequency_hz", "amplitude_vpp", "waveform", "offset_v", "gate_s", "trigger_level_v"}


class Watch:
    """What is known of a run and of its bench now.

    Pages change nothing here, and nothing is kept for any of them.  With a bench for practice, it follows what that
    records, unless it stays with its run; `bench` returns where that publishes.

    Attributes:
        followed: the run folder; None while a bench for practice has recorded none.
        state: what the bench said last; None while it has said nothing.
        tick: grows with each change.
        has_own_bench: whether its bench is one that the run folder names, and not the one for practice.
    """

    def __init__(
        self,
        folder: Path | None,
        bench: Callable[[], Address | None] | None = None,
        clock: Callable[[], float] = time.monotonic,
        *,
        stays: bool = False,
    ) -> None:
        self.clock = clock
        self._stays = stays
        self.followed = Followed(folder, clock) if folder else None
        self.state: State | None = None
        self.tick = 0
        self.has_own_bench = False
        self.fit: Running | None = None
        self.fit_version = 0
        self._has_fitted = False
        self._bench = bench
        self._fitted = (-1, False)  # version of the readings, and whether they are all
        self._fit_again = 0.0
        self._heard = -np.inf
        self._records: dict[str, Record] = {}
        self._poses: deque[tuple[int, Poses]] = deque(maxlen=_MOST_POSES)
        self._pose_number = 0
        self._subscriber: Subscriber | None = None
        self._silent = True
        self._failure = ""  # what went wrong while this run was read

    # --- news ---

    @contextlib.contextmanager
    def failing_alone(self) -> Iterator[None]:
        """Let an error here, as of a damaged file, end neither the other watches nor this one: the page names it."""
        try:
            yield
        except Exception as error:  # noqa: BLE001 - whatever it is, the other runs are read on
            why = f"{type(error).__name__}: {error}"[:_LONGEST_FAILURE]
            failure = Text("this run cannot be read in full: {why}", why=why)
            if failure != self._failure:
                self._failure = failure
                self.tick += 1

    def step(self) -> None:
        """Read the news of the run; `tick` counts them."""
        self._subscribe()
        for message in self._subscriber.receive() if self._subscriber else ():
            self._take(message)
        silent = self.clock() - self._heard > SILENT_AFTER_S
        if silent != self._silent:
            self._silent = silent
            self.tick += 1
        if self.followed:
            self._look(self.followed)

    def _look(self, followed: Followed) -> None:
        before = (followed.version, followed.event_count, followed.status, followed.record, followed.problem)
        followed.look()
        if before != (followed.version, followed.event_count, followed.status, followed.record, followed.problem):
            self.tick += 1
        if folder := followed.continued_in:
            self.turn_to(folder)

    def _subscribe(self) -> None:
        """Listen to the bench that the run folder names; where it names none, to the one for practice."""
        practice = self._bench() if self._bench else None
        # where there is one for practice, a run that is over counts for nothing: a killed program leaves its address
        named = self.followed and (not self._bench or self.followed.status == "running")
        own = read_address(self.followed.folder) if self.followed and named else None
        self.has_own_bench = own is not None and own != practice
        address = own or practice
        if self._subscriber and address == self._subscriber.address:
            return
        if self._subscriber and address is None:
            return  # the run is over; its last state remains
        if self._subscriber:
            self._subscriber.close()
            self._subscriber = None
            self._records.clear()  # times of another bench are of another clock
            self._poses.clear()
        if address:
            try:
                self._subscriber = Subscriber(address, self.clock)
            except OSError:
                self._subscriber = None

    def _take(self, message: Message) -> None:
        self._heard = self.clock()
        self.tick += 1
        if isinstance(message, State):
            self.state = message
            if self._bench and message.folder and not self._stays:
                self.turn_to(Path(message.folder))
        elif isinstance(message, Record):
            self._records[message.channel] = message
        else:
            self._pose_number += 1
            self._poses.append((self._pose_number, message))

    def turn_to(self, folder: Path) -> None:
        """Follow another run folder from now on."""
        if self.followed is None or folder != self.followed.folder:
            self.followed = Followed(folder, self.clock)
            self.fit, self._fitted, self._fit_again = None, (-1, False), 0.0
            self._failure = ""
            self.fit_version += 1
            self.tick += 1

    # --- the running fit, which the server computes beside the frames ---

    def fit_task(self) -> tuple[Path, Callable[[], Running | None]] | None:
        """Return a run and the function that fits it, for a thread, if it is time; `take_fit` takes the result."""
        followed = self.followed
        ended = followed is not None and followed.status != "running"
        if (
            followed is None
            or followed.record is None
            or (followed.version, ended) == self._fitted
            or followed.behind
            or (self.clock() < self._fit_again and not ended)  # the last fit of a run waits for nothing
        ):
            return None
        self._fitted = (followed.version, ended)
        experiment, columns, groups = followed.record.experiment, followed.columns, followed.readings.groups()
        settings = followed.record.table(experiment)
        fit = partial(fit_so_far, experiment, columns, groups, settings, events=[*followed.events], ended=ended)
        return followed.folder, fit

    def take_fit(self, folder: Path, found: Running | None, took_s: float) -> None:
        """Take in the fit of a run, and its processor time [s].

        It is dropped if another run is followed by now.  The time of the first fit that draws a line says nothing of
        the next ones, as it has to import libraries.
        """
        took_s = took_s if self._has_fitted else 0.0
        self._has_fitted |= found is not None and found.curve is not None
        if self.followed is None or folder != self.followed.folder:
            return
        self._fit_again = self.clock() + min(max(_FIT_EVERY_S, took_s / _FIT_SHARE), _FIT_PAUSE_S)
        self.fit = found
        self.fit_version += 1
        self.tick += 1

    # --- what the page asks for ---

    def frame(self, ask: dict[str, Any], said: Sequence[Mapping[str, Any]] = (), language: str = ENGLISH) -> bytes:
        """Return the news for a page.

        Args:
            ask: the page's state: "run" (name), "readings", "events", "fit", "poses" (numbers), "records" (channel →
                number); and its wishes: "columns" of its picture, and whether the "latest" readings alone.
            said: the events of the bench for practice.
            language: of the texts, beside those that the page looks up itself.
        """
        followed = self.followed
        name = followed.folder.name if followed else ""
        ask = ask if ask.get("run") == name else {key: ask.get(key) for key in ("columns", "latest", "poses")}
        head: dict[str, Any] = {"tick": self.tick, "run": name, "bench": self._about_bench(language), "said": said}
        head["source"] = self._subscriber.address.port if self._subscriber else None
        if followed:
            head["about"] = _about(followed, in_language(self._failure, language))
            if ask.get("readings") != followed.version or ask.get("changed"):
                head["readings"] = _readings(followed, ask)
            seen = _count_or_zero(ask.get("events"))
            events = followed.texts_after(seen if seen <= followed.event_count else 0)
            head["events"] = [one | {"text": in_language(one["text"], language)} for one in events]
        if ask.get("fit") != self.fit_version:
            head["fit"] = self._about_fit(language)
        head["records"] = self._new_records(ask.get("records"))
        head["poses"] = self._new_poses(_count_or_zero(ask.get("poses")))
        return pack(head)

    def _about_bench(self, language: str) -> dict[str, Any] | None:
        if self.state is None:
            return None
        about = asdict(self.state) | {"silent": self._silent, "text": in_language(self.state.text, language)}
        return about | {"folder": Path(self.state.folder).name}  # where it lies is no concern of a page

    def _about_fit(self, language: str) -> dict[str, Any]:
        fit = self.fit
        if fit is None:
            return {"version": self.fit_version}
        head, *lines = (in_language(line, language) for line in (fit.head, *fit.lines, fit.dashed) if line)
        curve = vars(fit.curve) if fit.curve else None
        about = {"head": head, "lines": lines, "end_s": fit.end_s, "look": fit.look, "curve": curve}
        return about | {"version": self.fit_version}

    def _new_records(self, seen: Any) -> list[dict[str, Any]]:
        seen = seen if isinstance(seen, dict) else {}
        return [vars(record) for channel, record in self._records.items() if seen.get(channel) != record.number]

    def _new_poses(self, seen: int) -> list[dict[str, Any]]:
        if seen > self._pose_number:  # of another server
            seen = 0
        return [vars(poses) | {"number": number} for number, poses in self._poses if number > seen]

    def close(self) -> None:
        """Listen no longer."""
        if self._subscriber:
            self._subscriber.close()
            self._subscriber = None


def _count_or_zero(value: Any) -> int:
    return value if type(value) is int and value >= 0 else 0


def _about(followed: Followed, failure: str) -> dict[str, Any]:
    """Return the part of the run's record that the page shows.  failure: of the watch, empty without one."""
    problem = followed.problem or failure
    about: dict[str, Any] = {"status": followed.status, "problem": problem, "event_count": followed.event_count}
    record = followed.record
    if record is None:
        return about
    return about | {
        "experiment": record.experiment,
        "started_utc": record.started_utc,
        "ended_utc": record.ended_utc,
        "group": record.group[:500],
        "note": record.note[:500],
        "synthetic": record.synthetic,
        "instruments": {
            kind: {key: str(value)[:120] for key, value in one.items() if key in _INSTRUMENT}
            for kind, one in record.instruments.items()
        },
        "settings": {kind: _settings(one) for kind, one in record.instruments.items()},
    }


def _settings(instrument: dict[str, Any]) -> dict[str, Any]:
    """Return an instrument's settings at the start of a run that the page shows without the bench."""
    found = instrument.get("settings_start")
    found = found if isinstance(found, dict) else {}
    return {key: value for key, value in found.items() if key in _SETTINGS and isinstance(value, str | float | int)}


def _readings(followed: Followed, ask: dict[str, Any]) -> dict[str, Any]:
    """Return the readings as the page draws them, and the last one in full."""
    columns, readings = followed.columns, followed.readings
    last = readings.latest(1)
    about: dict[str, Any] = {
        "version": followed.version,
        "count": readings.count,
        "last": {name: float(last.mean[k, 0]) for k, name in enumerate(columns)} if len(last) else {},
    }
    view = view_of(followed.record.experiment if followed.record else "", columns)
    if view is None or not readings.count:
        return about
    groups = readings.latest(LATEST) if ask.get("latest") else readings.groups()
    place = {name: k for k, name in enumerate(columns)}
    x, low, high = groups.mean[place[view.x]], groups.low[place[view.y]], groups.high[place[view.y]]
    kept = np.isfinite(x) & np.isfinite(low)
    x, low, high = x[kept], low[kept], high[kept]
    width = min(max(_count_or_zero(ask.get("columns")), _FEWEST_COLUMNS), _MOST_COLUMNS)
    single = groups.size == 1 and len(x) <= 2 * width
    if not single:
        order = np.argsort(x, kind="stable")
        x, low, high = by_columns(x[order], low[order], high[order], width)
    return about | {
        "x": x,
        "low": low,
        "high": high,
        "u": groups.mean[place[u_of(view.y)]][kept] if single and u_of(view.y) in place else None,
        "single": single,
        "x_axis": [view.x_label, *shown_unit(view.x)],
        "y_axis": [view.y_label, *shown_unit(view.y)],
        "trend": _trend(groups, place),
    }


def _trend(groups: Any, place: dict[str, int]) -> float | None:
    """Return the rate of change of the spin by the last readings [Hz/s]; None where it is unknown."""
    if "time_s" not in place or "spin_frequency_hz" not in place:
        return None
    t, f = (groups.mean[place[name]][-4:] for name in ("time_s", "spin_frequency_hz"))
    known = np.isfinite(t) & np.isfinite(f)
    t, f = t[known], f[known]
    return float((f[-1] - f[0]) / (t[-1] - t[0])) if len(t) > 1 and t[-1] > t[0] else None

"""What the page says of one input: its readings and their uncertainty, how it was driven, with what it was measured."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from levilab.present.numbers import short_name
from levilab.present.words import setting_in_words, settings_in_words, value_in_words

if TYPE_CHECKING:
    from collections.abc import Mapping

    from analysis.spindown.fit import SpinDown
    from levilab.pipelines.sources import Options, Source
    from levilab.runs.run import RunRecord

#: Readings and events printed in the page; more stay in the run folder.  Readings stand in blocks side by side.
MOST_READINGS, MOST_EVENTS, BLOCK = 200, 100, 10
#: Events that tell when the top fell, and those that only repeat what happened before.
FELL, REPLAYED = "fell", "replayed"
#: What the drive's line says beside its signal.
_DRIVE = ("drive_waveform", "drive_frequency_hz", "drive_amplitude_vpp")


@dataclass(frozen=True)
class Block:
    """Consecutive readings: rows of index, time [s], spin [Hz] and u [Hz] or None."""

    rows: tuple[tuple[int, float, float, float | None], ...]


@dataclass(frozen=True)
class Input:
    """One input as the page shows it.

    facts: (what, in words), in the order of the page; events: (when, text); fell: what was seen of the fall.
    """

    name: str
    short: str
    fit: SpinDown
    count: int
    outliers: frozenset[int]
    facts: tuple[tuple[str, tuple[str, ...]], ...]
    events: tuple[tuple[str, str], ...]
    events_left_out: int
    fell: str
    blocks: tuple[Block, ...]

    @property
    def shown(self) -> int:
        """How many readings the page shows."""
        return sum(len(block.rows) for block in self.blocks)


def describe(source: Source, fit: SpinDown, options: Options) -> Input:
    """What is known of an input."""
    happened = source.run.events() if source.run else []
    events = [event for event in happened if event["kind"] != REPLAYED]
    zero = source.run.record.time_zero_utc if source.run else None
    return Input(
        name=source.name,
        short=short_name(source.name),
        fit=fit,
        count=len(source.readings.time),
        outliers=frozenset(fit.outliers),
        facts=tuple((what, texts) for what, texts in _facts(source, fit, options) if texts),
        events=tuple((_moment(event, zero), event["text"]) for event in events[:MOST_EVENTS]),
        events_left_out=max(0, len(events) - MOST_EVENTS),
        fell=_fell(events, fit),
        blocks=_blocks(source, options.reading_u),
    )


def _facts(source: Source, fit: SpinDown, options: Options) -> list[tuple[str, tuple[str, ...]]]:
    readings = _readings(source, fit, options)
    if source.run is None:
        return [("Readings", readings), ("Instruments", ("no instruments recorded",))]
    record = source.run.record
    made_up = (_sentence(record.synthetic_how or "not said how", record.seed),) if record.synthetic else ()
    instruments = [(kind.capitalize(), _instrument(about)) for kind, about in record.instruments.items()]
    return [
        ("Synthetic", made_up),
        ("Note", (record.note,) if record.note else ()),
        ("When", _when(record)),
        ("Status", (source.run.status,)),
        ("Readings", readings),
        ("Drive", _drive(record.configuration)),
        *(instruments or [("Instruments", ("no instruments recorded",))]),
        ("Command", (" ".join(record.command_line),) if record.command_line else ()),
    ]


def _sentence(how: str, seed: int | None) -> str:
    """How it was made, without saying again that it is synthetic."""
    text = how.removeprefix("SYNTHETIC").lstrip(":, ") or how
    return text if seed is None else f"{text} (seed {seed})"


# --- the readings --------------------------------------------------------------------------------------


def _readings(source: Source, fit: SpinDown, options: Options) -> tuple[str, ...]:
    count, outliers = len(source.readings.time), len(fit.outliers)
    told = f"{count} readings"
    if outliers:
        told += f", {outliers} of them outlier{'s' * (outliers > 1)}, {'kept' if options.keep_outliers else 'left out'}"
    t, nu = fit.time, fit.frequency
    span = f"{t[0]:.1f} s to {t[-1]:.1f} s, {nu[0]:.2f} Hz to {nu[-1]:.2f} Hz"
    return f"{told}; {span}", _uncertainty(source, fit, options)


def _uncertainty(source: Source, fit: SpinDown, options: Options) -> str:
    """How large u of a reading is, and where it comes from."""
    if fit.u is None:
        return "u of a reading: not known, taken from the scatter about each law"
    low, high = float(fit.u.min()), float(fit.u.max())
    size = f"{low:.2g} Hz" if low == high else f"{low:.2g} Hz to {high:.2g} Hz"
    if options.reading_u is not None:
        return f"u of a reading: {size}, as given to the analysis"
    channels = source.run.record.channels if source.run else []
    origin = next((c.get("source") for c in channels if c.get("name") == "spin_frequency_u_hz"), None)
    return f"u of a reading: {size}, {origin or 'from a column of the data'}"


def _blocks(source: Source, given_u: float | None) -> tuple[Block, ...]:
    readings = source.readings
    shown = min(len(readings.time), MOST_READINGS)
    u = [given_u] * shown if readings.u is None or given_u is not None else readings.u[:shown].tolist()
    rows = tuple(zip(range(shown), readings.time[:shown].tolist(), readings.frequency[:shown].tolist(), u, strict=True))
    return tuple(Block(rows[k : k + BLOCK]) for k in range(0, shown, BLOCK))


# --- when, and what happened ---------------------------------------------------------------------------


def _when(record: RunRecord) -> tuple[str, ...]:
    """Begin and end, as far as they are known; a virtual clock may have made one of them."""
    ends = [_time(utc) for utc in (record.started_utc, record.ended_utc) if utc]
    return (" to ".join(dict.fromkeys(ends)),) if ends else ()


def _time(utc: str) -> str:
    """A time of run.json to the second; what is no time stands as it is."""
    try:
        return datetime.fromisoformat(utc).astimezone(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    except ValueError:
        return utc


def _moment(event: Mapping[str, Any], zero: str | None) -> str:
    """When on the clock of the readings; "before" time zero there is none."""
    if event["time_s"] is not None:
        return f"{event['time_s']:.1f} s"
    return "before" if zero is None or str(event.get("utc", zero)) < zero else ""


def _fell(events: list[dict[str, Any]], fit: SpinDown) -> str:
    text = next((str(event["text"]) for event in reversed(events) if event["kind"] == FELL), None)
    if text is None:
        return ""
    return f"{text}; last reading that was fitted {fit.frequency[-1]:.2f} Hz at {fit.time[-1]:.1f} s"


# --- with what -----------------------------------------------------------------------------------------


def _drive(configuration: Mapping[str, Any]) -> tuple[str, ...]:
    """What drove the top before the readings, and what the bench stands."""
    spin, limits = configuration.get("spin"), configuration.get("limits")
    if not isinstance(spin, dict):
        return ()
    signal = [value_in_words(key, spin[key]) for key in _DRIVE if key in spin]
    ramp = [f"raised by {spin['ramp_hz_per_s']} Hz/s"] if "ramp_hz_per_s" in spin else []
    bounds = [setting_in_words(key, value) for key, value in limits.items()] if isinstance(limits, dict) else []
    return (", ".join(signal + ramp), *([f"limits of the bench: {', '.join(bounds)}"] if bounds else []))


def _instrument(about: Mapping[str, Any]) -> tuple[str, ...]:
    """Who answered, where, and the settings of the measurement: those at its end."""
    where = f"{about.get('identity', 'did not answer')} at {about.get('address', 'an unknown address')}"
    settings = about.get("settings_end")
    if not isinstance(settings, dict):
        return where, "settings not recorded"
    return where, settings_in_words(settings)

"""What the page says of one input, whatever the analysis: the drive, the instruments, what happened."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from levilab.present.clock import moment
from levilab.present.words import setting_in_words, settings_in_words, value_in_words

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from levilab.pipelines.part import InputPart, ReportPart
    from levilab.pipelines.sources import Source
    from levilab.runs.run import RunRecord

#: The name of a fact, such as "Counter", and the fact in words.
Fact = tuple[str, tuple[str, ...]]

#: Events printed in the page; more stay in the run folder.
MOST_EVENTS = 100
#: What the drive's line says beside its signal.
_DRIVE = ("drive_waveform", "drive_frequency_hz", "drive_amplitude_vpp")


@dataclass(frozen=True)
class About:
    """What one analysis says of an input.

    Attributes:
        whole: of all its inputs.
        part: of this one.
        several: if it has more.
    """

    source: Source[Any]
    whole: ReportPart
    part: InputPart
    several: bool


@dataclass(frozen=True)
class Input:
    """One input as the page shows it.

    Attributes:
        facts: (what, in words), in the order of the page.
        events: (when, text).
        parts: what each analysis says of it.
    """

    name: str
    facts: tuple[Fact, ...]
    events: tuple[tuple[str, str], ...]
    events_left_out: int
    parts: tuple[About, ...]

    @property
    def heading(self) -> str:
        """Its status unless that is finished, and the number of its readings."""
        facts = dict(self.facts)
        texts = [*facts.get("Status", ()), *facts.get("Readings", ())[:1]]
        return "; ".join(text for text in texts if text != "finished")

    def without(self, common: Sequence[Fact]) -> Input:
        """Return the input without the facts that all inputs share."""
        return replace(self, facts=tuple(fact for fact in self.facts if fact not in common))


def in_common(inputs: Sequence[Input]) -> tuple[Fact, ...]:
    """Return the facts that all inputs share."""
    first, *others = inputs
    return tuple(fact for fact in first.facts if all(fact in other.facts for other in others))


def describe(parts: Sequence[About]) -> Input:
    """What is known of an input, of which several analyses may say something."""
    source = parts[0].source
    events = source.run.events() if source.run else []
    zero = source.run.record.time_zero_utc if source.run else None
    return Input(
        name=source.name,
        facts=tuple((what, texts) for what, texts in _facts(source, parts) if texts),
        events=tuple((_moment(event, zero), event["text"]) for event in events[:MOST_EVENTS]),
        events_left_out=max(0, len(events) - MOST_EVENTS),
        parts=tuple(parts),
    )


def _facts(source: Source[Any], parts: Sequence[About]) -> list[Fact]:
    about_readings = _of_one(parts[0]) if len(parts) == 1 else [_of_several(part) for part in parts]
    if source.run is None:
        return [*about_readings, ("Instruments", ("no instruments recorded",))]
    record = source.run.record
    made_up = (_sentence(record.synthetic_how or "not said how", record.seed),) if record.synthetic else ()
    instruments = [(kind.capitalize(), _instrument(about)) for kind, about in record.instruments.items()]
    return [
        ("Synthetic", made_up),
        ("Note", (record.note,) if record.note else ()),
        ("When", (*_when(record), *_local_start(source))),
        ("Status", (source.run.status,)),
        *about_readings,
        ("Drive", _drive(record)),
        *(instruments or [("Instruments", ("no instruments recorded",))]),
        ("Command", (" ".join(record.command_line),) if record.command_line else ()),
    ]


def _of_one(about: About) -> list[Fact]:
    """What the only analysis says."""
    alone = [("This run alone", (about.part.alone,))] if about.several else []
    return [*alone, ("Readings", about.part.readings), ("Analysis", (about.part.origin,))]


def _of_several(about: About) -> Fact:
    """What one of several analyses says."""
    subject = about.whole.subject
    alone = (about.part.alone,) if about.several else ()
    return subject[0].upper() + subject[1:], (*alone, *about.part.readings, about.part.origin)


def _sentence(how: str, seed: int | None) -> str:
    """How it was made, without saying again that it is synthetic."""
    text = how.removeprefix("SYNTHETIC").lstrip(":, ") or how
    return text if seed is None else f"{text} (seed {seed})"


# --- when, and what happened ---------------------------------------------------------------------------


def _when(record: RunRecord) -> tuple[str, ...]:
    """Begin and end, as far as they are known; a virtual clock may have made one of them."""
    ends = [_time(utc) for utc in (record.started_utc, record.ended_utc) if utc]
    return (" to ".join(dict.fromkeys(ends)),) if ends else ()


def _local_start(source: Source[Any]) -> tuple[str, ...]:
    """The start on the clock of the person who reads."""
    if source.start is None:
        return ()
    return (f"{'time zero' if source.time_zero else 'started'} at {moment(source.start)}, local time",)


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


# --- with what -----------------------------------------------------------------------------------------


def _drive(record: RunRecord) -> tuple[str, ...]:
    """What drove the top before the readings, and what the bench stands."""
    settings, limits = (record.configuration.get(table) for table in (record.experiment, "limits"))
    if not isinstance(settings, dict) or settings.get(_DRIVE[1], 0) is None:  # nothing drives the top
        return ()
    signal = [value_in_words(key, settings[key]) for key in _DRIVE if key in settings]
    ramp = [f"raised by {settings['ramp_hz_per_s']} Hz/s"] if "ramp_hz_per_s" in settings else []
    if not signal + ramp:
        return ()
    bounds = [setting_in_words(key, value) for key, value in limits.items()] if isinstance(limits, dict) else []
    return (", ".join(signal + ramp), *([f"limits of the bench: {', '.join(bounds)}"] if bounds else []))


def _instrument(about: Mapping[str, Any]) -> tuple[str, ...]:
    """Who answered, where, and the settings of the measurement: those at its end."""
    where = f"{about.get('identity', 'did not answer')} at {about.get('address', 'an unknown address')}"
    settings = about.get("settings_end")
    if not isinstance(settings, dict):
        return where, "settings not recorded"
    return where, settings_in_words(settings)

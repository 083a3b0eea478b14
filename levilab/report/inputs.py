"""What a report says of one input, whatever the analysis: when, under which conditions, with what, what happened."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from levilab.errors import unquote
from levilab.pipelines.inputs.source import Source, mark_of
from levilab.pipelines.part import InputPart, ReportPart
from levilab.pipelines.tune.owner import washers_text
from levilab.present.clock import in_utc, moment
from levilab.present.document.blocks import Block, Details, Fact, Facts, Listing, Note, Section, Tabular, with_marks
from levilab.present.tables import table
from levilab.present.units import split
from levilab.present.words import setting_in_words, settings_in_words, value_in_words
from levilab.runs.run import RunRecord
from levilab.texts.text import Text, in_language, text_from, verbatim

#: Events printed in the page; more stay in the run folder.
MOST_EVENTS = 100
#: With more events they are folded away on a screen.
_FEW_EVENTS = 12
#: What the drive's line says beside its signal.
_DRIVE = ("drive_waveform", "drive_frequency_hz", "drive_amplitude_vpp")
#: The settings of the experiment that the drive's line says.
_IN_DRIVE = frozenset({*_DRIVE, "ramp_hz_per_s"})


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
    """One input as a report shows it.

    Attributes:
        facts: in their order.
        blocks: below the facts: what was changed, what happened, the readings.
    """

    name: str
    facts: tuple[Fact, ...]
    blocks: tuple[Block, ...]

    @property
    def more(self) -> str:
        """Its status unless that is finished, and the number of its readings."""
        facts = {fact.name: fact.texts for fact in self.facts}
        texts = [*facts.get("Status", ()), *facts.get("Readings", ())[:1]]
        return Text("{texts}", texts=tuple(text for text in texts if text != "finished"))

    def without(self, common: Sequence[Fact]) -> Input:
        """Return the input without the facts that all inputs share."""
        return replace(self, facts=tuple(fact for fact in self.facts if fact not in common))

    def section(self) -> Section:
        """Return the input below a heading of its own."""
        return Section(self.name, (Facts(self.facts), *self.blocks))

    def fold(self, on_paper: Literal["whole", "summary"]) -> Details:
        """Return the input as one of several, which can be opened on a screen."""
        return Details(self.name, (Facts(self.facts), *self.blocks), more=self.more, on_paper=on_paper)


def in_common(inputs: Sequence[Input]) -> tuple[Fact, ...]:
    """Return the facts that all inputs share, if they are several: one alone needs no table."""
    first, *others = inputs
    shared = tuple(fact for fact in first.facts if all(fact in other.facts for other in others))
    return shared if len(shared) > 1 else ()


def describe(parts: Sequence[About]) -> Input:
    """Return what is known of an input, of which several analyses may say something."""
    source = parts[0].source
    own = (_fold_listing(block) for one in parts for block in one.part.blocks)
    return Input(
        name=source.name if len({one.source.name for one in parts}) == 1 else verbatim(source.path.name),
        facts=tuple(fact for fact in _facts(source, parts) if any(fact.texts)),
        blocks=(*_changes(source), *_events(source), *with_marks(own, mark_of([source]))),
    )


def _fold_listing(block: Block) -> Block:
    """Return a listing of readings below its title, which opens it; any other block as it is."""
    if not isinstance(block, Listing):
        return block
    return Details(block.table.title, (replace(block, table=replace(block.table, title="")),))


def _facts(source: Source[Any], parts: Sequence[About]) -> list[Fact]:
    about_readings = _of_one(parts[0]) if len(parts) == 1 else [_of_several(part) for part in parts]
    none = Fact("Instruments", ("no instruments recorded",))
    if source.run is None:
        return [*about_readings, none]
    record = source.run.record
    made_up = (
        (_sentence(text_from(record.synthetic_says, record.synthetic_how or "not said how"), record.seed),)
        if record.synthetic
        else ()
    )
    instruments = [Fact(kind.capitalize(), _instrument(about)) for kind, about in record.instruments.items()]
    return [
        Fact("Synthetic", made_up),
        Fact("Group", (verbatim(record.group),) if record.group else ()),
        Fact("Run", (verbatim(source.path.name),) if source.path.name != source.name else ()),
        Fact("Note", (verbatim(record.note),) if record.note else ()),
        Fact("Temperature", () if record.temperature_c is None else (f"{record.temperature_c:g} °C",)),
        Fact("Washers", () if record.washers_kg is None else (washers_text(record.washers_kg),)),
        Fact("When", (*_when(record), *_local_start(source))),
        Fact("Status", (source.run.status,)),
        *about_readings,
        Fact("Drive", _drive(record)),
        Fact("Conditions", _conditions(record)),
        *(instruments or [none]),
    ]


def _of_one(about: About) -> list[Fact]:
    """Return what the only analysis says."""
    alone = [Fact("This run alone", (about.part.alone,))] if about.several else []
    return [*alone, Fact("Readings", about.part.readings), Fact("Analysis", (about.part.origin,))]


def _of_several(about: About) -> Fact:
    """Return what one of several analyses says."""
    subject = about.whole.subject
    alone = (about.part.alone,) if about.several else ()
    return Fact(subject[0].upper() + subject[1:], (*alone, *about.part.readings, about.part.origin))


def _sentence(how: str, seed: int | None) -> str:
    """Return how the input was made, without saying again that it is synthetic."""
    text = how.removeprefix("SYNTHETIC").lstrip(":, ") if how.startswith("SYNTHETIC:") else how
    return text if seed is None else Text("{made} (seed {seed})", made=text, seed=seed)


# --- when, and what happened ---------------------------------------------------------------------------


def _when(record: RunRecord) -> tuple[str, ...]:
    """Begin and end, as far as they are known; a virtual clock may have made one of them."""
    ends = [in_utc(utc) for utc in (record.started_utc, record.ended_utc) if utc]
    first, *last = dict.fromkeys(ends) or ("",)
    return (Text("{first} to {last}", first=first, last=last[0]) if last else first,)


def _local_start(source: Source[Any]) -> tuple[str, ...]:
    """Return the start on the clock of the person who reads."""
    if source.start is None:
        return ()
    said = "time zero at {moment}, local time" if source.time_zero else "started at {moment}, local time"
    return (Text(said, moment=moment(source.start)),)


def _events(source: Source[Any]) -> tuple[Block, ...]:
    """Return what happened, in the order of time."""
    events = source.run.events() if source.run else []
    if not events or source.run is None:
        return ()
    zero = source.run.record.time_zero_utc
    told = [(_moment(one, zero), in_language(text_from(one.get("says"), one["text"]))) for one in events[:MOST_EVENTS]]
    rows = [(at, unquote(text)) for at, text in told]
    left_out = len(events) - MOST_EVENTS
    note = Text("and {n} more, in events.jsonl", n=left_out) if left_out > 0 else ""
    if len(rows) <= _FEW_EVENTS:
        said = tuple(Text("{at:n}: {text}", at=at, text=text) if at else text for at, text in rows)
        return (Facts((Fact("What happened", said),)),)
    heads = ("at", "what happened")
    shown = Tabular("events", table("", heads, rows, numbers=heads[:1]), note, wraps=heads[1:])
    return (Details("What happened", (shown,), more=Text("{n} events", n=len(events)), on_paper="out"),)


def _moment(event: Mapping[str, Any], zero: str | None) -> str:
    """Return when on the clock of the readings; "before" time zero there is none."""
    if event["time_s"] is not None:
        return f"{event['time_s']:.1f} s"
    return "before" if zero is None or str(event.get("utc", zero)) < zero else ""


# --- with what -----------------------------------------------------------------------------------------


def _drive(record: RunRecord) -> tuple[str, ...]:
    """Return what drove the top before the readings, and what the bench stands."""
    settings = record.table(record.experiment)
    if settings.get(_DRIVE[1], 0) is None:  # nothing drives the top
        return ()
    signal = [value_in_words(key, settings[key]) for key in _DRIVE if key in settings]
    ramp = [Text("raised by {ramp} Hz/s", ramp=settings["ramp_hz_per_s"])] if "ramp_hz_per_s" in settings else []
    if not signal + ramp:
        return ()
    bounds = [setting_in_words(key, value) for key, value in record.table("limits").items()]
    limit = [Text("limits of the bench: {bounds}", bounds=tuple(bounds))] if bounds else []
    return (Text("{settings}", settings=(*signal, *ramp)), *limit)


def _conditions(record: RunRecord) -> tuple[str, ...]:
    """Return the other settings of the experiment."""
    settings = record.table(record.experiment)
    said = _IN_DRIVE if _drive(record) else frozenset()
    others = [
        setting_in_words(key, settings[key])
        for key in sorted(settings)
        if key not in said and settings[key] is not None
    ]
    return (Text("{settings}", settings=tuple(others)),) if others else ()


def _instrument(about: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the instrument's identity and link, and the settings of the measurement: at its end, else at its start."""
    identity, address = about.get("identity", "did not answer"), about.get("address", "an unknown address")
    where = Text("{identity} at {address}", identity=str(identity), address=str(address))
    at_start, at_end = (about.get(when) for when in ("settings_start", "settings_end"))
    if isinstance(at_end, dict):
        return where, settings_in_words(at_end)
    if isinstance(at_start, dict):
        return where, Text("at the start, no later settings are recorded: {settings}", settings_in_words(at_start))
    return where, "settings not recorded"


def _changes(source: Source[Any]) -> tuple[Block, ...]:
    """Return which settings differ between start and end."""
    instruments = source.run.record.instruments if source.run else {}
    both = [
        (kind.capitalize(), about["settings_start"], about["settings_end"])
        for kind, about in instruments.items()
        if all(isinstance(about.get(when), dict) for when in ("settings_start", "settings_end"))
    ]
    if not both:
        return ()
    rows = [row for one in both for row in _differences(*one)]
    if not rows:
        return (Note("No setting of an instrument changed between start and end."),)
    heads = ("instrument", "setting", "at the start", "at the end")
    changes = (Tabular("changes", table("", heads, rows)),)
    return (Details("Settings that changed between start and end", changes, on_paper="out"),)


def _differences(kind: str, start: Mapping[str, Any], end: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    """Yield a row for each setting that both have; the name of the instrument stands in its first alone."""
    name = kind
    for key in (key for key in end if key in start and start[key] != end[key]):
        yield (
            name,
            setting_name(key),
            *(Text("{value:n}", value=value_in_words(key, when[key])) for when in (start, end)),
        )
        name = ""


def setting_name(key: str) -> str:
    """Return a setting's name without its unit.

    >>> setting_name("trigger_level_v"), setting_name("sweep")
    ('trigger level', 'sweep')
    """
    return split(key)[0].replace("_", " ")

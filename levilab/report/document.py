"""Results → a document: what the data say, the figure, notes, then with what they were measured."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

from levilab.crosscheck.own.study import OWN, quick_study
from levilab.crosscheck.stored import read_study
from levilab.crosscheck.study import Study
from levilab.crosscheck.table import blocks_of, not_right_as_text
from levilab.errors import unquote
from levilab.pipelines.analyzed import A, Analyzed
from levilab.pipelines.document import Analysis
from levilab.pipelines.inputs.names import each_once
from levilab.pipelines.inputs.source import Source, mark_of
from levilab.pipelines.part import ReportPart
from levilab.present.document.blocks import (
    Banner,
    Block,
    Code,
    Document,
    Facts,
    Note,
    Paragraph,
    Picture,
    Section,
    Tabular,
    Verdict,
    Warnings,
    with_marks,
)
from levilab.present.numbers import enumeration, list_in_words
from levilab.report.beside import GOOD, class_of, count_marks
from levilab.report.inputs import About, Input, describe, in_common
from levilab.report.reproduction import Asked, paths_in_commands, reproduction
from levilab.texts.note import is_doubt
from levilab.texts.text import Sentences, Text, how_many, in_language

Results = Sequence[tuple[Analysis[Any], Any]]


#: With more inputs the report is an overview: the section of each can be opened, and the figure is a PNG, a tenth as
#: large as an SVG with the lines of all of them.
MOST_IN_FULL = 12


def document_of(results: Results, others: Sequence[Section] = (), asked: Asked | None = None) -> Document:
    """Return the report.

    Args:
        results: of measurements: analyses with what they found.
        others: sections of inputs that are no measurement; at least one of the two has something in it.
        asked: what was asked for; None: the whole report, but no cross-check where none is stored.
    """
    asked = asked or Asked(crosscheck=False)
    parts = [analysis.part(found) for analysis, found in results]
    alone = len(results) == 1 and not others
    sources = each_once(source for _, found in results for source in found.sources)
    banner = _document_banner(results, sources, others)
    blocks: list[Block] = []
    for (analysis, found), part in zip(results, parts, strict=True):
        own = blocks_of_part(analysis, found, part, asked, deeper=not alone)
        again = sum(other is analysis for other, _ in results) > 1
        blocks += own if alone else [_of_one_analysis(found, part, own, first=not blocks, again=again)]
    blocks += others
    if results and not asked.short:
        blocks.append(_measurements(results, parts))
    if results:
        blocks.append(reproduction(results, asked))
    counts = count_inputs(sources)
    first, *more = dict.fromkeys([*(part.subject for part in parts), *(one.title for one in others)])
    capital = first[:1].upper() + first[1:] if parts else first
    return Document(
        title=parts[0].heading if alone else _title(counts, others),
        lead=_lead(results[0][1], parts[0]) if alone else Text("{parts}", parts=(capital, *more)),
        blocks=tuple(blocks),
        banner=banner,
        contents=True,
        subject=Sentences(first, *more, counts, between=", "),
    )


def blocks_of_part(
    analysis: Analysis[A], found: A, part: ReportPart, asked: Asked, *, deeper: bool = False
) -> list[Block]:
    """Return what one analysis found: doubts, result, figure, notes, models, what else is known, run by run.

    Args:
        analysis: the row of the catalogue.
        found: what it found.
        part: its words.
        asked: what was asked for.
        deeper: whether sections stand below a heading of the analysis, and need no links of their own.
    """

    def section(title: str, anchor: str, *blocks: Block) -> Section:
        return Section(title, blocks, anchor=f"{analysis.name}-{anchor}" if deeper else anchor)

    grave, notes = (
        tuple(
            tuple(unquote(in_language(text)) for text in alike)
            for alike in found.grouped_warnings
            if is_doubt(alike[0]) == doubtful
        )
        for doubtful in (True, False)
    )
    study = _study(analysis, found, made=asked.crosscheck)
    not_right = not_right_as_text(study, analysis.symbols) if study else ""
    if study and any(one.misleads for one in study.spreads):
        grave, not_right = ((not_right,), *grave), ""
    beside = [Paragraph(not_right)] if not_right else []
    doubts = [Warnings(grave)] if grave else []
    of = class_of(analysis, found) if len({source.group for source in found.sources if source.group}) > 1 else None
    why = ["levilab class says why."] if of and any(one.word != GOOD for one in of.marks) else []
    whose = [Paragraph(Sentences(count_marks(of), *why))] if of else []
    core = part.values or tuple(one for one in part.result if isinstance(one, Tabular))[:1]
    blocks = [
        section(
            "Result",
            "result",
            *doubts,
            Verdict(_verdict(found)),
            *whose,
            *(core if asked.short else part.result),
            *beside,
        ),
        section("Figure", "figure", picture_of(analysis, found, part, short=asked.short)),
    ]
    if asked.short:
        under = _conditions(found, part) if len(found.sources) == 1 else ()
        both: list[Block] = [*([Warnings(notes)] if notes else []), *under]
        blocks += [section("Notes and conditions" if under else "Notes", "notes", *both)] if both else []
    else:
        blocks += [section("Notes", "notes", Warnings(notes))] if notes else []
        blocks += [section("The laws compared", "laws", *part.compared)] if part.compared else []
        blocks += [_budget(analysis, found), *_trials(analysis, found, study, made=asked.crosscheck)]
        blocks += [section(part.runs_title, "runs", *part.runs)] if part.runs else []
    return with_marks(blocks, mark_of(found.sources))


def _budget(analysis: Analysis[A], found: A) -> Section:
    """Return what the uncertainties are made of."""
    lead = "What u of each result is made of, what would make it smaller, and what it does not contain."
    return Section("Uncertainty budget", analysis.budgets(found), anchor="budget", lead=lead)


def _study(analysis: Analysis[Any], found: Any, *, made: bool) -> Study | None:
    """Return the cross-check that `levilab crosscheck --like` made of this result.

    made: where there is none, whether one is made of as many trials as a report has time for.
    """
    settings = analysis.settings_of(found)
    study = read_study(found.place, analysis.name, [source.sha256 for source in found.sources], settings)
    return quick_study(analysis.name, found, settings) if made and study is None and analysis.name in OWN else study


def _trials(analysis: Analysis[Any], found: Any, study: Study | None, *, made: bool) -> Iterable[Section]:
    """Yield the cross-check of this result; made: where there is none, how it is made."""
    named = " ".join(paths_in_commands(found.sources))
    why = Paragraph("Not made: it takes longer than a report. This makes and keeps it:")
    advice = (why, Code(f"levilab crosscheck {analysis.name} --like {named}")) if made and analysis.name in OWN else ()
    blocks = blocks_of(study, analysis.symbols) if study else advice
    if made and analysis.name not in OWN:
        why = Paragraph(
            "A cross-check of films takes minutes and cannot use the parameters of this film. This command checks "
            "films of other tops:"
        )
        yield Section("Cross-check", (why, Code(f"levilab crosscheck {analysis.name}")), anchor="crosscheck")
    if blocks:
        lead = (
            "Synthetic readings with the values, times and scatter of this result went through the same analysis: does "
            "it find these values, and are its u right?"
        )
        yield Section("Cross-check with these parameters", tuple(blocks), anchor="crosscheck", lead=lead)


def _verdict(found: Analyzed[Any, Any, Any, Any]) -> str:
    """Return what the data say; it is read alone, and says itself that real and synthetic inputs are mixed."""
    if not _mixes(found):
        return found.text
    made_up = sum(source.synthetic for source in found.sources)
    return Text(
        "MIXED, and so no measurement ({some} of {all} inputs are SYNTHETIC): {said}",
        some=made_up,
        all=len(found.sources),
        said=found.text,
    )


def picture_of(analysis: Analysis[A], found: A, part: ReportPart, *, short: bool = False) -> Picture:
    """Return the analysis's figure; short: the short one, where it has one."""
    many = len(found.sources) > MOST_IN_FULL
    words = part.short_figure if short and part.short_figure else part.figure
    return Picture(
        name=analysis.name,
        title=words.title,
        caption=words.caption,
        alt=words.title,
        draw=partial(analysis.figure, found, short=words is part.short_figure),
        points=() if many else words.points,
        raster=many,
        most_inch=_SHORT_INCH if short else math.inf,
    )


def _of_one_analysis(
    found: Analyzed[Any, Any, Any, Any], part: ReportPart, blocks: Iterable[Block], *, first: bool, again: bool
) -> Section:
    """Return one of several analyses below a heading of its own; again: there is another result of this analysis."""
    names = list_in_words([source.name for source in found.sources])
    mixed = _mixes(found)
    mark = banner_of(found.sources, mixed=True) if mixed else None
    return Section(
        Text("{heading}: {names}", heading=part.heading, names=names) if again else part.heading,
        (*([mark] if mark else []), *blocks),
        anchor=part.subject,
        lead=_lead(found, part),
        new_page=not first,
    )


def _title(counts: str, others: Sequence[Section]) -> str:
    """Return the title of a document of several parts; counts: of the measurements, empty for none."""
    if not counts:
        return others[0].title if len(others) == 1 else Text("Report of {n} simulations", n=len(others))
    return Text("Report of {counts}{others}", counts=counts, others=", with simulations" if others else "")


def _lead(found: Analyzed[Any, Any, Any, Any], part: ReportPart) -> str:
    """Return the amount of data used."""
    notes = count_notes(sum(map(len, found.grouped_warnings)))
    return Text("{inputs}, {used}, {notes}", inputs=count_inputs(found.sources), used=part.lead, notes=notes)


#: Height of the figure in a short report, which leaves room for the rest of the page [inch].
_SHORT_INCH = 3.0
#: What a short report says of its input, unless it is longer than some lines.
_SHORT_LETTERS = 300
_SHORT_FACTS = frozenset({"Group", "Note", "Temperature", "Washers", "When", "Drive", "Conditions"})


def _conditions(found: Analyzed[Any, Any, Any, Any], part: ReportPart) -> tuple[Note, ...]:
    """Return under which conditions the only input was measured, in a line."""
    facts = describe([About(found.sources[0], part, part.inputs[0], several=False)]).facts
    said = [Text("{name}: {texts}", name=one.name, texts=one.texts) for one in facts if one.name in _SHORT_FACTS]
    few = [text for text in said if len(text) <= _SHORT_LETTERS]
    return (Note(Sentences(*few, between=". ")),) if few else ()


def _measurements(results: Results, parts: Sequence[ReportPart]) -> Section:
    """Return each input: when, under which conditions, with which instruments; what happened; its readings."""
    abouts: dict[Path, list[About]] = {}
    for (_, found), part in zip(results, parts, strict=True):
        several = len(found.sources) > 1
        for source, of_input in zip(found.sources, part.inputs, strict=True):
            abouts.setdefault(source.path.resolve(), []).append(About(source, part, of_input, several))
    inputs = [describe(of_input) for of_input in abouts.values()]
    if len({one.name for one in inputs}) < len(inputs):
        sources = each_once(source for _, found in results for source in found.sources)
        inputs = [replace(one, name=source.name) for one, source in zip(inputs, sources, strict=True)]
    return Section("What was measured, and with what", tuple(_overview(inputs)), anchor="inputs")


def _overview(inputs: Sequence[Input]) -> Iterable[Block]:
    """Return the inputs: what several share once, and the rest of each folded away; on paper of many a line each."""
    common = in_common(inputs) if len(inputs) > 1 else ()
    if common:
        yield Section("All of them alike", (Facts(common),))
    if len(inputs) == 1:
        yield inputs[0].section()
        return
    on_paper: Literal["whole", "summary"] = "whole" if len(inputs) <= MOST_IN_FULL else "summary"
    yield Section("Each by itself", tuple(one.without(common).fold(on_paper) for one in inputs))


# --- what is synthetic ---------------------------------------------------------------------------------


def _document_banner(results: Results, sources: Sequence[Source[Any]], others: Sequence[Section]) -> Banner | None:
    """Return the mark of the whole document."""
    if not results:
        return Banner("SYNTHETIC.", "All of it was simulated on a computer; nothing was measured.") if others else None
    mixed = _mixes(results[0][1]) if len(results) == 1 else False
    mark = banner_of(sources, mixed=mixed)
    if mark is None and others:
        return Banner("SYNTHETIC IN PART.", "Chapters that say so are of simulations on a computer.")
    return mark


def _mixes(found: Analyzed[Any, Any, Any, Any]) -> bool:
    """Return whether numbers are of real and synthetic inputs together."""
    return any(0 < sum(one.synthetic for one in together) < len(together) for together in found.averaged)


def banner_of(sources: Sequence[Source[Any]], *, mixed: bool = False) -> Banner | None:
    """Return which inputs are synthetic, and a warning of numbers that mix them with real ones."""
    total, made_up = len(sources), [source.name for source in sources if source.synthetic]
    files = sum(source.run is None for source in sources)
    if not made_up:
        return None
    if total == 1:
        run = "This run did not come from a real bench. How it was made stands in its run.json."
        return Banner(
            "SYNTHETIC.", "This file did not come from a real bench: its first line says so." if files else run
        )
    how = "How each was made stands in its run.json." if any(one.run for one in sources if one.synthetic) else ""
    if len(made_up) == total:
        said = Text("None of these {total} runs came from a real bench.", total)
        if files:
            said = Text("{inputs}: none came from a real bench.", inputs=count_inputs(sources))
        return Banner("SYNTHETIC.", Sentences(said, how))
    said = Text(
        "{some} of {total} runs did not come from a real bench ({names}).", len(made_up), total, list_in_words(made_up)
    )
    if not mixed and files:
        said = Text(
            "Of {inputs}, {some} did not come from a real bench ({names}).",
            inputs=count_inputs(sources),
            some=len(made_up),
            names=list_in_words(made_up),
        )
        return Banner("SYNTHETIC IN PART.", Sentences(said, "A data file seldom says where it is from.", how))
    if not mixed:
        return Banner("REAL AND SYNTHETIC RUNS.", Sentences(said, how))
    consequence = (
        "Means, comparisons and figure are of both together and so no measurement: report the real runs by themselves."
    )
    return Banner("REAL AND SYNTHETIC RUNS MIXED.", Sentences(said, consequence, how))


# --- a part in a notebook ------------------------------------------------------------------------------


def notebook_blocks(analysis: Analysis[A], found: A) -> tuple[Block, ...]:
    """Return the blocks of one analysis for another page: below a heading, with the origin of synthetic inputs."""
    part = analysis.part(found)
    mark = banner_of(found.sources, mixed=_mixes(found))
    made_up = [
        Note(f"{source.name}: {source.run.record.synthetic_how or 'not said how'}")
        for source in found.sources
        if source.run and source.run.record.synthetic
    ]
    how = [Section("How it was made", tuple(made_up))] if made_up else []
    blocks = (*([mark] if mark else []), *blocks_of_part(analysis, found, part, Asked(crosscheck=False)), *how)
    return (Section(part.heading, blocks, lead=_lead(found, part)),)


# --- words ---------------------------------------------------------------------------------------------


def count_notes(count: int) -> str:
    """Return how many notes."""
    return Text("{n} notes", n=count) if count > 1 else "1 note" if count else "no notes"


def count_inputs(sources: Sequence[Source[Any]]) -> str:
    """Return how many inputs of which kind: "4 runs and 1 data file"."""
    files = sum(source.run is None for source in sources)
    kinds = ((len(sources) - files, "run"), (files, "data file"))
    counts = [how_many(n, kind) for n, kind in kinds if n]
    return enumeration(counts) if counts else ""

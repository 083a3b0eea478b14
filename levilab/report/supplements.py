"""What a report says of an analysis beyond its own part: here other rooms add sections, a row each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from levilab.crosscheck.own.study import OWN, quick_study
from levilab.crosscheck.stored import read_study
from levilab.crosscheck.table import blocks_of
from levilab.present.document.blocks import Code, Paragraph, Section
from levilab.report.reproduction import paths_in_commands

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.pipelines.document import Analysis
    from levilab.present.document.blocks import Block

    Supplement = Callable[[Analysis[Any], Any], tuple[Block, ...]]


def budget(analysis: Analysis[Any], found: Any) -> tuple[Block, ...]:
    """Return what the uncertainties are made of."""
    lead = "What u of each result is made of, what would make it smaller, and what it does not contain."
    return (Section("Uncertainty budget", analysis.budgets(found), anchor="budget", lead=lead),)


def stored_trials(analysis: Analysis[Any], found: Any) -> tuple[Block, ...]:
    """Return the cross-check that `levilab crosscheck --like` made of this result."""
    settings = analysis.settings_of(found)
    known = read_study(found.place, analysis.name, [source.sha256 for source in found.sources], settings)
    return () if known is None else (_section(*blocks_of(known, analysis.symbols)),)


def trials(analysis: Analysis[Any], found: Any) -> tuple[Block, ...]:
    """Return the same; where there is none a shorter one, of as many trials as a report has time for."""
    stored = stored_trials(analysis, found)
    if stored or analysis.name not in OWN:
        return stored
    made = quick_study(analysis.name, found, analysis.settings_of(found))
    if made is not None:
        return (_section(*blocks_of(made, analysis.symbols)),)
    named = " ".join(paths_in_commands(found.sources))
    advice = Code(f"levilab crosscheck {analysis.name} --like {named}")
    return (_section(Paragraph("Not made: it takes longer than a report. This makes and keeps it:"), advice),)


def _section(*blocks: Block) -> Section:
    lead = "Readings made up with these values, times and scatters, through the same analysis: is it right here?"
    return Section("Cross-check with these parameters", blocks, anchor="crosscheck", lead=lead)


#: An analysis and what it found → blocks that stand between its figure and the part run by run; none where there is
#: nothing to say.  In this order.
SUPPLEMENTS: tuple[Supplement, ...] = (budget, stored_trials)
#: The same with a cross-check where there is none yet.
WITH_TRIALS: tuple[Supplement, ...] = (budget, trials)

"""Uncertainty budgets of results: the rows that analyses share, and how people are shown a budget."""

import math
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal

from analysis.budget import Budget, Component, u_of_limit
from analysis.numbers import digits
from analysis.uncertainty import Estimate
from instruments.time_bases import TIME_BASES
from levilab.pipelines.analyzed import Analyzed
from levilab.pipelines.inputs.source import Source, mark_of
from levilab.present.document.blocks import Block, Bullets, Details, Note, Paragraph, Tabular
from levilab.present.numbers import enumeration, with_uncertainty
from levilab.present.tables import Row, Table, table
from levilab.present.units import unit
from levilab.texts.text import Sentences, Text

#: No gate is longer [s]; what another program wrote beyond is none.
_LONGEST_GATE_S = 1e4
#: A row of unknown size says what so much of it would add (relative).
_TEN_PPM = 1e-5
#: Shares of u² below this are shown as such.
_LEAST_SHARE = 0.001
_REFERENCE = "a reference of 10 MHz at the instrument's input, or a comparison with one"


def time_base(source: Source[Any], kind: str, sensitivity: float, given: float | None, *, what: str = "") -> Component:
    """Return the row of an instrument's clock, which no repetition shows, so that it is in no u.

    Args:
        source: the input.
        kind: of the instrument, as run.json has it: "counter".
        sensitivity: of the result to a relative error of the clock.
        given: relative standard uncertainty, as given to the analysis.
        what: the row in words; empty: the time base of the instrument.
    """
    what = what or Text("time base of the {kind}", kind=kind)
    record = source.run.record if source.run else None
    if record and kind == "counter" and record.configuration.get("count_with"):
        kind = str(record.configuration["count_with"])
    about = record.instruments.get(kind) if record else None
    measured = source.settings(kind).get("clock_u")
    driver = str((about or {}).get("driver", ""))[:40]
    known = TIME_BASES.get(driver)
    remedy = known.remedy if known and known.remedy else _REFERENCE
    if given is not None:
        u, note = given, "as given to the analysis"
    elif isinstance(measured, float) and measured > 0:
        u, note = measured, Text("{kind:s}.clock_u of the bench file", kind=kind)
    elif drift := _clock_drift(about):
        u = math.hypot(*drift)
        note = Text(
            "it gained {gained:.0f}×10⁻⁶ on the computer's clock during the run, to {u:.0f}×10⁻⁶",
            gained=1e6 * drift[0],
            u=1e6 * drift[1],
        )
    elif known:
        u = u_of_limit(known.limit)
        note = Text(
            "±{limit:g}×10⁻⁶ when new, even over that range, and {drift:g}×10⁻⁶ more each year ({manual})",
            limit=known.limit * 1e6,
            drift=known.per_year * 1e6,
            manual=known.source,
        )
    elif about:
        u, note = (
            None,
            Text("not known for {driver}: the option --clock-u gives it, from its manual", driver or "this instrument"),
        )
    else:
        u, note = None, "no instrument is recorded: the option --clock-u gives it, from the manual"
    return Component("time_base", what, "B", u, "1", sensitivity, included=False, note=note, remedy=remedy)


def _clock_drift(about: Mapping[str, Any] | None) -> tuple[float, float] | None:
    """Return how much faster than the bench's an instrument's clock was found to go, relative, and u; None: unknown."""
    found = (about or {}).get("settings_end")
    drift = [found.get(name) for name in ("clock_drift", "clock_drift_u")] if isinstance(found, dict) else []
    known = [float(value) for value in drift if isinstance(value, int | float) and not isinstance(value, bool)]
    return (known[0], known[1]) if len(known) == 2 else None


def bench_clock(sensitivity: float) -> Component:
    """Return the row of the clock by which readings have their times; see `time_base`."""
    return Component(
        "bench_clock",
        "clock of the readings' times",
        "B",
        None,
        "1",
        sensitivity,
        included=False,
        note="that of the computer, whose rate is not known; one that is set by the network is right to 10⁻⁶ or so",
        remedy="a computer whose clock is set by the network",
    )


def direct_row(  # noqa: PLR0917 - the fields of a row
    name: str, what: str, part: float, unit: str, note: str, remedy: str, kind: Literal["A", "B"] = "B"
) -> Component:
    """Return a row whose size is known in the result's own unit alone [`unit`]; see `Component`."""
    return Component(name, what, kind, part, unit, 1.0, note=note, remedy=remedy)


def gate_of(source: Source[Any], experiment: str) -> float | None:
    """Return the counter's gate [s], where a run says it."""
    gate = source.number(experiment, "gate_s")
    return gate if gate is not None and 0 < gate < _LONGEST_GATE_S else None


# --- how people are shown it ---------------------------------------------------------------------------

#: Heads of the table, of which the numbers stand to the right.
HEADS = ("source", "type", "u of it", "sensitivity", "adds to u", "share of u²")
#: Shown unit of a sensitivity where the input has no unit, or the result.
_NO_UNIT = ""


def budget_table(budget: Budget, shown: Mapping[str, str] | None = None) -> Table:
    """Return a row for each component: what u is made of, u, and what it does not contain.

    Args:
        budget: of one result.
        shown: quantity → its symbol; by default its name.
    """
    budget = _in_shown_units(budget)
    rows = [Row(_cells(budget, one)) for one in budget.included]
    rows.append(Row(("combined: u", "", "", "", _number(budget.u, budget.unit), "100 %"), "together"))
    left_out = budget.left_out
    rows += [
        Row((Text("{source} (not in u)", cells[0]), *cells[1:])) for one in left_out if (cells := _cells(budget, one))
    ]
    if any(one.contribution for one in left_out):
        rows.append(
            Row(("u with all that is known", "", "", "", _number(budget.u_with_all, budget.unit), ""), "together")
        )
    return table(title_of(budget, shown), HEADS, rows, numbers=HEADS[2:])


def _in_shown_units(budget: Budget) -> Budget:
    """Return the same in the units that people read."""
    shown, factor = unit(budget.unit).fine
    rows = []
    for one in budget.components:
        of_input, times = unit(one.unit).fine
        u = None if one.u is None else one.u * times
        rows.append(replace(one, u=u, unit=of_input, sensitivity=one.sensitivity * factor / times))
    return replace(budget, value=budget.value * factor, u=budget.u * factor, unit=shown, components=tuple(rows))


def title_of(budget: Budget, shown: Mapping[str, str] | None = None) -> str:
    """Return the result, with its uncertainty."""
    name = (shown or {}).get(budget.quantity, budget.quantity.replace("_", " "))
    of = Text(" ({model})", model=budget.model) if budget.model else ""
    return Text("{name} = {value:n}{of}", name, with_uncertainty(Estimate(budget.value, budget.u, budget.unit)), of)


def _cells(budget: Budget, one: Component) -> tuple[str, ...]:
    share = budget.share(one)
    return (
        one.source,
        one.kind,
        "not known" if one.u is None else _number(one.u, one.unit),
        _number(abs(one.sensitivity), _ratio(budget.unit, one.unit)),
        "—" if one.contribution is None else _number(one.contribution, budget.unit),
        _percent(share) if one.included else "",
    )


def _number(value: float, unit: str) -> str:
    """Two digits: no uncertainty is known better."""
    return Text("{number:n} {unit}", number=digits(value), unit=unit) if unit else digits(value)


def _ratio(above: str, below: str) -> str:
    """Return the unit of a sensitivity."""
    if above == below:
        return ""
    if below == _NO_UNIT:
        return above
    return Text("per {unit}", unit=below) if above == _NO_UNIT else Text("{unit} per {below}", unit=above, below=below)


def _percent(share: float | None) -> str:
    """Return a share of u².

    >>> _percent(0.9312), _percent(0.00002), _percent(None)
    ('93 %', '< 0.1 %', '—')
    """
    if share is None:
        return "—"
    return "< 0.1 %" if share < _LEAST_SHARE else Text("{percent:n} %", percent=digits(100 * share, 2))


def sentences_of(budget: Budget, shown: Mapping[str, str] | None = None) -> list[str]:
    """Return what dominates u of a result, what would make it smaller, and what it does not contain."""
    name = (shown or {}).get(budget.quantity, budget.quantity.replace("_", " "))
    budget = _in_shown_units(budget)
    largest, texts = budget.largest, []
    if largest is not None:
        texts.append(
            Text(
                "{percent} of u² of {name} comes from: {source}.", _percent(budget.share(largest)), name, largest.source
            )
        )
        texts += [Text("u gets smaller with {remedy}.", remedy=largest.remedy)] if largest.remedy else []
    known = [one for one in budget.left_out if one.contribution]
    if known and not budget.misses_nothing:
        whole = _number(budget.u_with_all, budget.unit)
        texts.append(
            Text(
                "Not in u: {sources}; with all that is known u is {u}.",
                sources=enumeration([one.source for one in known]),
                u=whole,
            )
        )
    elif known:
        texts.append(Text("Not in u, as negligible: {sources}.", sources=enumeration([one.source for one in known])))
    unknown = [one for one in budget.left_out if one.u is None and one.sensitivity]
    clocks = [one for one in unknown if one.unit == _NO_UNIT]
    if clocks:
        most = max(abs(one.sensitivity) for one in clocks) * _TEN_PPM
        size = "less than 1 % of u" if most < 0.01 * budget.u else _number(most, budget.unit)
        texts.append(
            Text(
                "Not known: {sources}; an error of 10⁻⁵ would add {size}.",
                sources=enumeration([one.source for one in clocks]),
                size=size,
            )
        )
    return [
        *texts,
        *(
            Text("Not known: {source}; it takes {remedy}.", source=one.source, remedy=one.remedy)
            for one in unknown
            if one not in clocks
        ),
    ]


def budgets_of_result(found: Analyzed[Any, Any, Any, Any], shown: Mapping[str, str] | None = None) -> tuple[Block, ...]:
    """Return the budgets of what was found: of all inputs together, and of each.

    Args:
        found: by an analysis.
        shown: quantity → its symbol.
    """
    of_each = [
        (source, origin.budget)
        for source, origin in zip(found.sources, found.origins, strict=True)
        if len(found.sources) > 1 and origin.budget
    ]
    printed = len(of_each) if len(of_each) < _MANY else 0 if found.budget else 1
    each: list[Block] = [
        _by_itself(source, budgets, shown, is_printed=k < printed)
        for k, (source, budgets) in enumerate(of_each[:_MOST_RUNS])
    ]
    if printed < len(each) and not found.budget:
        each.append(Note("Only the first of them is printed; all are in the report as HTML, and in result.json."))
    if not found.budget and not each:
        return (Paragraph("No uncertainty was determined, so that there is none to divide."),)
    together = budget_blocks(found.budget, shown, mark=lambda budget: mark_of(found.inputs_of(budget.group)))
    return (*together, *each)


def _by_itself(
    source: Source[Any], budgets: Sequence[Budget], shown: Mapping[str, str] | None, *, is_printed: bool
) -> Details:
    """Return the budgets of one input among several."""
    blocks = budget_blocks(budgets, shown, source.name, lambda _: mark_of([source]))
    return Details(Text("{name:s} by itself", name=source.name), blocks, on_paper="whole" if is_printed else "out")


#: Of several results these first ones have their budget on paper, the others a line.
_PRINTED = 2
#: Number of runs from which on their budgets are not printed on paper, but for the first one where no mean has one; and
#: the most that a report has.
_MANY, _MOST_RUNS = 3, 12


def budget_blocks(
    budgets: Sequence[Budget],
    shown: Mapping[str, str] | None = None,
    of: str = "",
    mark: Callable[[Budget], str] | None = None,
) -> tuple[Block, ...]:
    """Return each budget in a line that opens its table, what holds for several once, then the sources of the numbers.

    Args:
        budgets: of the results.
        shown: quantity → its symbol.
        of: the input, for the names of tables; empty for all of them together.
        mark: what a result is synthetic of, see `Tabular`.
    """
    blocks: list[Block] = []
    said = [sentences_of(budget, shown) for budget in budgets]
    counts = Counter(text for texts in said for text in texts)
    of_all = [text for text, count in counts.items() if count > 1]
    for k, (budget, texts) in enumerate(zip(budgets, said, strict=True)):
        on_paper: Literal["whole", "summary"] = "whole" if k < _PRINTED else "summary"
        words = " ".join(filter(None, ("budget", of, budget.model, budget.quantity)))
        name = re.sub(r"[^a-z0-9]+", "-", words.casefold()).strip("-")
        found = budget_table(budget, shown)
        part = Tabular(name, replace(found, title=""), first_column_wraps=True, mark=mark(budget) if mark else None)
        more = Sentences(*(text for text in texts if text not in of_all))
        blocks.append(Details(found.title, (part,), more=more, on_paper=on_paper))
    blocks += [Paragraph(Sentences(*of_all))] if of_all else []
    notes = notes_of(budgets)
    if notes:
        explained = Details("What the columns mean", (Note(EXPLAINED),), on_paper="out")
        blocks.append(Details("Where these uncertainties come from", (Bullets(tuple(notes)), explained)))
    return tuple(blocks)


#: What the columns and rows of a budget mean.
EXPLAINED = (
    "Type A is evaluated from a scatter that was seen, type B from anything else (GUM). The sensitivity is the change "
    "of the result with the input, and what a row adds to u is the sensitivity times the u of the input; squares add "
    "up to u². What is not in u is common to all readings and runs, so that no repetition shows it."
)


def notes_of(budgets: Sequence[Budget]) -> list[str]:
    """Return the sources of the numbers in the rows, each once."""
    said = (
        Text("{source}: {note}", one.source, one.note) for budget in budgets for one in budget.components if one.note
    )
    return list(dict.fromkeys(said))

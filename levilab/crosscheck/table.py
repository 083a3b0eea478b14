"""A cross-check as people see it: the table, its meaning as text, the blocks of a report."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from analysis.numbers import digits
from levilab.crosscheck.own.model import OF_ONE_RUN
from levilab.crosscheck.own.study import ENOUGH, TRIALS
from levilab.crosscheck.study import LONG_TAILS, Judge, Spread, Study, Verdict, by_pulls
from levilab.present.document.blocks import Block, Details, Note, Paragraph, Tabular
from levilab.present.numbers import enumeration, with_sign
from levilab.present.tables import Row, Table, table
from levilab.texts.text import Sentences, Text, how_many

_NUMBERS = ("pulls", "mean pull", "s.d. of pulls\n(wanted)", "within 1 u\n(wanted)", "u/value")
#: Degrees of freedom from which on u is as if known.
_MANY = 30


def crosscheck_table(
    studies: Sequence[Study], symbols: Mapping[str, str] | None = None, judge: Judge = by_pulls
) -> Table:
    """Return a table with a row a quantity; behind ± stands the standard error, in parentheses what is wanted.

    Args:
        studies: with their trials.
        symbols: quantity → its symbol.
        judge: from the pulls of a quantity to the last column.
    """
    return table(
        "Pulls: (estimate − truth)/u",
        ("", "quantity", *_NUMBERS, "as wanted"),
        _rows(studies, symbols or {}, judge),
        numbers=_NUMBERS,
    )


def _rows(studies: Sequence[Study], symbols: Mapping[str, str], judge: Judge) -> Iterator[Row]:
    for study in studies:
        for k, one in enumerate(study.spreads):
            cells = (
                study.name if k == 0 else "",
                _name(one.quantity, symbols),
                str(one.n),
                f"{with_sign(one.mean, 2)} ± {one.u_mean:.2f}",
                _deviation(one),
                f"{100 * one.coverage:.0f} ± {100 * one.u_coverage:.0f} % ({100 * one.wanted_coverage:.0f} %)",
                "–" if one.relative_u is None else _percent(one.relative_u),
                judge(one).value,
            )
            yield Row(cells, "together" if k == 0 else "")


def _deviation(spread: Spread) -> str:
    """Return the standard deviation of pulls, and the wanted one; without a judgement where tails are long."""
    if math.isnan(spread.deviation):
        return "–"
    if math.isinf(spread.wanted_deviation):
        return Text("{deviation:.2f} (not judged)", deviation=spread.deviation)
    return f"{spread.deviation:.2f} ± {spread.u_deviation:.2f} ({digits(spread.wanted_deviation, 3)})"


def _percent(part: float) -> str:
    """Return two digits, and no power of ten.

    >>> _percent(0.00041), _percent(1.34)
    ('0.041 %', '134 %')
    """
    return f"{100 * part:.0f} %" if abs(part) >= 1 else f"{100 * part:.2g} %"


def _name(quantity: str, symbols: Mapping[str, str]) -> str:
    """Return the symbol or the name of a quantity.

    >>> _name("c32_of_one_run", {"c32": "C₃/₂"}), _name("start_frequency", {})
    ('C₃/₂ of one run', 'start frequency')
    """
    name = quantity.removesuffix(OF_ONE_RUN)
    called = symbols.get(name, name.replace("_", " "))
    return Text("{name} of one run", name=called) if name != quantity else called


def failures_as_text(study: Study) -> list[str]:
    """Return a sentence for each reason for which trials came to no estimate."""
    return [
        Text("{count} of {all} trials came to no estimate: {reason}.", count=count, all=study.trials, reason=reason)
        for reason, count in sorted(study.failures.items(), key=lambda item: -item[1])
    ]


def as_text(study: Study, symbols: Mapping[str, str] | None = None) -> str:
    """Return what the trials with the parameters of a result say.

    Args:
        study: the trials.
        symbols: quantity → its symbol.
    """
    texts: list[str] = [Text("{n} trials: {about}.", n=study.trials, about=study.about)]
    if not study.spreads:
        texts.append("No trial came to an estimate.")
    elif study.holds:
        so_far = (
            ""
            if study.trials >= ENOUGH
            else Text(", as far as so few trials show ({some} of {all})", some=study.trials, all=TRIALS)
        )
        texts.append(
            Text("Values and uncertainties of this analysis are right for readings such as these{so_far}.", so_far)
        )
    else:
        texts.append(not_right_as_text(study, symbols or {}))
    texts += [*_about_laws(study), *_about_student(study, symbols or {})]
    texts += study.more
    return Sentences(*texts, *failures_as_text(study))


def not_right_as_text(study: Study, symbols: Mapping[str, str]) -> str:
    """Return by how much the pulls find the analysis wrong; empty where they do not."""
    wrong = [_wrong(one, _name(one.quantity, symbols)) for one in study.spreads if one.verdict is Verdict.WRONG]
    return Text("In simulated readings like these {wrong}.", wrong=enumeration(wrong)) if wrong else ""


def _wrong(spread: Spread, symbol: str) -> str:
    """Return the errors of the estimates and of their u, with their sizes."""
    said: list[str] = []
    if abs(spread.mean) > spread.room * spread.u_mean:
        too_large = "{symbol} comes out {size:.1f} u too large on average"
        bias = too_large if spread.mean > 0 else "{symbol} comes out {size:.1f} u too small on average"
        said.append(Text(bias, symbol=symbol, size=abs(spread.mean)))
    if spread.excess > 1:
        said.append(Text("{symbol} scatters by {times:.1f} times its u", symbol=symbol, times=spread.excess))
    shares = Text(
        "{symbol} is within 1 u in {share:.0f} % of the trials instead of {wanted:.0f} %",
        symbol=symbol, share=100 * spread.coverage, wanted=100 * spread.wanted_coverage,
    )  # fmt: skip
    return enumeration(said or [shares])


def _about_laws(study: Study) -> Iterator[str]:
    """Yield how often the best law is the true one, or the true hypothesis is excluded."""
    if study.law and study.laws:
        n, again = sum(study.laws.values()), study.laws.get(study.law, 0)
        others = tuple(
            Text("{law} {times}", law=law, times="once" if count == 1 else Text("{n} times", n=count))
            for law, count in study.laws.items()
            if law != study.law
        )
        yield Text(
            "The {law} law, which is true there, is the best one in {again} of {n} trials{other}, and is excluded in "
            "{excluded}.",
            law=study.law,
            again=again,
            n=n,
            other=Text(" (else {others})", others=others) if others else "",
            excluded=study.excluded,
        )
    elif study.hypothesis and study.tested:
        chance = study.expected_share * study.tested
        yield Text(
            "The test excludes {hypothesis} in {excluded} of {tested} trials; chance alone does so in "
            "{chance:.0f} ± {u:.0f}.",
            hypothesis=study.hypothesis,
            excluded=study.excluded,
            tested=study.tested,
            chance=chance,
            u=math.sqrt(chance * (1 - study.expected_share)),
        )


def _about_student(study: Study, symbols: Mapping[str, str]) -> Iterator[str]:
    """Yield what Student's law makes of the pulls."""
    few = {one.quantity: one for one in study.spreads if one.freedom is not None and one.freedom < _MANY}
    if few:
        fewest = min(few.values(), key=lambda one: one.freedom or 0)
        freedom = fewest.freedom or 0
        share = Text("{percent:.0f} %", percent=100 * fewest.wanted_coverage)
        of = enumeration([_name(name, symbols) for name in few])
        yield Text(
            "As u of {of} comes from the scatter of few values, {share} within 1 u are right (Student's t).", of, share
        )
        if freedom <= LONG_TAILS:
            degrees = Text("{degrees} of freedom", degrees=how_many(freedom, "degree"))
            # the variance of Student's t is n/(n − 2)
            tails = "has no finite standard deviation" if freedom <= 2 else "has long tails"
            yield Text(
                "Student's t with {degrees} {tails}, so the standard deviation of these pulls is not judged.",
                degrees=degrees,
                tails=tails,
            )
    widened = next((one for one in study.spreads if one.widened is not None and one.widened < _MANY), None)
    if widened is not None:
        wanted = widened.wanted_deviation
        pulls = (
            Text("pulls have a standard deviation of {wanted:.2f}", wanted=wanted)
            if math.isfinite(wanted)
            else "pulls have long tails"
        )
        yield Text("As u comes from few pulses and holds 68 % by Student's factor, {pulls}.", pulls=pulls)


def blocks_of(study: Study, symbols: Mapping[str, str] | None = None) -> tuple[Block, ...]:
    """Return the trials as blocks of a report."""
    room = max((one.room for one in study.spreads), default=0.0)
    note = Text(
        "A pull is (estimate − truth)/u. Wanted is a mean of 0; the wanted standard deviation and "
        "share within 1 u stand in parentheses: 1 and 68 %, or what Student's t gives where u comes "
        "from few values. Behind ± stands one standard error. Yes: no number misses what is wanted "
        "by more than {room:.1f} standard errors, which chance does in one right study of a hundred; "
        "a smaller standard deviation and a larger share mean that u is on the safe side.",
        room=room,
    )
    found = crosscheck_table([study], symbols)
    # the readings of the trials are synthetic, whatever the result is of
    pulls = Tabular(f"crosscheck-{study.name}", replace(found, title=""), mark="SYNTHETIC.")
    return Paragraph(as_text(study, symbols)), Details(found.title, (pulls, Note(note)), on_paper="out")

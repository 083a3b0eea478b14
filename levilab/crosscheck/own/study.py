"""Trials with the parameters of a result: their outcome as JSON, a table and blocks of a report.

The random numbers follow from the readings' hashes, so that the same result has the same trials.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping  # noqa: TC003 - pydantic reads the types of OwnCheck when it runs
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.errors import AnalysisError
from analysis.numbers import digits
from analysis.pulses.regression import student
from levilab.crosscheck.own import field, limit, precession, spin, spindown
from levilab.crosscheck.own.model import OF_ONE_RUN
from levilab.crosscheck.study import CHANCE, COVERAGE, Spread, by_reason, spreads_of
from levilab.errors import LevilabError
from levilab.present.document.blocks import Note, Paragraph, Tabular
from levilab.present.numbers import enumeration, signed
from levilab.present.tables import Table, table

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from levilab.crosscheck.own.model import Own
    from levilab.pipelines.analyzed import Analyzed
    from levilab.present.document.blocks import Block

#: Analysis → its result as a subject of trials.
OWN: Mapping[str, Callable[[Any], Own]] = MappingProxyType({
    "spindown": spindown.own, "precession": precession.own, "spin": spin.own, "field": field.own, "limit": limit.own,
})  # fmt: skip
#: Up to so many degrees of freedom a standard deviation of pulls says nothing; from so many on u is as if known.
_LONG_TAILS, _MANY = 8, 30
#: How many trials are made where no number is asked for.
TRIALS = 200
#: A report makes as many as fit into so much processor time, but so many even if they take longer ...
REPORT_S, ENOUGH = 2.0, 25
#: ... up to this time: then as many as fit into that, which say less, and none below so few.
LONGEST_S, FEWEST = 4.0, 5


@dataclass(frozen=True)
class OwnCheck:
    """The outcome of the trials.

    Attributes:
        analysis: its name.
        inputs: sha256 of the readings, in the order of the inputs.
        settings: of the analysis, as result.json has them.
        about: what was made up.
        trials, seed: how many, and of the random numbers.
        spreads: of the pulls, one a quantity.
        law: that was true; empty where none competes.
        laws: law → how often it was favoured.
        excluded, tested: in how many trials the analysis excluded what is true, of how many that tested it.
        hypothesis, expected_share: what that is where it is no law, and the share that chance excludes.
        failures: why trials came to no estimate → how often.
        freedom: quantity → degrees of freedom of its u, where these are few.
        more: what to know of the pulls.
        widened: degrees of freedom of u in the median trial, where that has Student's factor; None: it has not.
    """

    analysis: str
    inputs: tuple[str, ...]
    settings: Mapping[str, Any]
    about: str
    trials: int
    seed: int
    spreads: tuple[Spread, ...]
    law: str
    laws: Mapping[str, int]
    excluded: int
    tested: int
    hypothesis: str
    expected_share: float
    failures: Mapping[str, int]
    freedom: Mapping[str, int]
    more: tuple[str, ...] = ()
    widened: float | None = None

    @property
    def holds(self) -> bool:
        """Whether estimates and uncertainties are right: pulls without bias that scatter by no more than wanted.

        Uncertainties that are too large are no error here: a hidden tilt is in them, and in no reading that is made up.
        """
        return bool(self.spreads) and all(map(self.is_right, self.spreads))

    def is_right(self, spread: Spread) -> bool:
        """Whether the pulls of one quantity are as wanted."""
        return holds(spread, self.freedom.get(spread.quantity), self.widened)


def wanted_coverage(freedom: int | None) -> float:
    """Share of true values within 1 u, where u rests on a scatter with so many degrees of freedom (Student's t).

    >>> round(wanted_coverage(None), 3), round(wanted_coverage(3), 3)
    (0.683, 0.609)
    """
    if freedom is None:
        return COVERAGE
    from scipy.special import stdtr

    return float(2 * stdtr(freedom, 1.0) - 1)


def wanted_deviation(freedom: int | None, widened: float | None = None) -> float:
    """Standard deviation of pulls whose u comes from a scatter with so many degrees of freedom: Student's law.

    Args:
        freedom: of u that is the scatter's own.
        widened: of u that was multiplied by Student's factor, so that it covers 68 %.

    >>> wanted_deviation(None), round(wanted_deviation(12), 2), round(wanted_deviation(None, 12), 2)
    (1.0, 1.1, 1.05)
    """
    few = freedom if freedom is not None else widened
    if few is None:
        return 1.0
    if few <= _LONG_TAILS:
        return math.inf
    return math.sqrt(few / (few - 2)) / (student(few) if freedom is None else 1.0)


def holds(spread: Spread, freedom: int | None = None, widened: float | None = None) -> bool:
    """Whether pulls have no bias and scatter by no more than wanted, with room for chance.

    With few degrees of freedom they have long tails, and their standard deviation says nothing: what lies within 1 u
    does.
    """
    if spread.n < 2:
        return True
    wanted = wanted_coverage(freedom)
    few = CHANCE * math.sqrt(wanted * (1 - wanted) / spread.n)
    scatter = wanted_deviation(freedom, widened)
    return (
        abs(spread.mean) <= 0.1 + CHANCE * max(spread.deviation, 1.0) / math.sqrt(spread.n)
        and spread.deviation <= scatter * (1.1 + CHANCE / math.sqrt(2 * spread.n))
        and spread.coverage >= wanted - 0.05 - few
    )


def seed_of(analysis: str, inputs: Sequence[str]) -> int:
    """Of the random numbers, from the readings."""
    digest = hashlib.sha256("\n".join([analysis, *inputs]).encode()).digest()
    return int.from_bytes(digest[:6], "big")


def trials_of_report(subject: Own) -> int:
    """How many trials a report makes of its own accord; 0 where there is no time for enough of them.

    The cost is the subject's own estimate, and no clock is read: the bytes of a report do not depend on the machine.
    """
    wanted, longest = (int(time / subject.cost_s) for time in (REPORT_S, LONGEST_S))
    count = min(TRIALS, max(wanted, min(ENOUGH, longest)))
    return count if count >= FEWEST else 0


def check_own(
    analysis: str,
    found: Analyzed[Any, Any, Any, Any],
    settings: Mapping[str, Any],
    trials: int = TRIALS,
    progress: Callable[[float], None] = lambda _: None,
) -> OwnCheck:
    """Make the trials of a result.

    Args:
        analysis: its name.
        found: what it found.
        settings: of the analysis, as result.json has them.
        trials: how many.
        progress: called with the share that is done.
    """
    subject = OWN[analysis](found)
    inputs = tuple(source.sha256 for source in found.sources)
    seed = seed_of(analysis, inputs)
    done, failures = [], []
    for k in range(trials):
        try:
            with np.errstate(all="ignore"):
                done.append(subject.trial(np.random.default_rng((seed, k))))
        except (LevilabError, AnalysisError) as error:
            failures.append(str(error))
        progress((k + 1) / trials)
    laws = [trial.law for trial in done if trial.law]
    tested = [trial.excluded for trial in done if trial.excluded is not None]
    return OwnCheck(
        analysis=analysis,
        inputs=inputs,
        settings=settings,
        about=subject.about,
        trials=trials,
        seed=seed,
        spreads=tuple(spreads_of([pull for trial in done for pull in trial.pulls])),
        law=subject.law,
        laws={law: laws.count(law) for law in sorted(set(laws), key=lambda one: (-laws.count(one), one))},
        excluded=sum(tested),
        tested=len(tested),
        hypothesis=subject.hypothesis,
        expected_share=subject.expected_share,
        failures=by_reason(failures),
        freedom=subject.freedom,
        more=subject.more,
        widened=_median([trial.widened for trial in done if trial.widened is not None]),
    )


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


# --- how people are shown it ---------------------------------------------------------------------------

_NUMBERS = ("pulls", "mean pull", "s.d. of pulls\n(wanted)", "within 1 u\n(wanted)")


def own_table(found: OwnCheck, shown: Mapping[str, str] | None = None) -> Table:
    """A row a quantity; behind ± stands what chance leaves to so many pulls, one standard error, then what is wanted.

    Args:
        found: the trials.
        shown: quantity → its symbol.
    """
    rows = [
        (
            _in_words(one.quantity, shown or {}),
            str(one.n),
            f"{signed(one.mean, 2)} ± {1 / math.sqrt(one.n):.2f}",
            _deviation(one, wanted_deviation(found.freedom.get(one.quantity), found.widened)),
            _coverage(one, wanted_coverage(found.freedom.get(one.quantity))),
            "yes" if found.is_right(one) else "NO",
        )
        for one in found.spreads
    ]
    return table("", ("quantity", *_NUMBERS, "as wanted"), rows, numbers=_NUMBERS)


def _deviation(spread: Spread, wanted: float) -> str:
    """The standard deviation of pulls, and the wanted one; without a judgement where tails are long."""
    if math.isnan(spread.deviation):
        return "–"
    if math.isinf(wanted):
        return f"{spread.deviation:.2f} (not judged)"
    return f"{spread.deviation:.2f} ± {wanted / math.sqrt(2 * spread.n):.2f} ({digits(wanted, 3)})"


def _coverage(spread: Spread, wanted: float) -> str:
    """The share within 1 u, and the wanted one."""
    by_chance = math.sqrt(wanted * (1 - wanted) / spread.n)
    return f"{100 * spread.coverage:.0f} ± {100 * by_chance:.0f} % ({100 * wanted:.0f} %)"


def _in_words(quantity: str, shown: Mapping[str, str]) -> str:
    """Its symbol or its name.

    >>> _in_words("c32_of_one_run", {"c32": "C₃/₂"}), _in_words("start_frequency", {})
    ('C₃/₂ of one run', 'start frequency')
    """
    name = quantity.removesuffix(OF_ONE_RUN)
    return shown.get(name, name.replace("_", " ")) + quantity[len(name) :].replace("_", " ")


def in_words(found: OwnCheck, shown: Mapping[str, str] | None = None) -> str:
    """What the trials say.

    Args:
        found: the trials.
        shown: quantity → its symbol.
    """
    texts = [f"{found.trials} times anew: {found.about}."]
    if not found.spreads:
        texts.append("No trial came to an estimate.")
    elif found.holds:
        so_far = "" if found.trials >= ENOUGH else f", as far as so few trials show ({found.trials} of {TRIALS})"
        texts.append(f"Values and uncertainties of this analysis are right for readings such as these{so_far}.")
    else:
        wrong = ", ".join(_in_words(one.quantity, {}) for one in found.spreads if not found.is_right(one))
        texts.append(f"For readings such as these the analysis is not right in {wrong}: trust its u the less.")
    if found.law and found.laws:
        n, again = sum(found.laws.values()), found.laws.get(found.law, 0)
        others = ", ".join(
            f"{law} {'once' if count == 1 else f'{count} times'}"
            for law, count in found.laws.items()
            if law != found.law
        )
        texts.append(
            f"The {found.law} law, which is true there, is the best one in {again} of {n} trials"
            + (f" (else {others})" if others else "")
            + f", and is excluded in {found.excluded}."
        )
    elif found.hypothesis and found.tested:
        chance = found.expected_share * found.tested
        texts.append(
            f"The test excludes {found.hypothesis} in {found.excluded} of {found.tested} trials; chance alone "
            f"does so in {chance:.0f} ± {math.sqrt(chance * (1 - found.expected_share)):.0f}."
        )
    few = {n for n in found.freedom.values() if n < _MANY}
    if few:
        share = f"{100 * wanted_coverage(min(few)):.0f} %"
        of = enumeration([_in_words(name, shown or {}) for name, n in found.freedom.items() if n < _MANY])
        texts.append(f"As u of {of} comes from the scatter of few values, {share} within 1 u are right (Student's t).")
        if min(few) <= _LONG_TAILS:
            texts.append(_about_tails(min(few)))
    if found.widened is not None and found.widened < _MANY:
        wanted = wanted_deviation(None, found.widened)
        pulls = f"pulls have a standard deviation of {wanted:.2f}" if math.isfinite(wanted) else "pulls have long tails"
        texts.append(f"As u comes from few pulses and holds 68 % by Student's factor, {pulls}.")
    texts += [f"{text[0].upper()}{text[1:]}." for text in found.more]
    texts += [f"{count} trials came to no estimate: {reason}." for reason, count in found.failures.items()]
    return " ".join(texts)


def _about_tails(freedom: int) -> str:
    """Why the standard deviation of pulls is not judged."""
    degree = f"{freedom} degree{'s' * (freedom > 1)} of freedom"
    if freedom <= 2:  # the variance of Student's t is n/(n − 2)
        return f"Student's t with {degree} has no finite standard deviation, so that of these pulls is not judged."
    return f"Student's t with {degree} has long tails, so the standard deviation of these pulls is not judged."


def own_blocks(found: OwnCheck, shown: Mapping[str, str] | None = None) -> tuple[Block, ...]:
    """The trials as blocks of a report."""
    note = (
        "A pull is (estimate − truth)/u. Wanted is a mean of 0; the wanted standard deviation and share within 1 u "
        "stand in parentheses: 1 and 68 %, or what Student's t gives where u comes from few values. Behind ± stands "
        "what chance leaves to so many pulls, one standard error. Yes: mean and standard deviation miss what is wanted "
        "by a tenth at most and three standard errors, the share by 5 % and three; a smaller standard deviation and a "
        "larger share mean that u is on the safe side."
    )
    return (
        Paragraph(in_words(found, shown)),
        # the readings of the trials are made up, whatever the result is of
        Tabular(f"crosscheck-{found.analysis}", own_table(found, shown), mark="SYNTHETIC."),
        Note(note),
    )


def quick_check(analysis: str, found: Analyzed[Any, Any, Any, Any], settings: Mapping[str, Any]) -> OwnCheck | None:
    """As many trials as a report has time for; None where these would be too few, or the result has no trials."""
    try:
        count = trials_of_report(OWN[analysis](found))
    except (LevilabError, AnalysisError):
        return None
    return check_own(analysis, found, settings, count) if count else None

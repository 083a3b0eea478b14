"""Results → each group's numbers beside those of the class, as other programs read them, and as sentences."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.comparison import Comparison, compare, gross_errors
from analysis.numbers import digits
from analysis.spindown.drag import LAWS
from analysis.spindown.fit import SpinDown
from analysis.uncertainty import Estimate, mean, student
from levilab.crosscheck.truth import Truth, truth_of
from levilab.errors import as_typed, unquote
from levilab.pipelines.inputs.names import seed_of_group, short_paths
from levilab.pipelines.options import OF_FILES
from levilab.present.numbers import enumeration, plain, with_sign, with_uncertainty
from levilab.present.units import unit
from levilab.report.reproduction import typed_options
from levilab.texts.note import Note, is_doubt, weight_of
from levilab.texts.text import Sentences, Text, how_many, in_language

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from levilab.pipelines.document import Analysis
    from levilab.pipelines.inputs.source import Source


#: Distance in u beyond which a value is far off: one in four hundred is by chance.
FAR = 3.0
#: Probabilities that a value is grossly wrong, by those of the others: above the one, more probably than not, it is in
#: no mean; the other warns.  Of 42 000 sound ones that scatter by 10 % in classes of 3 to 30, four are above 0.5.
_WRONG, _PERHAPS_WRONG = 0.5, 0.2
#: Tops of one kind scatter by a smaller part of a value: the four published drags of one top by 2 %.
_ALIKE = 0.1
#: Quantities that are compared where an analysis names none and has no model.
_MOST_QUANTITIES = 3


@dataclass(frozen=True)
class Group:
    """One input of a class.

    Attributes:
        source: with its name and note.
        statistics: of the model; empty where the analysis has none.
        best_model: the law that describes its readings best, or "undecided"; empty where no laws compete.
        warnings: about it, without advice, doubts and those of models that are not compared.
        doubts: that make its numbers worthless where they are right, with the command that follows their advice.
        excluded: laws that its readings exclude.
    """

    source: Source[Any]
    statistics: Mapping[str, Any]
    best_model: str
    warnings: tuple[str, ...]
    doubts: tuple[str, ...] = ()
    excluded: tuple[str, ...] = ()


@dataclass(frozen=True)
class Compared:
    """One quantity of all groups, in SI.

    Attributes:
        name: as in result.json.
        symbol: for people.
        unit: of results.
        estimates: of each group, as its analysis has them; None where it has no value with u.
        freedoms: degrees of freedom of each u that is of repetitions alone; else None.
        truths: of each group; None where it is not known.
        mean: of those that are used, by the rule of several runs in a report; None where there are none.
        together: whether those agree; None where there are none.
        used: whether a group has a value that is neither doubtful, wrong nor far from its truth, or no group has.
        apart: why the groups have no common value, and so no mean; empty: they have.
        shared_u: the part of u of each group that is the same in all, which no mean makes smaller.
        wrong: the probability that a value is grossly wrong, by those of the others; 0 where its truth is known.
    """

    name: str
    symbol: str
    unit: str
    estimates: tuple[Estimate | None, ...]
    freedoms: tuple[float | None, ...]
    truths: tuple[float | None, ...]
    mean: Estimate | None
    together: Comparison | None
    used: tuple[bool, ...]
    apart: str = ""
    shared_u: tuple[float, ...] = ()
    wrong: tuple[float, ...] = ()

    @property
    def shown_unit(self) -> str:
        """The unit that people read."""
        return unit(self.unit).shown.unit

    @property
    def head(self) -> str:
        """Symbol and unit, above a column."""
        return f"{self.symbol} [{self.shown_unit}]" if self.shown_unit else self.symbol

    def show(self, value: float | None, u: float | None = None) -> Estimate | None:
        """Return a number in the unit that people read."""
        text, factor = unit(self.unit).shown
        return None if value is None else Estimate(value * factor, None if u is None else u * factor, text)

    @property
    def widened(self) -> list[Estimate | None]:
        """The estimates with the u by which groups are compared."""
        pairs = zip(self.estimates, self.freedoms, strict=True)
        return [replace(one, u=one.u * _width(freedom)) if one and one.u else None for one, freedom in pairs]

    @property
    def truth(self) -> tuple[float, float, float] | None:
        """The mean of the truths, the distance of the mean from it in u, and this u; None where a truth is not known.

        How one top differs from another is in neither.
        """
        rows = zip(self.widened, self.truths, self.shared_u, self.used, strict=True)
        used = [(one, truth, shared) for one, truth, shared, use in rows if use and one]
        if self.mean is None or any(truth is None for _, truth, _ in used):
            return None
        values, truths, u, shared = np.array([(one.value, truth, one.u, part) for one, truth, part in used], float).T
        of_mean = np.hypot(np.sqrt(np.sum(u**2 - shared**2)) / len(used), shared.mean())
        return float(truths.mean()), float((values - truths).mean() / of_mean), float(of_mean)

    @property
    def difference(self) -> Estimate | None:
        """The mean of value − truth; None where a truth is not known."""
        return Estimate(self.truth[1] * self.truth[2], self.truth[2], self.unit) if self.truth else None

    @cached_property
    def from_class(self) -> tuple[float | None, ...]:
        """The distance of each group from the mean of the others, in u."""
        others = iter(self.together.distances if self.together else ())
        return tuple(next(others, None) if use else None for use in self.used)

    @cached_property
    def from_truth(self) -> tuple[float | None, ...]:
        """The distance of each group from its truth, in its u."""
        return tuple(
            None if one is None or truth is None else (one.value - truth) / one.u  # type: ignore[operator]
            for one, truth in zip(self.estimates, self.truths, strict=True)
        )

    def limits(self, most: float) -> list[float]:
        """Return for each group the distance from its truth that is as improbable as `most` of a normal number [u]."""
        return [most if freedom is None else student(freedom, most) for freedom in self.freedoms]

    def off(self, most: float) -> tuple[bool, ...]:
        """Return whether each group is farther from its truth than its limit."""
        pairs = zip(self.from_truth, self.limits(most), strict=True)
        return tuple(distance is not None and abs(distance) > limit for distance, limit in pairs)


@dataclass(frozen=True)
class Class:
    """The groups of a class by one analysis.

    Attributes:
        analysis: the row of the catalogue.
        found: what it found.
        model: the law whose constants are compared, that of most seeds; empty where the analysis has one model.
        others: the law of each group's seed where that is another one, by the group's name.
        unread: what to do about inputs that are not among the groups, by their names.
    """

    analysis: Analysis[Any]
    found: Any
    model: str
    groups: tuple[Group, ...]
    quantities: tuple[Compared, ...]
    others: Mapping[str, str]
    unread: Mapping[str, Mark] = field(default_factory=dict)

    @cached_property
    def marks(self) -> tuple[Mark, ...]:
        """The mark of each group."""
        return tuple(_mark(self, k) for k in range(len(self.groups)))

    @property
    def places(self) -> list[str]:
        """The name of each run's folder, and of each file with the folders that distinguish it."""
        files = [group.source.path for group in self.groups if not group.source.run]
        names = dict(zip(files, short_paths(files), strict=True)) if files else {}
        return [names.get(group.source.path, group.source.path.name) for group in self.groups]

    @property
    def knows_truth(self) -> bool:
        """Whether the truth of any quantity of any group is known."""
        return any(truth is not None for one in self.quantities for truth in one.truths)


def class_of(analysis: Analysis[Any], found: Any, more: Sequence[str] = ()) -> Class:
    """Put the groups of a class beside each other; more: names of quantities beside those that a class compares."""
    document = analysis.document(found, Path())
    truths = [truth_of(source.run, analysis.name) for source in found.sources]
    laws = Counter(one.model for one in truths if one.model)
    parts = document["runs"]
    has_models = any(part["models"] for part in parts)
    best = document.get("best_model", "") if has_models else ""
    model = max(laws, key=lambda law: laws[law], default=best)
    said = [
        [
            text
            for text in (*source.warnings, *found.about_run(run))
            if weight_of(text) != "advice" and text not in _of_other_models(part, model)
        ]
        for source, run, part in zip(found.sources, found.runs, parts, strict=True)
    ]
    groups = tuple(
        Group(
            source,
            _model(part, model).get("statistics", {}),
            part.get("best_model", "") if part.get("decided", True) else "undecided",
            tuple(plain_text(text) for text in texts if not is_doubt(text)),
            tuple(_with_command(text, analysis, source, origin.options) for text in texts if is_doubt(text)),
            run.verdict.excluded if isinstance(run, SpinDown) else (),
        )
        for source, run, part, texts, origin in zip(found.sources, found.runs, parts, said, found.origins, strict=True)
    )
    names = analysis.compared or (_constants(document, model) if has_models else []) or _common(parts)
    doubts = [bool(group.doubts) for group in groups]
    found_of = (
        _quantity(name, analysis, model, parts, truths, runs=found.runs, doubts=doubts) for name in (*names, *more)
    )
    quantities = tuple(one for one in found_of if one.together)
    if why := analysis.apart(found):
        quantities = tuple(
            replace(
                one, mean=None, together=None, apart=why, wrong=(0.0,) * len(groups), used=(*map(bool, one.estimates),)
            )
            if one.name in analysis.compared
            else one
            for one in quantities
        )
    others = {
        group.source.name: truth.model
        for group, truth in zip(groups, truths, strict=True)
        if truth.model not in {"", model}
    }
    return Class(analysis, found, model, groups, quantities, others)


def _model(part: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """Return the model of this name, or the first; empty where there are none."""
    models: Sequence[Mapping[str, Any]] = part.get("models") or [{}]
    return next((one for one in models if one.get("name") == name), {} if name else models[0])


def _of_other_models(part: Mapping[str, Any], name: str) -> set[str]:
    """Return the warnings about models whose constants are not compared."""
    others = (one for one in part["models"] if name and one["name"] != name)
    return {text for one in others for text in one.get("warnings", ())}


def _constants(document: Mapping[str, Any], law: str) -> list[str]:
    """Return the constants of a law, without the start of a run, which no two share."""
    found = _model(document, law).get("parameters", {}) if law else {}
    return [name for name in found if law not in LAWS or name in LAWS[law].constants]


def _common(parts: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the first quantities that all inputs have with their u."""
    first, *others = ([name for name, value in part["values"].items() if _has_u(value)] for part in parts)
    return [name for name in first if all(name in other for other in others)][:_MOST_QUANTITIES]


def plain_text(text: str) -> str:
    """Return a message without backquotes, which stand for a terminal's bold letters."""
    return unquote(in_language(text)).replace("`", "")


def _with_command(text: str, analysis: Analysis[Any], source: Source[Any], options: Any) -> str:
    """Return a doubt, with the command that follows its advice, if a program can say it."""
    if not isinstance(text, Note) or not text.options:
        return plain_text(text)
    if answer := text.options.get("columns"):
        said = '{reason}: levilab open {typed:s} --columns "{answer:s}" --keep answers so for all commands'
        return Text(said, plain_text(text), as_typed(source.path), answer)
    typed = " ".join(typed_options(replace(options, **text.options)))
    said = "{doubt}; levilab analyze {name:s} {path:s} {typed:s} fits a part, and levilab class then takes its result"
    return Text(said, plain_text(text), analysis.name, as_typed(source.path), typed)


def _has_u(value: Mapping[str, Any]) -> bool:
    """Return whether a value of result.json is a number with an uncertainty."""
    return (
        bool(value["u"]) and value["value"] is not None and math.isfinite(value["u"]) and math.isfinite(value["value"])
    )


def _quantity(
    name: str,
    analysis: Analysis[Any],
    model: str,
    parts: Sequence[Mapping[str, Any]],
    truths: Sequence[Truth],
    *,
    runs: Sequence[Any],
    doubts: Sequence[bool],
) -> Compared:
    found = [_model(part, model).get("parameters", {}).get(name) or part["values"].get(name) for part in parts]
    good = [one if one and _has_u(one) else None for one in found]
    of = Compared(
        name,
        analysis.symbols.get(name, name.replace("_", " ")),
        next((one["unit"] for one in good if one), "1"),
        tuple(Estimate(one["value"], one["u"], one["unit"]) if one else None for one in good),
        tuple((part.get("result", {}).get("statistics") or {}).get("freedom") for part in parts),
        tuple(truth.values.get(name) if truth.model in {"", model} else None for truth in truths),
        None,
        None,
        tuple(one is not None for one in good),
        shared_u=tuple(
            analysis.shared_u(run, model, name, one["u"]) if one else 0.0 for run, one in zip(runs, good, strict=True)
        ),
    )
    used = tuple(bool(one) and not (doubt or far) for one, doubt, far in zip(good, doubts, of.off(FAR), strict=True))
    used = used if any(used) else of.used
    of = replace(of, wrong=_gross_errors(of, used))
    right = tuple(use and not wrong > _WRONG for use, wrong in zip(used, of.wrong, strict=True))
    used = right if any(right) else used
    known, widened = ([*filter(None, compress(each, used))] for each in (of.estimates, of.widened))
    if not known:
        return replace(of, used=used)
    shared = [*compress(of.shared_u, used)]
    together = compare(*np.array([(one.value, one.u) for one in widened], float).T)
    return replace(of, used=used, mean=mean(known, shared), together=together)


def _gross_errors(of: Compared, used: Sequence[bool]) -> tuple[float, ...]:
    """Return for each group the probability that its value is grossly wrong, by those that are used."""
    known = [(one.value, one.u) for one in compress(of.widened, used) if one]
    found = iter(gross_errors(*np.reshape(np.array(known, float), (-1, 2)).T))
    each = [float(next(found)) if use else 0.0 for use in used]
    return tuple(0.0 if truth is not None else one for one, truth in zip(each, of.truths, strict=True))


def _width(freedom: float | None) -> float:
    """Return the standard deviation of Student's t: what u from a scatter is worth (GUM supplement 1, 6.4.9.4).

    It is infinite below three degrees of freedom, and then that of three.
    """
    return 1.0 if freedom is None else math.sqrt(max(freedom, 3.0) / (max(freedom, 3.0) - 2.0))


GOOD, LOOK, REPEAT = "good", "look", "repeat"


@dataclass(frozen=True)
class Mark:
    """What a teacher does about a group.

    Attributes:
        word: GOOD; LOOK: there is something to know about it; REPEAT: its result is wrong or missing.
        why: the reasons, the worst first.
        notes: remarks of an analysis on readings that are too few or doubtful, of which the reason is enough.
    """

    word: str
    why: tuple[str, ...]
    notes: tuple[str, ...] = ()


def _mark(of: Class, k: int) -> Mark:
    group, wrong, odd = of.groups[k], list[str](), list[str]()
    for one in of.quantities:
        truth, others = one.from_truth[k], one.from_class[k]
        if one.estimates[k] is None:
            wrong.append(Text("{symbol}: no value with u", symbol=one.symbol))
        elif truth is not None and one.off(FAR)[k]:
            said = (
                "{symbol}: {times:n} u from its truth: look at the residuals; a disturbed run, laws that fit as well "
                "or another seed can be the cause"
            )
            wrong.append(Text(said, symbol=one.symbol, times=with_sign(truth, 1)))
        elif one.wrong[k] > _PERHAPS_WRONG:
            (wrong if one.wrong[k] > _WRONG else odd).append(_beside_others(one, k))
        elif truth is None and others is not None and abs(others) > FAR:
            odd.append(_from_others(one, others))
    odd += [*filter(None, [_other_options(of, k), _other_limits(of, k)])]
    wrong_time = any(one.wrong[k] > _WRONG for one in of.quantities)  # a wrong unit makes a run short, too
    short = "" if wrong_time else _too_short(of, k)
    if short or group.doubts:
        why = (*group.doubts, *filter(None, [short]), *wrong, *odd)
        return Mark(REPEAT if wrong or group.doubts else LOOK, why, group.warnings)
    odd += [*filter(None, [_other_law(of, k), _other_seed(of, k)]), *group.warnings]
    return Mark(REPEAT if wrong else LOOK if odd else GOOD, (*wrong, *odd))


def _other_law(of: Class, k: int) -> str:
    """Return that a group's readings exclude the law of the class, which most groups' do not."""
    exclude = [of.model in group.excluded for group in of.groups]
    if not exclude[k] or 2 * sum(exclude) >= len(exclude):
        return ""
    return Text("its readings exclude the law by which the class is compared")


def _beside_others(one: Compared, k: int) -> str:
    """Return how many times the median of the others a value is, or, where that may be zero, how many u beside it."""
    mine, others = one.estimates[k], [*filter(None, one.estimates[:k] + one.estimates[k + 1 :])]
    median, u = (statistics.median(each) for each in zip(*((each.value, each.u) for each in others), strict=True))
    if abs(median) > FAR * u:
        said = "{symbol}: {factor:n} times the median of the others"
        if one.wrong[k] > _WRONG:
            said = "{symbol}: {factor:n} times the median of the others, more than tops differ"
        return Text(said, symbol=one.symbol, factor=digits(mine.value / median))  # type: ignore[union-attr]
    return _from_others(one, (mine.value - median) / math.hypot(mine.u, u))  # type: ignore[union-attr, arg-type]


def _from_others(one: Compared, times: float) -> str:
    return Text("{symbol}: {times:n} u from the others", symbol=one.symbol, times=with_sign(times, 1))


def _too_short(of: Class, k: int) -> str:
    """Return that a group measured for less than half of the time of the others, or half as often; else an empty text.

    A run that has a clock may have few readings: who types reads every 10 s, who clicks every 2 s.
    """
    times = [getattr(group.source.readings, "time", None) for group in of.groups]
    lasts = [count_readings(of.groups[k]) if time is None else float(np.ptp(time)) for k, time in enumerate(times)]
    others = lasts[:k] + lasts[k + 1 :]
    usual = statistics.median_low(others) if len(others) > 1 else 0  # one may be too long itself
    said, advice = "{n:.0f} readings instead of {usual:.0f}: {advice}", "measure longer"
    if times[k] is not None:
        said = "{n:.0f} s of readings instead of {usual:.0f} s: {advice}"
        advice = "measure longer, if the times are right"
    run = of.groups[k].source.run
    if run and run.status == "interrupted":
        goes_on = "the run was interrupted, levilab acquire {name:s} --resume {folder:s} continues it"
        advice = Text(goes_on, run.record.experiment, run.folder)
    return Text(said, n=lasts[k], usual=usual, advice=advice) if lasts[k] < usual / 2 else ""


#: Options of an input itself, and those of which its analysis has a note.
_OF_INPUT = frozenset({*OF_FILES, "between", "start_s", "stop_s"})


def _other_options(of: Class, k: int) -> str:
    """Return that a group was analyzed with other options than most, where it was; else nothing."""
    each = [typed_options(origin.options, _OF_INPUT) for origin in of.found.origins]
    groups = Counter(each)
    usual = max(groups, key=lambda options: (groups[options], -len(options)))
    if each[k] == usual:
        return ""
    own, others = (" ".join(options) or "no options" for options in (each[k], usual))
    return Text("analyzed with {own}, most groups with {others}", own=own, others=others)


#: Of limits of another kind than most groups have.
_OTHER_LIMITS = {
    "upper": "upper limits, where most groups have lower ones: is each turn counted twice?",
    "lower": "lower limits, where most groups have upper ones",
}


def _other_limits(of: Class, k: int) -> str:
    """Return that a group has limits of another kind than most, where it has; else nothing."""
    each = [getattr(run, "which", "") for run in of.found.runs]
    ((usual, count),) = Counter(each).most_common(1)
    return _OTHER_LIMITS.get(each[k], "") if each[k] != usual and 2 * count > len(each) else ""


def _other_seed(of: Class, k: int) -> str:
    """Return that a group has another seed than its worksheet lists, where most groups have theirs; else nothing."""
    seeds = [group.source.run.record.seed if group.source.run else None for group in of.groups]
    numbers = [seed_of_group(group.source.group, 0) for group in of.groups]
    pairs = zip(seeds, numbers, strict=True)
    firsts = [None if seed is None or number is None else seed - number for seed, number in pairs]
    known = Counter(first for first in firsts if first is not None)
    first, count = max(known.items(), key=lambda one: one[1], default=(0, 0))
    if firsts[k] in {None, first} or 2 * count <= known.total():
        return ""
    said = "seed {seed:d}, where the worksheet of the other groups lists {listed:d}"
    return Text(said, seed=seeds[k], listed=seed_of_group(of.groups[k].source.group, first))


def count_readings(group: Group) -> int:
    """Return how many readings the fit used, or, without one, how many there are."""
    return int(group.statistics.get("n") or len(group.source.readings))


def count_marks(of: Class) -> str:
    """Return how many groups have a good result, and which others have not."""
    named: dict[str, list[str]] = {GOOD: [], LOOK: [], REPEAT: []}
    for group, one in zip(of.groups, of.marks, strict=True):
        named[one.word].append(group.source.name)
    for name, mark in of.unread.items():
        named[mark.word].append(name)
    good = len(named[GOOD])
    said = "{n} of {all} results is good." if good == 1 else "{n} of {all} results are good."
    texts: list[str] = [Text(said, n=good, all=len(of.groups) + len(of.unread))]
    texts += [Text("To repeat: {names}.", names=_list_names(named[REPEAT]))] if named[REPEAT] else []
    return Sentences(*texts, *([Text("To look at: {names}.", names=_list_names(named[LOOK]))] if named[LOOK] else []))


def _list_names(names: Sequence[str]) -> str:
    """Return names as a list in a sentence, with semicolons where a name has a comma, as that of a group's file."""
    return "; ".join(names) if any(", " in name for name in names) else enumeration(names)


#: Below it chance does not make groups differ so much.
DIFFER = 0.01
#: Degrees of freedom from which on a scatter is known well enough, to a third.
_FEW = 5
#: Distance from the truth [u] at which a mean still agrees with it: as a rule one in twenty is farther away.
_AGREES = 2.0
#: Share of groups within 2 u of their truth, where u is right.
_WITHIN_2_U = 0.954


def finding(of: Class) -> str:
    """Return the mean of the class, in one line."""
    if not of.quantities:
        return Text(
            "{groups}: no quantity has a value with u", groups=count_sources([group.source for group in of.groups])
        )
    first = of.quantities[0]
    if first.apart:
        return Text("{symbol} of {groups}", symbol=first.symbol, groups=_count(of, first))
    return Text("{mean}, mean of {groups}", mean=_mean(first), groups=_count(of, first))


def verdict(of: Class) -> str:
    """Return whose results are good, and the mean of each quantity beside the truth."""
    if len(of.groups) == 1 and not of.unread:
        (group,), (mark,) = of.groups, of.marks
        return Text("{name:s} alone measured this: {mark}.", name=group.source.name, mark=mark.word)
    texts = [
        Text("The groups have no common {symbol}: {why}.", symbol=one.symbol, why=one.apart)
        if one.apart
        else Text("{mean} is the mean of {groups}{truth}.", _mean(one), _count(of, one), _beside_truth(one))
        for one in of.quantities
    ]
    return Sentences(count_marks(of), *_scenes(of), *texts)


def _beside_truth(of: Compared) -> str:
    if of.truth is None:
        return ""
    _, distance, u = of.truth
    agrees = "agrees with" if abs(distance) <= _AGREES else "disagrees with"
    shown = of.show(distance * u, u)
    return (
        Text(", and {agrees} the truth (mean − truth = {difference})", agrees, with_uncertainty(shown)) if shown else ""
    )


def agreement(of: Class) -> str:
    """Return how far the groups agree, quantity by quantity, and how well they met the truth; empty for one group."""
    if len(of.groups) == 1:
        return ""
    texts = [
        Text("{symbol}: {agreement}.", symbol=one.symbol, agreement=_agreement(one))
        for one in of.quantities
        if not one.apart
    ]
    return Sentences(*texts, _truth(of) if of.knows_truth else "")


def statistics_of_agreement(of: Class) -> str:
    """Return the statistics behind the agreement; empty where no groups were compared."""
    compared = [(one, one.together) for one in of.quantities if one.together and one.together.freedom]
    rule = "The mean is unweighted; its u is the larger of s/√N and √Σu²/N (s: standard deviation of the values)."
    shared = "The part of u that all groups share is not in this Σu²: it is added in quadrature, as no mean reduces it."
    meaning = [rule, *[shared] * any(any(one.shared_u) for one, _ in compared)] if compared else []
    return Sentences(*meaning, *(_chi_square(one, together) for one, together in compared))


def _scenes(of: Class) -> list[str]:
    """Return a sentence where the virtual benches of the runs had several scenes, whose tops are not comparable.

    Where the truth of each group is known, its result stands beside that, and needs no other group.
    """
    if all(truth is not None for one in of.quantities for truth in one.truths):
        return []
    records = [source.run.record for source in of.found.sources if source.run]
    scenes = {record.table("scene").get("name", "") for record in records if record.synthetic}
    if len(scenes) < 2:
        return []
    named = enumeration(sorted(name or "a spin alone" for name in scenes))
    return [
        Text(
            "Compare these runs apart: they are of several scenes of the virtual bench ({names}), whose tops differ.",
            names=named,
        )
    ]


def _mean(of: Compared) -> str:
    shown = of.show(of.mean.value, of.mean.u) if of.mean else None
    return Text("{symbol} = {value:n}", symbol=of.symbol, value=with_uncertainty(shown)) if shown else of.symbol


def _count(of: Class, one: Compared) -> str:
    """Return the number of groups in the mean, and that of their runs where it is another one."""
    found = [group.source for group, use in zip(of.groups, one.used, strict=True) if use]
    groups, runs = count_sources(found), how_many(len(found), "run")
    several = len({source.group or source.name for source in found}) < len(found)
    return Text("{runs} of {groups}", runs=runs, groups=groups) if several else groups


def count_sources(sources: Sequence[Source[Any]], more: Iterable[str] = ()) -> str:
    """Return the number of groups, or of runs where no run names its group; more: names that were not read."""
    named = any(source.group for source in sources)
    return how_many(len({*more, *(source.group or source.name for source in sources)}), "group" if named else "run")


def _agreement(of: Compared) -> str:
    together = of.together
    if together is None or together.scatter is None:
        return "there is no other group to compare it with"
    if together.p < DIFFER and together.scatter > _ALIKE * abs(of.mean.value or 0.0 if of.mean else 0.0):
        said = "the groups scatter by {scatter}, more than their u, and more than tops do: compare how they measured"
        return Text(said, scatter=_scatter(of, together))
    if together.p < DIFFER:
        return Text("the groups scatter by {scatter}, more than their u, as different tops do", _scatter(of, together))
    return Text("the groups agree within their u: they scatter by {scatter}", scatter=_scatter(of, together))


def _scatter(of: Compared, together: Comparison) -> str:
    """Return the standard deviation of the groups: in per cent of the mean, unless that is near zero."""
    scatter, average = together.scatter or 0.0, abs(of.mean.value or 0.0) if of.mean else 0.0
    if scatter < average:
        return Text("{percent:n} % (s.d.)", percent=digits(100 * scatter / average, 2))
    return Text("{scatter:n} {unit:s} (s.d.)", digits(scatter * unit(of.unit).shown.factor, 2), of.shown_unit)


def _chi_square(one: Compared, together: Comparison) -> str:
    p = "p < 10⁻⁶" if together.p < 1e-6 else Text("p = {p:n}", p=plain(together.p, 2))
    freedom = Text("{degrees} of freedom", degrees=how_many(together.freedom, "degree"))
    return Text(
        "{symbol}: χ² = {chi:n} for {freedom}, {p}{known}.",
        symbol=one.symbol,
        chi=plain(together.chi_square),
        freedom=freedom,
        p=p,
        known=_known_to(together.freedom),
    )


def _known_to(freedom: int) -> str:
    """Return how well few groups give their scatter, with the interval that holds the mean in 68 % of all classes."""
    if freedom >= _FEW:
        return ""
    known, factor = 100 / math.sqrt(2 * freedom), student(freedom)
    return Text(
        "; {n} values give their scatter to {percent:.0f} % only: a 68 % interval is {factor:n} u",
        n=freedom + 1,
        percent=known,
        factor=digits(factor, 2),
    )


def _truth(of: Class) -> str:
    known = sum(one is not None for quantity in of.quantities for one in quantity.from_truth)
    near = known - sum(sum(quantity.off(2)) for quantity in of.quantities)
    return Text(
        "On the virtual bench the truth is known: {near} of {values} lie within 2 u of it, where {percent:.0f} % are "
        "expected.",
        near=near,
        values=how_many(known, "value"),
        percent=100 * _WITHIN_2_U,
    )

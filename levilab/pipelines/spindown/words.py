"""Quantities of a spin-down, symbols of the drag laws, the verdict and remarks on the numbers."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import floor, log10
from types import MappingProxyType
from typing import Any

import numpy as np

from analysis.arrays import Array
from analysis.numbers import digits
from analysis.remarks import Remark
from analysis.residuals import Change, independent
from analysis.spindown.air import LEAST, MOST
from analysis.spindown.combine import Combined, CombinedLaw
from analysis.spindown.drag import LAWS, DragLaw
from analysis.spindown.fit import SpinDown
from analysis.spindown.lawfit import LawFit
from analysis.spindown.tilt import PARAMETERS as WOBBLE
from analysis.spindown.verdict import Verdict, is_change, is_simple
from analysis.uncertainty import Estimate
from levilab.pipelines.note import FEW_LEFT, Weighed, note_of
from levilab.pipelines.row import Column, Quantity, columns_of, entry, estimate, statistic
from levilab.present.numbers import enumeration, with_uncertainty
from levilab.present.units import name_with_unit
from levilab.texts.note import Note, reword
from levilab.texts.text import Sentences, Text, verbatim


@dataclass(frozen=True)
class StraightLine:
    """The function of ω that is a straight line in time where a law of one power holds.

    Attributes:
        quantity: for text.
        axis: for the axis of a figure, with its unit.
        transform: of ω [rad/s].
    """

    quantity: str
    axis: str
    transform: Callable[[Array], Array]


def straight_line(law: DragLaw) -> StraightLine | None:
    """Return the straight line of a law; None for a law of several terms or of a free exponent.

    >>> [straight_line(LAWS[name]).quantity for name in ("stokes", "newton", "disc")]
    ['ln ω', '1/ω', 'ω^−½']
    """
    if law.exponent is None:
        return None
    (m,) = law.orders
    if m == 0:
        return StraightLine("ln ω", "ln ω   (ω in rad/s)", np.log)
    if m == 1:
        return StraightLine("1/ω", "1/ω  [s/rad]", lambda omega: 1 / omega)
    power = str(Fraction(m).limit_denominator(100))
    text = "½" if math.isclose(m, 0.5) else power
    return StraightLine(f"ω^−{text}", f"ω$^{{−{power}}}$  [(s/rad)$^{{{power}}}$]", lambda omega: np.asarray(omega**-m))


#: The laws that have a straight line.
STRAIGHT_LINES = MappingProxyType({law.name: line for law in LAWS.values() if (line := straight_line(law))})
#: Parameters of the laws in the field's letters, then of what the counter sees beside the spin.
SYMBOLS = MappingProxyType(
    {"start_frequency": "ν₀"}
    | {name: symbol for law in LAWS.values() for name, symbol in zip(law.constants, law.symbols, strict=True)}
    | {"moment_tilt": "δ", "resonance": "ν_r", "wobble": "K"}
)

#: Of `analysis.spindown.fit.SpinDown`, each with a column in the tables of runs; the constants of laws are in
#: `analysis.spindown.drag.LAWS`.
OF_RUN = (
    Quantity("start_time", "s", "time of the first reading", "begins at", has_u=False),
    Quantity("duration", "s", "time from the first reading to the last", "lasts", has_u=False,
             of=lambda run: float(run.time[-1] - run.time[0])),
)  # fmt: skip
#: Of what the counter sees of the wobble, by the best law, and of the noise; they have a table of their own.
TILT = Quantity("moment_tilt", "rad", "angle between moment and axis, where the count shows it", "δ", fine=True,
                of=lambda run: run.fit(run.best).parameters.get("moment_tilt"), optional=True)  # fmt: skip
CORRELATION = Quantity("residual_correlation", "1", "correlation of neighbouring residuals", "correlation",
                       of="correlation.value", u="correlation.u", optional=True)  # fmt: skip
QUANTITIES = (*OF_RUN, TILT, CORRELATION)

#: Statistics of a law: name in the result, name of the column, unit, meaning.
_STATISTICS = (
    ("reduced_chi_square", "reduced_chi_square", "1", "χ² per degree of freedom"),
    ("rms_residual", "rms_residual", "Hz", "root mean square of the residuals"),
    ("difference", "delta_aicc", "1", "ΔAICc, its criterion above that of the best law"),
)


def _of_law(law: DragLaw) -> Iterator[Column]:
    """Yield the columns of a law: its constants with their uncertainties, and how well it fits."""

    def model(part: Mapping[str, Any]) -> Mapping[str, Any]:
        found: Iterator[Mapping[str, Any]] = (model for model in part["models"] if model["name"] == law.name)
        return next(found, {"parameters": {}, "statistics": {}})  # a law that was not to be fitted

    for name, unit in zip(law.parameters, law.parameter_units, strict=True):
        yield from estimate(
            f"{law.name}_{name}", unit, f"{name} of the law {law.name}",
            lambda part, name=name: model(part)["parameters"].get(name),  # type: ignore[misc]
        )  # fmt: skip
    for name, heading, unit, meaning in _STATISTICS:
        yield Column(
            name_with_unit(f"{law.name}_{heading}", unit), "number", f"of the law {law.name}: {meaning}",
            lambda part, name=name: model(part)["statistics"].get(name),  # type: ignore[misc]
        )  # fmt: skip


SPINDOWN_ROW = (
    statistic("n", "1", "readings in the fits", "readings_used", kind="count"),
    entry("outliers", "count", "readings that do not belong to the others", "result.outliers"),
    *columns_of(OF_RUN),
    entry("best_model", "text", "the law with the smallest criterion"),
    entry("decided", "truth", "whether the readings single it out"),
    entry("describes", "truth", "whether any law describes the readings"),
    *(column for law in LAWS.values() for column in _of_law(law)),
    *columns_of((TILT, CORRELATION)),
    entry("verdict", "text", "what the readings say about the laws"),
)


#: How the drag by such a law depends on the spin ω, in plain notation.
_DRAGS = {"stokes": "ω", "disc": "ω^(3/2)", "newton": "ω²"}
#: Laws that have a person's name, as text; the others are called as the options call them.
_PERSONS = {"stokes": "Stokes", "newton": "Newton"}
#: u of an exponent, or of an angle [rad], that no measurement has.
TOO_SMALL = 5e-10
#: A tilt δ of the moment is mentioned from this multiple of its u on. Readings give δ², whose relative u is twice that
#: of its root: these are three u of δ².
SEEN = 6.0
#: Part of u that what was known beforehand makes, from which a number is marked as a prior.
PRIOR = 0.9


def law_name(law: str) -> str:
    """Return the name of a drag law in a sentence."""
    return _PERSONS.get(law, law)


def law_names(laws: Iterable[str], power: str = "power") -> str:
    """Return drag laws as a list in a sentence, in which other languages have articles; "the laws" for none.

    >>> law_names(["stokes", "disc"])
    'Stokes and disc'
    """
    return enumeration([Text("{law}", power if law == "power" else law_name(law)) for law in laws] or ["the laws"])


def short_law(law: str) -> str:
    """Return the name of a drag law where room is short."""
    return verbatim(_PERSONS[law]) if law in _PERSONS else law.capitalize()


def verdict_of_run(run: SpinDown) -> str:
    """Return what one run says about the laws."""
    constants = {fit.name: {name: fit.parameters[name] for name in fit.law.constants} for fit in run.fits}
    return _verdict(run, run.fits, constants, run.fit(run.best).parameters.get("moment_tilt"), [run])


def verdict_of_all(found: Combined, runs: Sequence[SpinDown]) -> str:
    """Return what all runs together say about the laws."""
    if len(runs) == 1:
        return verdict_of_run(runs[0])
    return _verdict(found, found.fits, {fit.name: fit.constants for fit in found.fits}, found.tilt, runs)


def is_seen(tilt: Estimate | None) -> bool:
    """Return whether readings show a tilt of the moment, and not only what was known of it beforehand."""
    return tilt is not None and tilt.value is not None and bool(tilt.u) and tilt.value > SEEN * (tilt.u or 0.0)


def is_prior(fit: LawFit, name: str) -> bool:
    """Return whether a number is what was known of tops beforehand, to which the readings add little."""
    part, u = fit.parts.get(name), fit.parameters[name].u
    return name in WOBBLE and part is not None and bool(u) and part.tilt > PRIOR * (u or 0.0)


def finding(found: Combined) -> str:
    """Return the verdict of all runs in a few words, for the head of a figure."""
    said, best = found.verdict, found.best
    if not said.describes:
        return Text("no drag law describes these readings; the {law} law comes nearest", law=law_name(best))
    if said.decided:
        how = "; {laws} is excluded" if len(said.excluded) == 1 else "; {laws} are excluded"
        excluded = Text(how, laws=law_names(said.excluded)) if said.excluded else ""
        return Text("the {law} law describes the readings{excluded}", law=law_name(best), excluded=excluded)
    simple = _simple(said)
    if len(simple) == 1:
        how = "{laws} cannot be distinguished; {law} has the fewest constants"
        return Text(how, laws=law_names(said.indistinguishable), law=law_name(best))
    return Text("the readings cannot distinguish {laws}", laws=law_names(simple))


def _simple(said: Verdict) -> list[str]:
    """Return the laws that contain no other one and are not excluded."""
    return [name for name in (*said.indistinguishable, *said.weak) if is_simple(name)]


def _verdict(
    found: SpinDown | Combined,
    fits: Sequence[LawFit | CombinedLaw],
    constants: Mapping[str, Mapping[str, Estimate]],
    tilt: Estimate | None,
    runs: Sequence[SpinDown],
) -> str:
    said, stats = found.verdict, {fit.name: fit.statistics for fit in fits}
    best = stats[said.best]
    power = Text("power ({exponent:n})", exponent=_exponent(constants.get("power", {}).get("exponent")))
    simple, law = _simple(said), law_name(said.best)
    compared = [name for name in said.needless if stats[name].difference is not None]
    how, others, advice = _how(said.best, constants[said.best]), said.indistinguishable[1:], ""
    if not said.describes:
        first = Text(
            "No law describes these readings; the best one, {law}, leaves {rms:n} Hz rms. Its constants and their "
            "uncertainties are those of a curve through the readings, not of a drag.",
            law=law, rms=digits(best.rms_residual),
        )  # fmt: skip
    elif said.decided:
        start = "The {law} law fits best: {how}." if how else "The {law} law fits best."
        if len(fits) == 1:
            start = "The {law} law alone was fitted: {how}." if how else "The {law} law alone was fitted."
        first = Text(start, law=law, how=how)
    elif len(simple) == 1:
        alike = law_names(said.indistinguishable, power)
        first = Text("The laws {alike} cannot be distinguished: {law} has the fewest constants.", alike=alike, law=law)
        advice = "More runs, or a longer fall of the spin, can decide."
    else:
        fall = max(float(1 - run.frequency[-1] / run.frequency[0]) for run in runs)
        first = Text(
            "These {n} readings cannot distinguish {laws}: over a fall of the spin by {percent:n} % they differ too "
            "little for readings of this number and precision.",
            n=best.n, laws=law_names(simple if len(simple) > 1 else ()), percent=digits(100 * fall),
        )  # fmt: skip
        advice = "Let the top fall further, or read it more often."
    misses = [Text("{rms:n} Hz", rms=digits(stats[name].rms_residual)) for name in said.excluded]
    misses = misses[:1] if len(set(misses)) == 1 else misses
    excluded = Text(
        "The readings exclude {laws}, off by {rms} (rms); {law} is off by {least:n} Hz.",
        laws=law_names(said.excluded), rms=enumeration(misses or [""]), law=law, least=digits(best.rms_residual),
    )  # fmt: skip
    weak = Text("They speak against {laws}, not strongly enough to exclude.", laws=law_names(said.weak))
    needless = Text("No better than {law}, with more constants: {laws}.", law=law, laws=law_names(compared, power))
    return Sentences(
        first,
        Text("If the {law} law holds, {how}.", law=law, how=how) if how and said.describes and not said.decided else "",
        excluded if misses else "",
        Text("They cannot distinguish it from {laws}.", law_names(others, power)) if others and said.decided else "",
        advice,
        weak if said.weak else "",
        needless if compared and (said.decided or len(simple) == 1) and said.describes else "",
        _wobble(tilt),
    )


def _how(law: str, constants: Mapping[str, Estimate]) -> str:
    """Return how the drag grows by a law, and its constants; empty where neither is known."""
    drag, known = _DRAGS.get(law), _constants(constants)
    if not drag:
        return known
    grows = Text("the drag of the air grows as {drag}", drag=drag)
    return Text("{grows}, with {constants}", grows=grows, constants=known) if known else grows


def _constants(of: Mapping[str, Estimate]) -> str:
    """Return the constants of a law with their u, of a single one also its relative u; empty where none has a u."""
    known = {name: one for name, one in of.items() if one.value is not None and one.u}
    texts = [Text("{symbol} = {value:n}", SYMBOLS[name], with_uncertainty(one)) for name, one in known.items()]
    if len(known) != 1 or len(of) != 1:
        return enumeration(texts) if texts else ""
    (one,) = known.values()
    percent = digits(100 * float(f"{one.u or 0.0:.2g}") / abs(one.value or 1.0), 2)  # as u is shown
    return Text("{constant}, known to {percent:n} %", constant=texts[0], percent=percent)


def _wobble(tilt: Estimate | None) -> str:
    """Return what the readings say of the tilt of the moment; of one that they do not show, where it ends (95 %)."""
    if tilt is None or tilt.value is None or not tilt.u:
        return ""
    if is_seen(tilt):
        seen = "The counter sees the wobble of the top: its moment is tilted against its axis by {tilt:n} rad."
        return Text(seen, tilt=_value(tilt))
    return Text(
        "The readings do not make certain that the moment of the top is tilted against its axis: it is by less than "
        "{most:n} rad.",
        most=digits(max(tilt.value, 0.0) + 2 * tilt.u, 2),
    )


def _exponent(exponent: Estimate | None) -> str:
    """Return an exponent as n = 1.507 ± 0.006."""
    if exponent is None or exponent.value is None or not exponent.u:
        return "of whatever exponent"
    return Text("n = {n:n}", n=_value(exponent))


def _value(estimate: Estimate) -> str:
    """Return 1.507 ± 0.006; without u where that is smaller than any measurement makes it."""
    value, u = estimate.value or 0.0, estimate.u or 0.0
    if u < TOO_SMALL:
        return f"{round(value, 9) + 0.0:.9g}"
    places = min(max(0, -floor(log10(u)) + (u < 3 * 10 ** floor(log10(u)))), 9)
    return f"{value:.{places}f} ± {u:.{places}f}"


# --- remarks ------------------------------------------------------------------------------------------

#: Instead of a verdict, where no unit is sure.
UNIT_FIRST = "The unit comes first: laws are compared once it is known."
#: What a tilt costs that the readings do not show: docs/crosscheck.md has the numbers.
TILT_ALLOWED = (
    "u allows for a tilt of the moment, which these readings leave open; for a top that is known to have none: `tilt` "
    "= none"
)


def doubts_about_law(run: SpinDown, runs: int) -> Iterator[Note]:
    """Yield that no law describes a run, one of some, and where it leaves them; or that no drag of air is its drag."""
    change = run.verdict.change
    if change and is_change(change.p, runs):
        falls = float(run.frequency[change.first] - run.frequency[change.last])
        size = min(-change.size, falls) if change.size < 0 < falls else abs(change.size)
        said = Text(
            "no law describes the readings: they {way} by {hz:n} Hz beyond each law between {first:.6g} s and "
            "{last:.6g} s, or bend there, as {cause}. Fit a part, by `start` and `stop`, or leave it out",
            way="rise" if change.size > 0 else "fall", hz=digits(size),
            first=float(run.time[change.first]), last=float(run.time[change.last]), cause=_cause(run, change),
        )  # fmt: skip
        before = change.first + 1 >= run.time.size - change.last  # the part with more readings
        end = run.time[change.first if before else change.last]
        options = {"stop_s" if before else "start_s": float(f"{end:.9g}")}
        yield Note("no law", said, weight="doubt", options=options)
    else:
        yield from _drag_in_doubt(run.drag_over_disc)


def _cause(run: SpinDown, change: Change) -> str:
    """Return the causes of a change that fit it, the likeliest first."""
    periods = 1e3 / run.frequency
    if np.all(np.abs(periods - np.round(periods)) < _WHOLE_MS):
        return Text("of periods that are counted in whole milliseconds")
    if change.size < 0 and change.last == change.first + 1:
        return Text("where a row was missed and the times were numbered on, or of a top that was touched")
    if change.size > 0 and 4 * change.last < run.time.size:
        return Text("of a top that is still driven or held, or was spun again or touched")
    return Text("of a top that was spun again or touched")


#: Periods that are this near to whole milliseconds all are [ms]; a frequency of 1/min, rounded, moves them by 0.01.
_WHOLE_MS = 0.02
#: A drag below this multiple of its u is not known; one is out of bounds if it is so by more than the other multiple.
_KNOWN, _CERTAIN = 2.0, 3.0
#: By which factor it changes the drag where times are taken for others.
_MISTAKES = {
    0.001: "milliseconds that are taken for seconds",
    1 / 60: "seconds that are taken for minutes",
    0.1: "tenths of a second that are taken for seconds",
    10: "numbers of readings, 10 s apart, that are taken for seconds",
    24: "a spreadsheet's days that are taken for hours",
    60: "minutes that are taken for seconds",
}


def _drag_in_doubt(drag: Estimate) -> Iterator[Note]:
    """Yield that no air drags a top so, from the drag over that of a bare disc, and the usual cause."""
    times, u = drag.value or 0.0, drag.u or 0.0
    if times < _KNOWN * u:
        said = (
            "the spin falls by less than twice the uncertainty of the fall, so the readings do not determine the drag. "
            "Record longer, or with a clearer signal"
        )
        yield Note("drag", said, weight="doubt")
        return
    if LEAST - _CERTAIN * u <= times <= MOST + _CERTAIN * u:
        return
    factor = min(_MISTAKES, key=lambda one: abs(math.log(max(times, 1e-9) / one)))
    said = Text(
        "the drag is {times:n} times that of a bare disc of the top's size in laminar air; with rim and washers "
        "{least:g} to {most:g} times are possible. A factor of about {factor:.2g} is typical of {mistake}. If the "
        "times are right, {other}",
        times=digits(times), least=LEAST, most=MOST, factor=factor, mistake=_MISTAKES[factor],
        other="a drive pushes the top, or it spins in a vacuum" if times < 1 else "more than air brakes the top, as "
        "eddy currents in metal beside it",
    )  # fmt: skip
    yield Note("drag", said, weight="doubt")


def remark(of: Remark) -> str:
    """Return a remark as a sentence, without its full stop."""
    note = note_of(of, _REMARKS, of)
    of_law = of.law and of.kind in _OF_A_LAW
    return reword(note, Text("{law}: {said}", law=short_law(of.law), said=note)) if of_law else note


_OF_A_LAW = frozenset({
    "not converged", "no freedom", "not separated", "out of range", "negative", "undetermined", "factor", "missing",
    "scatters",
})  # fmt: skip
#: A reading more times its unit away than this is only said to be: all others lie on the law then.
_MOST_TIMES = 1000


def _outlier(of: Remark) -> str:
    time, frequency, off, times, stated, kept, falling = of.values
    many = Text("more than {most}", most=_MOST_TIMES) if times >= _MOST_TIMES else digits(times)
    return Text(
        "the reading of {hz:.6g} Hz at {time:.12g} s lies {off:n} Hz from the {law} law, {many:n} times {unit}, and "
        "was {kept}{falling}",
        hz=frequency, time=round(time, 3), off=digits(off), law=law_name(of.law or ""), many=many,
        unit="its uncertainty" if stated else "the rms residual of the others",
        kept="kept as asked" if kept else "left out",
        falling="; it stands at the end: the top may already have been falling" if falling else "",
    )  # fmt: skip


def _few_runs(of: Remark) -> str:
    n, width = of.values
    return Text(
        "{n:.0f} runs give their scatter, and so u of the means, to {percent:.0f} % only: a 68 % "
        "interval is {width:n} u to each side (Student's t)",
        n=n, percent=100 / (2 * (n - 1)) ** 0.5, width=digits(width),
    )  # fmt: skip


_REMARKS: Mapping[str, str | Callable[[Remark], str] | Weighed] = MappingProxyType(
    {
        "not converged": "the fit did not converge, the numbers are those of the best point found",
        "no freedom": (
            "{n:.0f} parameters pass through {n:.0f} readings, so nothing shows their uncertainty: "
            "record more readings, or state the uncertainty of each"
        ),
        "not separated": "the readings do not separate the parameters, so these have no uncertainty",
        "out of range": "{name} is too large or too small for a number, as it depends exponentially on the exponent",
        "negative": "{name} is negative by {times:.1f} standard uncertainties, which no drag can be",
        "undetermined": "{name} is not determined, as it depends exponentially on the exponent",
        "factor": "{name} is known only to a factor of about {times:n}, as it depends exponentially on the exponent",
        "outlier": _outlier,
        "falling": Weighed(_outlier, "advice"),
        "calculated": Weighed(
            lambda of: Text(
                "the readings lie on the {law} law to {hz:n} Hz, too good to be measured: were they "
                "calculated? Then no uncertainty here says anything about a top",
                law=of.law,
                hz=digits(of.values[0], 1),
            ),
            "doubt",
        ),
        "no u": Weighed(
            "the readings have no uncertainties of their own: their scatter about each law stands for them, so a law "
            "that does not fit shows only beside a better one",
            "advice",
        ),
        "few left": FEW_LEFT,
        "understated": lambda of: Text(
            "even the best law, {law}, misses the readings by {times:n} times their stated uncertainties, more than "
            "chance explains: all uncertainties are enlarged; check the readings' uncertainties",
            law=law_name(of.law or ""),
            times=digits(of.values[0]),
        ),
        "overstated": Weighed(
            "the readings scatter only {times:n} times as much about the best law as their stated uncertainties say: "
            "these are upper bounds, and so is u of the constants",
            "advice",
        ),
        "few readings": lambda of: Text(
            "{n:.0f} readings are too few for AICc: BIC compares the laws, as sure as the stated uncertainties are"
            if of.values[1]
            else "{n:.0f} readings are too few to compare {laws} by AICc: record more readings",
            n=of.values[0],
            laws=law_names(filter(None, of.name.split(", "))),
        ),
        "correlated": Weighed(
            lambda of: Text(
                "neighbouring residuals resemble each other: their correlation is {r:.2f} ± {u:.2f}, so {n:.0f} "
                "readings are worth as much as {worth:n} independent ones; it is in all uncertainties",
                r=of.values[0],
                u=of.values[1],
                n=of.values[2],
                worth=digits(independent(round(of.values[2]), of.values[0])),
            ),
            "advice",
        ),
        "mixed u": Weighed(
            "{some:.0f} of {all:.0f} runs give no uncertainties of their readings: theirs come from the "
            "scatter about each law",
            "advice",
        ),
        "one run": (
            "this is one run: another of the same top may differ by more than its u (draught, temperature, the start): "
            "record several"
        ),
        "few runs": _few_runs,
        "missing": "{some:.0f} of {all:.0f} runs have no {name} and are not in its mean",
        "scatters": lambda of: Text(
            "{symbol} scatters between the runs {times:n} times as much as each fit's own uncertainty "
            "explains: the runs differ, so trust the scatter, not the fit of one run",
            symbol=SYMBOLS.get(of.name, of.name),
            times=digits(of.values[0]),
        ),
    }
)

"""Limits at some paths: each run by itself, and those of the same conditions together."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from analysis import stability
from analysis.errors import AnalysisError
from analysis.limits import Comparison, Sample, Statistics, combine, compare, nearest_edge, spins_of_window, summarize
from analysis.locked import Cause
from analysis.numbers import digits
from analysis.spindown.fall import FALLS_BETWEEN_HZ, STOPPED_ABOVE_HZ
from levilab.errors import DataError
from levilab.formats.understanding import possible_spins
from levilab.pipelines.analyzed import Analyzed
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.limit.readings import LimitReadings
from levilab.pipelines.options import LimitOptions
from levilab.pipelines.row import Quantity, columns_of, entry
from levilab.present.numbers import enumeration, with_uncertainty
from levilab.runs.events import RunEvent
from levilab.simulator.keys import SceneError
from levilab.simulator.published.printed import published
from levilab.simulator.scene import Scene, scene_of
from levilab.stability.thesis import ISLANDS_HZ, is_thesis_device
from levilab.texts.note import Note
from levilab.texts.text import Sentences, Text

#: Of `analysis.limits.Statistics`.
QUANTITIES = (
    Quantity("mean", "Hz", "mean limit", optional=True),
    Quantity("scatter", "Hz", "standard deviation of one limit", optional=True),
    Quantity("trend", "Hz", "change from one limit to the next", optional=True),
    Quantity("between_runs", "Hz", "standard deviation between runs", of="between", optional=True, column=False),
    Quantity("standard_error", "Hz", "standard error of the mean, where it rests on the scatter",
             of=lambda found: found.mean.u if found.scatter else None, has_u=False),
    Quantity("step_error", "Hz", "uncertainty from the steps of the drive",
             of=lambda found: found.step or None, has_u=False, optional=True, column=False),
)  # fmt: skip

LIMIT_ROW = (
    entry("which", "text", "lower or upper", "result.which"),
    entry("repetitions", "count", "limits that were measured", "result.statistics.n"),
    *columns_of(QUANTITIES),
    entry("trend_p", "number", "probability of such a trend by chance", "result.statistics.trend_p"),
    entry("outliers", "count", "limits far from the others", "result.statistics.outliers"),
    *(
        entry(f"linear_{edge}_hz", "number", f"{edge} edge of the linear window of the top",
              f"result.device.linear_{edge}_hz")
        for edge in ("lower", "upper")
    ),
    entry("verdict", "text", "what the limits say"),
)  # fmt: skip


Which = Literal["lower", "upper"]

#: The experiment whose runs it takes, and whose settings count.
EXPERIMENT = "limit"
#: Kinds of events that say how a top was lost, in words.
ENDS: Mapping[str, str] = {
    RunEvent.FELL: "fell freely",
    RunEvent.LOCK_LOST: "was lost by the drive",
    RunEvent.TOP_LOST: "fell under the drive",
    RunEvent.LEVELS_OFF: "got no faster under the drive",
}
#: What became of one top and of several, at which spin, and what such spins are called.
_LOST = {"lower": ("The top fell at", "The tops fell at"),
         "upper": ("The drive lost the top at", "The drive lost the tops at")}  # fmt: skip
_NO_FASTER = "The top went no faster than", "The tops went no faster than"
_NAMES = {"lower": ("lower limit", "lower limits"), "upper": ("upper limit", "upper limits")}
_SPINS = "spin", "spins"
#: Waveforms of a drive in words.
_WAVEFORMS = {"SIN": "sine", "SQU": "square", "TRI": "triangle"}
#: Names of what theory says, of each limit.
LOWER_EDGE, UPPER_EDGE = "lower edge of the linear window", "upper edge of the linear window"
RESONANCE = "resonance of the wobble"
#: Names of what other experiments reached.  Simon's top is another one: it is compared as a part of its own edge.
THESIS_HIGHEST = "thesis's highest spin"
SIMON = "Simon's top 3, as a part of its upper edge"
#: From there on a simulated top is up or lost by its start; half-width of that spin [Hz], by which an error of the
#: simulation that is a tenth moves it.
ISLANDS, ISLANDS_WITHIN_HZ = "where the islands of simulated tops begin", 1.0
#: Name → spin that the thesis's device reached, as printed.
_REACHED = {THESIS_HIGHEST: published("thesis")["measured.highest"]}


@dataclass(frozen=True)
class Device:
    """What theory says of the top that was measured.

    Attributes:
        name: where its parameters come from, in words.
        linear_lower_hz, linear_upper_hz: edges of the linear window of its spin.
        resonance_hz: of its wobble; None where there is none.
        is_thesis: whether base and top are the thesis's, but for the mass.
    """

    name: str
    linear_lower_hz: float
    linear_upper_hz: float
    resonance_hz: float | None
    is_thesis: bool = False

    def expected_spins(self, which: Which) -> dict[str, tuple[float, float]]:
        """Name → spin that a limit is compared with, and its standard uncertainty [Hz]."""
        if which == "upper":
            reached = {name: (one.value, one.rounding / 3**0.5) for name, one in _REACHED.items()}
            of_thesis = {ISLANDS: (ISLANDS_HZ[0], ISLANDS_WITHIN_HZ / 3**0.5)} | reached
            computed = {UPPER_EDGE: (self.linear_upper_hz, 0.0), SIMON: (_simon_share() * self.linear_upper_hz, 0.0)}
            return computed | (of_thesis if self.is_thesis else {})
        resonance = {} if self.resonance_hz is None else {RESONANCE: (self.resonance_hz, 0.0)}
        return {LOWER_EDGE: (self.linear_lower_hz, 0.0)} | resonance


def _simon_share() -> float:
    """Return the measured upper limit of Simon's top 3 as a part of the upper edge of its linear window.

    >>> round(_simon_share(), 3)
    0.893
    """
    simon = published("simon-1997")
    return simon["abstract.upper_measured"].value * 2 * math.pi / 60 / simon["top.3.upper_quartic"].value


@dataclass(frozen=True)
class Conditions:
    """Under which limits were measured; limits under other conditions are no repetitions of these.

    Attributes:
        which: of the two limits.
        top: where the parameters of the top come from, in words.
        waveform, amplitude_vpp, creep_hz_per_s, step_hz: the drive of an upper limit, and how far it goes between two
            looks at the top; None where the data do not say, and of lower limits: a free top falls without a drive.
        synthetic: whether the runs were simulated or made up; None where that is not known, as of a data file.
        triggered: whether the top triggered the drive, which then makes no steps.
        levels_off: whether the spins are no limits, but those at which the pull of the drive equalled the drag.
    """

    which: Which
    top: str
    waveform: str | None = None
    amplitude_vpp: float | None = None
    creep_hz_per_s: float | None = None
    step_hz: float | None = None
    synthetic: bool | None = None
    triggered: bool = False
    levels_off: bool = False

    @property
    def text(self) -> str:
        """In words, without whether they are SYNTHETIC."""
        drive = [
            "triggered" * self.triggered,
            "" if self.waveform is None else _WAVEFORMS.get(self.waveform, self.waveform),
            "" if self.amplitude_vpp is None else Text("{volts:g} Vpp", volts=self.amplitude_vpp),
            "" if self.creep_hz_per_s is None else Text("{rate:g} Hz/s", rate=self.creep_hz_per_s),
            "" if self.step_hz is None else Text("a look each {step:g} Hz", step=self.step_hz),
        ]
        return Text("{parts}", parts=(*filter(None, drive), self.top))


@dataclass(frozen=True)
class Limits:
    """What was found of one run, or of several under the same conditions.

    Attributes:
        which: of the two limits.
        conditions: of them.
        statistics: of the repetitions.
        comparisons: with theory.
        device: that theory is of.
        ends: kind of event → how often a top was lost so.
        runs: of a group, the numbers of the inputs, from 0.
        causes: cause of a loss, told by the phase before it → number of tops; of runs that recorded it.
        says_synthetic: whether another group differs from this one only in what is SYNTHETIC, so that the text says it.
    """

    which: Which
    conditions: Conditions
    statistics: Statistics
    comparisons: tuple[Comparison, ...]
    device: Device
    ends: Mapping[str, int]
    runs: tuple[int, ...] = ()
    causes: Mapping[str, int] = field(default_factory=dict)
    says_synthetic: bool = False

    @property
    def theory(self) -> tuple[Comparison, ...]:
        """The comparisons with theory; those with what others reached stand in the table alone."""
        return tuple(one for one in self.comparisons if one.name not in {SIMON, *_REACHED})

    @property
    def is_doubtful(self) -> bool:
        """Whether tops that nothing stops would have floated on for long, or have fallen or flown off long before."""
        off = {one.name: one.difference.value or 0.0 for one in self.comparisons}
        far = STOPPED_ABOVE_HZ - FALLS_BETWEEN_HZ[1]
        return abs(off.get(LOWER_EDGE, 0.0)) > far or off.get(UPPER_EDGE, 0.0) > far

    @property
    def may_be_of_two_marks(self) -> bool:
        """Whether upper limits of a file are lower ones if two pulses a turn were counted."""
        high, low = FALLS_BETWEEN_HZ
        unsaid = self.which == "upper" and self.conditions.waveform is None  # a run has its drive
        return unsaid and low <= (self.statistics.mean.value or 0.0) / 2 <= high

    @property
    def conditions_text(self) -> str:
        """The conditions in words."""
        made_up = "SYNTHETIC" if self.conditions.synthetic else "not known to be SYNTHETIC"
        return f"{self.conditions.text}, {made_up}" if self.says_synthetic else self.conditions.text

    @property
    def text(self) -> str:
        """What the limits say, in a few sentences."""
        return Sentences(*_sentences(self))


class LimitAnalysis(Analyzed[LimitReadings, Limits, tuple[Limits, ...], LimitOptions]):
    """Limits, each run by itself and those of the same conditions together."""

    @property
    def groups(self) -> tuple[Limits, ...]:
        """One for each of the conditions that there are runs of, lower limits first."""
        return self.combined

    @property
    def text(self) -> str:
        """What the data say, in a few sentences, for each of the conditions in a line of its own."""
        return Sentences(*(group.text for group in self.groups), between="\n")

    @property
    def averaged(self) -> Sequence[Sequence[Source[LimitReadings]]]:
        """Those of the same conditions."""
        return tuple(tuple(self.sources[k] for k in group.runs) for group in self.groups)

    def inputs_of(self, group: int | None) -> Sequence[Source[LimitReadings]]:
        """Return the inputs of the same conditions, by their number in `groups`; None: all inputs."""
        return self.sources if group is None else self.averaged[group]

    def prefix(self, group: Limits) -> str:
        """Return what the names of a group's values begin with; empty where it is the only group."""
        if len(self.groups) == 1:
            return ""
        of_kind = self.number(group)
        return f"{group.which}_" if of_kind is None else f"{group.which}_{of_kind}_"

    def number(self, group: Limits) -> int | None:
        """Return the number of a group among those of its kind, from 1; None where it is the only one."""
        alike = [one for one in self.groups if one.which == group.which]
        return alike.index(group) + 1 if len(alike) > 1 else None

    def about_all(self) -> Iterable[str]:
        """Return what to know of the limits of the same conditions, and of conditions that differ."""
        for which in ("lower", "upper"):
            texts = [group.conditions_text for group in self.groups if group.which == which]
            if len(texts) > 1:
                several = "the {which} limits are of {n} conditions and are not combined: {conditions}"
                yield Text(several, which=which, n=len(texts), conditions=tuple(texts))
        for group in self.groups:
            if len(group.runs) > 1:
                of_runs = group.statistics.between is not None  # their own notes name outliers
                yield from warnings_of(replace(group.statistics, outliers=()) if of_runs else group.statistics)

    def about_run(self, run: Limits) -> Iterable[str]:
        """Yield what to know of one run."""
        if run.which == "upper" and run.is_doubtful:
            mean = run.statistics.mean
            fitting = possible_spins(mean.value or 0.0)
            units = tuple(f"{unit} ({hz:.1f} Hz)" for unit, hz in fitting.items() if unit != "Hz")
            said = "{spin:n} is no upper limit of a top: is it in {units}, or was each turn counted several times?"
            yield Note("stopped", Text(said, with_uncertainty(mean), units or ("another unit",)), weight="doubt")
        elif run.is_doubtful:
            fast = (run.statistics.mean.value or 0.0) > run.device.linear_lower_hz
            why = "was it stopped, or held by a drive?" if fast else "was each second turn counted?"
            text = Text("{spin:n} is no lower limit of a top: {why}", with_uncertainty(run.statistics.mean), why)
            yield Note("stopped", text, weight="doubt")
        if run.may_be_of_two_marks:
            said = "taken for upper limits of a driven top; with 2 marks a turn they are lower ones, at {hz:.2f} Hz"
            yield Note("two marks", Text(said, hz=(run.statistics.mean.value or 0.0) / 2))
        yield from warnings_of(run.statistics)


def limits_of(source: Source[LimitReadings], options: LimitOptions) -> Limits:
    """Analyze one input.  Raises AnalysisError, DataError."""
    device = device_of(source)
    which = _which(source, device)
    statistics = summarize(_sample(source, which, options))
    conditions = _conditions(source, which, device)
    events = source.run.events() if source.run else []
    kinds = Counter(str(event["kind"]) for event in events)
    causes = Counter(str(event["cause"]) for event in events if event.get("cause"))
    ends = {str(kind): kinds[kind] for kind in ENDS if kinds[kind]}
    return Limits(
        which, conditions, statistics, _comparisons(statistics, device, conditions), device, ends, causes=dict(causes)
    )


def together(
    sources: Sequence[Source[LimitReadings]], runs: Sequence[Limits], options: LimitOptions
) -> tuple[Limits, ...]:
    """Return the limits of each of the conditions, lower ones first, else in the order in which they are given.

    What was made up says nothing about a real top: it makes a group of its own.
    """
    groups: dict[tuple[Conditions, Device], list[int]] = {}
    for k, run in sorted(enumerate(runs), key=lambda one: one[1].which):
        made_up = replace(run.conditions, synthetic=sources[k].synthetic)
        groups.setdefault((made_up, run.device), []).append(k)
    return tell_apart(
        replace(runs[numbers[0]], runs=tuple(numbers))
        if len(numbers) == 1
        else _combine(tuple(numbers), sources, runs, options)
        for numbers in groups.values()
    )


def tell_apart(groups: Iterable[Limits]) -> tuple[Limits, ...]:
    """Return the groups; those that differ only in what is SYNTHETIC say it in their text."""
    keyed = [((replace(group.conditions, synthetic=None), group.device), group) for group in groups]
    alike = Counter(key for key, _ in keyed)
    return tuple(replace(group, says_synthetic=alike[key] > 1) for key, group in keyed)


def synthetic_source(source: Source[LimitReadings]) -> bool | None:
    """Return whether an input is synthetic; None of a data file, which does not say it."""
    return source.synthetic if source.run else None


def synthetic_runs(runs: Iterable[Limits]) -> bool | None:
    """Return whether runs are synthetic; None where that is not known of all, or not alike."""
    kinds = {run.conditions.synthetic for run in runs}
    return kinds.pop() if len(kinds) == 1 else None


def _combine(
    numbers: tuple[int, ...], sources: Sequence[Source[LimitReadings]], runs: Sequence[Limits], options: LimitOptions
) -> Limits:
    first = runs[numbers[0]]
    which, device = first.which, first.device
    statistics = combine([_sample(sources[k], which, options) for k in numbers])
    ends, causes = (
        sum((Counter(getattr(runs[k], name)) for k in numbers), Counter[str]()) for name in ("ends", "causes")
    )
    comparisons = _comparisons(statistics, device, first.conditions)
    conditions = replace(first.conditions, synthetic=synthetic_runs(runs[k] for k in numbers))
    return Limits(which, conditions, statistics, comparisons, device, dict(ends), numbers, dict(causes))


def _sample(source: Source[LimitReadings], which: Which, options: LimitOptions) -> Sample:
    """Return the limits of a source; of an upper limit that levilab measured, u is a step of the drive over √12."""
    readings = source.readings
    if options.reading_u is not None:
        return Sample(readings.limit, np.full(len(readings), options.reading_u))
    if which == "upper" and source.run is not None and readings.u is not None and not _is_triggered(source):
        return Sample.within_steps(readings.limit, readings.u)
    return Sample(readings.limit, readings.u, common=readings.common)


def _conditions(source: Source[LimitReadings], which: Which, device: Device) -> Conditions:
    """Return the conditions by the run's configuration and its record."""
    said = source.settings(EXPERIMENT)
    if which == "lower" or not said:
        return Conditions(which, device.name, synthetic=synthetic_source(source))
    triggered = _is_triggered(source)
    creep, interval = (
        None if triggered else source.number(EXPERIMENT, name) for name in ("creep_hz_per_s", "interval_s")
    )
    waveform = said.get("drive_waveform")
    return Conditions(
        which,
        device.name,
        waveform=waveform if isinstance(waveform, str) else None,
        amplitude_vpp=source.number(EXPERIMENT, "drive_amplitude_vpp"),
        creep_hz_per_s=creep,
        step_hz=None if creep is None or interval is None else round(creep * interval, 9),
        synthetic=synthetic_source(source),
        triggered=triggered,
        levels_off=source.readings.common is not None,
    )


def _is_triggered(source: Source[LimitReadings]) -> bool:
    return source.settings(EXPERIMENT).get("drive") == "triggered"


def _comparisons(statistics: Statistics, device: Device, conditions: Conditions) -> tuple[Comparison, ...]:
    """Return the comparisons with theory; spins that are no limits have none."""
    expected = {} if conditions.levels_off else device.expected_spins(conditions.which)
    return tuple(compare(statistics, name, *spin) for name, spin in expected.items())


def _which(source: Source[LimitReadings], device: Device) -> Which:
    """Return the limit that the run names; else the limit whose edge is nearer."""
    said = source.settings(EXPERIMENT).get("which")
    if said in {"lower", "upper"}:
        return "upper" if said == "upper" else "lower"
    mean = float(source.readings.limit.mean())
    return "upper" if nearest_edge(mean, (device.linear_lower_hz, device.linear_upper_hz)) == "upper" else "lower"


def device_of(source: Source[LimitReadings]) -> Device:
    """Return the top of the run's scene, or else the thesis's.  Raises DataError for an odd scene."""
    if not (table := source.settings("scene")):
        return described_device(Scene(), "the thesis's top, 25.26 g")
    try:
        scene = scene_of(table)
        return described_device(scene, f"scene {scene.name}, {1000 * scene.top.mass_kg:g} g")
    except (SceneError, AnalysisError) as error:
        raise DataError("{path:s}/run.json: configuration.scene: {error}", path=source.path, error=error) from error


def described_device(scene: Scene, name: str) -> Device:
    """Return what theory says of a scene's top, where it floats.  Raises NoWindow, SceneError."""
    from levilab.simulator.equilibrium import stability_of  # with numba, which no other analysis needs

    found = stability_of(scene)
    windows = found.floating.spins if found.floating else ()
    low, high = spins_of_window(windows, scene.start.spin_hz)
    assert found.floating is not None  # else there would be no window
    resonance = stability.wobble_resonance(found.field, found.top, found.floating.height)
    return Device(name, low, high, None if np.isnan(resonance) else resonance, is_thesis_device(scene))


def warnings_of(statistics: Statistics) -> list[Note]:
    """Return what to know before using the mean."""
    texts: dict[str, str] = {}
    if statistics.outliers:
        numbers = [str(i + 1) for i in statistics.outliers]
        texts["outliers"] = (
            Text("limit {number} does not belong to the others; the mean has it", *numbers)
            if len(numbers) == 1
            else Text("limits {numbers} do not belong to the others; the mean has them", enumeration(numbers))
        )
    if statistics.drifts and statistics.trend:
        texts["drifts"] = Text(
            "the limit drifts by {trend:n} a repetition: the mean is of no fixed state of the top; look for its mass, "
            "or the room's temperature",
            trend=with_uncertainty(statistics.trend),
        )
    if statistics.scatter is None:
        texts["single"] = "a single repetition: its scatter is not known, repeat it"
    if statistics.mean.u and statistics.step**2 > 0.5 * statistics.mean.u**2 and statistics.scatter:
        texts["steps"] = Text(
            "the tops scatter by less than the drive's steps, which leave {hz:n} Hz to the mean however often it is "
            "repeated: creep slower, or look more often (limit.creep_hz_per_s, limit.interval_s)",
            hz=digits(statistics.step),
        )
    return [Note(kind, text) for kind, text in texts.items()]


# --- in words ---


def _sentences(limits: Limits) -> Iterable[str]:
    found, levels_off = limits.statistics, limits.conditions.levels_off
    several = found.n > 1
    spread: str = ", which do not scatter" * (found.scatter is not None)
    if found.scatter and found.scatter.value:
        spread = Text(", which scatter by {scatter:n}", scatter=with_uncertainty(found.scatter))
    yield Text(
        "{lost} {mean:n}{average}: {n} {name}{spread} ({conditions:n}).",
        lost=(_NO_FASTER if levels_off else _LOST[limits.which])[several],
        mean=with_uncertainty(found.mean),
        average=" on average" if several else "",
        n=found.n,
        name=(_SPINS if levels_off else _NAMES[limits.which])[several],
        spread=spread,
        conditions=limits.conditions_text,
    )
    yield from () if levels_off else _beside_theory(limits)
    if found.between:
        said = "The means of the {n} runs scatter by {beyond:n} beyond the scatter of the tops."
        yield Text(said, n=found.runs, beyond=with_uncertainty(found.between))
    if limits.ends and found.n > 1:
        ends = tuple(_times(ENDS[kind], n) for kind, n in limits.ends.items())
        yield Text("The top {ends}.", ends=ends)
    if levels_off:
        yield "The pull of the drive equals the drag there: a stronger drive gets higher, this is no limit of the top."
    elif limits.causes:
        told = tuple(_times(cause, n) if found.n > 1 else cause for cause, n in sorted(limits.causes.items()))
        how = "Causes" if limits.conditions.triggered else "The phase before each loss tells why"
        yield Text("{how}: {causes}.", how=how, causes=told)


#: Below it the tail of a distribution is known too badly for a number of runs.
_SELDOM = 1e-3


def _times(what: str, n: int) -> str:
    times = {1: "once", 2: "twice"}.get(n) or Text("{n} times", n=n)
    return Text("{what} {times}", what=what, times=times)


def _beside_theory(limits: Limits) -> Iterable[str]:
    """Yield how far the mean lies from a limit of theory, why tops are lost sooner, and how often that is chance."""
    theory = {one.name: one for one in limits.comparisons}
    edge = theory.get(LOWER_EDGE) or theory.get(UPPER_EDGE)
    if edge is None:
        return
    off = edge.difference.value or 0.0
    lower = limits.which == "lower"
    why, one = "", theory.get(RESONANCE)
    if (off > 0) == lower:
        other = set(limits.causes) - {Cause.OUT_OF_WINDOW, Cause.NOT_KNOWN}
        why = "" if other else ", likely because a tilted top moves, and is lost sooner"
        if limits.is_doubtful:
            why = ", more than a tilt explains"
        elif lower and one:
            why = ", likely because a tilted top leans ever more towards {hz:.2f} Hz, the {name}, and falls sooner"
            why = Text(why, hz=one.expected, name=one.name)
    yield Text(
        "In theory an upright top at rest floats {way} to {edge:.2f} Hz (the {name}); {mean} lies {off:.2f} Hz {side} "
        "it{why}.",
        way="down" if lower else "up",
        edge=edge.expected,
        name=edge.name,
        mean="that" if limits.statistics.n == 1 else "the mean",
        off=abs(off),
        side="above" if off > 0 else "below",
        why=why,
    )
    if edge.p is not None:
        p = f"p = {digits(edge.p)}" if edge.p >= 1e-6 else "p < 10⁻⁶"
        seldom = "once in {n:.0f} such runs" if edge.p >= _SELDOM else "in fewer than one of {n:.0f} such runs"
        once = Text(seldom, n=1 / max(edge.p, _SELDOM))
        often = Text("in {percent:.0f} % of such runs", percent=100 * edge.p) if edge.agrees else once
        yield Text("By chance alone so large a difference comes {often} ({p:n}).", often=often, p=p)

"""Limits at some paths: each run by itself, and all lower and all upper ones together."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from analysis import stability
from analysis.errors import AnalysisError
from analysis.limits import Comparison, Statistics, compare, nearest_edge, spins_of_window, summarize
from levilab.errors import DataError
from levilab.pipelines.analyzed import Analyzed, Method
from levilab.pipelines.limit.readings import LimitReadings, read_limit_file, read_limit_run
from levilab.pipelines.sources import InputOptions, Needs
from levilab.present.numbers import with_uncertainty
from levilab.simulator.keys import SceneError
from levilab.simulator.scene import Scene, scene_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from levilab.pipelines.sources import Source

Which = Literal["lower", "upper"]

LIMIT = "limit"
#: The runs that suit, and what is needed of a data file.
NEEDS = Needs(
    analysis=LIMIT,
    experiments=frozenset({"limit"}),
    read_file=read_limit_file,
    read_run=read_limit_run,
)
#: Kinds of events that say how a top was lost, in words.
ENDS = {"fell": "fell freely", "lock lost": "was lost by the drive", "top lost": "fell under the drive"}
#: Names of what theory says, of each limit.
LOWER_EDGE, UPPER_EDGE = "lower edge of the linear window", "upper edge of the linear window"
RESONANCE = "resonance of the wobble"


@dataclass(frozen=True)
class LimitOptions(InputOptions):
    """How limits are analyzed.  reading_u: of every limit [Hz], in the place of what the data say."""

    reading_u: float | None = None


@dataclass(frozen=True)
class Device:
    """What theory says of the top that was measured.

    Attributes:
        name: where its parameters come from, in words.
        lower, upper: edges of the linear window of its spin [Hz].
        resonance: of its wobble [Hz]; None where there is none.
    """

    name: str
    lower: float
    upper: float
    resonance: float | None

    def expected(self, which: Which) -> dict[str, float]:
        """Name → spin [Hz] that a limit is compared with."""
        if which == "upper":
            return {UPPER_EDGE: self.upper}
        return {LOWER_EDGE: self.lower} | ({RESONANCE: self.resonance} if self.resonance is not None else {})


@dataclass(frozen=True)
class Limits:
    """What was found of one run, or of several of one kind.

    Attributes:
        which: of the two limits.
        statistics: of the repetitions.
        comparisons: with theory.
        device: that theory is of; None of runs whose tops differ.
        ends: kind of event → how often a top was lost so.
        runs: of several runs of a kind, the numbers of the inputs, from 0.
    """

    which: Which
    statistics: Statistics
    comparisons: tuple[Comparison, ...]
    device: Device | None
    ends: Mapping[str, int]
    runs: tuple[int, ...] = ()

    @property
    def text(self) -> str:
        """What the limits say, in a few sentences."""
        return " ".join(_sentences(self))


class LimitAnalysis(Analyzed[LimitReadings, Limits, tuple[Limits, ...], LimitOptions]):
    """Limits, each run by itself and those of a kind together."""

    @property
    def groups(self) -> tuple[Limits, ...]:
        """One for each of the limits, lower and upper, that there are runs of."""
        return self.combined

    @property
    def text(self) -> str:
        """What the data say, in a few sentences."""
        return "  ".join(group.text for group in self.groups)

    def about_all(self) -> Iterable[str]:
        """What to know of the limits of a kind."""
        for group in self.groups:
            yield from self._about_tops(group)
            if len(group.runs) > 1:
                yield from warnings_of(group.statistics)

    def _about_tops(self, group: Limits) -> Iterable[str]:
        synthetic = sum(self.sources[k].synthetic for k in group.runs)
        if 0 < synthetic < len(group.runs):
            yield (
                f"{synthetic} of {len(group.runs)} runs of {group.which} limits are SYNTHETIC, the others are not "
                "known to be: a mean over both says nothing about a real top"
            )
        if group.device is None:
            yield f"the {group.which} limits are of tops that differ: their mean is not compared with theory"

    def about_run(self, run: Limits) -> Iterable[str]:
        """What to know of one run."""
        return warnings_of(run.statistics)


def limits_of(source: Source[LimitReadings], options: LimitOptions) -> Limits:
    """One input.  Raises DataError, which names the file."""
    device = device_of(source)
    try:
        statistics = summarize(source.readings.limit, _u(source.readings, options))
    except AnalysisError as error:
        raise DataError(f"{source.data}: {error}") from error
    which = _which(source, statistics, device)
    kinds = Counter(str(event["kind"]) for event in source.run.events()) if source.run else Counter[str]()
    ends = {kind: kinds[kind] for kind in ENDS if kinds[kind]}
    return Limits(which, statistics, _comparisons(statistics, device, which), device, ends)


def together(
    sources: Sequence[Source[LimitReadings]], runs: Sequence[Limits], options: LimitOptions
) -> tuple[Limits, ...]:
    """All lower limits, and all upper ones."""
    groups = []
    kinds: tuple[Which, ...] = ("lower", "upper")
    for which in kinds:
        numbers = tuple(k for k, run in enumerate(runs) if run.which == which)
        if len(numbers) == 1:
            groups.append(replace(runs[numbers[0]], runs=numbers))
        elif numbers:
            groups.append(_combined(which, numbers, sources, runs, options))
    return tuple(groups)


def _combined(
    which: Which,
    numbers: tuple[int, ...],
    sources: Sequence[Source[LimitReadings]],
    runs: Sequence[Limits],
    options: LimitOptions,
) -> Limits:
    us = [_u(sources[k].readings, options) for k in numbers]
    known = [u for u in us if u is not None]
    u = np.concatenate(known) if len(known) == len(us) else None
    statistics = summarize(np.concatenate([sources[k].readings.limit for k in numbers]), u)
    devices = {runs[k].device for k in numbers}
    device = devices.pop() if len(devices) == 1 else None
    ends = sum((Counter(runs[k].ends) for k in numbers), Counter[str]())
    return Limits(which, statistics, _comparisons(statistics, device, which), device, dict(ends), numbers)


def _u(readings: LimitReadings, options: LimitOptions) -> np.ndarray | None:
    return readings.u if options.reading_u is None else np.full(len(readings), options.reading_u)


def _comparisons(statistics: Statistics, device: Device | None, which: Which) -> tuple[Comparison, ...]:
    expected = device.expected(which) if device else {}
    return tuple(compare(statistics, name, spin) for name, spin in expected.items())


def _which(source: Source[LimitReadings], statistics: Statistics, device: Device) -> Which:
    """As the run says; else the limit whose edge is nearer."""
    table = source.run.record.configuration.get(LIMIT) if source.run else None
    said = table.get("which") if isinstance(table, dict) else None
    if said in {"lower", "upper"}:
        return "upper" if said == "upper" else "lower"
    mean = statistics.mean.value or 0.0
    return "upper" if nearest_edge(mean, (device.lower, device.upper)) == "upper" else "lower"


def device_of(source: Source[LimitReadings]) -> Device:
    """The top that was measured: that of the run's scene, or else the thesis's.  Raises DataError for an odd scene."""
    table: Any = source.run.record.configuration.get("scene") if source.run else None
    if not isinstance(table, dict):
        return described_device(Scene(), "the thesis's top, 25.26 g")
    try:
        scene = scene_of(table)
        return described_device(scene, f"the scene {scene.name}, {1000 * scene.top.mass_kg:g} g")
    except (SceneError, AnalysisError) as error:
        raise DataError(f"{source.path}/run.json: configuration.scene: {error}") from error


def described_device(scene: Scene, name: str) -> Device:
    """What theory says of a scene's top, where it floats.  Raises NoWindow, SceneError."""
    from levilab.simulator.equilibrium import stability_of  # with numba, which no other analysis needs

    found = stability_of(scene)
    windows = found.floating.spins if found.floating else ()
    low, high = spins_of_window(windows, scene.start.spin_hz)
    assert found.floating is not None  # else there would be no window
    resonance = stability.wobble_resonance(found.field, found.top, found.floating.height)
    return Device(name, low, high, None if np.isnan(resonance) else resonance)


def warnings_of(statistics: Statistics) -> list[str]:
    """What to know before using the mean."""
    texts = []
    if statistics.outliers:
        numbers = ", ".join(str(i + 1) for i in statistics.outliers)
        plural = "s" * (len(statistics.outliers) > 1)
        texts.append(
            f"repetition{plural} {numbers} do{'es' * (not plural)} not belong to the others; the mean includes them"
        )
    if statistics.drifts and statistics.trend:
        texts.append(
            f"the limit drifts by {with_uncertainty(statistics.trend)} a repetition: the mean is of no fixed state of "
            "the top; look for its mass, or the room's temperature"
        )
    if statistics.scatter is None:
        texts.append("a single repetition: its scatter is not known, repeat it")
    return texts


METHOD = Method(needs=NEEDS, kind=LimitAnalysis, options=LimitOptions, fit=limits_of, combine=together)


def analyze_limits(paths: Sequence[Path], options: LimitOptions) -> LimitAnalysis:
    """Statistics of the limits found at the paths, and what theory says of them.

    Raises DataError for what cannot be used; the text names the file.
    """
    return METHOD.analyze(paths, options)


# --- in words ---


def _sentences(limits: Limits) -> Iterable[str]:
    found = limits.statistics
    many = f"{found.n} {limits.which} limits have the mean" if found.n > 1 else f"one {limits.which} limit,"
    scatter = f" and scatter by {with_uncertainty(found.scatter)}" if found.scatter else ""
    yield f"{many} {with_uncertainty(found.mean)}{scatter}."
    if limits.ends:
        yield "The top " + ", ".join(f"{ENDS[kind]} {_times(n)}" for kind, n in limits.ends.items()) + "."
    for one in limits.comparisons:
        yield _compared(one)


def _times(n: int) -> str:
    return {1: "once", 2: "twice"}.get(n, f"{n} times")


def _compared(one: Comparison) -> str:
    off = one.difference.value or 0.0
    where = f"{abs(off):.2f} Hz {'above' if off > 0 else 'below'} the {one.name}, {one.expected:.2f} Hz"
    if one.p is None:
        return f"That is {where}."
    verdict = "which chance explains" if one.agrees else "more than chance makes"
    return f"The mean lies {where}, {verdict} (p = {one.p:.2g})."

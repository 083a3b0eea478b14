"""Spin-downs at some paths: each by itself and together."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import compress

from analysis.spindown.air import disc_constant
from analysis.spindown.combine import Combined, CombinedLaw, combine
from analysis.spindown.drag import LAWS
from analysis.spindown.fit import SpinDown, fit_spin_down
from analysis.spindown.lawfit import LawFit
from analysis.spindown.tilt import THESIS_TOP, Top
from levilab.errors import DataError
from levilab.formats.device import Device
from levilab.pipelines.analyzed import Analyzed
from levilab.pipelines.budget import gate_of
from levilab.pipelines.field.device import THESIS, inertias
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import SpinDownOptions
from levilab.pipelines.spindown.readings import SpinReadings
from levilab.pipelines.spindown.words import (
    TILT_ALLOWED,
    UNIT_FIRST,
    doubts_about_law,
    is_seen,
    law_names,
    remark,
    verdict_of_all,
)
from levilab.present.numbers import enumeration
from levilab.texts.text import Text

#: The experiment whose runs it takes, and whose settings say how the readings were counted.
EXPERIMENT = "spin"


class SpinDownAnalysis(Analyzed[SpinReadings, SpinDown, Combined, SpinDownOptions]):
    """Spin-downs, each by itself and together."""

    @property
    def text(self) -> str:
        """What the data say, in a few sentences."""
        return UNIT_FIRST if self.is_doubtful else verdict_of_all(self.combined, self.taken)

    @property
    def is_doubtful(self) -> bool:
        """Whether no unit is sure, so that nothing of it is to be believed."""
        return all(source.readings.doubtful for source in self.sources)

    def about_all(self) -> Iterable[str]:
        """Yield remarks on the means, on the laws that are not excluded, and on what was asked for."""
        if self.is_doubtful:
            return
        yield from (*map(remark, self.combined.remarks), *self._left_out(), *self._of_laws(self.combined.fits))
        if self.options.laws:
            said = "drag laws other than {laws} are left out, as asked: another one may fit better"
            yield Text(said, laws=law_names(self.options.laws))
        if self.options.correlation == "none":
            yield "the noise of the readings is taken to be white, as asked: u is too small where it is not"
        if any(run.has_tilt for run in self.runs) and not is_seen(self.combined.tilt):
            yield TILT_ALLOWED

    @cached_property
    def is_taken(self) -> list[bool]:
        """Whether verdict and means are of each run."""
        return take(self.sources, self.runs)

    @property
    def taken(self) -> list[SpinDown]:
        """The runs that verdict and means are of."""
        return [*compress(self.runs, self.is_taken)]

    def _left_out(self) -> Iterable[str]:
        """Yield which runs the verdict and the means leave out."""
        if names := [source.name for source, one in zip(self.sources, self.is_taken, strict=True) if not one]:
            yield Text("verdict and means leave out {names}: correct the file, or remove it", enumeration(names))

    def about_run(self, run: SpinDown) -> Iterable[str]:
        """Return remarks on one run."""
        return (*doubts_about_law(run, len(self.runs)), *map(remark, run.remarks), *self._of_laws(run.fits))

    def _of_laws(self, fits: Iterable[LawFit | CombinedLaw]) -> Iterable[str]:
        excluded = self.combined.verdict.excluded  # what they lack is of no interest any more
        return (remark(each) for fit in fits if fit.name not in excluded for each in fit.remarks)


def fit_source(source: Source[SpinReadings], options: SpinDownOptions) -> SpinDown:
    """Fit all laws to one input.  Raises AnalysisError."""
    readings = source.readings
    return fit_spin_down(
        readings.time,
        readings.frequency,
        readings.u if options.reading_u is None else options.reading_u,
        laws=options.laws or tuple(LAWS),
        keep_outliers=options.keep_outliers,
        tilt=options.tilt == "fitted" or (options.tilt == "auto" and not readings.upright),
        release=readings.release,
        gate=gate_of(source, EXPERIMENT),
        top=top_of_device(options.device),
        correlated=options.correlation == "fitted",
    )


def top_of_device(device: Device | None) -> Top:
    """Return what a device's file says of the top for the count; the thesis's where it says nothing.

    ν_r goes with √(|μ|/(I₃ − I₁)): the field where a top floats is taken for that of the thesis's base.  The drag of a
    disc goes with R⁴/I₃ and is the thesis's unless both are said; R is that of the largest part.
    """
    if device is None:
        return THESIS_TOP
    transverse, axial, missing = inertias(device.top)
    one, three = transverse.value or 0.0, axial.value or 0.0
    if not 0 < one < three:
        raise DataError(
            "the top of the device has I₁ = {one:g} and I₃ = {three:g} kg m²: I₁ < I₃ is expected", one=one, three=three
        )
    share = one / three
    u = share * math.hypot((transverse.u or 0.0) / one, (axial.u or 0.0) / three)
    moment = (device.top.moment_a_m2 or THESIS["moment"][0]) / THESIS["moment"][0]
    slow = (three - one) / (THESIS["axial"][0] - THESIS["transverse"][0])
    radius = max((part.outer_radius_m for part in device.top.parts), default=device.top.magnet_radius_m)
    return replace(
        THESIS_TOP,
        kappa=1 - share,
        kappa_u=u or THESIS_TOP.kappa_u,
        resonance_hz=THESIS_TOP.resonance_hz * math.sqrt(moment / slow),
        disc_constant=disc_constant(radius, three) if radius and not missing else THESIS_TOP.disc_constant,
    )


def combine_sound(sources: Sequence[Source[SpinReadings]], runs: Sequence[SpinDown], _: SpinDownOptions) -> Combined:
    """Return all runs together that are taken."""
    return combine([*compress(runs, take(sources, runs))])


def take(sources: Sequence[Source[SpinReadings]], runs: Sequence[SpinDown]) -> list[bool]:
    """Return whether each run is taken: not one of a doubtful unit or that no law describes, unless every one is."""
    pairs = zip(sources, runs, strict=True)
    doubtful = (source.readings.doubtful or any(doubts_about_law(run, len(runs))) for source, run in pairs)
    sound = [not one for one in doubtful]
    return sound if any(sound) else [True] * len(runs)

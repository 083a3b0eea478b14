"""Tracks of a swaying top at some paths, each by itself."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.numbers import digits
from analysis.sway import Geometry, Swings, choose_lines, geometric_magnetism, mirrored, swings_of
from levilab.errors import DataError
from levilab.pipelines.analyzed import EachAlone
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import SwayOptions
from levilab.pipelines.row import Quantity, columns_of, entry, statistic
from levilab.pipelines.sway.device import known_of
from levilab.pipelines.sway.readings import SwayReadings
from levilab.present.numbers import with_uncertainty
from levilab.texts.note import Note
from levilab.texts.text import Sentences, Text

#: Of `analysis.sway.Geometry`.
QUANTITIES = (
    Quantity("geometric_magnetism", "Hz", "geometric magnetism Ω_g/2π at a spin of 30 Hz, from the slow swings",
             "Ω_g/2π at 30 Hz", of="measured"),
    Quantity("predicted", "Hz", "the same from the form of the base's field", "Ω_g/2π predicted"),
    Quantity("ratio", "1", "measured over predicted", "measured/predicted"),
    Quantity("gradient", "1/m", "B′/2B that goes with the slow swings", "B′/2B by the swings"),
    Quantity("gradient_of_precession", "1/m", "B′/2B that goes with the precession", "B′/2B by the precession",
             of="of_precession", optional=True),
    Quantity("gradient_of_base", "1/m", "B′/2B of the base where the top floats", "B′/2B of the base", of="of_base"),
    Quantity("split_significance", "1", "split over its standard uncertainty", "split over its u", of="against_null",
             has_u=False),
    Quantity("joint_ratio", "1", "measured over predicted, of all lines fitted together",
             "measured/predicted, all lines", of="joint.ratio"),
    Quantity("joint_gradient", "1/m", "B′/2B of all lines fitted together", "B′/2B by all lines", of="joint.gradient"),
    Quantity("windows", "1", "windows in which the swings stand out", of=lambda found: float(len(found.shares)),
             has_u=False),
)  # fmt: skip

SWAY_ROW = (
    *columns_of(QUANTITIES),
    statistic("reduced_chi_square", "1", "χ² per degree of freedom of the windows"),
    entry("mirrored", "truth", "whether the view was mirrored", "result.mirrored"),
    entry("text", "text", "what the swings say"),
)

#: A split of fewer standard uncertainties excludes nothing; a ratio that is more of them from 1 disagrees.
_ENOUGH = 3.0
#: A tilt of the precession that adds more to the split is most likely a mark far from the centre of mass.
_LEANS = 0.01
#: A relative u above this comes from the meeting of beat and vertical swing, and there is something to do about it.
_LARGE_U = 0.03


@dataclass(frozen=True, eq=False)
class SwayRun:
    """One track.

    Attributes:
        swings: of each window.
        spin: in the middle of each, shape (n,) [Hz].
        geometry: what they say.
        mirrored: whether the view was mirrored; None where no precession is seen to tell it.
        unknown: what is not known of top and base, and taken from the thesis.
    """

    swings: tuple[Swings, ...]
    spin: NDArray[np.float64]
    geometry: Geometry
    mirrored: bool | None
    unknown: tuple[str, ...]

    @property
    def text(self) -> str:
        """What the swings say, in a few sentences."""
        low, high, spin = float(min(self.spin)), float(max(self.spin)), self.geometry.spin
        said = "The spins seen are {low:.1f} to {high:.1f} Hz: the value at {spin:g} Hz is in proportion to the spin."
        beyond = [] if low <= spin <= high else [Text(said, low, high, spin)]
        return Sentences(_in_words(self.geometry), *beyond)

    @property
    def warnings(self) -> tuple[Text, ...]:
        """Doubts about the numbers."""
        of_thesis = (
            "not known, and taken from the thesis: {missing}; the prediction is of that device; describe yours in a "
            "file, for the option `device`"
        )
        said = [Text(of_thesis, missing=self.unknown)] if self.unknown else []
        return (*said, *_doubts(self.swings, self.geometry, view=self.mirrored))


class SwayAnalysis(EachAlone[SwayReadings, SwayRun, SwayOptions]):
    """Tracks, each by itself: another mass or another height has another split."""

    def about_all(self) -> Iterable[str]:
        """Yield that a stated spin is not used where all tracks have their own."""
        if self.options.spin_hz is not None and all(source.readings.spin is not None for source in self.sources):
            yield Note("own spin", "`spin` is not used: the tracks have spins of their own", weight="advice")


def analyze_source(source: Source[SwayReadings], options: SwayOptions) -> SwayRun:
    """Find the swings of one input, and what they say.  Raises AnalysisError, DataError."""
    readings = source.readings
    if readings.spin is not None:
        spin = readings.spin
    elif options.spin_hz is not None:
        spin = np.full(len(readings), options.spin_hz)
    else:
        raise DataError(
            "{path:s}: the spin is not known: a column spin_frequency_hz, or the option `spin` where it is nearly "
            "constant, is expected",
            path=source.data,
        )
    known, unknown = known_of(source, options)
    places, sensor = readings.x + 1j * readings.y, readings.sensor

    def look(places: NDArray[np.complex128]) -> list[Swings]:
        found = swings_of(readings.time, places, readings.height, rising=sensor is not None)
        return [sensor.corrected(one) for one in found] if sensor else found

    swings = look(places)
    view = mirrored(swings)
    beside = sensor is not None and not sensor.above  # they see a precession that is one of their own tilt
    if view if not beside else np.mean([one.split for one in swings]) < 0:
        swings = look(places.conj())
    at = np.interp([one.time for one in swings], readings.time, np.abs(spin))
    swings = choose_lines(swings, at, known)
    geometry = geometric_magnetism(swings, at, known)
    return SwayRun(tuple(swings), at, geometry, False if beside else view, unknown)


def _in_words(found: Geometry) -> str:
    excluded = found.against_null > _ENOUGH
    null = Text(
        "That swings do not split is excluded: the split is {pull:n} standard uncertainties."
        if excluded
        else "That swings do not split is not excluded: the split is {pull:n} standard uncertainties.",
        pull=digits(found.against_null),
    )
    off = abs((found.ratio.value or 0.0) - 1) / (found.ratio.u or np.inf)
    agrees = "agrees with" if off < _ENOUGH else "disagrees with"
    if (found.ratio.u or np.inf) * _ENOUGH > 1:
        agrees = "is too uncertain for a comparison with"
    said = Text(
        "The slow swings are split by geometric magnetism of {split:n} at a spin of {spin:g} Hz, which {agrees} the "
        "{predicted:n} that follow from the field: ratio {ratio:n}.",
        split=with_uncertainty(found.measured),
        spin=found.spin,
        agrees=agrees,
        predicted=with_uncertainty(replace(found.predicted, u=found.predicted.u or 0.0)),
        ratio=with_uncertainty(found.ratio),
    )
    return Sentences(said, null)


def _doubts(swings: Sequence[Swings], found: Geometry, *, view: bool | None) -> Iterable[Text]:
    if view:
        yield Text("the precession turns backwards: the view is from below, or in a mirror; y has got the other sign")
    if view is None:
        yield Text(
            "no precession is seen, which would show whether the view is mirrored: a split of the other sign would be "
            "one of a mirrored view"
        )
    if found.lean > _LEANS:
        yield Text(
            "the precession is so large that {percent:.0f} % are added to the split for its tilt: is the place that of "
            "the top's middle?  The end of the stem moves more; follow its foot or the rim",
            percent=100 * found.lean,
        )
    large = _LARGE_U * abs(found.measured.value or 0.0)
    if found.parts["mistake"] > large:
        one = swings[len(swings) // 2]
        yield Text(
            "u is large: the slow swings may be the lines at {one:.2f} or {backward:.2f} Hz and at {other:.2f} or "
            "{forward:.2f} Hz; let the top swing less, by half a millimetre, or film until its spin has fallen by a "
            "third",
            one=one.frequency[0],
            backward=one.frequency[1] - one.vertical.value,
            other=one.frequency[1],
            forward=one.frequency[0] + one.vertical.value,
        )
    elif (found.measured.u or 0.0) > large:
        beat = float(np.mean([one.frequency[1] - one.frequency[0] for one in swings]))
        vertical = float(np.mean([one.vertical.value for one in swings]))
        yield Text(
            "u is large: the beat of the slow swings, {beat:.2f} Hz, is near the vertical swing, {vertical:.2f} Hz, "
            "and they exchange energy; add or take off a washer of 0.1 g, or let the top swing less",
            beat=beat,
            vertical=vertical,
        )

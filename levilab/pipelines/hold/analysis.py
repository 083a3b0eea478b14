"""Held spins at some paths: each by itself, the drag laws through all of them, and a spin-down beside these."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.held import HeldLaw, HeldLaws, Hold, fit_held, hold_of
from analysis.limits import AGREES_P
from analysis.numbers import digits
from analysis.spindown.tilt import slowing_by_tilt
from analysis.uncertainty import Estimate
from levilab.pipelines.analyzed import Analyzed
from levilab.pipelines.hold.readings import HoldReadings
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.options import HoldOptions
from levilab.pipelines.row import Quantity, columns_of
from levilab.pipelines.spindown.analysis import SpinDownAnalysis
from levilab.pipelines.spindown.document import SPINDOWN
from levilab.pipelines.spindown.words import SYMBOLS, law_name
from levilab.present.numbers import enumeration, plain, with_uncertainty
from levilab.runs.run import read_record
from levilab.texts.text import Sentences, Text

#: Of `analysis.held.Hold`.
QUANTITIES = (
    Quantity("spin_frequency", "Hz", "the held spin, mean of the readings", "ν", of="spin"),
    Quantity("scatter", "Hz", "standard deviation of the readings of the held spin", "s.d. of ν"),
    Quantity("share", "1", "share of the full amplitude that held the spin", "s", has_u=False),
    Quantity("gain", "Hz/s", "rate at which the full amplitude raises the spin there", "g", optional=True),
    Quantity("drag", "Hz/s", "drag at this spin, from the amplitude that balanced it", "d", optional=True),
)

HOLD_ROW = tuple(columns_of(QUANTITIES))


#: A constant that is more standard uncertainties from the spin-down's disagrees.
_ENOUGH = 3.0
#: Held spins that differ by less are said to be one [Hz].
_ONE_SPIN_HZ = 0.1


@dataclass(frozen=True, eq=False)
class HeldTogether:
    """Several held spins together.

    Attributes:
        laws: through the drag of an upright top, the best first.
        between: part of the drag by which tops differ beyond their u.
        compared: whether the exponent of the drag is known well enough to name a best law.
        factors: of each input's drag over that of an upright top, by the spin-down's tilt; 1 where none is known.
        beside: law with a single constant → that of the spin-down, and the pull: their difference over its u.
    """

    laws: tuple[HeldLaw, ...]
    factors: tuple[float, ...]
    beside: dict[str, tuple[Estimate, float]]
    between: float = 0.0
    compared: bool = False

    @property
    def best(self) -> HeldLaw | None:
        """The best law; None where laws are not compared."""
        return self.laws[0] if self.compared else None

    @property
    def drag(self) -> Estimate:
        """The mean drag of an upright top, at the mean of the spins, where there is no best law."""
        law, (constant,) = self.laws[0], self.laws[0].constants.values()
        drag = float(law.drag(np.array([law.reference_hz]))[0])
        return Estimate(drag, constant.u and drag * constant.u / (constant.value or 1.0), "Hz/s")


class HoldAnalysis(Analyzed[HoldReadings, Hold, HeldTogether, HoldOptions]):
    """Held spins, each by itself and together."""

    @property
    def at_one_spin(self) -> bool:
        """Whether the held spins agree."""
        return bool(np.ptp([run.spin.value for run in self.runs]) < _ONE_SPIN_HZ)

    @property
    def text(self) -> str:
        """What the data say, in a few sentences."""
        spins = [run.spin.value or 0.0 for run in self.runs]
        said = "{n} runs held a top, at {low:.1f} Hz to {high:.1f} Hz."
        if self.at_one_spin:
            said = "{n} runs held a top, at {low:.1f} Hz."
        several = Text(said, n=len(spins), low=min(spins), high=max(spins))
        last = (several,) if len(spins) > 1 else text_of(self.runs[0]).each
        return Sentences(*_of_laws(self.combined), *last)

    def about_all(self) -> Iterable[str]:
        """Return whether the tops differ."""
        from scipy.special import chdtrc

        found = self.combined
        if not found.between:
            return
        fit = found.laws[0].statistics
        if chdtrc(fit.degrees_of_freedom, fit.chi_square or 0.0) < AGREES_P:
            said = (
                "the drag scatters by {percent:n} % from top to top, more than its u explains: the tops differ, or no "
                "law holds; u of the constants includes this"
            )
            yield Text(said, percent=digits(100 * found.between, 2))

    def about_run(self, run: Hold) -> Iterable[str]:
        """Return what to know of one held spin."""
        if run.gain is None:
            yield "the run has no gain at the full amplitude, so that no drag follows: hold the top by less than 90 %"


def text_of(run: Hold) -> Sentences:
    """Return what a held spin says, in two sentences."""
    held = Text(
        "{percent:.1f} % of the drive's amplitude held the top at {spin:n}: so much balanced the drag of the "
        "air{drag}.",
        percent=100 * run.share,
        spin=with_uncertainty(run.spin),
        drag=Text(", {drag:n}", drag=with_uncertainty(run.drag)) if run.drag else "",
    )
    return Sentences(held, Text("A reading scatters by {hz:n} Hz.", hz=plain(run.scatter.value, 2)))


def _of_laws(found: HeldTogether) -> Iterable[str]:
    if best := found.best:
        constants = [
            Text("{symbol} = {value:n}", SYMBOLS[name], with_uncertainty(one)) for name, one in best.constants.items()
        ]
        yield Text("The {law} law fits best: {how}.", law=law_name(best.name), how=enumeration(constants))
        if (chi := best.statistics.reduced_chi_square) is not None:
            yield Text("The held spins scatter about it by {times:n} of their u.", times=plain(math.sqrt(chi), 2))
    elif found.laws:
        said = (
            "The drag at {spin:.1f} Hz, {drag:n}, lies on the curve of each law: hold more tops, or spins farther "
            "apart, to see which holds."
        )
        yield Text(said, spin=found.laws[0].reference_hz, drag=with_uncertainty(found.drag))
    for law in found.laws[: 1 if best else None]:  # a single drag lies on each
        if law.name in found.beside:
            (name,) = law.constants
            spindown, pull = found.beside[law.name]
            agrees = (
                "By the {law} law {symbol} agrees with the spin-down's {value:n}: {pull:n} standard uncertainties off."
                if abs(pull) < _ENOUGH
                else "By the {law} law {symbol} DISAGREES with the spin-down's {value:n}: {pull:n} standard "
                "uncertainties off."
            )
            value = with_uncertainty(spindown)
            yield Text(agrees, law=law_name(law.name), symbol=SYMBOLS[name], value=value, pull=plain(pull, 2))


def fit_source(source: Source[HoldReadings], _: HoldOptions) -> Hold:
    """Return what one held spin says."""
    one = source.readings
    return hold_of(one.time, one.spin, one.u, one.share, one.gains)


def combine(_: Sequence[Source[HoldReadings]], runs: Sequence[Hold], options: HoldOptions) -> HeldTogether:
    """Return the laws through the drag, and their constants beside a spin-down's.  Raises DataError."""
    beside = SPINDOWN.recall([options.spindown]) if options.spindown else None
    spins = np.array([run.spin.value for run in runs])
    factors, u_factors = _tilt(beside, spins)
    known = [run.drag is not None for run in runs]
    held = HeldLaws((), 0.0, compared=False)
    if any(known):
        drag, u = np.array([(run.drag.value, run.drag.u) for run in runs if run.drag]).T / factors[known]
        held = fit_held(spins[known], drag, u, drag * u_factors[known])
    of_spindown = dict(_compare(held.laws, beside)) if beside else {}
    return HeldTogether(held.laws, tuple(factors.tolist()), of_spindown, held.between, held.compared)


def _tilt(beside: SpinDownAnalysis | None, spins: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return by which factor the tilt of the moment changes the drag of the count, and its relative u, shape (n,)."""
    fits = [run.fit(beside.combined.best) for run in beside.runs] if beside else []
    tilted = [fit.parameters for fit in fits if fit.has_tilt]
    if not tilted:
        return np.ones(len(spins)), np.zeros(len(spins))
    delta, u = (float(np.mean([getattr(one["moment_tilt"], name) or 0.0 for one in tilted])) for name in ("value", "u"))
    resonance = float(np.mean([one["resonance"].value or 0.0 for one in tilted]))
    factor = slowing_by_tilt(spins, resonance, delta, fits[0].top)
    return factor, np.abs(slowing_by_tilt(spins, resonance, delta + u, fits[0].top) / factor - 1)


def _compare(laws: Sequence[HeldLaw], beside: SpinDownAnalysis) -> Iterable[tuple[str, tuple[Estimate, float]]]:
    theirs = {fit.name: fit.constants for fit in beside.combined.fits}
    for law in laws:
        if len(law.constants) == 1 and law.name in theirs:
            ((name, held),) = law.constants.items()
            other = theirs[law.name][name]
            if held.value is not None and held.u and other.value is not None and other.u:
                yield law.name, (other, float((held.value - other.value) / np.hypot(held.u, other.u)))


def set_spindown_beside(paths: Sequence[Path], options: HoldOptions) -> tuple[Sequence[Path], HoldOptions]:
    """Take a single spin-down run among the paths for the one that the held spins are compared with."""
    spindowns = [path for path in paths if (path / "run.json").exists() and read_record(path).experiment == "spin"]
    if options.spindown or len(spindowns) != 1 or len(paths) == 1:
        return paths, options
    return [path for path in paths if path != spindowns[0]], replace(options, spindown=spindowns[0])

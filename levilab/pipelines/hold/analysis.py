"""Held spins at some paths: each by itself, the drag laws through all of them, and a spin-down beside these."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from analysis.held import HeldLaw, Hold, fit_held, hold_of
from analysis.spindown.tilt import slowing_by_tilt
from analysis.uncertainty import Estimate
from levilab.pipelines.analyzed import Analyzed, Method
from levilab.pipelines.hold.readings import HoldReadings, read_hold_file, read_hold_run
from levilab.pipelines.options import HoldOptions, SpinDownOptions
from levilab.pipelines.sources import Needs
from levilab.pipelines.spindown.document import DOCUMENT as SPINDOWN
from levilab.pipelines.spindown.laws import SYMBOLS
from levilab.present.numbers import list_in_words, plain, with_uncertainty

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from levilab.pipelines.sources import Source
    from levilab.pipelines.spindown.analysis import SpinDownAnalysis

HOLD = "hold"
NEEDS = Needs(analysis=HOLD, experiments=frozenset({HOLD}), read_file=read_hold_file, read_run=read_hold_run)
#: A constant that is more standard uncertainties from the spin-down's disagrees.
_ENOUGH = 3.0


@dataclass(frozen=True)
class Compared:
    """A constant of a drag law, beside that of a spin-down.

    law, constant: their names; held, spindown: the two; pull: their difference over its u.
    """

    law: str
    constant: str
    held: Estimate
    spindown: Estimate
    pull: float


@dataclass(frozen=True, eq=False)
class HeldTogether:
    """Several held spins together.

    Attributes:
        laws: through the drag of an upright top, the best first.
        factors: of each input's drag over that of an upright top, by the spin-down's tilt; 1 where none is known.
        compared: the constants of laws with a single one.
    """

    laws: tuple[HeldLaw, ...]
    factors: tuple[float, ...]
    compared: tuple[Compared, ...]


class HoldAnalysis(Analyzed[HoldReadings, Hold, HeldTogether, HoldOptions]):
    """Held spins, each by itself and together."""

    @property
    def text(self) -> str:
        """What the data say, in a few sentences."""
        return " ".join([text_of(run) for run in self.runs] + [*_of_laws(self.combined)])

    def about_run(self, run: Hold) -> Iterable[str]:
        """Return what to know of one held spin."""
        if run.gain is None:
            yield "the run has no gain at the full amplitude, so that no drag follows: hold the top by less than 90 %"


def text_of(run: Hold) -> str:
    """Return what a held spin says, in a sentence."""
    drag = f": {with_uncertainty(run.drag)}" if run.drag else ""
    return (
        f"Held at {with_uncertainty(run.spin)}, s.d. of a reading {plain(run.scatter.value, 2)} Hz; "
        f"{100 * run.share:.1f} % of the amplitude balanced the drag{drag}."
    )


def _of_laws(found: HeldTogether) -> Iterable[str]:
    if not found.laws:
        return
    best = found.laws[0]
    constants = [f"{SYMBOLS.get(name, name)} = {with_uncertainty(one)}" for name, one in best.constants.items()]
    chi = best.statistics.reduced_chi_square
    fits = "" if chi is None else f", χ² per degree of freedom {plain(chi, 2)}"
    yield f"Of the drag laws {best.name} is the best: {list_in_words(constants)}{fits}."
    beside = next((one for one in found.compared if one.law == best.name), None) or next(iter(found.compared), None)
    if beside:
        agrees = "agrees with" if abs(beside.pull) < _ENOUGH else "DISAGREES with"
        yield (
            f"By the {beside.law} law {SYMBOLS[beside.constant]} {agrees} the spin-down's "
            f"{with_uncertainty(beside.spindown)}: {plain(beside.pull, 2)} standard uncertainties off."
        )


def fit_source(source: Source[HoldReadings], _: HoldOptions) -> Hold:
    """Return what one held spin says."""
    one = source.readings
    return hold_of(one.time, one.spin, one.u, one.share, one.gains)


def combine(_: Sequence[Source[HoldReadings]], runs: Sequence[Hold], options: HoldOptions) -> HeldTogether:
    """Return the laws through the drag, and their constants beside a spin-down's.  Raises DataError."""
    beside = SPINDOWN.recall([options.spindown], SpinDownOptions()) if options.spindown else None
    spins = np.array([run.spin.value for run in runs])
    factors, u_factors = (np.ones(len(runs)), np.zeros(len(runs))) if beside is None else _tilt(beside, spins)
    known = np.array([run.drag is not None for run in runs])
    drags = np.array([(run.drag.value, run.drag.u) for run in runs if run.drag]).T
    laws: tuple[HeldLaw, ...] = ()
    if known.any():
        upright = drags[0] / factors[known]
        laws = fit_held(spins[known], upright, np.hypot(drags[1] / factors[known], upright * u_factors[known]))
    return HeldTogether(laws, tuple(factors.tolist()), tuple(_compare(laws, beside)) if beside else ())


def _tilt(beside: SpinDownAnalysis, spins: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return by which factor the tilt of the moment changes the drag of the count, and its relative u, shape (n,)."""
    fits = [run.fit(beside.combined.best) for run in beside.runs]
    tilted = [fit.parameters for fit in fits if fit.has_tilt]
    if not tilted:
        return np.ones(len(spins)), np.zeros(len(spins))
    delta, u = (float(np.mean([getattr(one["moment_tilt"], name) or 0.0 for one in tilted])) for name in ("value", "u"))
    resonance = float(np.mean([one["resonance"].value or 0.0 for one in tilted]))
    factor = slowing_by_tilt(spins, resonance, delta, fits[0].top)
    return factor, np.abs(slowing_by_tilt(spins, resonance, delta + u, fits[0].top) / factor - 1)


def _compare(laws: Sequence[HeldLaw], beside: SpinDownAnalysis) -> Iterable[Compared]:
    theirs = {fit.name: fit.constants for fit in beside.combined.fits}
    for law in laws:
        if len(law.constants) > 1 or law.name not in theirs:
            continue
        ((name, held),) = law.constants.items()
        other = theirs[law.name][name]
        if held.value is not None and held.u and other.value is not None and other.u:
            pull = (held.value - other.value) / np.hypot(held.u, other.u)
            yield Compared(law.name, name, held, Estimate(other.value, other.u, other.unit), float(pull))


METHOD = Method(
    needs=NEEDS,
    kind=HoldAnalysis,
    options=HoldOptions,
    fit=fit_source,
    combine=combine,
    mixed="a drag law through both says nothing about a real top",
    skips=True,
)

"""Spin-downs with the fitted constants, times, scatter, correlation, gates and number of runs of a result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.arrays import Array
from analysis.budget import gate_bias, printed_step
from analysis.spindown.combine import combine
from analysis.spindown.drag import LAWS
from analysis.spindown.fit import SpinDown, fit_spin_down
from analysis.spindown.lawfit import LawFit
from analysis.spindown.tilt import Release, count_of
from levilab.crosscheck.own.model import OF_ONE_RUN, Own
from levilab.crosscheck.subject import Trial, pull_of
from levilab.pipelines.budget import gate_of
from levilab.pipelines.spindown.analysis import EXPERIMENT, SpinDownAnalysis
from levilab.simulator import laws
from levilab.texts.text import Text, how_many

#: Processor time of the fits of one run [s]: of any, and for a reading.
_COST_S, _COST_OF_READING_S = 0.006, 2e-5
#: What fitting the tilt adds to that, for any run and for a reading.
_COST_OF_TILT_S, _TILTED_READING_S = 0.015, 1e-4
#: Runs that scatter by this multiple of the scatter that their readings leave give u from their scatter alone.
_SCATTERS = 1.5


@dataclass(frozen=True, eq=False)
class _Run:
    """A run as its trials are made.

    Attributes:
        time, u: of the readings [s], [Hz], shape (n,); u is None where it is not stated.
        fit: the law that is true.
        noise: standard deviation of a reading, shape (n,) [Hz].
        rho: correlation of neighbours.
        step: last digit of the readings [Hz]; 0: they are not rounded.
        gate: of the counter [s]; 0: not known.
        tilt, release, correlated: as the analysis had them.
    """

    time: Array
    u: Array | None
    fit: LawFit
    noise: Array
    rho: float
    step: float
    gate: float
    tilt: bool
    release: Release | None
    correlated: bool

    def readings(self, random: np.random.Generator, factors: Sequence[float]) -> Array:
        """Made-up readings, the constants multiplied by factors, shape (n,) [Hz]."""
        return _round(self.curve(factors) + self.noise * _noise(random, len(self.time), self.rho), self.step)

    @property
    def cost_s(self) -> float:
        """Processor time of its fits, as measured [s]."""
        n = len(self.time)
        cost = _COST_S + n * _COST_OF_READING_S
        return cost + (_COST_OF_TILT_S + n * _TILTED_READING_S if self.tilt else 0.0)

    def curve(self, factors: Sequence[float]) -> Array:
        """Return the mean of the counted frequency over the gate, shape (n,) [Hz]."""
        frequency, duration = self.fit.reference
        solution = self.fit.solution.copy()
        solution[1 : 1 + len(factors)] *= factors
        tau = (self.time - self.fit.start_time) / duration
        half = min(self.gate / duration / 2, 0.5)
        middle = np.clip(tau, half, 1 - half)

        def at(times: Array) -> Array:
            return np.asarray(count_of(LAWS[self.fit.name], times, solution, self.fit.top))

        bias = gate_bias(at(middle - half), at(middle), at(middle + half)) if half else 0.0
        return np.asarray(frequency * (at(tau) + bias))


def trials_of(found: SpinDownAnalysis) -> Own:
    """Return the trials of spin-downs: each simulates all runs again."""
    law = found.combined.best
    runs = [_run(found, k, run.fit(law), run) for k, run in enumerate(found.runs)]
    constants = [name for name in LAWS[law].constants if name != "exponent"]
    spread = _between(found, law, constants)
    several = len(runs) > 1
    return Own(
        about=Text(
            "{runs} by the {law} law, {differ}with the times, scatter, correlation, gate and digits of the readings",
            runs=how_many(len(runs), "spin-down"),
            law=law,
            differ="constants that differ from run to run as these do, " if several else "",
        ),
        trial=lambda random: _trial(random, runs, law, constants, spread),
        cost_s=sum(run.cost_s for run in runs),
        law=law,
        freedom=_freedom(found, law, constants),
    )


def _run(found: SpinDownAnalysis, k: int, fit: LawFit, run: SpinDown) -> _Run:
    source = found.sources[k]
    step = printed_step(source.readings.frequency.tolist())
    noise = _scatter(fit, run)
    return _Run(
        time=run.time,
        u=run.u,
        fit=fit,
        noise=np.sqrt(np.maximum(noise**2 - (step or 0.0) ** 2 / 12, 0.0)),
        rho=(run.correlation.value or 0.0) if run.correlation and run.is_correlated else 0.0,
        step=step or 0.0,
        gate=gate_of(source, EXPERIMENT) or 0.0,
        tilt=fit.has_tilt,
        release=run.model.release,
        correlated=run.model.correlated,
    )


def _scatter(fit: LawFit, run: SpinDown) -> Array:
    """Return the standard deviation of each reading, shape (n,) [Hz]: as stated, or more where they scatter more."""
    stats = fit.statistics
    if run.u is not None:
        return np.asarray(run.u * np.sqrt(stats.variance_factor))
    return np.full(len(run.time), np.sqrt(stats.rss / max(stats.degrees_of_freedom, 1)))


def _between(found: SpinDownAnalysis, law: str, constants: Sequence[str]) -> list[float]:
    """Return the relative scatter of each constant between runs, beyond that of the readings of each run."""
    means = found.combined.fit(law).constants
    spread = []
    for name in constants:
        mean = means[name]
        own_u = [fit.parameters[name].u or 0.0 for fit in (run.fit(law) for run in found.runs)]
        variance = 0.0 if mean.scatter is None else mean.scatter**2 - float(np.mean(np.square(own_u)))
        spread.append(float(np.sqrt(max(variance, 0.0))) / abs(mean.value) if mean.value else 0.0)
    return spread


def _freedom(found: SpinDownAnalysis, law: str, constants: Sequence[str]) -> dict[str, int]:
    """Return the degrees of freedom of the means whose u comes from the scatter of the runs."""
    freedom = {}
    for name in constants:
        mean = found.combined.fit(law).constants[name]
        own_u = [run.fit(law).parameters[name].u or 0.0 for run in found.runs]
        if mean.scatter is not None and mean.scatter > _SCATTERS * float(np.sqrt(np.mean(np.square(own_u)))):
            freedom[name] = mean.degrees_of_freedom
    return freedom


def _trial(
    random: np.random.Generator, runs: Sequence[_Run], law: str, constants: Sequence[str], spread: Sequence[float]
) -> Trial:
    """Simulate and analyze all runs."""
    several = len(runs) > 1
    means = [float(np.mean([run.fit.parameters[name].value or 0.0 for run in runs])) for name in constants]
    fits, pulls = [], []
    for run in runs:
        # of several runs each has a constant of its own about the mean; of one it is the fitted one
        truths = [mean * (1 + s * random.standard_normal()) for mean, s in zip(means, spread, strict=True)]
        factors = [
            truth / (run.fit.parameters[name].value or truth) if several else 1.0
            for name, truth in zip(constants, truths, strict=True)
        ]
        readings = run.readings(random, factors)
        fits.append(
            fit_spin_down(
                run.time,
                readings,
                run.u,
                tilt=run.tilt,
                release=run.release,
                gate=run.gate or None,
                top=run.fit.top,
                correlated=run.correlated,
            )
        )
        if several:
            of_run = fits[-1].fit(law).parameters
            pulls += [
                pull_of(f"{name}{OF_ONE_RUN}", of_run[name], truth)
                for name, truth in zip(constants, truths, strict=True)
                if name != "c"
            ]
    together = combine(fits)
    found = together.fit(law).constants if several else fits[0].fit(law).parameters
    pulls += [pull_of(name, found[name], mean) for name, mean in zip(constants, means, strict=True) if name != "c"]
    if not several:
        truth = runs[0].fit.parameters["start_frequency"].value or 0.0
        pulls.append(pull_of("start_frequency", found["start_frequency"], truth))
    exponent = laws.LAWS[law].exponent if law in laws.LAWS else None
    if law == "power":
        exponent = float(np.mean([run.fit.parameters["exponent"].value or 0.0 for run in runs]))
    if exponent is not None:
        of_power = together.fit("power").constants if several else fits[0].fit("power").parameters
        pulls.append(pull_of("exponent", of_power["exponent"], exponent))
    return Trial(pulls, law=together.best, excluded=law in together.verdict.excluded)


def _noise(random: np.random.Generator, n: int, rho: float) -> Array:
    """Return noise of unit variance whose neighbours have a correlation, shape (n,)."""
    news = random.standard_normal(n)
    if rho <= 0:
        return np.asarray(news)
    noise = np.empty(n)
    noise[0] = news[0]
    root = float(np.sqrt(1 - rho**2))
    for k in range(1, n):
        noise[k] = rho * noise[k - 1] + root * news[k]
    return noise


def _round(values: Array, step: float) -> Array:
    return np.asarray(np.round(values / step) * step) if step else values

"""Many traces of each kind, and what the estimates of their frequency are worth: ours, and a user's otherwise."""

import math
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from analysis.arrays import Array
from analysis.errors import AnalysisError
from analysis.pulses import spin_of_times, spin_of_trace
from analysis.pulses.synthetic import DURATION, HARD, RATE, Case, Trace, bound, make
from analysis.pulses.trace import Choice
from levilab.benchmark.found import describe_measurement
from levilab.errors import UsageError
from levilab.files import finite

#: Range of the frequency, which the other methods are given [Hz].
LOW, HIGH = 20.0, 45.0


def fft_peak(samples: Array, rate: float) -> float:
    """Return the highest line behind a Hann window, placed between the bins by a parabola through three logarithms."""
    n = samples.size
    height = np.abs(np.fft.rfft((samples - samples.mean()) * np.hanning(n)))
    first = int(LOW * n / rate)
    peak = first + int(np.argmax(height[first : int(HIGH * n / rate)]))
    return (peak + _vertex(np.log(height[peak - 1 : peak + 2]))) * rate / n


def autocorrelation(samples: Array, rate: float) -> float:
    """Return one over the lag at which the trace resembles itself most, placed by a parabola."""
    n = samples.size
    power = np.abs(np.fft.rfft(samples - samples.mean(), 2 * n)) ** 2
    alike = np.fft.irfft(power)
    first = int(rate / HIGH)
    peak = first + int(np.argmax(alike[first : int(rate / LOW)]))
    return float(rate / (peak + _vertex(alike[peak - 1 : peak + 2])))


def mean_period(samples: Array, rate: float) -> float:
    """Return one over the mean interval of scipy's find_peaks above half the height, half a turn apart at least."""
    from scipy.signal import find_peaks

    peaks, _ = find_peaks(samples, height=0.5 * float(samples.max()), distance=int(0.5 * rate / HIGH))
    return float((peaks.size - 1) * rate / (peaks[-1] - peaks[0]))


def _vertex(three: Array) -> float:
    a, b, c = three
    return float(0.5 * (a - c) / (a - 2 * b + c))


PEERS: dict[str, Callable[[Array, float], float]] = {
    "FFT peak, interpolated": fft_peak,
    "autocorrelation": autocorrelation,
    "find_peaks, mean period": mean_period,
}

#: Seed of the traces, unless given.
SEED = 2026
#: Signal to noise of the study [dB].
SNR = (0.0, 5.0, 10.0, 20.0, 30.0, 40.0)
OURS: dict[str, Choice] = {"default": "auto", "fast": "edges", "maximum likelihood": "likelihood"}
#: An estimate this many standard deviations off is a failure.
FAILURE = 10.0
#: What was aimed at: method, lowest SNR [dB], RMSE over the bound, samples per CPU second.
AIMS = (
    ("default", 5.0, 1.10, 40e6),
    ("fast", 10.0, 1.25, 120e6),
    ("maximum likelihood", 0.0, 1.10, RATE * DURATION / 0.1),
)


@dataclass
class Trials:
    """Estimates of one method: errors [Hz], uncertainties and bounds [Hz], CPU times [s]; and what failed."""

    errors: list[float] = field(default_factory=list)
    u: list[float] = field(default_factory=list)
    bounds: list[float] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    refused: int = 0
    notes: Counter[str] = field(default_factory=Counter)


@dataclass(frozen=True)
class Score:
    """What one method's estimates are worth on one kind of trace.

    Attributes:
        name: of the method, or of the hard case.
        snr_db: of the traces.
        trials: their number.
        failures: refused, or off by more than ten standard deviations: the bound's where it is the closed form;
            elsewhere the estimate's own, or the scatter of the trials, whichever is smaller.
        rmse_hz, rmse_over_bound: of those that did not fail; the bound is the closed form, or of hard cases the median
            of what the estimates state for their own pulse and noise.
        coverage: share of one-sigma intervals that hold the truth.
        pull_mean, pull_sd, pull_kurtosis: of the errors in units of the stated uncertainties, without the failures; the
            kurtosis of a normal distribution is 0.
        best_ms, median_ms: CPU time of a trace [ms].
        samples_per_s: by the best time.
        notes: how often each finding was named.
    """

    name: str
    snr_db: float
    trials: int
    failures: int
    rmse_hz: float
    rmse_over_bound: float
    coverage: float | None
    pull_mean: float | None
    pull_sd: float | None
    pull_kurtosis: float | None
    best_ms: float
    median_ms: float
    samples_per_s: float | None
    notes: dict[str, int]

    @property
    def coverage_error(self) -> float:
        """Standard error of a coverage of 0.68 from this number of trials."""
        return math.sqrt(0.6827 * 0.3173 / self.trials)


@dataclass(frozen=True)
class Study:
    """All scores.

    Attributes:
        trials: of each score.
        scores: by method and SNR.
        hard: of the default on the hard cases.
    """

    trials: int
    scores: tuple[Score, ...]
    hard: tuple[Score, ...]


def study(
    *, trials: int, cases: Sequence[str] = (), seed: int = SEED, tell: Callable[[str], None] = lambda _: None
) -> Study:
    """Carry it all out.

    Args:
        trials: of each score.
        cases: only these hard cases; empty: all, and each method at each SNR.
        seed: the same gives the same traces.
        tell: called with what is under way.

    Raises:
        UsageError: for a case that is none.
    """
    if unknown := [name for name in cases if name not in HARD]:
        raise UsageError("case", f"one of these is expected: {'; '.join(HARD)}", value=unknown[0])
    scores: list[Score] = []
    for snr in () if cases else SNR:
        tell(f"{snr:g} dB, {trials} traces")
        scores += _at(snr, trials, seed)
    hard = []
    for name in cases or HARD:
        tell(f"{name}, {trials} traces")
        hard.append(hard_case(name, HARD[name], trials, seed))
    return Study(trials, tuple(scores), tuple(hard))


def _at(snr: float, trials: int, seed: int = SEED) -> list[Score]:
    """Try all methods on the same traces, one after the other on each."""
    found = {name: Trials() for name in (*OURS, *PEERS)}
    random = np.random.default_rng([seed, round(snr)])
    for number in range(-1, trials):  # the first is not counted: caches, imports
        trace = make(Case(snr=snr), random)
        for name, method in OURS.items():
            _try(found[name], trace, number, method)
        for name, estimate in PEERS.items():
            begin = time.process_time()
            value = estimate(trace.samples, RATE)
            if number >= 0:
                found[name].seconds.append(time.process_time() - begin)
                found[name].errors.append(value - trace.frequency)
    return [_score(name, snr, each, bound(snr)) for name, each in found.items()]


def hard_case(name: str, case: Case, trials: int, seed: int = SEED) -> Score:
    """Study the default on one kind of hard trace."""
    found = Trials()
    random = np.random.default_rng([seed, list(HARD).index(name) + 100])
    for number in range(-1, trials):
        _try(found, make(case, random), number, "auto", times=case.bounces)
    return _score(name, case.snr, found, None)


def _try(found: Trials, trace: Trace, number: int, method: Choice, *, times: bool = False) -> None:
    begin = time.process_time()
    try:
        # the slope of these traces stays, and so it does in the bound
        if times:
            spin = spin_of_times(trace.samples, degree=2)
        else:
            spin = spin_of_trace(trace.samples, RATE, method=method, degree=2)
    except AnalysisError:
        found.refused += number >= 0
        return
    seconds = time.process_time() - begin
    if number < 0:
        return
    assert spin.frequency.value is not None
    assert spin.frequency.u is not None
    found.errors.append(spin.frequency.value - trace.truth(spin.reference_time))
    found.u.append(spin.frequency.u)
    found.bounds.append(spin.bound or math.nan)
    found.seconds.append(seconds)
    found.notes.update(note.name for note in spin.notes)


def _score(name: str, snr: float, found: Trials, limit: float | None) -> Score:
    errors = np.array(found.errors)
    trials = errors.size + found.refused
    if limit is None:
        limit = float(np.median(found.bounds))
        scatter = 1.4826 * float(np.median(np.abs(errors)))
        wrong = np.abs(errors) > FAILURE * np.minimum(np.array(found.u), scatter)
    else:
        wrong = np.abs(errors) > FAILURE * limit
    right = errors[~wrong] if found.u and not wrong.all() else errors
    rmse = float(np.sqrt(np.mean(right**2)))
    seconds = np.array(found.seconds)
    mean, sd, kurtosis = _shape(errors[~wrong] / np.array(found.u)[~wrong]) if found.u else (None, None, None)
    traced = not math.isnan(limit)
    return Score(
        name=name,
        snr_db=snr,
        trials=trials,
        failures=int(np.count_nonzero(wrong)) + found.refused,
        rmse_hz=rmse,
        rmse_over_bound=rmse / limit,
        coverage=float(np.mean(np.abs(errors) < np.array(found.u))) if found.u else None,
        pull_mean=mean,
        pull_sd=sd,
        pull_kurtosis=kurtosis,
        best_ms=1e3 * float(seconds.min()),
        median_ms=1e3 * float(np.median(seconds)),
        samples_per_s=RATE * DURATION / float(seconds.min()) if traced and name != "5 pulses only" else None,
        notes=dict(sorted(found.notes.items())),
    )


def _shape(pulls: Array) -> tuple[float | None, float | None, float | None]:
    """Return mean, standard deviation, and kurtosis less that of a normal distribution; None of none."""
    if pulls.size < 2 or not (sd := float(pulls.std())) > 0:
        return None, None, None
    mean = float(pulls.mean())
    return mean, sd, float(np.mean(((pulls - mean) / sd) ** 4)) - 3


def as_document(found: Study) -> dict[str, Any]:
    """Everything, with units in the names."""
    return {
        "schema": "levilab-benchmark-estimators/1",
        "traces": "Gaussian pulse of 3 % duty, 29.5 to 30.5 Hz, -0.1 Hz/s, 20 kS/s, 10 s; hard cases at 20 dB",
        **describe_measurement("levilab", "numpy", "scipy"),
        "trials": found.trials,
        "methods": [_row(score) for score in found.scores],
        "hard_cases": [_row(score) for score in found.hard],
        "aims": [
            {"method": name, "from_snr_db": snr, "rmse_over_bound": ratio, "samples_per_s": speed}
            for name, snr, ratio, speed in AIMS
        ],
    }


def _row(score: Score) -> dict[str, Any]:
    row: dict[str, Any] = finite(asdict(score) | {"coverage_standard_error": score.coverage_error})
    return row

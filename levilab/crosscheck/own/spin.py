"""Records of pulses with the frequency, slope, noise, jitter and length of a result."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from analysis.budget import rest
from analysis.pulses import SpinFrequency, spin_of_times, spin_of_trace
from analysis.rotation import FieldSpin, spin_of_field
from analysis.uncertainty import Estimate
from levilab.crosscheck.own.model import Own
from levilab.crosscheck.subject import Trial, TrialFailed, pull_of
from levilab.texts.text import Text

if TYPE_CHECKING:
    from analysis.arrays import Array
    from levilab.pipelines.spin.analysis import SpinAnalysis


#: Processor time of a trial and of a sample of it [s].
_COST_S, _COST_OF_SAMPLE_S = 0.004, 8e-8
#: The same of a magnetometer's window.
_COST_OF_FIELD_S = 0.03
#: Width of a pulse, standard deviation over a turn: narrower ones no sample shows, wider ones are no pulses.
_NARROWEST, _WIDEST = 0.002, 0.12


def trials_of(found: SpinAnalysis) -> Own:
    """Return the trials of the first input; of a long record or of several, of the window or record in the middle."""
    run, source, options = found.runs[0], found.sources[0], found.options
    spin = run.spin
    turns = spin.pulses + spin.missing
    if line := run.line:
        about = Text(
            "a record of {n} samples with a line of this spin and slope, of these amplitudes, in this noise",
            n=line.samples,
        )
        return Own(about, lambda random: _of_field(random, line), _COST_OF_FIELD_S)
    if source.readings.pulses or spin.bound is None or spin.snr_db is None:
        about = Text("the times of {turns} pulses of this spin and slope, each with an error as theirs", turns=turns)
        return Own(about, lambda random: _of_times(random, spin), _COST_S)
    rate = source.readings.waveforms[0].rate
    n = round((turns + 1) / (spin.frequency.value or 1.0) * rate)
    record = "a record of {n} samples with {turns} pulses of this spin and slope, with this noise and jitter"
    about = Text(record, n=n, turns=turns)
    code = run.code or 0.0
    return Own(
        about,
        lambda random: _of_trace(random, spin, rate, n, method=options.method, code=code),
        _COST_S + n * _COST_OF_SAMPLE_S,
    )


def _phase(spin: SpinFrequency, times: Array) -> Array:
    """Return the turns since the reference time, under a drag, shape (n,)."""
    frequency, chirp, bend = _motion(spin)
    return np.asarray(times * (frequency + times * (chirp / 2 + times * bend / 6)))


def _motion(spin: SpinFrequency) -> tuple[float, float, float]:
    frequency, chirp = spin.frequency.value, spin.chirp.value
    if not frequency or chirp is None:
        raise TrialFailed("the record has no frequency")
    return frequency, chirp, (spin.bend.value if spin.bend else None) or 0.0


def _pulse_times(spin: SpinFrequency) -> Array:
    """Return the times at which the pulses pass, from the reference time on, shape (n,) [s]."""
    frequency, chirp, bend = _motion(spin)
    turns = np.arange(spin.pulses + spin.missing, dtype=float)
    turns -= turns.mean()
    times = turns / frequency
    for _ in range(20):  # by Newton's method
        times = times - (_phase(spin, times) - turns) / (frequency + chirp * times + bend * times**2 / 2)
    return np.asarray(times)


def _compare(found: SpinFrequency, spin: SpinFrequency) -> Trial:
    """Return the pulls of a fit, against the truth at its own reference time."""
    frequency, chirp, bend = _motion(spin)
    at = found.reference_time
    return Trial(
        [
            pull_of("frequency", found.frequency, frequency + chirp * at + bend * at**2 / 2),
            pull_of("chirp", found.chirp, chirp + bend * at),
        ],
        widened=found.freedom,
    )


def _of_times(random: np.random.Generator, spin: SpinFrequency) -> Trial:
    times = _pulse_times(spin)
    kept = np.ones(times.size, dtype=bool)
    kept[random.choice(times.size, min(spin.missing, times.size // 4), replace=False)] = False
    times = np.sort(times + spin.scatter * random.standard_normal(times.size))[kept]
    return _compare(spin_of_times(times), spin)


def _of_field(random: np.random.Generator, line: FieldSpin) -> Trial:
    """Try a line under a drag of a power from 1 to 2 of the spin, near the frequency: its folds are not in question."""
    late = np.asarray((np.arange(line.samples) - (line.samples - 1) / 2) / line.rate)
    bend = random.uniform(1, 2) * line.chirp**2 / line.frequency
    turns = late * (line.frequency + late * (line.chirp / 2 + late * bend / 6))
    angles = 2 * np.pi * (turns[:, None] + random.uniform(size=len(line.noise)))
    field = line.amplitude * np.cos(angles) + line.noise * random.standard_normal(angles.shape)
    found = spin_of_field(late, field, near=line.frequency)
    return Trial(
        [
            pull_of("frequency", Estimate(found.frequency, found.u_frequency, "Hz"), line.frequency),
            pull_of("chirp", Estimate(found.chirp, found.u_chirp, "Hz/s"), line.chirp),
        ]
    )


def _of_trace(
    random: np.random.Generator, spin: SpinFrequency, rate: float, n: int, *, method: str, code: float
) -> Trial:
    """Try Gaussian pulses of unit height, as wide as the bound of the result implies for such noise."""
    assert spin.bound is not None
    assert spin.snr_db is not None
    frequency, _, _ = _motion(spin)
    span = (spin.pulses + spin.missing - 1) / frequency
    noise = 10 ** (-spin.snr_db / 20)
    samples = span * rate
    # σ_f² = 12σ²/(N G T²), G = √π/(2s) for a pulse of the standard deviation s in turns
    width = math.sqrt(math.pi) * samples * (span * spin.bound / noise) ** 2 / 24
    width = min(max(width, _NARROWEST), _WIDEST)
    by_noise = spin.bound * math.sqrt(spin.pulses / 12) * span / frequency
    jitter = rest(spin.scatter, by_noise)
    times = np.asarray((np.arange(n) - (n - 1) / 2) / rate, dtype=np.float64)
    phase = _phase(spin, times)
    turn = np.rint(phase).astype(np.int64)
    moved = jitter * frequency * random.standard_normal(int(np.ptp(turn)) + 1)
    away = phase - turn - moved[turn - turn.min()]
    volts = np.exp(-(away**2) / (2 * width**2)) + noise * random.standard_normal(n)
    if code > 0:
        volts = np.round(volts / (code * noise)) * code * noise
    found = spin_of_trace(volts, rate, start=float(times[0]), method=method)  # type: ignore[arg-type]
    return _compare(found, spin)

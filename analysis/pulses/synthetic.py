"""Traces of a top's light pulses, as easy and as hard as they come, with the frequency that is in them."""

from dataclasses import dataclass, field

import numpy as np

from analysis.arrays import Array

Random = np.random.Generator

RATE, DURATION, CHIRP, DUTY = 20_000.0, 10.0, -0.1, 0.03
#: Signal to noise of the hard cases [dB].
HARD_SNR = 20.0


@dataclass(frozen=True)
class Case:
    """A kind of trace.

    Attributes:
        frequency: at the middle [Hz]; each trial's lies up to 0.5 Hz beside it.
        duration: [s]; turns: the length in turns, instead of `duration`.
        snr: pulse height over noise [dB].
        missing: share of turns without a pulse.
        reflection: height of a second pulse 0.1 turn later.
        spikes: number of samples or short bursts of 1 to 5 pulse heights.
        bobbing: amplitude of the pulse height's modulation at 0.8 Hz.
        hum: (frequency [Hz], amplitude in pulse heights), each.
        wander: amplitude of a wandering baseline, a sine of 0.3 Hz and a random walk.
        clip: the detector's greatest signal, in pulse heights.
        bits: of the converter, its range 1.6 pulse heights.
        gap: share of the record in which the detector is dead (constant).
        nan: share of samples that are NaN, a third of them in bursts.
        trapezoid: a pulse with straight flanks of 0.01 turn and a flat top of 0.03, instead of a Gaussian one.
        bounces: the record is a list of times from a switch that bounces at half of its turns.
    """

    frequency: float = 30.0
    duration: float = DURATION
    turns: int | None = None
    snr: float = HARD_SNR
    missing: float = 0.0
    reflection: float = 0.0
    spikes: int = 0
    bobbing: float = 0.0
    hum: tuple[tuple[float, float], ...] = field(default=())
    wander: float = 0.0
    clip: float | None = None
    bits: float | None = None
    gap: float = 0.0
    nan: float = 0.0
    trapezoid: bool = False
    bounces: bool = False


#: The hard cases.
HARD = {
    "none of them": Case(),
    "10 % of the pulses missing": Case(missing=0.1),
    "40 % of the pulses missing": Case(missing=0.4),
    "second reflection, 0.6 at 0.1 turn": Case(reflection=0.6),
    "30 spurious spikes": Case(spikes=30),
    "bobbing, 50 %": Case(bobbing=0.5),
    "bobbing, 95 %": Case(bobbing=0.95),
    "hum, 0.3 at 50 Hz": Case(hum=((50.0, 0.3),)),
    "hum, 0.3 at 100 Hz": Case(hum=((100.0, 0.3),)),
    "hum, 1.0 at 50 Hz": Case(hum=((50.0, 1.0),)),
    "hum, 1.0 at 100 Hz": Case(hum=((100.0, 1.0),)),
    "wandering baseline": Case(wander=1.0),
    "clipped at half height": Case(clip=0.5),
    "6 bits": Case(bits=6),
    "2.5 bits": Case(bits=2.5),
    "a gap of 20 %": Case(gap=0.2),
    "NaN samples": Case(nan=0.03),
    "trapezoid pulse": Case(trapezoid=True),
    "25 Hz": Case(frequency=25.0),
    "50 Hz": Case(frequency=50.0),
    "100 Hz": Case(frequency=100.0),
    "5 pulses only": Case(turns=5),
    "a switch that bounces, times": Case(bounces=True),
    "all together": Case(
        missing=0.1, reflection=0.6, spikes=30, bobbing=0.5, hum=((50.0, 0.3), (100.0, 0.3)), wander=0.3, clip=0.5,
        bits=6, gap=0.2, nan=0.03,
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Trace:
    """A synthetic record with its truth.

    Attributes:
        samples: shape (n,), or, of a switch, times [s].
        frequency: at the middle of the record [Hz].
        middle: of the record [s].
    """

    samples: Array
    frequency: float
    middle: float

    def truth(self, time: float) -> float:
        """Return the frequency at a time [Hz]."""
        return self.frequency + CHIRP * (time - self.middle)


def bound(snr: float) -> float:
    """Return the Cramér–Rao bound of the frequency at the middle [Hz] of a trace with a snr [dB].

    σ_f² = 12 σ²/(N G T²), G = A²√π/(2 s), s = duty/2.3548.
    """
    steepness = np.sqrt(np.pi) / (2 * DUTY / np.sqrt(8 * np.log(2)))
    return float(np.sqrt(12 / (RATE * DURATION * steepness * DURATION**2)) * 10 ** (-snr / 20))


def make(case: Case, random: Random) -> Trace:
    """Return one trace of a kind; its frequency, phase and disturbances are drawn at random."""
    frequency = case.frequency + random.uniform(-0.5, 0.5)
    duration = case.duration if case.turns is None else case.turns / frequency
    first = random.uniform(0, 1) if case.turns is None else 0.0
    middle = duration / 2
    if case.bounces:
        return Trace(_switch(frequency, duration, first, random), frequency, middle)
    time = np.arange(round(RATE * duration)) / RATE
    since = time - middle
    phase = first + frequency * (since + middle) + 0.5 * CHIRP * (since**2 - middle**2)
    samples = _light(case, phase, random)
    if case.bobbing:
        samples *= 1 + case.bobbing * np.sin(2 * np.pi * (0.8 * time + random.uniform()))
    samples += 10 ** (-case.snr / 20) * random.standard_normal(time.size)
    _disturb(case, samples, time, random)
    return Trace(samples, frequency, middle)


def _light(case: Case, phase: Array, random: Random) -> Array:
    turn = np.floor(phase)
    place = phase - turn
    samples = _trapezoid(place) if case.trapezoid else _gaussian(place)
    if case.reflection:
        samples += case.reflection * _gaussian(place - 0.1)
    if case.missing:
        there = random.uniform(size=int(turn[-1]) + 1) >= case.missing
        samples *= there[turn.astype(np.intp)]
    return samples


def _gaussian(place: Array) -> Array:
    sigma = DUTY / np.sqrt(8 * np.log(2))
    return np.asarray(np.exp(-0.5 * ((place - 0.5) / sigma) ** 2))


def _trapezoid(place: Array) -> Array:
    return np.asarray(np.clip((0.025 - np.abs(place - 0.5)) / 0.01, 0, 1))


def _disturb(case: Case, samples: Array, time: Array, random: Random) -> None:
    for frequency, amplitude in case.hum:
        samples += amplitude * np.sin(2 * np.pi * (frequency * time + random.uniform()))
    if case.wander:
        walk = np.cumsum(random.standard_normal(time.size)) / np.sqrt(time.size)
        samples += case.wander * (np.sin(2 * np.pi * (0.3 * time + random.uniform())) + walk)
    for _ in range(case.spikes):
        at, length = int(random.integers(time.size - 5)), int(random.integers(1, 6))
        samples[at : at + length] += random.uniform(1, 5)
    if case.clip is not None:
        np.minimum(samples, case.clip, out=samples)
    if case.bits is not None:
        step = 1.6 / (2**case.bits - 1)
        np.rint(samples / step, out=samples)
        samples *= step
    if case.gap:
        length = round(case.gap * time.size)
        at = int(random.integers(time.size // 10, time.size - length - time.size // 10))
        samples[at : at + length] = 0.0
    if case.nan:
        _lose(case.nan, samples, random)


def _lose(share: float, samples: Array, random: Random) -> None:
    samples[random.uniform(size=samples.size) < share * 2 / 3] = np.nan
    for _ in range(10):
        length = round(share / 30 * samples.size)
        at = int(random.integers(samples.size - length))
        samples[at : at + length] = np.nan


def _switch(frequency: float, duration: float, first: float, random: Random) -> Array:
    """Return times of a switch with a jitter of 1e-4 s, which bounces at 45 % of the turns and misses 8 %."""
    turn = np.arange(1, int(frequency * duration) - 1)
    since = duration / 2
    start = frequency - CHIRP * since  # at time 0
    times = (-start + np.sqrt(start**2 + 2 * CHIRP * (turn - first))) / CHIRP
    times = times[times < duration] + 1e-4 * random.standard_normal(np.count_nonzero(times < duration))
    bouncing = times[random.uniform(size=times.size) < 0.45]
    closed = times[random.uniform(size=times.size) >= 0.08]
    bounces = [bouncing]
    later = bouncing
    for _ in range(4):
        later = later[random.uniform(size=later.size) < 0.7]
        later = later + random.exponential(0.15 / frequency, later.size) + 2e-4
        bounces.append(later)
    return np.unique(np.concatenate([closed, *bounces[1:]]))

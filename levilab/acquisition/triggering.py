"""A drive that the top triggers: its tape's pulse starts a cycle of the drive at each turn, as in a brushless motor.

Nothing is to be captured and no lock can be lost: the cycle comes when the top does.  Where the tape sits beside the
moment is not known, so the start phase that speeds the top up is found by trial.  A cycle has to end before the next
pulse, which would be ignored otherwise; so it is CYCLE times as fast as the top, and follows it count by count.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from analysis.arrays import Array
from analysis.limits import U_OF_WAY
from analysis.uncertainty import Estimate
from levilab.acquisition.counting import middle_of_count, prepare_counter_again, spin_now
from levilab.acquisition.session import DidNotFollow, ExperimentFailed, NotHeld, Session
from levilab.runs.events import RunEvent
from levilab.texts.text import Text

#: The frequency of the cycle over that of the top: a pulse comes up to 6 % of a turn early (2 % is its scatter), and
#: the top gains 2 % until the next count is set.  The pull is 8 % less than that of a cycle as long as a turn.
CYCLE = 1.1
#: Start phases of the trials [°], number of counts at each, and their gates [s]: the slope of 6 counts of 0.06 Hz is
#: known to 0.03 Hz/s beside a pull of 0.4 Hz/s, so the phase to 5°, which costs 0.4 % of the pull.  Where noise hides
#: the pull the trials are repeated with the longer gate: u of a slope goes with its power −3/2.
_PHASES, _COUNTS, GATES_S = (0.0, 120.0, 240.0), 6, (0.5, 1.0)
#: A trial that brakes ends once the top has lost this [Hz]: it may float only little above its lowest spin.
_MOST_LOST_HZ = 1.0
#: A pull is seen where it is larger than this multiple of its u; where half of the usual one [Hz/s] would be seen and
#: is not, there is none.
_CLEAR, _PULL = 4.0, 0.18
#: A count further than this from the last one [Hz] is none of this top; number of such counts, one after another, that
#: end the drive.
_WITHIN_HZ, _MOST_MISSED = 2.0, 3
#: The loop brings the spin back in this time [s]: five counts, so that it does not swing, and their noise of 0.03 Hz
#: moves the amplitude by 2 %; the sum of the errors counts over four times as long: critically damped.
_BACK_S, _SUM_S = 5.0, 20.0
#: The spin nears the target when it would be there within this time [s].
_NEAR_S = 3.0
#: A top that gains less than this [Hz] within this number of counts has reached the greatest spin of the drive.
_LEAST_GAIN_HZ, _GAINING = 0.15, 30
#: Number of counts that show the gain at the full amplitude: 3 mHz/s of 0.2 Hz/s; a top that is held by more than this
#: share of the amplitude gains too little for that.  Near its lowest spin a top that leans is turned so much harder
#: that ten counts would lead out of its window: they cover no more than this [Hz].
_GAIN_COUNTS, _MOST_SHARE, _GAIN_HZ = 10, 0.9, 3.0
#: Fewest counts that show a gain, also on the way to a spin: to 13 mHz/s.
_FEWEST_COUNTS = 4
#: The pull changes by no more than this factor on the way to a spin: that of the lean is 2 from 30 to 80 Hz.
_MOST_CHANGE = 3.0
#: Least amplitude of the drive, as a share: no generator is near its own lowest one.
_LEAST_SHARE = 0.01
#: Where the pull was not found by trial: that of 0.4 mT on the thesis's top [Hz/s]; a factor of 3 does not matter.
_USUAL_PULL_HZ_PER_S = 0.36


@dataclass(frozen=True)
class Response:
    """The answer of a top to start phases.

    phase: that speeds it up most [°]; pull, u: rate that the cycles at this phase add to its spin, and its standard
    uncertainty [Hz/s]; drag: rate of its loss without a drive [Hz/s].
    """

    phase: float
    pull: float
    u: float
    drag: float


def response(slopes: Sequence[float], u: float) -> Response:
    """Return the answer of a top to start phases, evenly spaced from 0 on: slope = pull cos(φ − phase) − drag.

    Args:
        slopes: of its spin at each phase, at least three [Hz/s].
        u: of each slope [Hz/s].

    >>> found = response([-0.3, 0.1, 0.1], 0.03)
    >>> round(found.phase), round(found.pull, 3), round(found.drag, 3)
    (180, 0.267, 0.033)
    """
    n = len(slopes)
    turn = np.exp(2j * np.pi * np.arange(n) / n)
    vector = complex(2 / n * np.dot(slopes, turn))
    phase = math.degrees(math.atan2(vector.imag, vector.real)) % 360
    return Response(phase, abs(vector), u * math.sqrt(2 / n), -float(np.mean(slopes)))


def slope_of(times: Sequence[float], spins: Sequence[float]) -> tuple[float, float, float]:
    """Return the slope of counts in time [Hz/s], their standard deviation about the line [Hz], and √Σ(t − mean)² [s].

    The slope's standard uncertainty is the second over the third.
    """
    slope, at = np.polyfit(times, spins, 1)
    residuals = np.asarray(spins) - (slope * np.asarray(times) + at)
    scatter = np.sqrt(np.sum(residuals**2) / max(len(spins) - 2, 1))
    return float(slope), float(scatter), float(np.std(times)) * math.sqrt(len(times))


@dataclass(frozen=True, eq=False)
class Climb:
    """A way up under the full amplitude of the drive.

    times, spins: middles of the counts [s], and counts [Hz], shape (n,); first_missed: when the first count without the
    top would have ended [s], later than which a dark counter answers; lost: what was seen in its place; levels_off_at:
    the spin at which pull and drag are equal, of a top that was not lost [Hz].
    """

    times: Array
    spins: Array
    first_missed: float
    lost: NotHeld | None = None
    levels_off_at: Estimate | None = None


@dataclass
class Motor:
    """A top whose pulses start the cycles of the drive.

    Attributes:
        session: the acquisition.
        spin: the last count [Hz].
        phase: the start phase that speeds it up [°].
        pull: rate that the full amplitude adds to its spin [Hz/s]; the less the faster, since a tilted top leans less.
        drag: rate of its loss without a drive over ν^(3/2) [Hz^(-1/2)/s]; None where the phase was not found by trial.
        share: of the full amplitude that holds it, as the loop has found.
        counts: its spin while it was held [Hz].
        shares: of the full amplitude, at each of the counts.
        gains: times [s] and counts [Hz] at the full amplitude, about the spin at which it is held, of each measurement.
    """

    session: Session[Any]
    spin: float
    phase: float
    pull: float
    drag: float | None = None
    share: float = 1.0
    counts: list[float] = field(default_factory=list)
    shares: list[float] = field(default_factory=list)
    gains: list[tuple[list[float], list[float]]] = field(default_factory=list)
    _missed: int = 0
    _trend: float = 0.0  # of the spin [Hz/s]
    _errors: float = 0.0  # summed [Hz s]
    _base: float = 1.0  # share of the amplitude without errors

    # --- the generator ---

    def start(self) -> None:
        """Set the bursts up, and put them on the coil."""
        session, settings = self.session, self.session.settings
        session.bench.generator.prepare_triggered(
            waveform=settings.drive_waveform,
            frequency_hz=CYCLE * self.spin,
            amplitude_vpp=settings.drive_amplitude_vpp,
            phase_deg=self.phase,
            rising=session.bench.trigger == "rising",
        )
        text = Text("drive on, triggered by the top, {spin:.2f} Hz", spin=self.spin)
        session.event(RunEvent.DRIVE_ON, text, frequency_hz=self.spin)
        session.bench.generator.output = True

    def count(self, gate_s: float | None = None) -> float:
        """Count the spin, and let the cycle follow it.  Raises NotHeld where no such top is seen any more."""
        session = self.session
        session.stop.check()
        seen = spin_now(session, gate_s)
        if seen is None or abs(seen - self.spin) > _WITHIN_HZ:
            self._missed += 1
            if self._missed >= _MOST_MISSED:
                raise NotHeld(seen, self.spin)
        else:
            self._missed, self.spin = 0, seen
            ahead = self._trend * (session.settings.gate_s if gate_s is None else gate_s)  # until the next count
            session.bench.generator.frequency = round(CYCLE * (seen + ahead), 6)
        return self.spin

    def _turn_to(self, phase: float) -> None:
        self.session.bench.generator.burst_phase = round(phase % 360, 3)

    def _set_share(self, share: float) -> None:
        self.share = min(max(share, _LEAST_SHARE), 1.0)
        self.session.bench.generator.amplitude = round(self.share * self.session.settings.drive_amplitude_vpp, 4)

    # --- the start phase ---

    def find_phase(self) -> None:
        """Try start phases, and choose the one that speeds the top up.  Raises DidNotFollow, NotHeld."""
        session = self.session
        for gate_s in GATES_S:
            found, scatter = self._answer(gate_s)
            if _CLEAR * found.u < max(found.pull, _PULL):  # it is seen, or excluded
                break
        prepare_counter_again(session)
        self.phase, self.pull = found.phase, found.pull
        if found.pull < _CLEAR * found.u:
            raise _no_pull(session, found, scatter)
        self._turn_to(self.phase)
        text = Text(
            "a start phase of {phase:.0f}° speeds the top up most, by {pull:.2f} Hz/s less drag",
            phase=found.phase,
            pull=found.pull,
        )
        session.event(RunEvent.PHASE_FOUND, text, phase_deg=found.phase, pull_hz_per_s=found.pull, u_hz_per_s=found.u)

    def _answer(self, gate_s: float) -> tuple[Response, float]:
        """Return the answer to trials with this gate, and the scatter of their counts [Hz].  Raises NotHeld."""
        session = self.session
        prepare_counter_again(session, gate_s)
        lines, means = [], []
        for k, phase in enumerate(_PHASES):
            session.progress(Text("start phase {phase:g}°: how the spin answers", phase=phase), k / len(_PHASES))
            self._turn_to(phase)
            times: list[float] = []
            spins: list[float] = []
            while len(spins) < _COUNTS and (len(spins) < 3 or spins[0] - spins[-1] < _MOST_LOST_HZ):
                spins.append(self.count(gate_s))
                times.append(session.now())
            lines.append(slope_of(times, spins))
            means.append(np.mean(spins))
        slopes, scatters, spreads = zip(*lines, strict=True)
        scatter = math.sqrt(float(np.mean(np.square(scatters))))
        found = response(slopes, scatter / min(spreads))
        self.drag = max(found.drag, 0.0) / float(np.mean(means)) ** 1.5
        return found, scatter

    # --- to a spin, and there ---

    def measure_gain(self, target: float) -> None:
        """Measure the gain at the full amplitude, evenly about a spin [Hz], and come back.  Raises NotHeld.

        Where the top is held by nearly all of the amplitude there is too little left.
        """
        share, gain = self.share, self.pull * (1 - self.share)
        if share > _MOST_SHARE:
            return
        half = min(gain * _GAIN_COUNTS, _GAIN_HZ) / 2
        self._set_share(_LEAST_SHARE)
        while self.spin > target - half - 1.5 * gain:  # a count and half of the next
            self.count()
        self._set_share(1.0)
        self._trend = gain
        self.count()  # of a gate in which the amplitude may have changed
        times: list[float] = []
        spins: list[float] = []
        while len(spins) < _FEWEST_COUNTS or (self.spin < target + half - gain / 2 and len(spins) < 2 * _GAIN_COUNTS):
            spins.append(self.count())
            times.append(self.session.now())
        self.gains.append((times, spins))
        slope, _, _ = slope_of(times, spins)
        text = Text("gains {slope:.3f} Hz/s at the full amplitude, about {mean:.2f} Hz", slope, np.mean(spins))
        self.session.event(RunEvent.GAIN, text, times_s=times, spins_hz=spins)
        self.pull = max(slope / (1 - share), self.pull / _MOST_CHANGE)
        self._trend = 0.0
        self._set_share(_LEAST_SHARE)
        while self.spin > target:
            self.count()
        self._set_share(share)

    def go_to(self, target: float) -> None:
        """Speed the top up to a spin [Hz], or brake it.  Raises DidNotFollow, NotHeld."""
        session, start = self.session, self.spin
        brakes = start > target
        sign = -1 if brakes else 1
        if brakes:
            self._turn_to(self.phase + 180)
        times, spins = [session.now()], [start]
        gain = (sign - 0.25) * self.pull  # a guess: the drag is a quarter of the pull
        while (target - self.spin - _NEAR_S * gain) * sign > 0:
            spins.append(self.count())
            times.append(session.now())
            recent = slice(-_GAINING, None)
            if len(spins) > 2:
                gain, _, _ = slope_of(times[recent], spins[recent])
            self._trend = gain
            share = min((self.spin - start) / (target - start), 1.0)
            session.progress(
                Text("{does}, {spin:.2f} Hz", does="brakes" if brakes else "speeds up", spin=self.spin), max(share, 0.0)
            )
            if len(spins) > _GAINING and abs(spins[-1] - spins[-_GAINING]) < _LEAST_GAIN_HZ:
                raise DidNotFollow(
                    "the top spins at {spin:.2f} Hz and gets no {other}: pull and drag are equal there, "
                    "{target:g} Hz were asked for",
                    "drive harder ({experiment:s}.drive_amplitude_vpp), or ask for less",
                    spin=self.spin,
                    other="slower" if brakes else "faster",
                    target=target,
                    experiment=session.writer.record.experiment,
                )
        self._trend = 0.0
        if brakes:
            self._turn_to(self.phase)
        latest = slice(max(1, len(spins) - _GAIN_COUNTS), None)  # the first count was not under this drive
        if self.drag is not None and len(spins[latest]) >= _FEWEST_COUNTS:
            gain, _, _ = slope_of(times[latest], spins[latest])
            pull = sign * (gain + self.drag * self.spin**1.5)
            self.pull = min(max(pull, self.pull / _MOST_CHANGE), self.pull * _MOST_CHANGE)
        self._set_share(sign - gain / self.pull)  # drag over pull, for gain = sign · pull − drag

    def climb(self, highest: float) -> Climb:
        """Speed the top up at the full amplitude until it is lost, or gets no faster.

        The gain nears zero at the rate 3/2 pull/spin, that of the drag C ω^(3/2), which the pull equals in the end: the
        rest of the way is added.

        Args:
            highest: a spin that ends it, too [Hz].

        Raises:
            DidNotFollow: the top gets slower.
            ExperimentFailed: it is faster than that.
        """
        session, start = self.session, self.spin
        self._set_share(1.0)
        times: list[float] = []
        spins: list[float] = []
        first_missed, lasts, level = math.nan, session.settings.gate_s, 0
        while True:
            missed, asked = self._missed, session.now()
            try:
                self.count()
            except NotHeld as lost:
                return Climb(np.array(times), np.array(spins), first_missed, lost=lost)
            if self._missed > missed:
                first_missed = asked + lasts if missed == 0 else first_missed
                continue
            times.append(middle_of_count(session, self.spin))
            spins.append(self.spin)
            lasts = session.now() - asked
            if self.spin > highest:
                raise _too_fast(session, highest)
            session.progress(Text("speeds up, {spin:.2f} Hz", spin=self.spin), (self.spin - start) / (highest - start))
            recent = slice(-_GAINING, None)
            if len(spins) < _GAINING:
                continue
            gain, scatter, spread = slope_of(times[recent], spins[recent])
            self._trend = gain
            gained = gain * (times[-1] - times[-_GAINING])
            if gained < -_LEAST_GAIN_HZ:
                raise DidNotFollow(
                    "the top gets slower under the drive, {spin:.2f} Hz after {before:.2f} Hz",
                    "does the cable lead from the phototransistor to the generator's trigger input, and to the coil?",
                    spin=self.spin,
                    before=max(spins),
                )
            level = level + 1 if gained < _LEAST_GAIN_HZ else 0
            if level == _GAINING:  # for as long: one that is about to get slower has shown it
                rate = 1.5 * self.pull / self.spin
                left = max(gain, 0.0) / rate
                at = Estimate(self.spin + left, math.hypot(U_OF_WAY * left, scatter / spread / rate), "Hz")
                return Climb(np.array(times), np.array(spins), math.nan, levels_off_at=at)

    def hold(self, target: float, duration: float) -> None:
        """Hold the top at a spin [Hz] for a time [s]: the amplitude follows each count.  Raises NotHeld."""
        session = self.session
        begin = last = session.now()
        if not self.counts:
            self._base = self.share
        while session.now() - begin < duration:
            missed = self._missed
            self.count()
            now = session.now()
            session.progress(Text("held at {target:.2f} Hz", target=target), min((now - begin) / duration, 1.0))
            if self._missed > missed:
                last = now
                continue
            error, lapse, last = target - self.spin, now - last, now
            wish = self._base + (error + (self._errors + error * lapse) / _SUM_S) / (self.pull * _BACK_S)
            if _LEAST_SHARE < wish < 1:  # else the sum would grow without an effect
                self._errors += error * lapse
            self.counts.append(self.spin)
            self.shares.append(self.share)
            self._set_share(wish)


def _too_fast(session: Session[Any], highest: float) -> ExperimentFailed:
    name = session.writer.record.experiment
    return ExperimentFailed(
        "the top still gets faster at {highest:.1f} Hz ({name}.highest_hz, and "
        "limits.drive_frequency_hz over {cycle:g}, for the cycles are so much faster than the "
        "top): allow more there, or weaken the drive",
        highest=highest,
        name=name,
        cycle=CYCLE,
    )


def _no_pull(session: Session[Any], found: Response, scatter: float) -> DidNotFollow:
    name = session.writer.record.experiment
    if _CLEAR * found.u > _PULL:
        return DidNotFollow(
            "the counts scatter by {scatter:.2f} Hz, which hides a pull of the bursts below {least:.2f} Hz/s",
            "set the trigger level half way up the tape's pulse, count with another counter, or state the start phase "
            "({name}.drive_phase_deg)",
            scatter=scatter,
            least=_CLEAR * found.u,
            name=name,
        )
    return DidNotFollow(
        "the bursts do not turn the top: at each start phase its spin changes by {slower:.2f} Hz/s, as without a drive",
        "does the cable lead from the phototransistor to the generator's trigger input, does its "
        "pulse reach TTL levels there, once a turn, and is the drive strong enough "
        "({name}.drive_amplitude_vpp)?",
        slower=-found.drag,
        name=name,
    )


def spin_up(session: Session[Any], spin: float, target: float) -> Motor:
    """Let the top trigger its drive, bring it to a spin, and hold it there for the time in the settings.

    Args:
        session: the acquisition.
        spin: of the top now [Hz].
        target: that spin [Hz].

    Raises:
        DidNotFollow: the bursts do not turn it, or not enough.
        NotHeld: no such top is seen any more.
    """
    settings = session.settings
    motor = Motor(session, spin, phase=settings.drive_phase_deg or 0.0, pull=_USUAL_PULL_HZ_PER_S)
    motor.start()
    if settings.drive_phase_deg is None:
        motor.find_phase()
    motor.go_to(target)
    text = Text("the top triggers its drive at {spin:.2f} Hz", spin=motor.spin)
    session.event(RunEvent.LOCKED, text, frequency_hz=motor.spin)
    motor.hold(target, settings.hold_s)
    return motor

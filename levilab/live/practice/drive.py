"""The drive on the bench for practice: as a person sets it, on its ramp, and while it takes hold of a top."""

import contextlib
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from instruments.errors import InstrumentError
from levilab.acquisition.grip import Grip
from levilab.acquisition.onlooker import drive_of
from levilab.bench.bench import Bench
from levilab.bench.config import Limits
from levilab.live.practice.commands import CommandRefused, TuneDrive, Voice
from levilab.telemetry.messages import Drive
from levilab.texts.text import Text

#: Between runs the counter counts for so long [s], as the light of the tape passes this level [V].
GATE_S, TRIGGER_V = 0.5, 0.6
#: The drive's frequency moves in even steps of about this time [s]; with uneven ones the top swings about the drive.
_RAMP_STEP_S = 0.5
#: The drive can take hold of a top that spins as fast as it is set, within this [Hz].
_CATCHES_WITHIN_HZ = 1.0
#: A top that the drive took hold of swings about it by less than this [Hz], on the ramp, too.  One that is not held
#: loses 0.1 Hz/s to the air: it is compared this long after the drive has yielded [s], and lost beyond this [Hz].
_SWINGS_HZ, _COMPARED_S, _LOST_HZ = 0.4, 6.0, 1.0
#: A top that follows the drive this far above where it took hold was tuned up [Hz].
_TUNED_UP_HZ = 0.5
#: What a person can do about a top that the drive lost on the way up, on the way down, and where it stood still.
_AGAIN = {
    1: "switch it off, match the spin, and go up more slowly",
    -1: "switch it off, match the spin, and go down more slowly",
    0: "switch it off, match the spin, and drive with more volts",
}


@dataclass
class Hold:
    """The drive and the top, from the moment the drive came on near the top's spin.

    Attributes:
        asked_hz: where the drive was set then [Hz].
        grip: moves its frequency while it yields to the top.
        since: when it stood still, bench time [s]; None while it yields.
        at_hz: where the top was first seen to follow [Hz]; None before.
        is_lost: whether it follows no more.
    """

    asked_hz: float
    grip: Grip
    since: float | None = None
    at_hz: float | None = None
    is_lost: bool = False


class PracticeDrive:
    """The generator between runs.

    Attributes:
        bench: that is open; None while a run has its instruments.
        took_hold, tuned_up: whether a person has come so far.

    Args:
        limits: of the bench.
        now: bench time [s].
        voice: for what becomes of the top.
    """

    def __init__(self, limits: Limits, now: Callable[[], float], voice: Voice) -> None:
        self._limits, self._now, self._voice = limits, now, voice
        self.bench: Bench | None = None
        self._set = Drive("SQU", 30.0, 10.0)  # as a person set it: where its frequency is, or is going
        self._ramp_hz_per_s = 0.1
        self._is_matched = False  # to the top, whose spin it follows until it is switched on
        self._hold: Hold | None = None  # while it is on near the top's spin
        self.took_hold = self.tuned_up = False
        self._moved = 0.0  # bench time of the last step of the frequency [s]

    def leave(self) -> None:
        """Forget the bench, which is closed with its outputs off."""
        self.bench, self._hold, self._set = None, None, replace(self._set, output=False)

    @property
    def generator(self) -> Any:
        """That of the open bench."""
        assert self.bench is not None
        return self.bench.generator

    @property
    def frequency(self) -> float:
        """The frequency as it was commanded last [Hz]."""
        return float(self.generator.last_set.get("frequency_hz", 0.0))

    @property
    def goal_hz(self) -> float:
        """The frequency as a person set it: where it is, or goes [Hz]."""
        return self._set.frequency_hz

    @property
    def output_hz(self) -> float | None:
        """The frequency on the terminals [Hz]; None while the output is off."""
        return self.frequency if self.bench and self._set.output else None

    @property
    def follows(self) -> bool:
        """Whether the top was seen to follow, and is not lost since."""
        return self._hold is not None and self._hold.at_hz is not None and not self._hold.is_lost

    @property
    def yields(self) -> bool:
        """Whether each count moves the frequency, and not the ramp."""
        return self._hold is not None and self._hold.since is None

    def state(self) -> Drive | None:
        """Return the drive for the views; while it is off, as it comes when it is switched on."""
        drive = drive_of(self.bench) if self.bench else None
        return drive if drive is None or drive.output else replace(self._set, output=False)

    # --- what a person does; it may raise CommandRefused ---

    def match(self, spin: float | None) -> None:
        """Set the frequency to the spin that was counted last [Hz]; None: no light pulses."""
        if spin is None:
            raise CommandRefused("the counter sees no top whose spin the drive could be set to: put the top back first")
        if self._set.output:
            raise CommandRefused(
                "the drive is on, and changes its frequency only slowly, so it cannot be set to the spin at once: "
                "switch it off, then match"
            )
        self.tune(TuneDrive(frequency_hz=round(spin, 2)))
        self._is_matched = True

    def tune(self, command: TuneDrive) -> None:
        """Change what the command names."""
        changes = command.model_dump(exclude={"do", "ramp_hz_per_s"}, exclude_none=True)
        before, wanted = self._set, replace(self._set, **changes)
        self._check(wanted)
        self._set, self._ramp_hz_per_s = wanted, command.ramp_hz_per_s or self._ramp_hz_per_s
        self._is_matched = self._is_matched and wanted.frequency_hz == before.frequency_hz
        if wanted.output and wanted.waveform != before.waveform:
            self._switch_on(self.frequency)
        elif wanted.output and command.amplitude_vpp is not None:
            self.generator.amplitude = wanted.amplitude_vpp

    def switch(self, spin: float | None, *, on: bool) -> None:
        """Switch the output; near the spin that was counted last [Hz] it takes hold of the top."""
        if not on:
            self._switch_off()
            self._voice.text = ""
        if self._set.output == on:
            return
        self._check(self._set)
        self._set = replace(self._set, output=True)
        hz = self._set.frequency_hz
        if spin is not None and (self._is_matched or abs(spin - hz) <= _CATCHES_WITHIN_HZ):
            self._is_matched = False
            self._take_hold(spin)
            return
        self._switch_on(hz)
        beside = "the counter sees no top" if spin is None else Text("the top spins at {spin:.2f} Hz", spin=spin)
        takes = "it takes hold of one that spins as fast"
        far = Text("drive on at {hz:g} Hz, but {beside}: {takes}", hz=hz, beside=beside, takes=takes)
        self._voice.say(far, Text("the drive holds no top: {takes}", takes=takes))

    def _check(self, wanted: Drive) -> None:
        """Raise CommandRefused beyond the limits of the bench."""
        limits = self._limits.of_the_drive()
        found = limits.beyond(frequency_hz=wanted.frequency_hz, amplitude_vpp=wanted.amplitude_vpp)
        if found:
            unit = "Vpp" if found.name == "drive_amplitude_vpp" else "Hz"
            allowed = "at most" if found.is_highest else "at least"
            raise CommandRefused(
                "{value:g} {unit}: the coil of this bench stands {allowed} {limit:g} {unit}",
                value=found.value,
                unit=unit,
                allowed=allowed,
                limit=found.limit,
            )

    def _switch_on(self, frequency: float) -> None:
        volts = self._set.amplitude_vpp
        self.generator.prepare(waveform=self._set.waveform, frequency_hz=frequency, amplitude_vpp=volts)
        self.generator.output = True
        self._moved = self._now()

    def _switch_off(self) -> None:
        if self.bench:
            self.bench.outputs_off()
        self._hold, self._set = None, replace(self._set, output=False)

    # --- what the drive does by itself ---

    def move(self) -> None:
        """Move the frequency towards its goal, as far as the ramp has gone since the last move."""
        since = self._now() - self._moved
        if self.bench is None or not self._set.output or self.yields or since < _RAMP_STEP_S:
            return
        self._moved += since
        here = self.frequency
        way = self._set.frequency_hz - here
        if not way:
            return
        step = math.copysign(min(abs(way), self._ramp_hz_per_s * since), way)
        with contextlib.suppress(InstrumentError):  # the virtual one is always there; the next step comes
            self.generator.frequency = round(here + step, 6)

    def lose(self) -> str:
        """Take note that the top has fallen.  Returns how the drive held it by then."""
        hold, self._hold = self._hold, None
        if hold is None:
            beside = ", beside a drive at {hz:.1f} Hz that did not hold it"
            return Text(beside, hz=self.output_hz) if self.output_hz else ""
        return ", after its drive had lost it" if hold.is_lost else ", where its drive held it"

    def take_count(self, spin: float | None) -> None:
        """Go on with taking hold of the top, or see whether it follows, just after a count.

        Args:
            spin: that was counted [Hz]; None: no light pulses.
        """
        hold = self._hold
        if self._is_matched and spin is not None:  # it is still off, and the top gets slower meanwhile
            self._set = replace(self._set, frequency_hz=round(spin, 2))
        if hold is None or hold.is_lost:
            return
        if hold.since is None:
            self._yield(hold, spin)
        elif self._now() - hold.since >= _COMPARED_S:
            self._compare(hold, spin)

    def _take_hold(self, spin: float) -> None:
        self._switch_on(spin)
        limits = self.generator.limits
        self._hold = Hold(self._set.frequency_hz, Grip(spin, limits.drive_lowest_hz, limits.drive_frequency_hz))
        self._voice.say(
            "drive on at the top's spin: its frequency follows the top for at most 20 s, then the top follows the drive"
        )

    def _yield(self, hold: Hold, spin: float | None) -> None:
        grip = hold.grip
        self.generator.frequency = grip.follow(spin)
        if grip.is_lost:
            self._give_up()
        elif grip.is_over:
            hold.since = self._moved = self._now()
        if self._set.frequency_hz == hold.asked_hz:  # else a person has tuned it on meanwhile
            hold.asked_hz = grip.drive
            self._set = replace(self._set, frequency_hz=grip.drive)

    def _compare(self, hold: Hold, spin: float | None) -> None:
        """Compare the spin with the drive: it follows, was tuned up, or was lost."""
        drive, say = self.frequency, self._voice.say
        off = math.inf if spin is None else abs(spin - drive)
        if hold.at_hz is None:
            if off > _SWINGS_HZ:
                self._give_up()
                return
            hold.at_hz, self.took_hold = drive, True
            say(Text("the top follows the drive at {drive:.2f} Hz", drive=drive), "the top follows the drive")
        elif off > _LOST_HZ:
            hold.is_lost = True
            again = _AGAIN[int(np.sign(self._set.frequency_hz - drive))]
            say(Text("the drive has lost the top near {drive:.1f} Hz: {again}", drive=drive, again=again))
        elif off <= _SWINGS_HZ and drive >= hold.at_hz + _TUNED_UP_HZ and not self.tuned_up:
            self.tuned_up = True
            say("the top follows the drive up", "the top follows the drive")

    def _give_up(self) -> None:
        self._switch_off()
        self._voice.say("the drive does not hold the top, and is off: match the spin, and drive with more volts")

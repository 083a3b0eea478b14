"""A simulated motion in a few numbers: its end, heights, spin, lines and errors."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from levilab.errors import unquote
from levilab.files import finite
from levilab.motion.lines import LONGEST_S, AxisLines, lines_of, rate_for
from levilab.motion.lock import is_locked
from levilab.present.numbers import with_decimals
from levilab.simulator.equilibrium import advice, stability_of
from levilab.simulator.scene import Scene, remarks
from levilab.simulator.trajectory import Accuracy, Trajectory
from levilab.texts.text import Text

#: A smaller error at the end [m, rad] shows in no figure.
SMALL = 1e-5

#: A relative change of the spin below this is rounding.
CONSTANT = 1e-9
#: A spin swings if it leaves the range between its start and its end by more than this [Hz].
SWINGS_HZ = 0.002

FALLS = {"radius": "drifted out to {cm:.3g} cm from the axis", "height": "came down to {cm:.3g} cm"}
#: How a motion ended; how is one of FALLS.  A top that drifts out has not fallen yet.
ENDINGS = {"radius": "was lost after {s:.4g} s: it {how}", "height": "fell after {s:.4g} s: it {how}"}


@dataclass(frozen=True)
class Summary:
    """A motion in a few numbers.

    Attributes:
        motion: the whole of it.
        duration: as the user wants it [s].
        rate: states kept per second [1/s].
        computing: the time that the computation took [s].
        lines: of the axis.
        energy_change: greatest departure from the energy at the start, relative to that.
        notes: sentences that a reader should know.
    """

    motion: Trajectory
    duration: float
    rate: float
    computing: float
    lines: AxisLines
    energy_change: float
    notes: tuple[str, ...]

    @property
    def end(self) -> float:
        """The time at which it ended [s]: the duration, or the fall."""
        return float(self.motion.time[-1])

    @property
    def speed(self) -> float:
        """How many times faster than the real top the simulation ran."""
        return self.end / max(self.computing, 1e-9)

    @property
    def heights(self) -> str:
        """The range of the heights as text; a zero has no sign."""
        height = 100 * self.motion.position[:, 2]
        low, high, mean = (with_decimals(x, 3) for x in (height.min(), height.max(), height.mean()))
        return Text("{low:n} to {high:n} cm, mean {mean:n} cm", low=low, high=high, mean=mean)

    @property
    def fell(self) -> str:
        """The description of the fall; empty if the top did not fall."""
        if self.motion.fell is None:
            return ""
        escape = self.motion.scene.escape
        limit = {"radius": escape.radius_m, "height": escape.height_m}[self.motion.fell.name]
        return Text(FALLS[self.motion.fell.name], cm=100 * limit)

    @property
    def ending(self) -> str:
        """The description of the motion's end."""
        if self.motion.scene.observed == "spin":
            return Text("the spin alone, {s:g} s", s=self.end)
        if self.motion.fell is None:
            return Text("stayed up for {s:g} s", s=self.end)
        return Text(ENDINGS[self.motion.fell.name], s=self.end, how=self.fell)

    @property
    def spin(self) -> str:
        """The spin as text, with range and mean where start and end do not show them."""
        spin = self.motion.spin_hz
        first, last, low, high = (float(x) for x in (spin[0], spin[-1], spin.min(), spin.max()))
        if high - low <= CONSTANT * abs(first):
            return Text("constant, {hz:n} Hz", hz=with_decimals(first, 3))
        said = start_and_end(first, last)
        if high - low <= abs(last - first) + SWINGS_HZ:
            return said
        lowest, highest, mean = (with_decimals(x, 3) for x in (low, high, spin.mean()))
        return Text("{said}; {low:n} to {high:n} Hz, mean {mean:n} Hz", said=said, low=lowest, high=highest, mean=mean)


def start_and_end(first: float, last: float) -> str:
    """Return a spin at the start and at the end [Hz] as text."""
    said = "{first:n} Hz at the start, {last:n} Hz at the end"
    return Text(said, first=with_decimals(first, 3), last=with_decimals(last, 3))


def summarise(
    motion: Trajectory, duration: float, rate: float, computing: float, *, uses_states: bool = True
) -> Summary:
    """Summarise a motion.

    Args:
        motion: the whole of it.
        duration: as the user wants it [s].
        rate: states kept per second [1/s].
        computing: the time that the computation took [s].
        uses_states: whether the states at this rate are used, where too low a rate shows lines elsewhere.
    """
    energy = motion.energies
    change = float(np.max(np.abs(energy - energy[0]))) / (abs(float(energy[0])) or 1.0)
    lines = lines_of(motion)
    if motion.fell is not None and not any(line.name for line in lines.lines):
        lines = replace(lines, lines=())
    notes = _notes(motion, lines, rate if uses_states else math.inf)
    return Summary(motion, duration, rate, computing, lines, change, tuple(notes))


def changing_energy(scene: Scene) -> tuple[str, ...]:
    """Return names of the effects that change the energy in a scene; empty if the energy is conserved."""
    there = {
        "drag": scene.drag.law != "none" and any(scene.drag.constants),
        "drive": scene.drive.waveform != "off" and scene.drive.amplitude_t > 0,
        "friction of the washers": scene.washers.inertia_kg_m2 > 0,
    }
    return tuple(name for name, is_there in there.items() if is_there)


def _why_no_lines(motion: Trajectory, lines: AxisLines) -> str:
    end, states = float(motion.time[-1]), motion.time.size
    if motion.scene.observed == "spin":
        return "the spin alone is simulated, and the lines are those of the axis"
    if lines.signal is not None and motion.fell is not None:
        return "the top falls, and its axis has none of the frequencies of small motions"
    if lines.signal is not None:
        return "the axis stands still"
    if (states - 1) < end * rate_for(motion.scene) / 2:
        return Text("{states} states in {end:.3g} s are too few for a spectrum", states=states, end=end)
    if motion.fell is not None:
        return Text("the top was up for {end:.3g} s only, which is too short; 2 s would be enough", end=end)
    return Text("{end:.3g} s are too short; 2 s are enough, and 10 s give a resolution of 0.2 Hz", end=end)


def _notes(motion: Trajectory, lines: AxisLines, rate: float) -> list[str]:
    accuracy, notes = motion.accuracy, remarks(motion.scene)
    if not accuracy.reached:
        notes.append(_not_reached(accuracy))
    if motion.fell is not None:
        found = stability_of(motion.scene)
        notes += [] if found.floating else [advice(found)]
    highest = max((abs(line.frequency) for line in lines.lines), default=0.0)
    if highest > rate / 2:
        note = (
            "{rate:g} states per second are less than twice the highest line, {highest:.3g} Hz: the lines here come "
            "from more of them, but the states show it elsewhere; take `rate` = {more}"
        )
        notes.append(Text(note, rate=rate, highest=highest, more=math.ceil(3 * highest / 10) * 10))
    if not lines.lines and motion.scene.observed == "motion":
        notes.append(Text("no lines of the axis: {why}", why=_why_no_lines(motion, lines)))
    if lines.lines and lines.until < 0.99 * min(float(motion.time[-1]), LONGEST_S):
        note = "the lines are those of the first {s:.3g} s: later the changing spin moves them beyond their resolution"
        notes.append(Text(note, s=lines.until))
    return notes


def _not_reached(accuracy: Accuracy) -> str:
    worst = max(accuracy.position, accuracy.axis)
    if accuracy.nodes > worst / 2:
        said = (
            "the tolerance of {tolerance:g} was not reached: the magnet came so near to the base that the nodes it is "
            "averaged over leave an error of {error:.1g}; end at a greater escape.height_m"
        )
        return Text(said, tolerance=accuracy.tolerance, error=accuracy.nodes)
    said = (
        "the tolerance of {tolerance:g} was not reached, and shorter steps do not help: rounding, magnified by the "
        "motion, leaves {error:.1g}"
        if worst < SMALL
        else "the tolerance of {tolerance:g} was not reached, and shorter steps do not help: this motion is chaotic.  "
        "How such a top moves is right; where exactly it is at a late moment, and when exactly it falls, depends on "
        "the last digit of its start"
    )
    return Text(said, tolerance=accuracy.tolerance, error=worst)


def as_document(summary: Summary) -> dict[str, Any]:
    """Return the summary for programs, with units in the names; a value that is not finite is null."""
    motion = summary.motion
    height, accuracy, fell = motion.position[:, 2], motion.accuracy, motion.fell
    has_washers = motion.scene.washers.inertia_kg_m2 > 0
    document = {
        "scene": motion.scene.name,
        "survived": motion.survived,
        "fell": None if fell is None else {"how": fell.name, "text": summary.fell, "time_s": fell.time},
        "duration_s": summary.duration,
        "end_s": summary.end,
        "height_mean_m": float(height.mean()),
        "height_min_m": float(height.min()),
        "height_max_m": float(height.max()),
        "distance_from_axis_max_m": float(np.hypot(*motion.position[:, :2].T).max()),
        "tilt_max_rad": float(motion.tilt.max()),
        "spin_start_hz": float(motion.spin_hz[0]),
        "spin_end_hz": float(motion.spin_hz[-1]),
        "spin_mean_hz": float(motion.spin_hz.mean()),
        "spin_min_hz": float(motion.spin_hz.min()),
        "spin_max_hz": float(motion.spin_hz.max()),
        "locked": is_locked(motion.scene, motion.states, survived=motion.survived),
        **({"washer_spin_end_hz": float(motion.washer_spin_hz[-1])} if has_washers else {}),
        "energy_conserved": not changing_energy(motion.scene),
        "energy_change_relative": summary.energy_change,
        "lines": [
            {"frequency_hz": line.frequency, "amplitude_rad": line.amplitude, "name": line.name}
            for line in summary.lines.lines
        ],
        "no_lines_because": None if summary.lines.lines else _why_no_lines(motion, summary.lines),
        "line_resolution_hz": summary.lines.resolution,
        "lines_until_s": summary.lines.until,
        "position_error_m": float(accuracy.position),
        "axis_error_rad": float(accuracy.axis),
        "tolerance": accuracy.tolerance,
        "tolerance_reached": accuracy.reached,
        "scheme": accuracy.scheme,
        "step_s": float(accuracy.step),
        "steps": accuracy.steps,
        "computing_time_s": summary.computing,
        "times_real_time": summary.speed,
        "notes": [unquote(note) for note in summary.notes],
    }
    return {key: finite(value) for key, value in document.items()}

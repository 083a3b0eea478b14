"""The lines of a motion: the spectrum of the axis, n_x + i n_y, and what each of its lines is."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from analysis.arrays import Array
from analysis.lines import FEWEST, LOBE, Line, Signal, amplitude_spectrum, lines_of_signals
from levilab.motion.lock import keeps_phase
from levilab.simulator.energy import spin_of
from levilab.simulator.equilibrium import modes_at
from levilab.simulator.kernels.motion import TIME, N, R
from levilab.simulator.numbers import largest
from levilab.simulator.scene import Scene
from levilab.simulator.trajectory import Trajectory
from levilab.texts.text import Text

#: A line gets the name of a theoretical one within NEAR_HZ plus this share of its frequency: amplitudes of some tenths
#: of a radian shift a line that far.
NEAR_HZ, NEAR_SHARE = 0.1, 0.06
#: A line within this distance of a stronger, named one is its sideband [Hz].
SIDEBAND_HZ = 2.0
#: In a shorter motion lines cannot be distinguished [s]; of a longer one this part shows them all, and the rest would
#: only broaden lines that are never quite steady.
SHORTEST_S, LONGEST_S = 1.0, 300.0
#: The most lines to show, and the amplitude of the weakest relative to the strongest.
MOST, WEAKEST = 16, 0.01


@dataclass(frozen=True)
class NamedLine:
    """A line of n_x + i n_y.

    Attributes:
        frequency: [Hz], positive in the sense of a positive spin.
        amplitude: [rad].
        name: of the motion that makes it; empty if not known.
        sideband: whether it stands beside a stronger line that has a name.
    """

    frequency: float
    amplitude: float
    name: str
    sideband: bool = False


@dataclass(frozen=True)
class AxisLines:
    """The lines of the axis.

    Attributes:
        lines: the strongest first.
        resolution: closer lines are not distinguished [Hz].
        until: end of the time from which they come [s]; before the motion's end if that is longer than LONGEST_S, or if
            the spin changes so much that the lines would wander.
        signal: from which they come, and its samples per second [Hz]; None where there is none.
    """

    lines: tuple[NamedLine, ...] = ()
    resolution: float = math.inf
    until: float = 0.0
    signal: tuple[Signal, float] | None = None

    @cached_property
    def spectrum(self) -> tuple[Array, Array] | None:
        """Frequencies [Hz] and amplitudes [rad]; None where there is none."""
        return None if self.signal is None else amplitude_spectrum(*self.signal)


def rate_for(scene: Scene) -> Any:
    """Return the samples per second for a spectrum: four times nutation plus spin, which leaves room for sidebands."""
    spin = abs(scene.start.spin_hz)
    turning = largest(spin, scene.drive.frequency_hz) if scene.drive.is_periodic else spin
    return 4 * (turning + spin * _flatness(scene)) + 40.0


def lines_of(motion: Trajectory) -> AxisLines:
    """Find the lines of a motion that is sampled evenly, except for its last sample."""
    return lines_of_many([(motion.scene, motion.states)])[0]


def lines_of_many(motions: Sequence[tuple[Scene, Array]]) -> list[AxisLines]:
    """Find the lines of motions: scene and states, shape (n, 18), sampled evenly except for the last.

    Those of one length go through the transform side by side; what is found in a motion depends on it alone.
    """
    found = [AxisLines()] * len(motions)
    alike: dict[tuple[int, float], list[tuple[int, Signal, Array]]] = {}
    for i, (scene, states) in enumerate(motions):
        signal, rate, spin = _signal_of(scene, states)
        if signal.size:
            alike.setdefault((signal.size, rate), []).append((i, signal, spin))
    for (n, rate), several in alike.items():
        signals = np.array([signal for _, signal, _ in several])
        for (i, signal, spin), lines in zip(
            several, lines_of_signals(signals, rate, most=MOST, weakest=WEAKEST), strict=True
        ):
            named = _name_lines(lines.lines, *motions[i], spin, lines.resolution)
            found[i] = AxisLines(named, lines.resolution, n / rate, (signal, rate))
    return found


def _signal_of(scene: Scene, states: Array) -> tuple[Signal, float, Array]:
    """Return n_x + i n_y of the time whose lines are looked for, its samples per second [Hz], and its spins [Hz].

    The signal is empty where no line can be found.
    """
    nothing, time = np.empty(0, dtype=np.complex128), states[:-1, TIME]
    if time.size < FEWEST or time[-1] - time[0] < SHORTEST_S or scene.observed == "spin":
        return nothing, 0.0, np.empty(0)
    rate = (time.size - 1) / float(time[-1] - time[0])
    if rate < rate_for(scene) / 2:  # too few samples: lines would be seen at other frequencies than their own
        return nothing, 0.0, np.empty(0)
    spin = spin_of(scene, states) / (2 * np.pi)
    n = max(round(min(_steady_time(scene, states[:, TIME], spin), LONGEST_S) * rate), FEWEST)
    axis = states[:-1, N][:n]
    return axis[:, 0] + 1j * axis[:, 1], rate, spin[:n]


def _flatness(scene: Scene) -> Any:
    return scene.top.inertia_axial_kg_m2 / scene.top.inertia_transverse_kg_m2


def _steady_time(scene: Scene, time: Array, spin: Array) -> float:
    """Return the time from the start in which no line wanders farther than the resolution [s].

    The nutation's frequency is I₃/I₁ times the spin.  At a chirp c it moves by c I₃/I₁ T in a time T, and the
    resolution is LOBE/T.  A spin that swings to and fro, as that of a locked top, counts as steady: its lines have
    sidebands.
    """
    if time.size < 3 or time[-1] == time[0]:
        return float(time[-1])
    away = time - time.mean()
    chirp = float((away * spin).sum() / (away * away).sum())
    swing = float(np.std(spin - chirp * away))
    if abs(chirp) * (time[-1] - time[0]) < 4 * swing or chirp == 0:
        return float(time[-1])
    return math.sqrt(LOBE / (abs(chirp) * _flatness(scene)))


# --- names ---


def _name_lines(
    lines: tuple[Line, ...], scene: Scene, states: Array, spin: Array, resolution: float
) -> tuple[NamedLine, ...]:
    expected = _expected_lines(scene, states, spin)
    names: dict[int, str] = {}
    for what, place in expected.items():
        width = resolution / 2 if what == "drive" else NEAR_HZ + NEAR_SHARE * abs(place)
        near = [i for i, line in enumerate(lines) if abs(line.frequency - place) <= width and i not in names]
        # the strongest comes first; if its sidebands are as strong, the line is the one in their middle
        strong = [i for i in near if lines[i].amplitude > lines[near[0]].amplitude / 2]
        if strong:
            names[min(strong, key=lambda i: abs(lines[i].frequency - place))] = what
    known = dict(names)
    for i, line in enumerate(lines):
        strong = [k for k in known if abs(lines[k].frequency - line.frequency) <= SIDEBAND_HZ]
        if i not in names and strong:
            k = min(strong, key=lambda k: abs(lines[k].frequency - line.frequency))
            away = line.frequency - lines[k].frequency
            beside = "{name} − {away:.3g} Hz" if away < 0 else "{name} + {away:.3g} Hz"
            names[i] = Text(beside, name=known[k], away=abs(away))
    return tuple(
        NamedLine(line.frequency, line.amplitude, names.get(i, ""), sideband=i in names and i not in known)
        for i, line in enumerate(lines)
    )


def _expected_lines(scene: Scene, states: Array, spin: Array) -> dict[str, float]:
    """Return name → frequency [Hz] by the theory of small motions: drive, wobble of a tilted moment, four modes."""
    places: dict[str, float] = {}
    if scene.drive.is_periodic and scene.drive.amplitude_t > 0:
        places["drive"] = math.copysign(scene.drive.frequency_hz, scene.start.spin_hz)
    if not scene.top.aligned and not keeps_phase(scene, states):  # otherwise the wobble is the drive's line
        places["wobble, once a turn"] = float(spin.mean())
    return places | _modes(scene, float(np.mean(states[:, R.stop - 1])), float(spin[0]))


def _modes(scene: Scene, height: float, spin: float) -> dict[str, float]:
    """Return the modes [Hz] of small motions about a mean height [m] at a spin [Hz]; none if they are not stable."""
    modes = modes_at(scene, height, spin)
    if np.abs(modes.imag).max() > 1e-6 * np.abs(modes).max():
        return {}  # the lines are other than these
    slow1, slow2, precession, nutation = sorted(modes.real, key=abs)
    return {"nutation": nutation, "precession": precession, "swing sideways": slow2, "swing sideways, backwards": slow1}

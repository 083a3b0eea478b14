"""The lines of a motion: the spectrum of the axis, n_x + i n_y, and what each of its lines is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from analysis.lines import FEWEST, LOBE, amplitude_spectrum, spectral_lines
from levilab.simulator.equilibrium import modes_at

if TYPE_CHECKING:
    from analysis.lines import Line
    from levilab.simulator.scene import Scene
    from levilab.simulator.trajectory import Trajectory

Array = NDArray[np.float64]

#: A line is called what theory has within so much of it: amplitudes of some tenths of a radian move a line by that.
NEAR_HZ, NEAR_SHARE = 0.1, 0.06
#: A line so near to a stronger one that has a name is a sideband of it [Hz].
SIDEBAND_HZ = 2.0
#: A spin that is on the average this far from the drive's frequency is not locked to it.
UNLOCKED_HZ = 0.5
#: A motion shorter than this has no lines that could be distinguished [s]; of one longer than this a part shows them
#: all, and more of it only breaks up lines that are never quite steady.
SHORTEST_S, LONGEST_S = 1.0, 300.0
#: Lines that are worth showing, and the weakest of them in parts of the strongest.
MOST, WEAKEST = 16, 0.01


@dataclass(frozen=True)
class NamedLine:
    """A line of n_x + i n_y: [Hz], above 0 in the sense of a spin above 0; [rad]; what it is, empty if not known.

    sideband: whether it stands beside a stronger line that has a name.
    """

    frequency: float
    amplitude: float
    name: str
    sideband: bool = False


@dataclass(frozen=True)
class AxisLines:
    """The axis's lines, strongest first, from the start until `until` [s]; lines nearer than resolution [Hz] are one.

    until is before the end where the motion is longer than LONGEST_S, or the spin changes so much that the lines
    would wander.
    """

    lines: tuple[NamedLine, ...] = ()
    resolution: float = math.inf
    until: float = 0.0
    spectrum: tuple[Array, Array] | None = None


def rate_for(scene: Scene) -> float:
    """Samples per second [1/s] for a spectrum: four times nutation and spin together, sidebands fit in."""
    spin = abs(scene.start.spin_hz)
    turning = max(spin, scene.drive.frequency_hz if scene.drive.waveform != "off" else 0.0)
    return 4 * (turning + spin * _flatness(scene)) + 40.0


def lines_of(motion: Trajectory) -> AxisLines:
    """The lines of a motion that is sampled evenly but for its end."""
    time, axis = motion.time[:-1], motion.axis[:-1]
    if time.size < FEWEST or time[-1] - time[0] < SHORTEST_S or motion.scene.observed == "spin":
        return AxisLines()
    rate = (time.size - 1) / float(time[-1] - time[0])
    if rate < rate_for(motion.scene) / 2:  # too few samples: lines would be seen at other frequencies than their own
        return AxisLines()
    n = max(round(min(_steady_time(motion), LONGEST_S) * rate), FEWEST)
    signal = (axis[:, 0] + 1j * axis[:, 1])[:n]
    found = spectral_lines(signal, rate, most=MOST, weakest=WEAKEST)
    named = _named(found.lines, motion, found.resolution)
    return AxisLines(named, found.resolution, len(signal) / rate, amplitude_spectrum(signal, rate))


def _flatness(scene: Scene) -> float:
    return scene.top.inertia_axial_kg_m2 / scene.top.inertia_transverse_kg_m2


def _steady_time(motion: Trajectory) -> float:
    """So long from the start [s] no line wanders farther than lines are told apart.

    Nutation follows the spin with the factor I₃/I₁: at a chirp c it moves by c I₃/I₁ T, and LOBE/T are told apart.
    A spin that only swings to and fro, as a locked one does, counts as steady: its lines have sidebands.
    """
    time, spin = motion.time, motion.spin_hz
    if time.size < 3 or time[-1] == time[0]:
        return float(time[-1])
    chirp, level = np.polyfit(time - time[0], spin, 1)
    swing = float(np.std(spin - chirp * (time - time[0]) - level))
    if abs(chirp) * (time[-1] - time[0]) < 4 * swing or chirp == 0:
        return float(time[-1])
    return math.sqrt(LOBE / (abs(chirp) * _flatness(motion.scene)))


# --- names ---


def _named(lines: tuple[Line, ...], motion: Trajectory, resolution: float) -> tuple[NamedLine, ...]:
    expected = _expected(motion)
    names: dict[int, str] = {}
    for what, place in expected.items():
        width = resolution / 2 if what == "drive" else NEAR_HZ + NEAR_SHARE * abs(place)
        near = [i for i, line in enumerate(lines) if abs(line.frequency - place) <= width and i not in names]
        # the strongest first; a line that has as strong sidebands is the one in their middle
        strong = [i for i in near if lines[i].amplitude > lines[near[0]].amplitude / 2]
        if strong:
            names[min(strong, key=lambda i: abs(lines[i].frequency - place))] = what
    known = dict(names)
    for i, line in enumerate(lines):
        strong = [k for k in known if abs(lines[k].frequency - line.frequency) <= SIDEBAND_HZ]
        if i not in names and strong:
            k = min(strong, key=lambda k: abs(lines[k].frequency - line.frequency))
            away = line.frequency - lines[k].frequency
            names[i] = f"{known[k]} {'−' if away < 0 else '+'} {abs(away):.3g} Hz"
    return tuple(
        NamedLine(line.frequency, line.amplitude, names.get(i, ""), sideband=i in names and i not in known)
        for i, line in enumerate(lines)
    )


def _expected(motion: Trajectory) -> dict[str, float]:
    """Where theory has lines [Hz], for small motions: the drive, the wobble of a tilted moment, and four modes."""
    scene = motion.scene
    places: dict[str, float] = {}
    if scene.drive.waveform != "off" and scene.drive.amplitude_t > 0:
        places["drive"] = math.copysign(scene.drive.frequency_hz, scene.start.spin_hz)
    spin = float(motion.spin_hz.mean())
    locked = abs(spin - places.get("drive", math.inf)) < UNLOCKED_HZ  # then the wobble is the drive's line
    if not scene.top.aligned and not locked:
        places["wobble, once a turn"] = spin
    return places | _modes(motion)


def _modes(motion: Trajectory) -> dict[str, float]:
    """The modes of small motions about the mean height; none where they are not stable."""
    scene = motion.scene
    height, spin = float(np.mean(motion.position[:, 2])), float(motion.spin_hz[0])
    modes = modes_at(scene, height, spin)
    if np.abs(modes.imag).max() > 1e-6 * np.abs(modes).max():
        return {}  # whatever lines there are, they are not these
    slow1, slow2, precession, nutation = sorted(modes.real, key=abs)
    return {
        "nutation": nutation,
        "precession": precession,
        "swing sideways": slow2,
        "swing sideways, backwards": slow1,
    }

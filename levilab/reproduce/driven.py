"""The driven top: its spin swings about the drive's frequency, and its φ̇ looks chaotic though the motion is not."""

import math
from functools import partial

import numpy as np

from analysis.arrays import Array
from levilab.motion.lines import AxisLines, lines_of
from levilab.motion.lock import is_locked
from levilab.present.document.blocks import Note, Picture
from levilab.present.numbers import with_decimals
from levilab.reproduce.check import Finding, Found, Within, check, statement
from levilab.reproduce.figure import azimuth_figure, driven_figure
from levilab.reproduce.tops import THESIS, simulate_for_lines
from levilab.simulator.scene import preset
from levilab.simulator.trajectory import Trajectory

#: Distances from a line within which the power of the axis is counted [Hz].
NEAR_LINES_HZ = (0.1, 1.0)
#: The run is as long as the thesis's [s]; its first part, for a spectrum with two digits, is shorter.
RUN_S, WINDOW_S = THESIS["driven.duration"].value, 30.0


def azimuth_rate(motion: Trajectory) -> Array:
    """Return φ̇/2π from the state, shape (n,) [Hz]: φ̇ = (n × ṅ)_z/sin²θ, ṅ = L × n/I₁; no sampling falsifies it."""
    n, momentum = motion.axis, motion.angular_momentum
    turning = np.cross(momentum, n) / motion.scene.top.inertia_transverse_kg_m2
    across = n[:, 0] ** 2 + n[:, 1] ** 2
    return np.asarray((n[:, 0] * turning[:, 1] - n[:, 1] * turning[:, 0]) / across / (2 * math.pi))


def wave(lines: AxisLines, name: str) -> float:
    """Return the frequency of the line with a name [Hz], NaN without one."""
    return next((line.frequency for line in lines.lines if line.name == name), math.nan)


def sideband(lines: AxisLines) -> float:
    """Return the distance of the sidebands next to the drive's line [Hz]: the spin's swing about the drive."""
    drive = wave(lines, "drive")
    return min(
        (abs(line.frequency - drive) for line in lines.lines if line.name.startswith("drive ")), default=math.nan
    )


def of_spin(motion: Trajectory, lines: AxisLines) -> list[Finding]:
    """Compare the spin of the run."""
    spin, drive = motion.spin_hz, THESIS["driven.drive"]
    turns = float(np.trapezoid(spin, motion.time)) / float(motion.time[-1])
    locked = is_locked(motion.scene, motion.states, survived=motion.survived)
    early = lines_of(simulate_for_lines(motion.scene, WINDOW_S))
    precession = wave(early, "precession")
    return [
        statement(
            "the top is locked",
            THESIS["driven.duration"].place,
            f"the spin oscillates about ν_d for {RUN_S:g} s and more",
            f"up after {motion.time[-1]:g} s, {'locked' if locked else 'not locked'}; spin from {spin.min():.2f} to "
            f"{spin.max():.2f} Hz",
            holds=motion.survived and bool(locked),
        ),
        check(
            "mean of the spin ω₃/2π",
            drive,
            turns,
            Within(
                0.1,
                "the body turns about the vertical as the drive does; ω₃ is that rate times cos θ, here lower by "
                f"{1e3 * (drive.value - turns):.0f} mHz on the average",
            ),
        ),
        check(
            "line of n_x + i n_y at the drive, which a laser beside the stem counts",
            drive,
            wave(lines, "drive"),
            u=lines.resolution / 2,
        ),
        check(
            f"free precession, in the first {WINDOW_S:g} s",
            THESIS["driven.precession"],
            precession,
            u=early.resolution / 2,
        ),
        check(
            "distance of the sidebands, the spin's swing about the drive",
            THESIS["driven.sideband"],
            sideband(lines),
            Within(
                1 / WINDOW_S,
                f"a bin of a record of {WINDOW_S:g} s is {1e3 / WINDOW_S:.0f} mHz wide; the place of a line between "
                "bins is found here",
            ),
        ),
    ]


def power_near(lines: AxisLines, width: float) -> float:
    """Return the share of the power of n_x + i n_y within a distance [Hz] of a line; NaN without a spectrum."""
    if lines.spectrum is None:
        return math.nan
    frequency, amplitude = lines.spectrum
    named = np.array([line.frequency for line in lines.lines if line.name])
    near = np.abs(frequency[:, None] - named).min(axis=1, initial=math.inf) <= width
    return float(np.sum(amplitude[near] ** 2) / np.sum(amplitude**2))


def of_azimuth(rate: Array, tilt: Array, lines: AxisLines) -> list[Finding]:
    """Explain why φ̇ looks chaotic, and the spectrum does not, from φ̇/2π [Hz] and θ [rad], shape (n,)."""
    named = [line for line in lines.lines if line.name]
    beyond = (rate > max(line.frequency for line in named)) | (rate < 0)
    tilt_then, tilt_ever = float(np.median(tilt[beyond])), float(np.median(tilt))
    power = sum(line.amplitude**2 for line in named)
    all_power = float(np.mean(np.abs(lines.signal[0]) ** 2)) if lines.signal else math.nan
    near = {width: power_near(lines, width) for width in NEAR_LINES_HZ}
    parts = ", ".join(f"{100 * share:.1f} % lie within {width:g} Hz" for width, share in near.items())
    return [
        statement(
            "φ̇ of the driven top",
            "figure of the driven precession",
            "φ̇ looks chaotic",
            f"φ̇/2π from {with_decimals(float(rate.min()), 0)} to {rate.max():.0f} Hz, far beyond any "
            "frequency of the axis",
            holds=bool(rate.max() > 100 and rate.min() < -20),
        ),
        statement(
            "its irregularity comes from passages near θ = 0",
            "figure of the driven precession",
            "",
            f"φ̇ is beyond the nutation or backwards {100 * beyond.mean():.0f} % of the time; the median tilt is then "
            f"{1e3 * tilt_then:.0f} mrad, and {1e3 * tilt_ever:.0f} mrad at all times",
            holds=tilt_then < 0.7 * tilt_ever,
        ),
        statement(
            "n_x + i n_y of the same run keeps to lines",
            "figure of the driven precession",
            "",
            f"{len(named)} steady lines, each with a name, hold {100 * power / all_power:.0f} % of its power; of all "
            f"of it {parts} of them. Whether what the lines do not hold is further sidebands or lines that wander is "
            "not distinguished",
            holds=power > 0.8 * all_power and near[NEAR_LINES_HZ[-1]] > 0.99,
        ),
    ]


def make() -> Found:
    """Make the chapter."""
    motion = simulate_for_lines(preset("driven"), RUN_S)
    lines = lines_of(motion)
    rate = azimuth_rate(motion)
    pictures = (
        Picture(
            "driven",
            "The spin of a locked top swings about its drive.",
            "Spin ω₃/2π of the thesis's driven top (ν₀ = 30.03 Hz, ν_d = 30 Hz, 24.45 g, 0.4 mT), as the band between "
            "its least and greatest values over the whole run, and its first 20 s below; dashed: the drive.",
            "Spin of the driven top over 300 s",
            partial(driven_figure, motion),
        ),
        Picture(
            "azimuth",
            "The azimuth's rate is wild, the axis is not.",
            "Above: φ̇/2π over five seconds, cut at ±120 Hz, and its values over the tilt θ at the same time: large "
            "where θ is small, since the azimuth turns by half a turn when the axis passes the vertical. Below: the "
            "spectrum of n_x + i n_y of the whole run, with the names of its lines.",
            "Rate of the azimuth over time and tilt, and the spectrum of the axis",
            partial(azimuth_figure, motion, rate, lines),
            raster=True,
        ),
    )
    note = Note(
        "The azimuth φ is undefined at θ = 0, where the top lives; n_x + i n_y is smooth there. A rate of φ is a "
        "property of the coordinate, not of the motion."
    )
    said = "The thesis's driven run, 300 s without drag, with the moment tilted by 1.77°."
    return Found((*of_spin(motion, lines), *of_azimuth(rate, motion.tilt, lines)), (*pictures, note), said)

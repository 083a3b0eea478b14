"""Make docs/pictures/fall.gif: a drive takes hold of the top, lets it go, and the top falls.

At the left the top, at the right its spin and the drive, at five times the real speed, the fall in slow motion.

python docs/pictures/fall.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from PIL import Image

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT)]
mpl.use("agg")

from matplotlib import pyplot as plt  # noqa: E402

from levilab.animation.film import Film, still, table_of_colours  # noqa: E402
from levilab.animation.poses import poses_of  # noqa: E402
from levilab.simulator.scene import preset  # noqa: E402
from levilab.simulator.single import simulate  # noqa: E402

#: The drive [Hz], how far beside it the top begins [Hz], and when the drive is switched off [s].
DRIVE_HZ, BESIDE_HZ, OFF_S = 27.0, 0.3, 10.0
#: Pictures a second of the film, its speed, and poses for each picture, for the path of the axis.
RATE, SPEED, POSES = 10, 5.0, 60
#: Poses of the fall from one picture to the next.
FALL, FALL_STEP = 160, 8
#: The last picture stays for this time [s].
END_S = 2.0
TOP, CHART = (300, 300), (420, 300)


def chart(times: np.ndarray, spins: np.ndarray, now: float, end: float) -> Image.Image:
    """Draw spin and drive up to a time."""
    figure, axes = plt.subplots(figsize=(CHART[0] / 100, CHART[1] / 100), dpi=100, layout="constrained")
    on = np.array([0.0, min(now, OFF_S)])
    axes.plot(on, [DRIVE_HZ, DRIVE_HZ], color="#d9730d", linewidth=4, alpha=0.45, label="drive")
    seen = times <= now
    axes.plot(times[seen], spins[seen], color="#1f5fa8", linewidth=1.6, label="spin")
    axes.set(xlim=(0, 1.04 * end), ylim=(spins.min() - 0.15, spins.max() + 0.15), xlabel="time [s]", ylabel="[Hz]")
    said = "the drive takes hold of the top" if now < OFF_S else "drive off: the air slows the top"
    falls = now > end - FALL / POSES / RATE * SPEED
    axes.set_title("too slow: it falls (slow motion)" if falls else said, fontsize=11, loc="left")
    axes.legend(loc="lower left", frameon=False, fontsize=9)
    axes.spines[["top", "right"]].set_visible(False)
    figure.canvas.draw()
    picture = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB")  # type: ignore[attr-defined]
    plt.close(figure)
    return picture


def main() -> None:
    """Simulate until the fall, and draw."""
    scene = preset("ramp").changed({
        "drive.frequency_hz": DRIVE_HZ, "drive.ramp_hz_per_s": 0.0, "drive.off_s": OFF_S,
        "start.spin_hz": DRIVE_HZ + BESIDE_HZ,
    })  # fmt: skip
    motion = simulate(scene, 120.0, tolerance=1e-6, rate=100.0)
    end = float(motion.time[-1])
    poses = poses_of(motion, 0.0, end, round(end * RATE / SPEED) * POSES)
    film = Film(poses, None, RATE, TOP, trail_s=1.0)
    pictures = []
    last = len(poses.times) - 1
    for k in [*range(0, last - FALL, POSES), *range(last - FALL, last, FALL_STEP), last]:
        sheet = Image.new("RGB", (TOP[0] + CHART[0], TOP[1]), "white")
        sheet.paste(still(film, k, with_words=False), (0, 0))
        sheet.paste(chart(motion.time, motion.spin_hz, float(poses.times[k]), end), (TOP[0], 0))
        pictures.append(sheet)
    table = table_of_colours(pictures[:: max(len(pictures) // 3, 1)], "light")
    small = [one.quantize(palette=table, dither=Image.Dither.NONE) for one in pictures]
    times = [1000 // RATE] * (len(small) - 1) + [round(1000 * END_S)]
    path = Path(__file__).with_suffix(".gif")
    small[0].save(path, save_all=True, append_images=small[1:], duration=times, loop=0, optimize=False)


if __name__ == "__main__":
    main()

"""How much a top nutates when the drive that raised it lets it go (docs/decisions/0011-what-the-counter-counts.md).

    python benchmarks/nutation.py            # 60 tops, two CPU minutes; writes results/nutation.json

Tops are drawn as `levilab crosscheck motion` draws them, and raised to 40 Hz as `levilab acquire spin` does.  When they
have been free for 15 s, the axis n_x + i n_y is taken from the motion itself, 4 s of it, and its line near the
frequency of nutation gives the angle α.  A counter then counts α²/2 of that frequency f too much, which makes
K = α² f/2 √((ν/ν_s)² − 1), and √((ν/ν_s)² − 1) = (f − p)/2√(fp), p being the frequency of precession.
"""

from __future__ import annotations

import argparse
import json
import math
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from instruments.clock import VirtualClock
from levilab.acquisition.table import settings_of, with_settings
from levilab.crosscheck.mock import acquire_mock
from levilab.crosscheck.subjects.motion import draw_scene
from levilab.simulator.kernels.motion import R
from levilab.simulator.start import start_of, steady_rates
from levilab.world.bench import scene_world, virtual_wiring

if TYPE_CHECKING:
    from levilab.acquisition.loop import AcquisitionRequest
    from levilab.world.spin_world import World

RESULTS = Path(__file__).parent / "results"
#: How long the readings go on after the drive is off [s]; then so many poses at this rate [1/s] are looked at.
AFTER_S, POSES, RATE = 15.0, 1600, 400.0
#: The line is looked for so far from where small motions of an aligned moment have it [Hz].
NEAR_HZ = 4.0
#: A line's power under the window of Hann is spread over so many bins.
BINS = 1.5


def main() -> None:
    """Raise the tops, print what each does, and keep it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=20_000)
    parser.add_argument("--tops", type=int, default=60)
    asked = parser.parse_args()
    tops = [nutation_of(seed) for seed in range(asked.seed, asked.seed + asked.tops)]
    shares = np.array([top["k_over_spin"] for top in tops])
    found = {
        "seed": asked.seed,
        "mean": shares.mean(),
        "deviation": shares.std(ddof=1),
        "quantiles": dict(zip(("10", "50", "90"), np.quantile(shares, (0.1, 0.5, 0.9)).tolist(), strict=True)),
        "tops": tops,
    }
    (RESULTS / "nutation.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(f"K/ν {shares.mean():.5f}, standard deviation {shares.std(ddof=1):.5f}, greatest {shares.max():.5f}")


def nutation_of(seed: int) -> dict[str, float]:
    """Return the angle of a top's nutation [rad], its spin [Hz] and K/ν."""
    scene = draw_scene(seed)
    world = scene_world(scene, VirtualClock, lambda _: None, seed=seed)

    def in_world(request: AcquisitionRequest) -> AcquisitionRequest:
        settings: Any = settings_of(request.config, "spin")
        config = with_settings(request.config, "spin", settings.model_copy(update={"longest_s": AFTER_S}))
        return replace(request, config=config, wiring=lambda: virtual_wiring(world, config.limits))

    with tempfile.TemporaryDirectory() as folder:
        spin = float(acquire_mock("spin", seed, Path(folder), in_world).readings().column("spin_frequency_hz")[-1])
    slow, fast = steady_rates(scene, 2 * math.pi * spin, start_of(scene)[R])
    angle = angle_at(fast / (2 * math.pi), world)
    counted = angle**2 / 2 * fast / (2 * math.pi)
    return {
        "seed": seed,
        "spin_hz": spin,
        "nutation_rad": angle,
        "k_over_spin": counted * (fast - slow) / (2 * math.sqrt(slow * fast)) / spin,
    }


def angle_at(frequency_hz: float, world: World) -> float:
    """Return the angle of the axis's line near a frequency, from now on [rad]."""
    x, y, z, w = world.poses(world.clock.now() + 0.2, 1 / RATE, POSES).quaternion.astype(float).T
    axis = 2 * (x * z + w * y) + 2j * (y * z - w * x)
    window = np.hanning(POSES)
    power = np.abs(np.fft.fft(axis * window) / window.sum()) ** 2
    near = np.abs(np.fft.fftfreq(POSES, 1 / RATE) - frequency_hz) < NEAR_HZ
    return math.sqrt(power[near].sum() / BINS)


if __name__ == "__main__":
    main()

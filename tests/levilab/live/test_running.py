"""The running fit: its forecast, and the u that the analysis gives."""

import numpy as np
import pytest

from analysis.spindown.drag import LAWS
from analysis.spindown.fall import FALLS_BETWEEN_HZ
from analysis.spindown.tilt import count_of
from analysis.uncertainty import Estimate
from levilab import analyze
from levilab.live.envelope import Groups
from levilab.live.running import _without_forecast, fit_so_far, spin_down
from levilab.live.watch import Watch
from levilab.present.numbers import with_uncertainty
from support.live_pages import GrowingRun

C32, START_HZ, RESONANCE_HZ, TILT_RAD = 2.3e-4, 34.0, 21.4, 0.025


def test_the_forecast_is_of_the_law_and_does_not_run_into_the_resonance():
    time = np.arange(0.5, 116.0, 2.0)
    q = LAWS["disc"].dimensionless([START_HZ, C32], START_HZ, time[-1])
    spin = START_HZ * count_of(LAWS["disc"], time / time[-1], np.array([*q, TILT_RAD**2, RESONANCE_HZ / START_HZ, 0.0]))
    noise = np.random.default_rng(2).normal(0, 0.005, time.size)
    found = spin_down({"time_s": time, "spin_frequency_hz": spin + noise}, 1)
    curve, last = found.curve, float(time[-1])
    two = Groups(1, *[np.array([time, spin])[:, :2]] * 3)
    assert fit_so_far("spin", ("time_s", "spin_frequency_hz"), two).lines == ("it begins with 3 readings; so far 2",)
    assert found.head.startswith(f"{found.look} law, the best so far   ω̇ = ")
    assert found.dashed == "dashed: the law alone; the count also sees the wobble"
    # under the drag of a disc ω^(−1/2) grows evenly, by C/2; 1 s: the fit's C is good to 1 %, of 25 to 30 s
    ends = [
        last + max(0.0, (2 * np.pi * limit) ** -0.5 - (2 * np.pi * spin[-1]) ** -0.5) * 2 / C32
        for limit in FALLS_BETWEEN_HZ
    ]
    assert np.abs(np.array(found.end_s) - ends).max() < 1.0
    assert curve.x[-1] == found.end_s[1]  # the line goes as far as the head of the page says
    steps = -np.diff(curve.y)
    assert steps.min() > 0
    ended = _without_forecast(found)
    assert ended.head.startswith(f"{found.look} law   ω̇ = ")
    assert not ended.dashed
    assert steps.max() < 2 * steps.min() * (START_HZ / FALLS_BETWEEN_HZ[1]) ** 1.5  # no kink at the last reading


@pytest.mark.parametrize("levels_off", [(), (2,), (1, 2, 3)])
def test_tops_that_level_off_count_as_in_the_analysis(tmp_path, levels_off):
    columns = ("time_s", "spin_frequency_hz", "spin_frequency_u_hz", "spin_seen_hz")
    run = GrowingRun(
        tmp_path,
        "20261122T100000Z-limit-0000",
        experiment="limit",
        configuration={"limit": {"which": "upper", "drive": "triggered"}},
        channels=[{"name": name, "unit": "", "source": ""} for name in columns],
    )
    (run.folder / "readings.csv").write_text(",".join(columns) + "\n", encoding="utf-8")
    run.readings([(10.0 * k, 68.0 + 0.2 * k, 0.6, 67.0 + 0.1 * k) for k in range(3)])
    for top in levels_off:
        run.event("the top gets no faster", "levels off", 10.0, top=top)
    run.event("the top fell", "top lost", 10.0, top=9)
    watch = Watch(run.folder, clock=lambda: 0.0)  # on which no look ends early
    watch.step()
    task = watch.fit_task()
    shown = task[1]()
    mean = analyze(run.folder, kind="limit").values["mean"]
    assert shown.lines[0] == with_uncertainty(Estimate(mean.value, mean.u, "Hz"))
    notes = {0: [], 1: ["without 1 of 3 tops that only got no faster"]}
    assert list(shown.lines[1:]) == notes.get(len(levels_off), ["the drive pulls no further: no limits of the top"])


@pytest.mark.parametrize("which", ["lower", "upper"])
@pytest.mark.parametrize("count", [1, 2, 5])
def test_the_mean_of_limits_has_the_u_of_the_analysis(tmp_path, which, count):
    settings = {"limit": {"which": which}}
    run = GrowingRun(tmp_path, "20261122T100000Z-limit-0000", experiment="limit", configuration=settings)
    run.readings([(10.0 * k, 23.23 + 0.009 * k, 0.036 * (1 + k % 2)) for k in range(count)])
    columns = run.folder.joinpath("readings.csv").read_text().splitlines()[0].split(",")
    rows = np.loadtxt(run.folder / "readings.csv", delimiter=",", skiprows=1, ndmin=2).T
    shown = fit_so_far("limit", tuple(columns), Groups(1, rows, rows, rows), settings["limit"])
    result = analyze(run.folder, kind="limit")
    assert shown.lines == (with_uncertainty(Estimate(result.values["mean"].value, result.values["mean"].u, "Hz")),)

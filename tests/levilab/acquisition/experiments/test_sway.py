"""Films of a swaying top on the virtual bench, and what is done without a camera."""

import json

import numpy as np
import pytest

from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.bench.config import ConfigError
from levilab.formats.table import read_run_readings
from levilab.pipelines.catalogue import ANALYSES
from levilab.simulator.scene import preset
from support.acquisitions import Impatient, Silent, acquired


def filmed(out, *settings, **more):
    return acquired("sway", out=out, settings=settings, **more)


def track_of(run):
    return read_run_readings(run.folder / "states.csv", ("time_s", "x_m", "y_m", "height_m")).columns


def test_a_film_of_the_virtual_bench_has_the_split_of_its_scene(tmp_path):
    run = filmed(tmp_path, "sway.longest_s=60", seed=5)
    assert (run.status, run.record.synthetic, run.count()) == ("finished", True, 31)
    track = track_of(run)
    steps = np.diff(track["time_s"])
    assert steps == pytest.approx(np.full(steps.size, 1 / 120), abs=2e-6)  # six decimals
    # neighbouring frames differ by the noise of two, 0.1 mm each, and hardly by motion
    assert np.std(np.diff(track["height_m"], 2)) == pytest.approx(np.sqrt(6) * 1e-4, rel=0.1)
    (found,) = ANALYSES["sway"].analyze([run.folder]).runs
    assert len(found.swings) == 3
    assert abs(found.geometry.ratio.value - 1) < 4 * found.geometry.ratio.u  # chance: one of 16 000
    assert found.geometry.ratio.u < 0.01
    described = {
        one["name"]: "schema" in one for one in json.loads((run.folder / "datapackage.json").read_text())["resources"]
    }
    assert (described["readings-csv"], described["states-csv"]) == (True, False)


def test_an_interrupted_film_goes_on_without_a_gap(tmp_path):
    first = filmed(tmp_path, "sway.longest_s=20", seed=5, show=Impatient(3))
    assert (first.status, first.count()) == ("interrupted", 3)
    with (first.folder / "states.csv").open("a") as file:
        file.write("4.0083")  # as a process that was killed leaves it
    whole = filmed(tmp_path, resume=first.folder)
    assert whole.status == "finished"
    assert np.diff(track_of(whole)["time_s"]).max() < 1.5 / 120


def test_a_film_ends_with_the_fall_within_the_time_left_that_is_shown(tmp_path):
    class Watching(Silent):
        def reading(self, text, elapsed, remaining):
            shown.append((elapsed + remaining[0], elapsed + remaining[1]))

    shown = []
    scene = tmp_path / "slow.toml"
    start = {"start.spin_hz": 26.0}  # falls after 22 s
    scene.write_text(preset("spindown").changed(start).as_toml(), encoding="utf-8")
    run = filmed(tmp_path, "sway.longest_s=60", seed=5, scene=str(scene), show=Watching())
    (fell,) = [event["time_s"] for event in run.events() if event["kind"] == "fell"]
    assert all(earliest < fell < latest for earliest, latest in shown)
    track = track_of(run)
    assert track["time_s"][-1] < run.readings().column("time_s")[-1] + 1 / 120


def test_a_real_bench_says_how_a_top_is_filmed(tmp_path):
    (tmp_path / "bench.toml").write_text('[counter]\nmodel = "53230A"\naddress = "TCPIP0::192.0.2.1::inst0::INSTR"\n')
    with pytest.raises(ConfigError, match="levilab analyze video"):
        request_for("sway", AcquisitionOptions(bench=tmp_path / "bench.toml"))

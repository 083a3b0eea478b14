"""Experiments with a phone as counter, on the virtual bench."""

import json

import numpy as np
import pytest

from instruments.virtual.bench.faults import Fault
from levilab.acquisition.loop import acquire
from levilab.world import bench as benches
from levilab.world.bench import virtual_bus
from support.acquisitions import Silent, mock, texts


@pytest.fixture(scope="module")
def spin_down(tmp_path_factory):
    return acquire(mock(tmp_path_factory.mktemp("phone"), counter="phyphox"), Silent())


def test_a_spin_down_has_a_u_of_each_reading_and_ends_with_the_fall(spin_down):
    assert spin_down.status == "finished"
    readings = spin_down.readings()
    u = readings.column("spin_frequency_u_hz")
    assert np.median(u) == pytest.approx(0.015, rel=0.5)  # the bound of 3 s at 20 cm, docs/phone.md
    assert (np.diff(readings.column("spin_frequency_hz")) < 0).all()
    assert "no line of a turning moment in the magnetic field any more: the top fell" in texts(spin_down, "fell")[0]
    assert readings.column("time_s")[0] > 0  # no sample from under the drive


def test_the_readings_scatter_about_their_law_as_their_u_says(spin_down):
    readings = spin_down.readings()
    times, spins = readings.column("time_s"), readings.column("spin_frequency_hz")
    root = spins**-0.5  # of a disc straight in time
    u = 0.5 * spins**-1.5 * readings.column("spin_frequency_u_hz")
    design = np.stack([np.ones_like(times), times], axis=1) / u[:, None]
    found, *_ = np.linalg.lstsq(design, root / u, rcond=None)
    chi = np.sum((root / u - design @ found) ** 2) / (times.size - 2)
    assert 0.3 < chi < 2.2  # of some 13 degrees of freedom: 1 ± 0.4, twice


def test_the_run_says_which_phone_and_how_its_clock_goes(spin_down):
    record = json.loads((spin_down.folder / "run.json").read_text(encoding="utf-8"))
    phone = record["instruments"]["counter"]
    assert phone["identity"] == "RWTH Aachen,phyphox,levilab VIRTUAL,1.2.0"
    end = phone["settings_end"]
    assert end["clock_drift"] == pytest.approx(2e-5, abs=3 * end["clock_drift_u"])
    assert record["synthetic"] is True


def test_a_wifi_that_is_away_costs_a_reading_and_not_the_run(tmp_path, monkeypatch):
    def with_faults(*given):
        bus = virtual_bus(*given)
        bus.faults.append(Fault("away for 5 s", question=r".*magX=.*", after=60))
        return bus

    monkeypatch.setattr(benches, "virtual_bus", with_faults)
    run = acquire(mock(tmp_path, counter="phyphox"), Silent())
    assert run.status == "finished"
    assert len(texts(run, "instrument lost")) == len(texts(run, "found again")) == 1
    assert "no answer" in texts(run, "instrument lost")[0] or "nothing answers" in texts(run, "instrument lost")[0]

"""The experiments of the practice bench agree with its scene."""

from __future__ import annotations

import pytest

from levilab.acquisition.loop import acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.live.practice.experiments import PRACTICE
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.options import FieldOptions
from levilab.present.progress import Display
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.scene import preset


def test_the_mass_to_set_by_the_scan_floats_on_the_same_bench(tmp_path):
    options = AcquisitionOptions(mock=True, out=tmp_path, seed=3, scene="practice", settings=PRACTICE["field"].settings)
    run = acquire(request_for("field", options), Display())
    values = ANALYSES["field"].analyze([run.folder], FieldOptions()).values
    window = stability_of(preset("practice")).lifted[-1]
    for name, mass in (
        ("lightest_mass", window.light),
        ("heaviest_mass", window.heavy),
        ("mass_to_set", (window.light + window.heavy) / 2),
    ):
        assert values[name].value == pytest.approx(mass, abs=2 * values[name].u)
        assert values[name].u < 2e-4  # of the moment, which is known to 0.6 %

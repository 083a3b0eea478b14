"""The linear theory's window, as the terminal and the document have it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from levilab.simulator.ensemble import simulate_many
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.scene import preset, with_settings
from levilab.stability.scan import all_up_until, last_up
from levilab.stability.table import as_document, print_stability, remarks
from levilab.stability.thesis import ISLANDS_HZ, STARTS

UNDRIVEN = preset("undriven")
DISC = UNDRIVEN.changed({"base.field": "exact", "top.magnet": "disc"})


def test_the_table_has_the_figures_of_the_thesis_beside(capsys):
    print_stability(stability_of(UNDRIVEN))
    shown = capsys.readouterr().out
    for figure in ("7.0035 – 7.5683", "24.742 – 25.485", "21.65", "80.60", "14.005, lacks it", "21.86 ± 0.08"):
        assert figure in shown
    print_stability(stability_of(UNDRIVEN.changed({"top.moment_a_m2": -0.715})))
    assert "thesis's estimate" in (other := capsys.readouterr().out)
    assert "lacks the factor 2√(I₁/I₃)" in other
    assert "21.86" not in other


def test_a_mode_of_frequency_zero_has_no_sign(capsys):
    print_stability(replace(stability_of(UNDRIVEN), modes=(-1e-5 + 0.5j, -2.5 + 0j)))
    assert "0.000 (decays), −2.500" in (shown := capsys.readouterr().out)
    assert "−0.000" not in shown


def test_the_region_above_the_others_is_the_upper_one_and_a_single_one_is_not(capsys):
    found = stability_of(UNDRIVEN)
    for count, names in ((1, ["lower"]), (2, ["lower", "upper"]), (3, ["lower", "lower", "upper"])):
        print_stability(replace(found, windows=(found.windows * 2)[:count]))
        shown = [line.split()[0] for line in capsys.readouterr().out.splitlines() if line.strip()]
        assert [word for word in shown if word in {"lower", "upper"}] == names


def test_the_document_has_no_number_that_json_has_not():
    for scene in (UNDRIVEN, UNDRIVEN.changed({"top.mass_kg": 0.03}), DISC):
        json.dumps(as_document(stability_of(scene)), allow_nan=False)


def test_what_the_theory_leaves_out_of_a_scene_is_reported():
    assert remarks(stability_of(UNDRIVEN)) == []
    (drag,) = remarks(stability_of(preset("friction")))
    assert "drag is left out" in drag
    assert "lost" in drag
    loose = " ".join(remarks(stability_of(preset("loose-washers"))))
    assert all(f"{word} left out" in loose for word in ("the drag is", "the drive is", "the loose washers are"))


def test_islands_lie_from_the_first_top_that_is_lost_to_the_last_one_up():
    spins = np.arange(45.0, 95.1, 0.5)
    up = np.array([
        simulate_many(
            with_settings(preset("undriven"), start), {"start.spin_hz": spins}, tolerance=1e-6, errors=False
        ).survived
        for start in STARTS.values()
    ])  # fmt: skip
    found = all_up_until(spins, up.all(axis=0)), last_up(spins, up.any(axis=0))
    assert found == pytest.approx(ISLANDS_HZ, abs=1.0)  # two steps: a tenfold tolerance moves the first by one or two

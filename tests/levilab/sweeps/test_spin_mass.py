"""Which spins and masses stay up: the map, its spans, its table and its picture, and the command."""

import json

import numpy as np
import pytest

from levilab.errors import UsageError
from levilab.files import CannotWrite
from levilab.simulator.scene import preset
from levilab.stability.figure import map_figure
from levilab.stability.map import span_of, survival, survival_map
from levilab.stability.table import place_for_map, write_map

UNDRIVEN = preset("undriven")


def test_survival_is_found_over_spin_and_mass():
    alive = survival(UNDRIVEN, np.array([20.0, 30.0]), np.array([0.0252, 0.0253, 0.0260]), 5.0)
    assert alive.tolist() == [[False, True], [False, True], [False, False]]


def test_a_map_is_written_as_a_table_and_a_picture(tmp_path):
    found = survival_map(UNDRIVEN, spins=(20.0, 32.0, 4), masses=(0.0252, 0.0256, 3), duration=2.0)
    assert found.spin_step == 4.0
    table, picture = write_map(found, tmp_path / "new")
    lines = table.read_text(encoding="utf-8").splitlines()
    assert lines[:3] == ["mass_kg,spin_hz,survived", "0.0252,20,0", "0.0252,24,1"]
    assert len(lines) == 1 + 12
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert np.isnan(found.slowest[-1])  # nothing of 25.6 g floats


def test_masses_of_a_map_in_grams_are_refused_with_the_same_in_kilograms():
    with pytest.raises(UsageError, match=r"Were grams meant\?  They are 0\.0252:0\.0256:0\.0002"):
        survival_map(UNDRIVEN, spins=(20.0, 32.0, 4), masses=(25.2, 25.6, 3), duration=2.0)


def test_a_map_has_a_legend_and_marks_the_masses_at_which_the_theory_ends():
    found = survival_map(UNDRIVEN, spins=(20.0, 32.0, 4), masses=(0.0245, 0.0256, 3), duration=2.0)
    assert found.floating == ((pytest.approx(0.024742, abs=1e-6), pytest.approx(0.025485, abs=1e-6)),)
    figure = map_figure(found)
    (axes,) = figure.axes
    marked = [line.get_ydata()[0] for line in axes.lines if line.get_linestyle() == "--"]
    assert marked == pytest.approx([24.742, 25.485], abs=1e-3)
    (legend,) = figure.legends
    said = [text.get_text() for text in legend.get_texts()]
    assert said[:2] == ["still up after 2 s", "lost before"]
    assert said[3] == "no stable equilibrium beyond 24.74 and 25.48 g: theory ends there"
    assert "may only last a while" in " ".join(text.get_text() for text in figure.texts)
    inside = survival_map(UNDRIVEN, spins=(20.0, 32.0, 2), masses=(0.0250, 0.0252, 2), duration=10.0)
    assert inside.notes == ()
    assert len(map_figure(inside).legends[0].get_texts()) == 3


def test_a_map_of_spins_the_other_way_round_has_its_edges_there():
    found = survival_map(UNDRIVEN, spins=(-32.0, -20.0, 4), masses=(0.0250, 0.0254, 2), duration=0.1)
    drawn = np.concatenate([line.get_xdata() for line in map_figure(found).axes[0].lines if len(line.get_xdata()) == 2])
    assert set(-found.slowest) <= set(drawn)


def test_spans_are_read_and_what_is_none_is_reported():
    assert span_of("spins", "20:23:0.5") == (20.0, 23.0, 7)
    assert span_of("spins", "-30:-20:4") == (-30.0, -22.0, 3)
    low, high, count = span_of("masses", "0.0245:0.0256:0.0001")
    assert (low, high, count) == (0.0245, pytest.approx(0.0256, rel=1e-12), 12)


@pytest.mark.parametrize(
    "text", ["20", "20:30", "20:30:x", "30:20:1", "20:30:0", "20:30:-1", "20:20:1", "0:inf:1", "0:nan:1"]
)
def test_a_span_that_is_none_is_refused_with_what_one_looks_like(text):
    with pytest.raises(UsageError, match=r"spins = .*: LOW:HIGH:STEP is expected, such as 20:30:0\.5"):
        span_of("spins", text)


def test_a_map_of_too_many_tops_or_of_no_masses_is_refused():
    with pytest.raises(UsageError, match="at most 250000 values"):
        span_of("spins", "0:1:1e-9")
    with pytest.raises(UsageError, match="1000 spins and 1000 masses are 1000000 tops"):
        survival_map(UNDRIVEN, spins=(20.0, 30.0, 1000), masses=(0.0250, 0.0254, 1000))
    with pytest.raises(UsageError, match="masses = from 0 kg: masses above 0"):
        survival_map(UNDRIVEN, masses=(0.0, 0.03, 2))


def test_the_command_maps_the_spins_and_masses_that_it_is_given(levilab, tmp_path):
    words = ["stability", "undriven", "--spins", "20:32:4", "--masses", "0.0252:0.0254:1e-4", "--duration", "2"]
    refused = levilab(*words, check=2)
    assert "give --map, too" in refused.stderr
    assert refused.stdout == ""
    done = levilab(*words, "--map", "--out", "there", "--json")
    assert "note: 2 s are short" in done.stderr
    found = json.loads(done.stdout)["map"]
    assert found["spins_hz"] == [20.0, 24.0, 28.0, 32.0]
    assert found["masses_kg"] == pytest.approx([0.0252, 0.0253, 0.0254])
    assert len((tmp_path / "there" / "survival.csv").read_text(encoding="utf-8").splitlines()) == 1 + 12


def test_a_map_that_is_there_is_not_written_over(tmp_path):
    (tmp_path / "survival.csv").write_text("precious", encoding="utf-8")
    with pytest.raises(CannotWrite, match="there already"):
        place_for_map(tmp_path)
    with pytest.raises(CannotWrite, match="another folder"):
        place_for_map(tmp_path / "survival.csv" / "inside")


def test_a_map_is_of_the_masses_that_are_lifted():
    # the lower region would pull this moment down, though its masses are nearer to 300 g
    found = survival_map(UNDRIVEN.changed({"top.mass_kg": 0.3}), spins=(28.0, 32.0, 2), duration=0.1)
    assert 0.024 < found.masses[0] < found.masses[-1] < 0.027

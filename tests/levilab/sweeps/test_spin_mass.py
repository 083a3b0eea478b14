"""The map of spin and mass: its spans, its table and its picture, and the command."""

import json

import pytest

from levilab.errors import UsageError
from levilab.files import CannotWrite
from levilab.simulator.scene import preset
from levilab.sweeps.run import run
from levilab.sweeps.spin_mass import as_document, notes_of, place_for_map, plan_of, span_of, write_map
from levilab.sweeps.store import Store

UNDRIVEN = preset("undriven")


def mapped(spins, masses, duration):
    store = Store.create(None, plan_of(UNDRIVEN, spins, masses, duration))
    run(store)
    return store.load()


@pytest.mark.usefixtures("drawn_figures")
def test_a_map_is_written_as_a_table_and_a_picture(tmp_path):
    found = mapped((20.0, 30.0, 2), (0.0252, 0.0254, 2), 5.0)
    table, picture = write_map(found, tmp_path / "new")
    lines = table.read_text(encoding="utf-8").splitlines()
    assert (len(lines), lines[:3]) == (1 + 4, ["mass_kg,spin_hz,survived", "0.0252,20,0", "0.0252,30,1"])
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert found.values["survived"].tolist() == [[False, True], [False, True]]
    document = as_document(found)
    assert document["spin_step_hz"] == 10.0
    assert document["floating_kg"] == [[pytest.approx(0.024742, abs=1e-6), pytest.approx(0.025485, abs=1e-6)]]


def test_a_short_map_has_a_note_and_a_long_one_has_none():
    short, long = (plan_of(UNDRIVEN, (20.0, 32.0, 2), (0.0250, 0.0252, 2), duration) for duration in (2.0, 10.0))
    assert "2 s are short: tops outside of the window may only last a while" in notes_of(short)[0]
    assert notes_of(long) == ()


def test_spans_are_read_and_what_is_none_is_reported():
    assert span_of("spins", "20:23:0.5") == (20.0, 23.0, 7)
    assert span_of("masses", "25g:26g:1g") == (0.025, pytest.approx(0.026, rel=1e-15), 2)
    assert span_of("spins", "-30:-20:4") == (-30.0, -22.0, 3)
    low, high, count = span_of("masses", "0.0245:0.0256:0.0001")
    assert (low, high, count) == (0.0245, pytest.approx(0.0256, rel=1e-12), 12)


@pytest.mark.parametrize(
    "text", ["20", "20:30", "20:30:x", "30:20:1", "20:30:0", "20:30:-1", "20:20:1", "0:inf:1", "0:nan:1"]
)
def test_a_span_that_is_none_is_refused_with_what_one_looks_like(text):
    with pytest.raises(UsageError, match=r"spins = .*: LOW:HIGH:STEP is expected, such as 20:30:0\.5"):
        span_of("spins", text)
    with pytest.raises(
        UsageError, match=r"such as 0\.0250:0\.0254:2e-5; write the number without its unit, which is kg"
    ):
        span_of("masses", "25m:26m:1m")


def test_a_map_of_too_many_tops_or_of_no_masses_is_refused():
    with pytest.raises(UsageError, match="at most 250000 values"):
        span_of("spins", "0:1:1e-9")
    with pytest.raises(UsageError, match="1000 spins and 1000 masses are 1000000 tops"):
        plan_of(UNDRIVEN, spins=(20.0, 30.0, 1000), masses=(0.0250, 0.0254, 1000))
    with pytest.raises(UsageError, match="masses = from 0 kg: masses above 0"):
        plan_of(UNDRIVEN, masses=(0.0, 0.03, 2))
    with pytest.raises(UsageError, match=r"Were grams meant\?  25\.2 g are 0\.0252"):
        plan_of(UNDRIVEN, masses=(25.2, 25.6, 3))


def test_the_command_maps_the_spins_and_masses_that_it_is_given(levilab, tmp_path):
    words = ["stability", "undriven", "--spins", "20:32:4", "--masses", "0.0252:0.0254:1e-4", "--duration", "2"]
    refused = levilab(*words, check=2)
    assert "give --map, too" in refused.stderr
    assert refused.stdout == ""
    done = levilab(*words, "--map", "--out", "there", "--json")
    assert "note: 2 s are short" in done.stderr
    found = json.loads(done.stdout)["map"]
    assert found["spins_hz"] + found["masses_kg"] == pytest.approx([20.0, 24.0, 28.0, 32.0, 0.0252, 0.0253, 0.0254])
    assert len((tmp_path / "there" / "survival.csv").read_text(encoding="utf-8").splitlines()) == 1 + 12


def test_a_map_that_is_there_is_not_written_over(tmp_path):
    (tmp_path / "survival.csv").write_text("precious", encoding="utf-8")
    with pytest.raises(CannotWrite, match="there already"):
        place_for_map(tmp_path)
    with pytest.raises(CannotWrite, match="another folder"):
        place_for_map(tmp_path / "survival.csv" / "inside")


def test_a_map_is_of_the_masses_that_are_lifted():
    # the lower region would pull this moment down, though its masses are nearer to 300 g
    masses = plan_of(UNDRIVEN.changed({"top.mass_kg": 0.3}), spins=(28.0, 32.0, 2)).axes[0].values
    assert 0.024 < masses[0] < masses[-1] < 0.027
    assert masses.size == 61
    start = plan_of(preset("motor")).scene.start  # each top begins where that of the scene floats, at rest
    assert (*start.position_m, *start.velocity_m_s) == pytest.approx((0, 0, 0.0742, 0, 0, 0), abs=5e-5)

"""Simulated motions, sweeps and results of stability in a report, beside measurements or alone."""

import json
import re
import shutil

import pytest
from matplotlib.text import Text

from levilab.errors import DataError
from levilab.motion.report import motion_section
from levilab.motion.simulation import SimulationRequest, run_simulation
from levilab.present.document.blocks import Banner, Code, Details, Facts, Picture, Section, Tabular, Verdict
from levilab.present.document.blocks import in_language_of_reader as in_language
from levilab.report.kinds import KINDS, MOST_IN_FULL, SWEEP
from levilab.report.page import write_report
from levilab.runs.run import Run
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.scene import preset, with_settings
from levilab.stability.report import stability_section
from levilab.stability.table import as_document
from levilab.sweeps.axes import axis_of
from levilab.sweeps.request import SweepRequest, store_for
from levilab.sweeps.run import compile_for, run
from levilab.sweeps.store import SCHEMA
from levilab.workers import this_process
from support.paths import SAMPLE_DATA


def silent(text): ...


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with a simulated motion, a sweep and a result of stability."""
    place = tmp_path_factory.mktemp("simulated")
    scene = with_settings(preset("undriven"), ["top.mass_kg=0.0252", "start.spin_hz=31"])
    run_simulation(SimulationRequest(scene, 1.2, 1e-6, 100.0, place / "runs"), silent)
    axes = axis_of("start.spin_hz", [18, 29, 40]), axis_of("start.position_m.2", ["70 mm", "72 mm"])
    request = SweepRequest(scene, axes, duration=0.3)
    store = store_for(request, place / "map.zarr")
    compile_for(store.plan)
    run(store, this_process())
    (place / "where.json").write_text(json.dumps(as_document(stability_of(scene))), encoding="utf-8")
    return place


@pytest.fixture(scope="module")
def folder(place):
    (folder,) = (place / "runs").iterdir()
    return folder


def all_in(block):
    yield block
    for inner in block.blocks if isinstance(block, Section | Details) else ():
        yield from all_in(inner)


def facts_of(section):
    return {fact.name: fact for block in all_in(section) if isinstance(block, Facts) for fact in block.facts}


def of_kind(section, kind):
    return [block for block in all_in(section) if isinstance(block, kind)]


def test_a_motion_says_how_it_ended_what_was_changed_and_how_good_it_is(folder):
    section = motion_section(Run.load(folder))
    facts = facts_of(section)
    assert isinstance(section.blocks[0], Banner)
    assert section.blocks[0].lead == "SYNTHETIC."
    assert "stayed up for all of 1.2 s" in of_kind(section, Verdict)[0].text
    assert facts["Changed keys"].texts == ("top.mass_kg = 0.0252", "start.spin_hz = 31.0")
    assert "drag of the air" in facts["Left out"].texts[0]
    assert "1×10⁻⁶" in facts["Asked for"].texts[0]
    assert facts["Asked for"].texts[0].endswith(": reached")
    assert facts["states.csv"].texts[0].startswith("sha256 ")
    names = [block.name for block in of_kind(section, Tabular)]
    assert names[0] == "motion"


@pytest.mark.parametrize("of", ["motion", "stability"])
def test_a_simulation_is_reported_in_german_to_the_last_word(of, place, folder):
    section = motion_section(Run.load(folder)) if of == "motion" else stability_section(place / "where.json")
    said = [re.sub(r"\\ndescription = .*?\\n", "", repr(in_language(section, "de")))]  # of the file
    for figure in (picture.draw() for picture in of_kind(section, Picture)):
        said += [in_language(text.get_text(), "de") for text in figure.findobj(Text)]
    words = re.findall(r"(?<![\w-])[a-z]+(?!-)\b", re.sub("<.*?>", "", " ".join(said)))
    assert {"the", "of", "is", "and", "with", "it"} & {*words} == set()


def test_a_motion_is_drawn_anew_only_if_it_ends_in_the_state_that_was_recorded(folder, tmp_path):
    (picture,) = of_kind(motion_section(Run.load(folder)), Picture)
    assert not picture.raster
    copy = shutil.copytree(folder, tmp_path / folder.name)
    lines = (copy / "states.csv").read_text(encoding="utf-8").splitlines()
    (copy / "states.csv").write_text("\n".join(lines[:-1]) + "\n", encoding="utf-8")
    (picture,) = of_kind(motion_section(Run.load(copy)), Picture)
    assert picture.raster, "the picture in the folder, since another state is the last one"
    (copy / "motion.png").unlink()
    assert of_kind(motion_section(Run.load(copy)), Picture) == []


def test_a_file_beside_a_sweep_that_cannot_be_used_is_told(place, tmp_path):
    shutil.copytree(place / "map.zarr", tmp_path / "map.zarr")
    (tmp_path / "bad.csv").write_text("t in s,f in Hz\n0,40\n10,abc\n", encoding="utf-8")
    write_report([tmp_path], tmp_path / "report.html", tell=(told := []).append)
    assert [text.partition(": holds 1 reading")[0] for text in told] == [f"skipped {tmp_path / 'bad.csv'}, line 1"]


def test_a_scene_of_its_own_is_printed_whole(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / folder.name)
    record = json.loads((copy / "run.json").read_text(encoding="utf-8"))
    record["configuration"]["scene"]["name"] = "<b>mine"
    record["command_line"] = ["/opt/levilab", "simulate", "my scene.toml"]
    (copy / "run.json").write_text(json.dumps(record), encoding="utf-8")
    section = motion_section(Run.load(copy))
    assert facts_of(section)["Changed keys"].texts == ("a scene of its own; all its keys stand below",)
    (keys,) = of_kind(section, Details)
    assert keys.on_paper == "whole"
    codes = [block.text for block in of_kind(section, Code)]
    assert "levilab simulate 'my scene.toml'" in codes


def test_a_motion_that_is_not_whole_is_an_error_that_names_the_folder(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / folder.name)
    record = json.loads((copy / "run.json").read_text(encoding="utf-8"))
    del record["simulation"]
    (copy / "run.json").write_text(json.dumps(record), encoding="utf-8")
    with pytest.raises(DataError, match=folder.name):
        write_report([copy], tmp_path / "x.html")


def test_simulations_and_a_measurement_go_into_one_report(place, tmp_path):
    said = []
    paths = [place, place / "where.json", SAMPLE_DATA / "lower-limits"]
    page = write_report(paths, tmp_path / "x.html", tell=said.append, tables=True).read_text(encoding="utf-8")
    for title in ("Limits of the spin", "Simulated motion: undriven", "Sweep: undriven", "Where the top floats"):
        assert title in page
    assert not [text for text in said if "simulate run" in text], "it is in the report"
    names = {file.name for file in (tmp_path / "x.tables").iterdir()}
    assert {"motions.csv", "sweep-map.csv", "limit-inputs.csv", "motion.tex"} <= names
    rows = (tmp_path / "x.tables/sweep-map.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "synthetic,start.spin_hz,start.position_m.2,survived,lifetime_s"
    assert len(rows) == 1 + 6
    assert rows[1].startswith("true,18.0,0.07,")


def test_a_report_of_simulations_alone_is_synthetic_as_a_whole(place, tmp_path):
    page = write_report([place / "map.zarr"], tmp_path / "x.html").read_text(encoding="utf-8")
    assert page.count("SYNTHETIC") >= 2
    assert "levilab sweep" in page or "How to reproduce it" in page


def test_of_many_motions_the_report_is_an_overview(folder, tmp_path):
    for k in range(MOST_IN_FULL + 1):
        shutil.copytree(folder, tmp_path / "runs" / f"{folder.name}-{k}")
    page = write_report([tmp_path / "runs"], tmp_path / "x.html").read_text(encoding="utf-8")
    assert f"{MOST_IN_FULL + 1} simulated motions" in page
    assert "<figure" not in page


def test_a_folder_that_only_its_name_makes_a_store_is_an_error(tmp_path):
    (tmp_path / "x.zarr").mkdir()
    with pytest.raises(DataError, match=r"x\.zarr"):
        write_report([tmp_path / "x.zarr"], tmp_path / "x.html")


def test_a_damaged_result_of_stability_is_an_error(place, tmp_path):
    found = json.loads((place / "where.json").read_text(encoding="utf-8"))
    (tmp_path / "s.json").write_text(json.dumps(found | {"windows": [{}]}), encoding="utf-8")
    with pytest.raises(DataError, match=r"s\.json"):
        write_report([tmp_path / "s.json"], tmp_path / "x.html")


def test_the_marks_of_the_kinds_are_those_that_are_written(place):
    found = {kind.name: kind.find(place) for kind in KINDS}
    assert SWEEP == SCHEMA
    assert [len(found["simulated motion"]), len(found["sweep"])] == [1, 1]
    assert KINDS[2].find(place / "where.json") == [place / "where.json"]
    assert KINDS[2].find(place) == []

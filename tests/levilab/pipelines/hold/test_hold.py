"""Held spins: from run folders to the drag, the laws through several, and a spin-down beside them."""

import json
import shutil

import numpy as np
import pytest

from analysis.spindown.drag import LAWS
from analysis.spindown.tilt import count_of, slowing_by_tilt
from analysis.uncertainty import student
from levilab.errors import DataError
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.hold.figure import hold_figure
from levilab.present.document.blocks import Paragraph
from support.paths import SAMPLE_DATA

HOLD = ANALYSES["hold"]
RUNS = sorted((SAMPLE_DATA / "hold").glob("*-hz"))
#: The constant of the virtual top of seed 3, as its run.json says.
C32 = 2.4355e-4


def analyzed(paths=RUNS, **options):
    return HOLD.analyze(paths, HOLD.options_from(options))


def test_each_held_spin_gives_its_drag_and_several_the_law():
    found = analyzed()
    for run in found.runs:
        truth = C32 * (2 * np.pi * run.spin.value) ** 1.5 / (2 * np.pi)
        assert abs(run.drag.value - truth) < 4 * run.drag.u
        assert run.drag.u < 0.02 * truth
    best = found.combined.laws[0]
    assert best.name == "disc"
    assert abs(best.constants["c32"].value - C32) < 4 * best.constants["c32"].u
    assert "disc law fits best" in found.text


def tilted_spin_down(path):
    """A spin-down of the same top with its moment tilted by 0.03 rad."""
    time = np.arange(0.0, 130.0, 2.0)
    q = LAWS["disc"].dimensionless([40.0, C32], 40.0, time[-1])
    spins = 40.0 * count_of(LAWS["disc"], time / time[-1], np.array([*q, 0.03**2, 22.0 / 40.0, 0.0]))
    noise = np.random.default_rng(3).normal(0, 0.005, time.size)
    np.savetxt(
        path, np.column_stack([time, spins + noise]), delimiter=",", header="time_s,spin_frequency_hz", comments=""
    )
    return path


def test_the_tilt_of_a_spin_down_is_taken_out_of_the_drag(tmp_path):
    alone, found = analyzed(), analyzed(spindown=tilted_spin_down(tmp_path / "a.csv"))
    factors = np.array(found.combined.factors)
    expected = slowing_by_tilt(np.array([run.spin.value for run in found.runs]), 22.0, 0.03)
    assert factors == pytest.approx(expected, abs=0.01)  # u of δ is 5 %
    assert factors.min() < 0.97
    before, after = (one.combined.laws[0].drag(np.array([26.0]))[0] for one in (alone, found))
    assert after > 1.003 * before  # 3 % more at 26 Hz alone, in a mean over four spins


def test_a_spin_down_is_compared():
    found = analyzed(spindown=SAMPLE_DATA / "spin-down-1")  # of another top, whose constant is 2.371e-4
    disc = found.combined.laws[0].constants["c32"]
    spindown, pull = found.combined.beside["disc"]
    assert pull == pytest.approx((disc.value - 2.371e-4) / np.hypot(disc.u, spindown.u), abs=0.3)
    assert "DISAGREES with" in found.text
    among = analyzed([*RUNS, SAMPLE_DATA / "spin-down-1"])
    assert among.combined.beside == found.combined.beside
    assert len(among.runs) == len(found.runs)


def test_a_result_is_as_the_interface_has_it(tmp_path):
    found = analyzed(spindown=SAMPLE_DATA / "spin-down-1")
    document = HOLD.document(found, tmp_path)
    assert document["analysis"] == "hold"
    assert document["best_model"] == "disc"
    assert document["values"]["c32"]["unit"] == "(rad/s)^-1/2/s"
    assert document["values"]["c32_pull"]["value"] > 3
    assert document["runs"][0]["values"]["drag"]["unit"] == "Hz/s"
    assert json.loads(json.dumps(document)) == document
    assert len(HOLD.budgets(found)) > 4


def test_tables_figure_and_report_have_each_spin_and_law():
    found = analyzed()
    spins, laws = HOLD.tables(found)
    assert len(spins.rows) == 4
    assert {row.cells[0] for row in laws.rows} == {"stokes", "newton", "disc", "mixed", "power"}
    assert hold_figure(found).axes[-1].get_xlabel() == "spin  [Hz]"
    assert any(isinstance(block, Paragraph) for block in HOLD.part(found).values)  # a short report explains s, g, d


def test_a_single_hold_and_one_without_a_gain(tmp_path):
    alone = analyzed(RUNS[:1])
    assert {law.name for law in alone.combined.laws} == {"stokes", "newton", "disc"}
    assert [row.cells[2] for row in HOLD.tables(alone)[1].rows] == ["—"] * 3  # no degree of freedom
    assert "lies on the curve of each law" in alone.text
    assert (part := HOLD.part(alone)).lead == "1 held spin"
    assert "Below" not in part.figure.caption
    assert "…" not in hold_figure(alone).texts[0].get_text()
    shutil.copytree(RUNS[0], tmp_path / "run")
    (tmp_path / "run" / "events.jsonl").write_text('{"kind": "gain measured", "text": "", "times_s": [1]}\n')
    found = analyzed([tmp_path / "run"])
    assert found.runs[0].drag is None
    assert any("no drag follows" in text for text in found.all_warnings)
    assert not found.combined.laws
    hold_figure(found)


def with_amplitude(run, folder, factor):
    """Copy a run with another amplitude, of which the drag is a function."""
    shutil.copytree(run, folder)
    table = folder / "readings.csv"
    heads, *rows = table.read_text(encoding="utf-8").splitlines()
    column = heads.split(",").index("drive_amplitude_v")
    cells = [row.split(",") for row in rows]
    scaled = [[*row[:column], str(factor * float(row[column])), *row[column + 1 :]] for row in cells]
    table.write_text("\n".join([heads, *map(",".join, scaled), ""]), encoding="utf-8")


def test_a_best_law_of_two_constants_has_both_in_its_result(tmp_path):
    for run, original in zip(RUNS, analyzed().runs, strict=True):
        with_amplitude(run, tmp_path / "runs" / run.name, (original.spin.value / 45) ** 0.2)
    found = analyzed([tmp_path / "runs"])
    values = HOLD.document(found, tmp_path)["values"]
    assert len(found.combined.best.constants) == 2
    assert set(values) == set(found.combined.best.constants)
    assert len(HOLD.tables(found)) == 2


def test_tops_that_differ_at_one_spin_have_a_mean_drag_and_no_law(tmp_path):
    for name, factor in (("a", 1.0), ("b", 1.1), ("c", 0.95)):
        with_amplitude(RUNS[3], tmp_path / name, factor)
    found = analyzed([tmp_path])
    assert "lies on the curve of each law" in found.text
    assert "runs held a top, at 45.0 Hz." in found.text
    assert "best" not in found.text
    (note,) = found.about_all()
    assert "the tops differ, or no law holds" in note
    drags = [run.drag.value for run in found.runs]
    mean = HOLD.document(found, tmp_path)["values"]["drag"]
    assert mean["value"] == pytest.approx(np.mean(drags), rel=0.01)
    assert mean["u"] == pytest.approx(student(2) * np.std(drags, ddof=1) / np.sqrt(3), rel=0.1)
    assert len(hold_figure(found).axes) == 1


@pytest.mark.parametrize(
    "spins", [None, 1.0, "40", [40], [40, 41], [40, 41, None], [40, 41, "x"], [[40], [41], [42]], {"a": 1}]
)
def test_a_damaged_gain_is_none(tmp_path, spins):
    shutil.copytree(RUNS[0], tmp_path / "run")
    event = {"kind": "gain measured", "text": "", "times_s": [1, 2, 3], "spins_hz": spins}
    (tmp_path / "run" / "events.jsonl").write_text(json.dumps(event) + "\n")
    assert analyzed([tmp_path / "run"]).runs[0].gain is None


def test_a_file_has_no_gain_and_is_refused(tmp_path):
    shutil.copy(RUNS[0] / "readings.csv", tmp_path / "a.csv")
    with pytest.raises(DataError, match="a run folder of `levilab acquire hold` is expected"):
        analyzed([tmp_path / "a.csv"])

"""levilab.acquire, load, analyze and simulate, as scripts and notebooks call them."""

import gc
import hashlib
import inspect
import json
import re
import shutil
import subprocess
import sys
from dataclasses import fields
from unittest.mock import Mock

import numpy as np
import pandas as pd
import pytest

import levilab
from levilab.acquisition.request import AcquisitionOptions
from levilab.acquisition.session import ExperimentFailed
from levilab.bench.person import Task
from levilab.errors import DataError, DoesNotSuit, UsageError
from levilab.motion.simulation import SimulationRequest
from levilab.notebook.acquisition import ask_with_input
from levilab.notebook.analysis import write_frame
from levilab.notebook.scene import chosen_scene, in_seconds
from levilab.pipelines.catalogue import ANALYSES
from levilab.runs.run import Run
from levilab.simulator.keys import SceneError, UnknownKey
from support.commands import command
from support.paths import SAMPLE_DATA
from support.waiting import HANG_GUARD_S

DEVICE = SAMPLE_DATA / "device.toml"
RECORD = SAMPLE_DATA / "scope-files" / "rigol-ds1000z.csv"

#: Analysis → a run, options for its bare readings, a value, and the truth: what made the readings, or was published.
CASES = {
    "spindown": ("spin-down-1", {"tilt": "none"}, "c32", 2.3711e-4),
    "field": ("field-scan", {"device": DEVICE}, "strength", 1.409299e-3),
    "limit": ("lower-limits", {}, "mean", 21.86),
    "precession": ("precession-sweep", {}, "slope", 1.0),
}


def test_importing_levilab_loads_nothing_heavy():
    heavy = {
        "numpy",
        "pandas",
        "scipy",
        "matplotlib",
        "pydantic",
        "typer",
        "rich",
        "lmfit",
        "numba",
        "pyvisa",
        "jinja2",
    }
    program = f"import levilab, sys; print(sorted({heavy!r} & set(sys.modules)))"
    words = [sys.executable, "-c", program]
    done = subprocess.run(words, capture_output=True, text=True, encoding="utf-8", check=True, timeout=HANG_GUARD_S)
    assert done.stdout.strip() == "[]"


# --- analyze ---


@pytest.mark.parametrize("kind", CASES)
def test_run_file_and_dataframe_of_the_same_readings_agree(kind, tmp_path):
    folder, options, name, truth = CASES[kind]
    run = levilab.load(SAMPLE_DATA / folder / "run.json")  # its folder is meant
    of_run = levilab.analyze(run)
    bare = tmp_path / "readings.csv"
    shutil.copy(run.folder / "readings.csv", bare)
    of_file = levilab.analyze(bare, **options)
    of_frame = levilab.analyze(run.to_dataframe(), **options)
    assert of_run.kind == of_file.kind == of_frame.kind == kind
    assert of_file.values == of_frame.values  # to the last bit
    quantity = of_run.values[name]
    assert quantity.u
    assert of_frame.values[name].value == pytest.approx(quantity.value, abs=quantity.u)  # a run knows more of itself
    assert quantity.value == pytest.approx(truth, abs=4 * quantity.u)


def test_records_of_light_are_analyzed_from_run_file_and_dataframe():
    of_run, of_file = levilab.analyze(SAMPLE_DATA / "trace-tape"), levilab.analyze(RECORD)
    assert of_run.kind == of_file.kind == "spin"
    assert 28 < float(of_run.values["frequency"]) < 30  # the tops of two drives that coast
    time = np.arange(6000) / 3000.0
    light = 1.0 * (np.abs((25.0 * time) % 1 - 0.5) < 0.03) + np.random.default_rng(1).normal(0, 0.01, time.size)
    of_frame = levilab.analyze(pd.DataFrame({"time_s": time, "light_v": light}))
    frequency = of_frame.values["frequency"]
    assert of_frame.kind == "spin"
    assert frequency.value == pytest.approx(25.0, abs=0.01)  # edges lie where a sample lies: 0.33 ms of 2 s


@pytest.fixture(scope="module")
def four():
    return levilab.analyze([SAMPLE_DATA / f"spin-down-{k}" for k in (1, 2, 3, 4)])


@pytest.fixture(scope="module")
def limits():
    return levilab.analyze(SAMPLE_DATA / "lower-limits")


def test_values_have_a_row_for_each_input_and_all_together(four):
    table = four.to_dataframe().set_index(["input", "name"])
    constants = table.loc[[f"spin-down-{k}" for k in (1, 2, 3, 4)]].xs("c32", level="name")
    assert constants["value"].mean() == pytest.approx(table.loc[("together", "c32"), "value"])
    assert set(constants["unit"]) == {"(rad/s)^-1/2/s"}
    assert four.by_input["spin-down-2"]["c32"].u == constants.loc["spin-down-2", "u"]


def test_readings_stand_with_their_residuals(four):
    readings = four.to_dataframe("readings")
    assert len(readings) == 78
    models = four.to_dataframe("models").set_index(["model", "name"])
    assert models.loc[("disc", "c32"), "value"] == float(four.values["c32"])
    assert readings["residual_hz"].std() == pytest.approx(0.03, rel=0.25)  # their noise; 3/√(2·78)
    limit = levilab.analyze(pd.DataFrame({"spin_frequency_hz": [21.0, 22.0, 23.0]}), "limit")
    assert limit.to_dataframe("readings")["residual_hz"].tolist() == [-1.0, 0.0, 1.0]


@pytest.mark.parametrize("kind", ANALYSES)
def test_every_analysis_has_readings_with_the_residuals_of_its_result(kind):
    folder = {"spin": "trace-laser", "sway": "sway/track.csv", "hold": "hold/45-hz", "video": "video"}
    folder |= {name: case[0] for name, case in CASES.items()}
    of_film = {"rim_m": 0.03, "stop_s": 1.0} if kind == "video" and pytest.importorskip("av") else {}
    result = levilab.analyze(SAMPLE_DATA / folder[kind], kind if of_film else None, **of_film)
    table = result.to_dataframe("readings")
    assert len(table) > 2
    assert np.isfinite(table.filter(regex="^(spin_frequency_hz|residual|flux)").to_numpy()).all()
    fits = [one for one in result.document["models"] if one["name"] in {"disc", "ring", "weighted"} and kind != "hold"]
    for model in fits:
        rms = float(np.sqrt((table.filter(like="residual").to_numpy() ** 2).mean()))
        assert rms == pytest.approx(model["statistics"]["rms_residual"])
    assert len(fits) == (kind in {"spindown", "field", "precession"})


def test_outliers_keep_their_row_and_have_no_residual():
    frame = levilab.load(SAMPLE_DATA / "spin-down-1").to_dataframe()
    frame.loc[7, "spin_frequency_hz"] *= 2
    readings = levilab.analyze(frame).to_dataframe("readings")
    assert readings.index[~readings["used"]].tolist() == [7]
    assert readings.index[readings["residual_hz"].isna()].tolist() == [7]


def test_the_short_form_of_a_result_is_a_few_lines(four, limits):
    name, sentence, mean, *_ = repr(limits).splitlines()
    assert (name, mean) == ("<limit of lower-limits", "  mean = 21.86(8) Hz")
    assert limits.verdict.startswith(sentence.strip())
    assert len(repr(four).splitlines()) <= 7


def test_the_summary_is_what_the_command_line_prints_also_in_a_notebook(limits, tmp_path, monkeypatch):
    printed = command("analyze", "limit", SAMPLE_DATA / "lower-limits", "--no-save", cwd=tmp_path)
    monkeypatch.setattr("rich.console._is_jupyter", lambda: True)
    assert limits.summary().split() == printed.out.split()


@pytest.mark.usefixtures("drawn_figures")
def test_a_notebook_shows_results_escaped_and_short(tmp_path):
    folder = tmp_path / "lower-limits"
    shutil.copytree(SAMPLE_DATA / "lower-limits", folder)
    record = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    record |= {"synthetic": True, "synthetic_how": "<script>alert(1)</script>", "note": "<script>"}
    (folder / "run.json").write_text(json.dumps(record), encoding="utf-8")
    result = levilab.analyze(folder)
    for html in (result._repr_html_(), result.to_html(), levilab.load(folder)._repr_html_()):
        assert "&lt;script&gt;" in html
        own = re.sub(r' xmlns(:xlink)?="http://www.w3.org/[^"]*"', "", html)  # names of SVG, which nothing fetches
        assert not any(text in own for text in ("<script", "http://", "https://", "@import", "<link"))
    assert "<figure id=" in result.to_html()
    assert '<img alt="readings and residuals"' in result._repr_html_()
    assert result.plot()._repr_png_().startswith(b"\x89PNG")


@pytest.mark.parametrize("kind", ANALYSES)
@pytest.mark.usefixtures("drawn_figures")
def test_a_cell_is_short_and_folds(kind):
    if kind == "video":
        return  # its film takes seconds, and its cell is as all others
    folder = {"spin": "trace-laser", "sway": "sway/track.csv", "hold": "hold/45-hz"}
    html = levilab.analyze(SAMPLE_DATA / (folder | {name: case[0] for name, case in CASES.items()})[kind])._repr_html_()
    assert len(html.encode()) < 30_000  # a tenth of a report
    assert html.count("<details") == html.count("</details>") > 1


def test_analyze_writes_nothing_and_save_does(tmp_path):
    folder = tmp_path / "lower-limits"
    shutil.copytree(SAMPLE_DATA / "lower-limits", folder)
    before = sorted(tmp_path.rglob("*"))
    result = levilab.analyze(folder)
    assert sorted(tmp_path.rglob("*")) == before
    result.save(tmp_path / "out")
    written = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
    assert written["values"]["mean"]["value"] == result.values["mean"].value
    assert written["inputs"][0]["path"] == "../lower-limits/readings.csv"


@pytest.mark.usefixtures("undrawn_figures")
def test_a_saved_result_of_a_dataframe_has_its_readings_beside(tmp_path):
    result = levilab.analyze(pd.DataFrame({"spin_frequency_hz": [21.1, 22.2, 23.3]}), "limit")
    file, *_ = result.save(tmp_path)
    assert pd.read_csv(file)["spin_frequency_hz"].tolist() == [21.1, 22.2, 23.3]
    written = json.loads((tmp_path / "DataFrame.csv.result.limit.json").read_text(encoding="utf-8"))
    sha256 = hashlib.sha256(file.read_bytes()).hexdigest()
    assert written["inputs"] == [{"path": "DataFrame.csv", "sha256": sha256}]
    reported = command("report", tmp_path, "-o", tmp_path / "report.html", "--no-crosscheck", cwd=tmp_path)
    assert reported.status == 0
    assert "analyzed for this page" not in (tmp_path / "report.html").read_text(encoding="utf-8")
    other = levilab.analyze(pd.DataFrame({"spin_frequency_hz": [21.1, 22.2, 23.4]}), "limit")
    assert next(path.name for path in other.save(tmp_path)) == "DataFrame-2.csv"
    assert pd.read_csv(file)["spin_frequency_hz"].tolist() == [21.1, 22.2, 23.3]
    (tmp_path / "a file").write_text("", encoding="utf-8")
    with pytest.raises(levilab.LevilabError, match=r"choose another `folder`$"):
        other.save(tmp_path / "a file")


def test_what_a_dataframe_was_written_to_goes_with_the_result():
    frame = pd.DataFrame({"spin_frequency_hz": [21.0, 22.0, 23.0]})
    result = levilab.analyze(frame, "limit")
    folder = result.found.sources[0].path.parent
    assert folder.exists()
    del result
    gc.collect()
    assert not folder.exists()


# --- DataFrames ---


def spin_down():
    time = 10.0 * np.arange(8)
    return pd.DataFrame({"time_s": time, "spin_frequency_hz": 40.0 * np.exp(-3.2e-3 * time) + 0.01 * np.cos(time)})


def test_messages_about_a_dataframe_name_its_rows():
    frame = spin_down()
    frame.loc[3, "time_s"] = 20.0
    with pytest.raises(DataError, match=r"^the data, row 3: the time 20 s is repeated after 20 s in row 2"):
        levilab.analyze(frame)
    frame.loc[3, "time_s"] = 30.0
    frame.loc[5, "spin_frequency_hz"] = np.nan
    result = levilab.analyze(frame, reading_u=0.03)
    assert any(text.startswith("the data: 1 of 8 rows is left out") for text in result.warnings)
    assert any(text.endswith("row 5") for text in result.document["warnings"])


def test_masked_readings_of_numpy_are_left_out_as_nan():
    time, spin = spin_down().to_numpy(copy=True).T
    masked = np.isin(time, [20.0, 50.0])
    spin[masked] = 99.0
    dates = np.datetime64("2026-01-01") + time.astype("timedelta64[s]")
    for data in ((time, np.ma.array(spin, mask=masked)), (np.ma.array(dates, mask=masked), spin)):
        result = levilab.analyze(data, reading_u=0.03)
        assert result.ndata == 6
        assert any(text.endswith("rows 2, 5") for text in result.document["warnings"])


def test_the_folder_of_a_saved_result_of_arrays_is_loaded(tmp_path):
    result = levilab.analyze(spin_down(), reading_u=0.03)
    result.save(tmp_path)
    assert levilab.load(tmp_path).values == result.values
    with pytest.raises(DataError, match=r"of results the folder has DataFrame\.csv\.result\.json"):
        levilab.load(tmp_path / "result.json")


def test_several_dataframes_are_named_by_their_place():
    frames = [spin_down(), spin_down() * 1.01]
    assert levilab.analyze(frames, reading_u=0.03).inputs == ("DataFrame 1", "DataFrame 2")
    frames[1].loc[2, "spin_frequency_hz"] = -1.0
    with pytest.raises(DataError, match=r"^DataFrame 2, row 2: the frequency is -1"):
        levilab.analyze(frames)


def test_numbered_columns_lose_no_row(tmp_path):
    write_frame(pd.DataFrame(spin_down().to_numpy()), tmp_path / "a.csv")
    assert len((tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()) == 8


def test_odd_titles_become_columns(tmp_path):
    write_frame(spin_down().rename(columns={"spin_frequency_hz": 'ν,\n"x"'}), tmp_path / "a.csv")
    assert list(pd.read_csv(tmp_path / "a.csv").columns) == ["time_s", 'ν, "x"']


def dates(frame):
    return pd.Timestamp("2026-11-28 10:00") + pd.to_timedelta(frame["time_s"], unit="s")


#: Forms that numbers come in.
FORMS = {
    "index with a name": lambda frame: frame.set_index("time_s"),
    "dates": lambda frame: frame.drop(columns="time_s").set_axis(pd.DatetimeIndex(dates(frame))),
    "spans of time": lambda frame: frame.drop(columns="time_s").set_axis(pd.to_timedelta(frame["time_s"].array, "s")),
    "seconds": lambda frame: frame.drop(columns="time_s").set_axis(frame["time_s"].array),
    "dates that only label": lambda frame: frame.set_axis(pd.date_range("2026-01-01", periods=len(frame))),
    "rows that were left out": lambda frame: frame.set_axis([*range(10, 10 + len(frame))]),
    "arrays": lambda frame: (frame["time_s"].to_numpy(), frame["spin_frequency_hz"].to_numpy()),
    "dates and an array": lambda frame: (dates(frame).to_numpy(), frame["spin_frequency_hz"].to_numpy()),
    "rows of readings": lambda frame: frame.to_numpy(),
    "a row a quantity": lambda frame: frame.to_numpy().T,
    "pairs": lambda frame: list(frame.itertuples(index=False, name=None)),
    "records": lambda frame: frame.to_records(index=False),
    "a Series over dates": lambda frame: frame.set_index(pd.DatetimeIndex(dates(frame)))["spin_frequency_hz"],
}


@pytest.mark.parametrize("form", FORMS)
def test_numbers_in_any_form_are_the_same_readings(form):
    expected = levilab.analyze(spin_down()).data
    found = levilab.analyze(FORMS[form](spin_down())).data
    assert found["time_s"].to_numpy() == pytest.approx(expected["time_s"].to_numpy(), abs=1e-6)  # dates have 1 µs
    assert found["spin_frequency_hz"].tolist() == expected["spin_frequency_hz"].tolist()


def test_two_arrays_need_no_brackets():
    frame = spin_down()
    found = levilab.analyze(frame["time_s"].tolist(), frame["spin_frequency_hz"].tolist())
    assert found.values == levilab.analyze((frame["time_s"], frame["spin_frequency_hz"])).values


# --- wrong calls ---


FOUR = [40.0, 41.0, 42.0, 43.5]
#: Wrong calls: the argument that the UsageError names, or the class of another error.
WRONG = {
    "several suit": (lambda: levilab.analyze(SAMPLE_DATA / "sway"), "kind"),
    "no such kind": (lambda: levilab.analyze(spin_down(), "spin-down"), "kind"),
    "no such data": (lambda: levilab.analyze(5), "data"),
    "frequencies before times": (lambda: levilab.analyze(([9.0, 7.0, 6.0], [1, 2, 3])), "data"),
    "times of a turn": (lambda: levilab.analyze(([1, 2, 3], [0.02, 0.03, 0.04])), "data"),
    "a result": (lambda: levilab.analyze(levilab.analyze(spin_down())), "data"),
    "a kind that is no text": (lambda: levilab.analyze(spin_down(), 5), "kind"),
    "no equal columns": (lambda: levilab.analyze({"time_s": [0.0, 1.0], "spin_frequency_hz": [40.0]}), "data"),
    "nothing": (lambda: levilab.analyze([]), "data"),
    "no columns": (lambda: levilab.analyze(pd.DataFrame()), "data"),
    "unknown titles": (lambda: levilab.analyze(pd.DataFrame({"a": FOUR, "b": FOUR})), DoesNotSuit),
    "two kinds": (lambda: levilab.analyze([SAMPLE_DATA / "spin-down-1", SAMPLE_DATA / "field-scan"]), DoesNotSuit),
    "no file": (lambda: levilab.analyze("nowhere.csv"), DataError),
    "foreign option": (lambda: levilab.analyze(spin_down(), method="edges"), "method"),
    "no such word": (lambda: levilab.analyze(spin_down(), tilt="x"), "tilt"),
    "no positive u": (lambda: levilab.analyze(spin_down(), reading_u=-1.0), "reading_u"),
    "u alone": (lambda: levilab.analyze(spin_down(), height_u_m=1e-3), "height_u_m"),
    "height alone": (lambda: levilab.analyze(SAMPLE_DATA / "field-scan", height_m=0.07), DataError),
    "no table": (lambda: levilab.analyze(spin_down()).to_dataframe("fits"), "table"),
    "no run": (lambda: levilab.load("nowhere"), DataError),
    "no name of a group": (lambda: levilab.acquire("spin", mock=True, group=" "), "group"),
    "a file": (lambda: levilab.load(RECORD), DataError),
    "many runs": (lambda: levilab.load(SAMPLE_DATA), DataError),
    "no experiment": (lambda: levilab.acquire("spinn", mock=True), "experiment"),
    "no setting": (lambda: levilab.acquire("limit", mock=True, settings={"limit.which": "uper"}), "settings"),
    "a seed of a real bench": (lambda: levilab.acquire("spin", seed=1), "seed"),
    "no scene": (lambda: levilab.simulate("undrivn"), SceneError),
    "no key": (lambda: levilab.simulate("undriven", settings={"top.mas_kg": 1}), UnknownKey),
    "no duration": (lambda: levilab.simulate("undriven", -1), "duration"),
    "no time": (lambda: levilab.simulate("undriven", "5 m"), "duration"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_call_names_the_argument_or_the_kind_of_failure(case):
    call, expected = WRONG[case]
    with pytest.raises(UsageError if isinstance(expected, str) else expected) as raised:
        call()
    assert getattr(raised.value, "name", expected) == expected
    assert "--" not in str(raised.value).replace("--settings", "")


@pytest.mark.parametrize(("call", "said"), [
    (lambda: levilab.analyze(([9.0, 7.0, 6.0], [1, 2, 3])), "from 1 to 3: times come first, and rise: analyze"),
    (lambda: levilab.analyze(([1, 2, 3], [0.02, 0.03, 0.04])), r"inverted first, analyze\(\(t, 1 / T\)\)"),
    (lambda: levilab.analyze(levilab.analyze(spin_down())), "^data = a result: .* give what it was made of"),
    (lambda: levilab.analyze(([0, 1], [40, 39])), "^the data: holds 2 readings, at least 3"),
    (lambda: levilab.analyze((FOUR[:2], FOUR[1:3], FOUR[2:]), "precession"), "^the data: holds 2 readings, at least 3"),
    (lambda: levilab.load("nowhere"), "^nowhere: there is no such file or folder in .*levilab runs lists"),
    (lambda: levilab.load(SAMPLE_DATA / "student-files" / "columns.json"), "is a file; a run folder is expected"),
    (lambda: levilab.analyze(levilab), "^data = the module levilab: a run,"),
    (lambda: levilab.analyze(spin_down(), "spindwon"), "^kind = spindwon: did you mean spindown"),
    (lambda: levilab.analyze(spin_down(), laws=["disk"]), "^laws = .*: did you mean disc"),
    (lambda: levilab.analyze({"a": spin_down(), "b": spin_down()}), r"'spin_frequency_hz': \[…\]}$"),
    (lambda: levilab.acquire("spni", mock=True), "^experiment = spni: did you mean spin"),
    (lambda: levilab.acquire("spin", mock=True, seed=-1), "^seed = -1: a whole number"),
    (lambda: levilab.acquire("spin", mock=True, progress=1), r"which help\(acquire\) lists$"),
    (lambda: levilab.analyze(spin_down()).conf_interval("c32"), "^sigmas = c32: numbers above 0 are expected"),
    (lambda: levilab.analyze(spin_down()).conf_interval([[1, np.nan]]), "^sigma = nan: a number above 0"),
    (lambda: levilab.analyze(spin_down()).compare(), "take to_dataframe"),
    (lambda: levilab.analyze(spin_down()).correlation, "did you mean correl"),
    (lambda: levilab.analyze(spin_down()).values["c1"].ci, "did you mean interval"),
])  # fmt: skip
def test_a_natural_but_wrong_call_is_told_how_to_call(call, said):
    with pytest.raises(levilab.LevilabError, match=said):
        call()


def test_numbers_are_taken_with_their_units_as_on_the_command_line():
    assert in_seconds("2min") == 120
    assert chosen_scene("undriven", {"start.spin_hz": "1800 rpm"}, {"mass_kg": "25 g", "law": "stokes"}).changed(
        {}
    ) == chosen_scene("undriven", {"start.spin_hz": 30.0}, {"mass_kg": 0.025, "law": "stokes"})


def test_every_option_is_a_keyword_with_its_default():
    given = inspect.signature(levilab.analyze).parameters
    options = {one.name: one.default for row in ANALYSES.values() for one in fields(row.options)}
    options.pop("guess")  # whether titles are guessed is for those who name a single file
    data = {"data", "kind", "u", "time", "frequency", "light"}
    assert {name: one.default for name, one in given.items() if name not in data} == options
    assert all(f"'{name}'" in str(given["kind"].annotation).replace('"', "'") for name in ANALYSES)
    of_acquire = set(inspect.signature(levilab.acquire).parameters) - {"experiment"}
    assert of_acquire == {one.name for one in fields(AcquisitionOptions)} - {"tell"}
    of_simulate = inspect.signature(levilab.simulate).parameters
    order = {one.name: one.default for one in fields(SimulationRequest) if one.name != "scene"}
    own = {"scene", "settings", "animate", "changes"}
    assert {name: one.default for name, one in of_simulate.items() if name not in own} == order


# --- acquire and load ---


def test_an_experiment_gives_its_run_without_a_word(tmp_path, capsys):
    settings = {"spin.hold_s": np.float64(0.0)}
    run = levilab.acquire("spin", mock=True, seed=1, out=tmp_path, note="first try", settings=settings)
    assert capsys.readouterr() == ("", "")
    assert isinstance(run, Run)
    assert (run.status, run.record.note, run.record.seed) == ("finished", "first try", 1)
    assert run.record.configuration["spin"]["hold_s"] == 0
    assert len(run.to_dataframe()) == run.count() > 10
    assert repr(levilab.load(run.folder)) == repr(run)
    assert "spin of 20" in repr(run)
    assert "finished, SYNTHETIC, in" in repr(run)
    with pytest.raises(levilab.LevilabError, match="is finished, only an interrupted or failed run"):
        levilab.acquire("spin", resume=run)


def test_a_person_who_cannot_be_asked_ends_the_experiment(monkeypatch):
    monkeypatch.setattr("builtins.input", Mock(side_effect=EOFError))
    with pytest.raises(ExperimentFailed, match=r"'float the top' cannot be answered: .* give `person`"):
        ask_with_input(Task("float the top"))


def test_readings_of_a_run_are_drawn_channel_by_channel():
    figure = levilab.load(SAMPLE_DATA / "field-scan").plot()
    assert [panel.get_ylabel() for panel in figure.axes] == ["flux density  [mT]"]
    assert figure.axes[-1].get_xlabel() == "height  [cm]"
    assert len(levilab.load(SAMPLE_DATA / "upper-limits").plot().axes) == 4


def test_a_run_whose_readings_are_damaged_is_still_shown(tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(SAMPLE_DATA / "lower-limits", folder)
    (folder / "readings.csv").write_text("spin_frequency_hz\nabc\n", encoding="utf-8")
    assert "readings.csv, line 2" in levilab.load(folder)._repr_html_()


# --- simulate ---


@pytest.mark.usefixtures("undrawn_figures")
def test_a_simulated_motion_has_the_states_that_were_asked_for(tmp_path):
    motion = levilab.simulate("undriven", 2, rate=50, settings={"start.spin_hz": 31.0}, out=tmp_path)
    states = motion.to_dataframe()
    assert states["time_s"].tolist() == pytest.approx(np.arange(101) / 50)
    assert np.allclose(np.hypot.reduce(states[["axis_x", "axis_y", "axis_z"]].to_numpy(), axis=1), 1, atol=1e-12)
    assert states["spin_frequency_hz"].iloc[0] == pytest.approx(31.0)
    assert np.array_equal(motion.position[:, 2], states["z_m"])
    assert repr(motion) == "<SimulatedMotion of undriven: 101 states in 2 s, up to the end>"
    assert "undriven: the top stayed up for all of 2 s" in motion.summary()
    assert "constant, 31.000 Hz" in motion._repr_html_()
    written = levilab.load(motion.folder).to_dataframe()
    assert np.array_equal(written.to_numpy(), states.to_numpy())


def test_a_top_too_heavy_to_float_falls():
    motion = levilab.simulate("undriven", 3, settings={"top.mass_kg": 0.04})
    assert not motion.survived
    assert "lost at the limit of its height" in repr(motion)
    assert motion.warnings

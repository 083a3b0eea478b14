"""result.json on the disk: how it is named, what is recalled from it, and what happens to one that cannot be used."""

import json
import math
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from levilab.errors import DataError
from levilab.files import replace_atomically
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.result import Place, beside, read_result, save
from levilab.pipelines.spindown.document import SPINDOWN
from levilab.pipelines.suits import save as save_found
from support.equal import differences
from support.spin_downs import spin_down_csv


def saved(*paths):
    return [file.name for file in save_found(ANALYSES["spindown"], SPINDOWN.analyze(paths))]


#: Names that come near one another: with dots, without an ending, like results themselves.
WORDS = st.sampled_from(["x", "run", "csv", "txt", "log", "001", "002", "result", "json", "spindown", "png", ""])
NAMES = st.lists(WORDS, min_size=1, max_size=4).map(".".join).filter(lambda name: name.strip("."))


@given(names=st.sets(NAMES, min_size=2, max_size=12))
@example(names={"run.001", "run.002"})
@example(names={"a.log", "a.prn", "a"})
@example(names={"x.csv", "x.txt", "x.csv.dat", "x"})
@example(names={"result", "result.json", "x.result"})
def test_no_two_files_share_a_result(names):
    with TemporaryDirectory() as folder:
        paths = [Path(folder) / name for name in sorted(names)]
        before = [beside(path) for path in paths]
        for path in paths:
            path.write_bytes(b"")
        places = [beside(path) for path in paths]
    assert places == before  # a file that comes later renames no result
    places.append(Place(Path(folder)))
    files = [place.result(analysis) for place in places for analysis in ("", "spindown", "field")]
    files += [place.figure(analysis) for place in places for analysis in ("spindown", "field")]
    assert len({str(file).casefold() for file in files}) == 5 * len(places)


@pytest.mark.usefixtures("undrawn_figures")
def test_files_that_differ_in_their_ending_alone_keep_their_results(tmp_path):
    paths = [spin_down_csv(tmp_path / name, seed=k) for k, name in enumerate(("run.001", "run.002", "run"))]
    assert [saved(path) for path in paths] == [
        ["run.001.result.json", "run.001.spindown.png"],
        ["run.002.result.json", "run.002.spindown.png"],
        ["run.result.json", "run.spindown.png"],
    ]


@pytest.mark.usefixtures("undrawn_figures")
def test_the_result_of_a_run_folder_is_result_json_in_it(tmp_path, sample_data, monkeypatch):
    def write(path, content):
        written.append(path.name)
        replace_atomically(path, content)

    written = []
    monkeypatch.setattr("levilab.pipelines.result.replace_atomically", write)
    run = shutil.copytree(sample_data / "spin-down-1", tmp_path / "run")
    assert saved(run) == ["result.json", "spindown.png"]
    assert written == ["spindown.png", "result.json"]  # who sees the new result sees no old figure
    assert (run / "result.json").is_file()
    assert SPINDOWN.analyze([run / "readings.csv"]).place.result() == run / "result.json"


def write_result(tmp_path):
    """The result of a data file, without its figure."""
    analysis = SPINDOWN.analyze([spin_down_csv(tmp_path / "my.csv")])
    return save(SPINDOWN.result_of(analysis, analysis.place), analysis.place, picture=b"")[0]


def damaged(content, *keys, value=...):
    """The content as text, with one place changed or, without a value, taken out."""
    place = content
    for key in keys[:-1]:
        place = place[key]
    if value is ...:
        del place[keys[-1]]
    else:
        place[keys[-1]] = value
    return json.dumps(content)


RUN = ["runs", 0, "result"]


@pytest.mark.parametrize(
    ("keys", "value", "says"),
    [
        (["schema"], "levilab-result/9", "schema is 'levilab-result/9', expected 'levilab-result/1'"),
        (["schema"], ..., "schema is None"),
        (["values"], ..., "values: is missing"),
        (["models", 2, "parameters"], 3, "models.2.parameters = '3'"),
        (["models", 2, "parameters", "c32", "runs"], 1, "c32.runs"),
        (["models", 2, "parameters", "c32", "scatter"], 0.1, "of how many runs"),
        (["combined"], ..., "combined: is missing"),
        (["combined", "fits"], "all", "combined.fits"),
        (["runs"], [], "1 inputs but 0 runs"),
        (RUN, ..., "runs.0.result: is missing"),
        ([*RUN, "best"], ..., "runs.0.result.best: is missing"),
        ([*RUN, "start_time"], "early", "runs.0.result.start_time = 'early': a number is expected"),
        ([*RUN, "start_time"], math.inf, "not finite"),
        ([*RUN, "time"], [math.nan, 1.0], "not finite"),
        ([*RUN, "time"], [[1.0], [1.0, 2.0]], "runs.0.result.time"),
        ([*RUN, "fits", 2, "statistics", "n"], "many", "result.fits.2.statistics.n = 'many': a whole number"),
        ([*RUN, "fits", 2, "reference"], [1.0], "result.fits.2.reference"),
        ([*RUN, "fits", 2, "parameters"], [["c32"]], "result.fits.2.parameters"),
        ([*RUN, "fits", 2, "parameters", 0, 1], {"value": "1.0 Hz"}, "result.fits.2.parameters.start_frequency"),
        (["settings", "tilt"], "guessed", "settings.tilt"),
        (["settings", "reading_u_hz"], -1.0, "reading_u_hz"),
    ],
)
def test_a_damaged_result_is_refused_with_what_is_wrong(tmp_path, keys, value, says):
    file = write_result(tmp_path)
    file.write_text(damaged(json.loads(file.read_text(encoding="utf-8")), *keys, value=value), encoding="utf-8")
    with pytest.raises(DataError) as caught:
        read_result(file, SPINDOWN.model)
    text = str(caught.value)
    assert text.startswith(f"{file}: ")
    assert says in text
    assert "levilab analyze" in text
    assert "\n" not in text


@pytest.mark.parametrize(
    "content", [b"", b"{", b"[]", b"null", b"[" * 100_000, b'{"schema": ' + b"1" * 5000 + b"}", b"\xff\xfe\x00{"]
)
def test_what_is_no_result_is_refused_in_one_line(tmp_path, content):
    file = tmp_path / "result.json"
    file.write_bytes(content)
    with pytest.raises(DataError, match=r"cut off or not JSON|schema is"):
        read_result(file, SPINDOWN.model)


def test_a_result_of_another_analysis_is_none_of_this_one(tmp_path):
    file = write_result(tmp_path)
    file.write_text(damaged(json.loads(file.read_text(encoding="utf-8")), "analysis", value="field"), encoding="utf-8")
    assert read_result(file, SPINDOWN.model) is None
    assert read_result(tmp_path / "nowhere.json", SPINDOWN.model) is None


def test_keys_of_a_newer_version_are_passed_over(tmp_path):
    file = write_result(tmp_path)
    file.write_text(damaged(json.loads(file.read_text(encoding="utf-8")), "new", value=1), encoding="utf-8")
    assert read_result(file, SPINDOWN.model)


def test_a_result_read_and_written_again_is_the_same_text(tmp_path):
    file = write_result(tmp_path)
    result = read_result(file, SPINDOWN.model)
    assert result.as_dict() == json.loads(file.read_text(encoding="utf-8"))


#: Inputs of each analysis among the sample data; a folder of several is searched.
INPUTS = (
    ("spindown", ["spin-down-1"]),
    ("spindown", ["spin-down-1", "spin-down-2"]),
    ("spin", ["trace-tape"]),
    ("spin", ["scope-files"]),
    ("field", ["field-scan"]),
    ("limit", ["lower-limits"]),
    ("limit", ["lower-limits", "upper-limits"]),
    ("precession", ["precession-sweep"]),
    ("sway", ["sway"]),
    ("hold", ["hold"]),
)


@pytest.mark.parametrize(("name", "inputs"), INPUTS)
def test_recalling_a_result_gives_what_was_found(tmp_path, sample_data, name, inputs):
    paths = [shutil.copytree(sample_data / one, tmp_path / "runs" / one) for one in inputs]
    places = paths if len(paths) == 1 else [tmp_path / "runs"]
    analysis = ANALYSES[name]
    options = analysis.options_from({})
    found = analysis.analyze(places, options)
    save(analysis.result_of(found, found.place), found.place, picture=None)
    again = analysis.recall(places, options)
    assert all(origin.text.startswith("as levilab analyze found it") for origin in again.origins)
    assert differences(found.runs, again.runs) == []
    assert differences(found.combined, again.combined) == []
    assert differences(found.budget, again.budget) == []
    assert again.all_warnings == found.all_warnings
    assert analysis.document(again, tmp_path) == analysis.document(found, tmp_path)

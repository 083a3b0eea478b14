"""Each analysis: what is recalled from result.json is what was found."""

import shutil

import pytest

from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.result import save
from support.equal import differences

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

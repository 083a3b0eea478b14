"""A report of many runs: an overview, in which nothing is said a hundred times and nothing is left out."""

import re

import pytest

from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.limit.figure import limit_figure
from levilab.report.document import MOST_IN_FULL
from levilab.report.page import write_report
from many_runs import make_runs
from support.paths import SAMPLE_DATA

COUNT = 16


@pytest.fixture
def page(tmp_path, undrawn_figures):
    """Of sixteen runs, two of which are broken."""
    make_runs(tmp_path / "runs", COUNT, broken=8)
    output = write_report([tmp_path / "runs"], tmp_path / "report.html", tell=pytest.fail)
    return output.read_text(encoding="utf-8")


def test_facts_that_many_runs_share_stand_there_once(page):
    assert COUNT - 2 > MOST_IN_FULL
    assert page.count("<dt>Status</dt>") == page.count("no instruments recorded") == 1
    assert len(re.findall(r"<summary><strong>[^<]*spin-[0-9a-f]+</strong>", page)) == COUNT - 2
    assert page.count("This run alone") == COUNT - 2
    assert page.count("/run.json: is cut off") == 1, "a broken run is named once, not once by each analysis"
    assert "data:image/png;base64," in page
    assert all(f'id="{target}"' in page for target in re.findall(r'href="#([^"]+)"', page))


def test_warnings_that_are_alike_stand_together(tmp_path):
    folders = make_runs(tmp_path / "runs", 6, broken=0)
    for folder in folders[:4]:
        with (folder / "readings.csv").open("a", encoding="utf-8") as file:
            file.write("200,")
    found = ANALYSES["spindown"].analyze([tmp_path / "runs"])
    torn = [alike for alike in found.grouped_warnings if "cut off" in alike[0]]
    assert [len(alike) for alike in torn] == [4]
    assert sorted(text for alike in found.grouped_warnings for text in alike) == sorted(found.all_warnings)


def test_of_many_runs_a_legend_does_not_name_each(tmp_path):
    limits = (SAMPLE_DATA / "upper-limits" / "readings.csv").read_text(encoding="utf-8")
    for k in range(9):
        (tmp_path / f"{k}.csv").write_text(limits.replace(",69.26", f",69.{k}6"), encoding="utf-8")
    found = ANALYSES["limit"].analyze([tmp_path])
    legend = limit_figure(found).axes[0].get_legend()
    assert [text.get_text() for text in legend.get_texts() if "runs" in text.get_text()] == ["9 runs: a top ± u"]
    assert len(legend.get_texts()) < len(found.sources)

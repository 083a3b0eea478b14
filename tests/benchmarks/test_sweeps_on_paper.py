"""The page about a thousand million points holds what its script computes."""

import json

import sweeps_on_paper
from support.paths import ROOT

PAGE = ROOT / "benchmarks/results/sweeps_on_paper.md"


def test_the_page_holds_what_its_script_computes():
    found = json.loads(sweeps_on_paper.RESULTS.read_text(encoding="utf-8"))
    assert sweeps_on_paper.page(found) in PAGE.read_text(encoding="utf-8")


def test_a_parent_that_is_slower_allows_fewer_cores():
    one = sweeps_on_paper.Measured(1e-3, 30.0, 10e-3, 2e-3, 2e-3, (17.0, 15.0), 3, 2000, 2e8)
    limits = {limit.name: limit for limit in sweeps_on_paper.limits_of(one, 2.0)}
    parent = limits["the parent, which writes"]
    # 83 chunks a second of 2 s each
    assert parent.cores == 2.0 / 12e-3
    assert parent.share == sweeps_on_paper.MACHINES * sweeps_on_paper.CORES_A_MACHINE / parent.cores
    # a million points in 500 chunks of three files
    assert round(limits["files of the store"].points / 1e8) == round(1e6 / 3 * 2000 / 1e8)

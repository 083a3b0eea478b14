"""The study: its page is made from its numbers, says what they say, and points of its maps come out again."""

import importlib.util
import json
import re

import numpy as np
import pytest

from levilab.simulator import preset, simulate_many
from levilab.sweeps.observables import observe
from levilab.sweeps.plan import Axis, Plan
from support.paths import ROOT

DOCS, STUDY = ROOT / "docs", ROOT / "benchmarks" / "study"
FOUND = json.loads((ROOT / "benchmarks/results/study.json").read_text(encoding="utf-8"))
TEXT = (DOCS / "study.md").read_text(encoding="utf-8")
#: Numbers with a point that the template may have: of starts, scans and scenes, which were chosen.
CHOSEN = {
    "0.01", "24.45", "25.26", "1.8", "0.1", "0.0025", "0.02", "0.7", "0.4", "0.2", "0.8", "0.3", "24.9", "25.20",
    "25.40", "25.4", "30.0", "30.9",
}  # fmt: skip


def page_module():
    spec = importlib.util.spec_from_file_location("study_page", STUDY / "page.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_made_from_the_numbers():
    assert page_module().page(FOUND) == TEXT, "run `python benchmarks/study --page`"


def test_the_page_says_in_words_what_the_numbers_say():
    claims = page_module().claims(FOUND)
    assert [claim for claim, holds in claims.items() if not holds] == []


def test_no_result_is_written_into_the_template_by_hand():
    template = (STUDY / "page.md.j2").read_text(encoding="utf-8")
    prose = re.sub(r"\{\{.*?\}\}|\{%.*?%\}|\{#.*?#\}|```.*?```", "", template, flags=re.DOTALL)
    assert set(re.findall(r"\d+\.\d+", prose)) <= CHOSEN


def test_points_of_the_survival_map_come_out_again():
    spots = FOUND["spots"]["survival"]
    spins, masses, heights, up, lifetimes = zip(*spots, strict=True)
    keys = {"start.spin_hz": spins, "top.mass_kg": masses, "start.position_m.2": heights}
    tops = simulate_many(preset("undriven"), keys, 30.0, tolerance=1e-6, errors=False)
    assert tops.survived.tolist() == list(up)
    fell = ~tops.survived
    expected = np.array([lifetime for lifetime in lifetimes if lifetime is not None])
    # the kept ones are rounded to 1e-6 s; another step changes the time of a fall that is no chance by less
    assert tops.time[fell] == pytest.approx(expected, abs=1e-4)


def test_points_of_the_lock_map_come_out_again():
    spots = FOUND["spots"]["lock"]
    drives, amplitudes, up, locked = (np.array(column) for column in zip(*spots, strict=True))
    axes = (Axis("drive.frequency_hz", drives, "table"), Axis("drive.amplitude_t", amplitudes, "table"))
    plan = Plan(preset("driven"), axes, ("survived", "locked"), 60.0, tolerance=1e-6)
    found = observe(plan, {axis.key: axis.values for axis in axes})
    assert found["survived"].tolist() == up.tolist()
    assert found["locked"].tolist() == locked.tolist()
    assert set(locked.tolist()) == {False, True}


def test_the_page_begins_with_the_commands_of_both_maps():
    shown = [line[2:] for line in TEXT.splitlines() if line.startswith("$ levilab sweep")]
    assert shown == [FOUND["commands"]["survival"], FOUND["commands"]["lock-sine"]]
    assert "'" not in "".join(FOUND["commands"].values())  # a quote that Windows does not know


@pytest.mark.parametrize("name", ["survival", "tongue", "masses", "edge", "limits", "lock"])
def test_the_figures_of_the_page_are_small(name):
    path = DOCS / "study" / f"{name}.png"
    assert 20_000 < path.stat().st_size <= 150_000
    assert f"study/{name}.png" in TEXT

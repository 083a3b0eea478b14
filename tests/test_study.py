"""The study: its page says what was found, and points of its maps come out again."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest

from levilab.simulator import preset, simulate_many
from levilab.sweeps.observables import observe
from levilab.sweeps.plan import Axis, Plan
from support.paths import ROOT

PAGE = ROOT / "docs" / "study.md"
FOUND: dict[str, Any] = json.loads((ROOT / "benchmarks/results/study.json").read_text(encoding="utf-8"))

#: Where in the results → how the page says it.
SAID = {
    ("survival", "up"): "{} of",
    ("survival", "tops"): "of {} tops",
    ("survival", "above_window"): "{} above it",
    ("survival", "lighter_than_adiabatic"): "{} tops lighter than it",
    ("bounces", "example", "mass_g"): "One of {:.0f} g",
    ("edge", "count_exponent"): "power -{:.2f} of the step",
    ("edge", "flips_of_nudge_m", "1e-06"): "by 1e-6 m {}",
    ("edge", "uncertainty_exponent"): "power {:.2f} of the distance",
    ("foot", "largest_difference_hz"): "by {:.2f} Hz at most; no number is fitted",
    ("starts", "IC1", "all_up_until_hz"): "up to {:.2f} Hz",
    ("starts", "changes", "IC4-steady", "lower_hz"): "to {:.2f} Hz. - **Upper",
    ("starts", "changes", "IC3-near-axis", "lower_hz"): "to {:.2f} Hz. With 5 mm",
    ("locks", "sine", "exponent"): "power {:.2f} for a sine",
    ("locks", "square_over_sine"): "{:.2f} times as wide",
    ("locks", "phase", "rms_difference_hz"): "off by {:.2f} Hz (rms)",
    ("locks", "modes", "vertical_hz"): "({:.2f} Hz, violet)",
}


def test_the_page_says_what_the_study_found() -> None:
    text = re.sub(r"\s+", " ", PAGE.read_text(encoding="utf-8"))
    for path, form in SAID.items():
        value: Any = FOUND
        for key in path:
            value = value[key]
        assert form.format(value) in text, path
    for name in ("IC1", "IC2", "IC3", "IC4"):
        found = FOUND["starts"][name]
        low, high = found["with_drag_hz"][1:]
        cells = [f"{found['lower_hz']:.2f}", f"{found['with_drag_published_hz']:.2f}", f"{low:.2f} to {high:.2f}"]
        assert f"| {name} | {found['published_hz'][0]:.2f} | {' | '.join(cells)} |" in text
        assert f"| {found['all_up_until_hz']:.2f} | {found['last_up_hz']:.2f} | {found['islands_above']} |" in text


def test_points_of_the_survival_map_come_out_again() -> None:
    spots = FOUND["spots"]["survival"]
    spins, masses, heights, up, lifetimes = zip(*spots, strict=True)
    keys = {"start.spin_hz": spins, "top.mass_kg": masses, "start.position_m.2": heights}
    tops = simulate_many(preset("undriven"), keys, 30.0, tolerance=1e-6, errors=False)
    assert tops.survived.tolist() == list(up)
    fell = ~tops.survived
    expected = np.array([lifetime for lifetime in lifetimes if lifetime is not None])
    # the kept ones are rounded to 1e-6 s; another step changes the time of a fall that is no chance by less
    assert tops.time[fell] == pytest.approx(expected, abs=1e-4)


def test_points_of_the_lock_map_come_out_again() -> None:
    spots = FOUND["spots"]["lock"]
    drives, amplitudes, up, locked = (np.array(column) for column in zip(*spots, strict=True))
    axes = (Axis("drive.frequency_hz", drives, "table"), Axis("drive.amplitude_t", amplitudes, "table"))
    plan = Plan.of(preset("driven"), axes, ("survived", "locked"), 60.0, tolerance=100.0)
    found = observe(plan, {axis.key: axis.values for axis in axes})
    assert found["survived"].tolist() == up.tolist()
    assert found["locked"].tolist() == locked.tolist()
    assert set(locked.tolist()) == {False, True}


def test_the_commands_of_the_page_are_those_of_the_study() -> None:
    text = PAGE.read_text(encoding="utf-8").replace("\\\n", "")
    shown = [re.sub(r"\s+", " ", line) for line in text.splitlines() if line.startswith("levilab sweep")]
    known = {frozenset(re.findall(r"--sweep (\S+)", one)) for one in FOUND["commands"]}
    assert len(shown) == 2
    assert all(frozenset(re.findall(r"--sweep (\S+)", one)) in known for one in shown)


@pytest.mark.parametrize("name", ["survival", "masses", "edge", "limits", "lock"])
def test_the_figures_of_the_page_are_small(name: str) -> None:
    path = ROOT / "docs" / "study" / f"{name}.png"
    assert 20_000 < path.stat().st_size <= 150_000
    assert f"study/{name}.png" in PAGE.read_text(encoding="utf-8")

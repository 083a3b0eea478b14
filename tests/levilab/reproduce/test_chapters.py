"""Quick chapters as a whole, slow ones in part: wrong numbers are noticed, and reasons have their words."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from levilab.motion.lines import AxisLines, NamedLine
from levilab.present.document.blocks import Picture
from levilab.present.style import as_svg
from levilab.reproduce import (
    beyond,
    dipole,
    drive,
    driven,
    errata,
    gans,
    limits,
    paths,
    simon,
    spindown,
    statistics,
    windows,
)
from levilab.reproduce.check import Because, Comparison, Verdict, check
from levilab.reproduce.tops import preset_at
from levilab.simulator.equilibrium import stability_of
from levilab.simulator.scene import preset
from levilab.stability.scan import all_up_until, last_up, lower_limit, upper_edges
from support.paths import ROOT

#: Chapters that take less than a second together; test_run.py looks at the verdicts of all.
QUICK = {"stability": windows, "statistics": statistics, "dipole": dipole, "spindown": spindown, "drive": drive}


@pytest.fixture(scope="module")
def quick():
    return {name: module.make() for name, module in QUICK.items()}


@pytest.fixture
def checks(monkeypatch):
    """The numbers that a chapter compares: a function of its name."""

    def of(name):
        module, kept = QUICK[name], []

        def keep(*given, **more):
            kept.append((given, more))
            return check(*given, **more)

        monkeypatch.setattr(module, "check", keep)
        module.make()
        return kept

    return of


def test_numbers_that_ours_was_made_for_do_not_count_as_independent(quick):
    kinds = {one.name: one.comparison for found in quick.values() for one in found.findings}
    assert kinds["run 1: C₁, straight line"] is Comparison.CONSTRUCTED
    assert kinds["mean of C₁"] is Comparison.CONSTRUCTED
    assert kinds["neither model is a perfect fit"] is Comparison.CONSTRUCTED
    assert kinds["the thesis's estimate, for 25.30 g at 7.3 cm"] is Comparison.FITTED
    assert kinds["b/a = 5.5/3: lower region from"] is Comparison.RECOMPUTED
    assert kinds["b = 2a: lower region from"] is Comparison.INDEPENDENT
    assert kinds["mean of ten"] is Comparison.INDEPENDENT
    near = {name: np.full(limits.MASSES_KG.size, one[0]) for name, one in limits.SIMULATED_HZ.items()}
    mass, *lower = limits.lower_checks(near, float(limits.MASSES_KG[5]))
    assert mass.comparison is None
    assert {one.comparison for one in lower} == {Comparison.FITTED}


@pytest.mark.parametrize("name", QUICK)
def test_a_wrong_published_number_is_unexpected(checks, name):
    for (title, printed, value, *rest), more in checks(name):
        away = 30 * printed.rounding + 30 * (more.get("u") or 0) + 2 * abs(value - printed.value)
        digits = len(printed.text.lower().partition("e")[0].partition(".")[2])
        text = f"{printed.value + away:.{digits + 2}e}" if "e" in printed.text else f"{printed.value + away:.{digits}f}"
        wrong = check(title, replace(printed, text=text), value, *rest, **more)
        explained = rest and isinstance(rest[0], Because) and isinstance(rest[0].explained, bool)
        assert explained or wrong.verdict is Verdict.UNEXPECTED, title


@pytest.mark.parametrize("name", QUICK)
def test_the_figures_of_a_chapter_are_drawn_and_explained(quick, name):
    pictures = [block for block in quick[name].blocks if isinstance(block, Picture)]
    assert pictures
    for picture in pictures:
        assert picture.alt
        assert picture.caption
        assert as_svg(picture.draw(), picture.name).startswith("<svg")


def test_made_up_readings_are_marked_in_the_chapter_and_its_figure(quick):
    found = quick["spindown"]
    assert "made up" in found.synthetic
    (picture,) = (block for block in found.blocks if isinstance(block, Picture))
    assert "SYNTHETIC" in picture.caption
    assert not quick["statistics"].synthetic


def test_the_least_spin_is_one_number_or_has_the_mass_that_changes_it_beside_it(quick):
    (estimate,) = (one for one in quick["stability"].findings if one.name.startswith("least spin"))
    assert "for 25.26 g at 7.30 cm, where they float, it is 21.69 Hz" in estimate.why
    slip = errata.least_spin()
    assert slip.values["true"] == pytest.approx(stability_of(preset("undriven")).sleeping, rel=1e-9)
    assert "25.26 g at 7.30 cm" in slip.name
    assert "the printed 14.005 Hz are its own equation's for 25.30 g at 7.3 cm" in slip.why
    limit, words, explained = paths.compare_sleeping_limits(preset_at("IC1", "friction"))
    assert limit == pytest.approx(21.729, abs=0.001)
    assert "21.73 Hz for its 25.285 g, which float at 7.28 cm" in words
    assert "25.26 g float at 7.30 cm, in a weaker field: 21.69 Hz" in words
    assert explained
    _, _, explained = paths.compare_sleeping_limits(preset_at("IC1", "friction", "top.inertia_axial_kg_m2=1.8e-6"))
    assert not explained


def test_the_edges_over_a_ring_of_dipoles_are_zeros_of_polynomials():
    low, high = gans.edges_by_hand()
    assert (low, high) == pytest.approx((1.69390, 1.82532), abs=1e-5)
    # up and down: B″ = −ψ‴ changes its sign at the lower edge
    assert abs(8 * low**4 - 24 * low**2 + 3) < 1e-9


def test_an_upper_limit_that_is_torn_differs_for_that_reason_alone():
    torn = limits.Upper(70.46, 80.9, np.array([70.47, 79.1]), np.ones(3, dtype=np.bool_), 9.9)
    (found,) = limits.upper_checks({"IC1": torn})
    assert found.verdict is Verdict.DIFFERS
    assert "1 islands" in found.why
    (found,) = limits.upper_checks({"IC1": replace(torn, until=60.0, last=60.0, edges=np.array([60.01]))})
    assert found.verdict is Verdict.UNEXPECTED


def test_the_power_near_named_lines_is_that_of_the_spectrum():
    rate, time = 64.0, np.arange(0, 64.0, 1 / 64)
    signal = np.exp(2j * np.pi * 5.0 * time) + 0.5 * np.exp(2j * np.pi * 5.5 * time)
    lines = AxisLines((NamedLine(5.0, 1.0, "drive"),), 0.03, 64.0, (signal, rate))
    assert driven.power_near(lines, 0.1) == pytest.approx(0.8, abs=0.01)
    assert driven.power_near(lines, 1.0) == pytest.approx(1.0, abs=0.01)
    assert driven.power_near(replace(lines, lines=(NamedLine(5.0, 1.0, ""),)), 1.0) == 0.0


def test_the_published_upper_limit_lies_in_the_range_of_starts_and_the_reason_says_so():
    way = simon._among([331.0, 328.0, 286.0])
    assert (way.low, way.high, way.step) == (286.0, 331.0, simon.STEP_RAD_S)
    assert "3 starts between 0.01 mm, 0.1 mrad and 1 mm, 10 mrad give 286 to 331 rad/s" in way.why


def test_the_mass_is_that_of_the_least_rms_difference():
    lower = {name: np.full(limits.MASSES_KG.size, one[0] + 0.1) for name, one in limits.SIMULATED_HZ.items()}
    for values in lower.values():
        values[3] -= 0.09
    mass, rms = limits.best_mass(lower)
    assert mass == limits.MASSES_KG[3]
    assert rms[3] == pytest.approx(0.01)


def test_a_limit_of_the_thesis_beyond_the_exact_window_differs_for_a_computed_reason(monkeypatch):
    low, high = beyond.about_window()
    assert low.verdict is Verdict.AGREES
    assert high.verdict is Verdict.DIFFERS
    assert high.ours_text.startswith("80.34 Hz")  # as the chapter on limits says
    assert "IC1, IC3 and IC4 lie below it; IC2 lies 1.39 Hz above it" in high.ours_text
    assert "from IC2 at 81 Hz" in high.why
    assert "is still up after 30 s; at 81.73 Hz it is lost after 6.2 s" in high.why
    monkeypatch.setattr(beyond, "BEYOND_HZ", 80.0)  # where small motions do not grow: no reason
    assert beyond.about_window()[1].verdict is Verdict.UNEXPECTED


def test_a_scan_has_limits_edges_and_gaps():
    spins, up = np.arange(5.0), np.array([False, True, True, False, True])
    assert lower_limit(spins, up) == 4.0
    assert last_up(spins, up) == 4.0
    assert upper_edges(spins, up).tolist() == [2.5]
    assert math.isnan(all_up_until(spins, up))
    assert all_up_until(spins, ~up) == 0.0
    assert math.isnan(lower_limit(spins, ~up & False))


def test_the_ends_in_full_motion_that_the_drives_chapter_quotes_are_the_kept_ones():
    results = json.loads((ROOT / "benchmarks/results/upper_limit.json").read_text(encoding="utf-8"))["entries"]
    fixed = next(
        one for one in results
        if (one["subject"], one["waveform"], one["field_t"], one["creep_hz_per_s"]) == ("creep", "sine", 4e-4, 0.1)
    )  # fmt: skip
    (loose,) = (one for one in results if one["subject"] == "washers")
    texts = [", ".join(f"{limit:.1f}" for limit in sorted(one["limit_hz"])) for one in (fixed, loose)]
    assert texts == ["64.0, 66.9, 69.1", "70.0, 70.0, 70.1"]
    (said,) = (one.ours_text for one in drive.about_61() if "loose washers" in one.name)
    assert "end at 64.0, 66.9 and 69.1 Hz with fixed washers, all at 70.0 to 70.1 Hz with loose ones" in said

"""Budgets of the results: they add up to u, they are kept with the result, and each row acts as it says."""

import numpy as np
import pytest

from analysis.spindown.drag import LAWS, spin
from levilab.pipelines.budget import budget_blocks, budget_table, sentences_of
from levilab.pipelines.catalogue import ANALYSES
from levilab.present.document.blocks import Details, Paragraph, Tabular
from support.paths import ROOT
from support.spin_downs import spin_down_csv

CASES = {
    "one spin-down": ("spindown", ("spin-down-1",)),
    "four spin-downs": ("spindown", ("spin-down-1", "spin-down-2", "spin-down-3", "spin-down-4")),
    "records": ("spin", ("trace-tape",)),
    "pulse times": ("spin", ("scope-files/pulse-times.txt",)),
    "a sound": ("spin", ("scope-files/recording.wav",)),
    "rounded times": ("spin", ("scope-files/rigol-ds1000e.csv",)),
    "a sweep": ("precession", ("precession-sweep",)),
    "a track": ("sway", ("sway/track.csv",)),
    "a held spin": ("hold", ("hold/45-hz",)),
    "a scan": ("field", ("field-scan",)),
    "lower limits": ("limit", ("lower-limits",)),
    "upper limits": ("limit", ("upper-limits",)),
}


def analyzed(name, paths, **given):
    row = ANALYSES[name]
    return row.analyze(paths, row.options_from(given))


@pytest.fixture(scope="module")
def found():
    return {
        case: analyzed(name, [ROOT / "sample_data" / part for part in parts]) for case, (name, parts) in CASES.items()
    }


def row_of(budget, name):
    (row,) = [one for one in budget.components if one.name == name]
    return row


def of(budgets, quantity):
    (budget,) = [one for one in budgets if one.quantity == quantity]
    return budget


@pytest.mark.parametrize("case", CASES)
def test_the_rows_of_every_budget_add_up_to_the_u_of_the_result(found, case):
    budgets = [one for origin in found[case].origins for one in origin.budget] + list(found[case].budget)
    assert budgets
    for budget in budgets:
        assert budget.closes, (budget.quantity, budget.combined / budget.u - 1)
        assert budget.u > 0
        assert all(row.contribution is None or np.isfinite(row.contribution) for row in budget.components)


@pytest.mark.parametrize("case", CASES)
def test_a_budget_is_of_the_value_that_the_result_has(found, case, tmp_path):
    name, _ = CASES[case]
    document = ANALYSES[name].document(found[case], tmp_path)
    values = document["values"] or document["runs"][0]["values"]
    for budget in document["budget"] if "budget" in document else document["runs"][0]["budget"]:
        if budget["quantity"] in values:
            assert budget["value"] == values[budget["quantity"]]["value"]
            assert budget["u"] == values[budget["quantity"]]["u"]


def test_of_laws_that_fit_alike_that_with_the_fewest_constants_has_the_budget(tmp_path):
    analysis = analyzed("spindown", [spin_down_csv(tmp_path / "run.csv", seed=7)])
    assert analysis.combined.best == "disc"
    assert not analysis.combined.verdict.decided
    assert {(one.model, one.quantity) for one in analysis.budget} >= {("disc", "c32")}
    assert of(analysis.budget, "c32").closes


# --- each row acts as it says --------------------------------------------------------------------------


def spin_down_file(folder, name, *, frequency=1.0, time=1.0, decimals=12):
    t = np.arange(0.0, 200.0, 10.0)
    nu = spin("disc", t, 40.0, 2.34e-4) + 0.003 * np.random.default_rng(2).standard_normal(len(t))
    lines = [f"{time * a:.9f},{frequency * b:.{decimals}f}" for a, b in zip(t, nu, strict=True)]
    path = folder / name
    path.write_text("\n".join(["time_s,spin_frequency_hz", *lines]) + "\n", encoding="utf-8")
    return path


def test_scatter_beyond_the_stated_u_names_the_law_about_which_it_is(tmp_path):
    budgets = analyzed("spindown", [spin_down_file(tmp_path, "run.csv")], tilt="none", reading_u=0.001).budget
    notes = [(budget.model, one.note) for budget in budgets for one in budget.included if one.name == "excess"]
    assert {law for law, _ in notes} == {"disc", "power"}
    assert all(note.endswith(f" about the {law} law") for law, note in notes)


def test_a_clock_that_is_wrong_moves_each_constant_by_its_row(tmp_path):
    off = 1e-4
    plain, fast, late = (
        analyzed("spindown", [spin_down_file(tmp_path, f"{k}.csv", frequency=f, time=t)], tilt="none", clock_u=off)
        for k, (f, t) in enumerate([(1.0, 1.0), (1 + off, 1.0), (1.0, 1 + off)])
    )
    budgets = plain.budget
    for name in LAWS["disc"].parameters:
        values = [one.runs[0].fit("disc").parameters[name].value for one in (plain, fast, late)]
        clock = row_of(of(budgets, name), "time_base")
        assert not clock.included
        assert values[1] - values[0] == pytest.approx(clock.sensitivity * off, rel=1e-3)
        if name == "c32":
            bench = row_of(of(budgets, name), "bench_clock")
            assert values[2] - values[0] == pytest.approx(bench.sensitivity * off, rel=1e-3)


def test_the_last_digit_is_part_of_the_scatter_and_no_more(tmp_path):
    fine, coarse = (
        analyzed("spindown", [spin_down_file(tmp_path, f"{d}.csv", decimals=d)], tilt="none").budget for d in (12, 2)
    )
    assert not [one for one in of(fine, "c32").components if one.name == "resolution"]
    row, budget = row_of(of(coarse, "c32"), "resolution"), of(coarse, "c32")
    assert row.u == pytest.approx(0.01 / 12**0.5)
    assert 0.2 < budget.share(row) < 1.0  # 2.9 mHz of 4 to 5
    assert budget.closes


def test_runs_that_differ_have_their_scatter_as_the_largest_row(found):
    budget = of(found["four spin-downs"].budget, "c32")
    assert budget.largest is row_of(budget, "runs")
    assert budget.share(budget.largest) > 0.9
    assert "16 instead of 4" in " ".join(sentences_of(budget))


def test_one_run_does_not_hide_that_runs_differ(found):
    row = row_of(of(found["one spin-down"].budget, "c32"), "runs")
    assert (row.u, row.included) == (None, False)
    assert "several runs" in " ".join(sentences_of(of(found["one spin-down"].budget, "c32")))


def test_a_scope_of_a_known_make_has_its_clock_as_a_row(found):
    row = row_of(of(found["records"].origins[0].budget, "frequency"), "time_base")
    assert row.u == pytest.approx(25e-6 / 3**0.5)
    assert not row.included
    assert "Rigol" in row.note


def test_a_clock_that_was_not_stated_is_not_known_rather_than_right(found):
    budget = of(found["a sound"].budget, "frequency")
    assert row_of(budget, "time_base").u is None
    assert "the option --clock-u gives it" in row_of(budget, "time_base").note  # as it is typed
    assert "Not known: clock of the recording" in " ".join(sentences_of(budget))


def test_the_clocks_of_a_sweep_are_a_factor_of_its_slope(found):
    row = row_of(of(found["a sweep"].budget, "slope"), "clocks")
    assert (row.u, row.included) == (pytest.approx(2e-5), False)


@pytest.mark.parametrize("with_u", [True, False])
@pytest.mark.parametrize("orthogonal", [True, False])
def test_a_line_closes_whatever_is_known_of_its_points(tmp_path, with_u, orthogonal):
    random, x = np.random.default_rng(3), np.linspace(28, 44, 9)
    y = x + 0.02 * random.standard_normal(9)
    lines = [f"{a},{b:.4f}" + (",0.004,0.01" if with_u else "") for a, b in zip(x, y, strict=True)]
    head = "drive_frequency_hz,precession_frequency_hz" + (
        ",precession_frequency_u_hz,drive_frequency_u_hz" if with_u else ""
    )
    path = tmp_path / "sweep.csv"
    path.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    budgets = analyzed("precession", [path], orthogonal=orthogonal).budget
    assert [budget.quantity for budget in budgets] == ["slope", "intercept"]
    assert all(budget.closes for budget in budgets)
    names = {one.name for one in budgets[0].included}
    assert ("drive" in names) == orthogonal
    assert ("excess" in names) == with_u  # the points scatter by more than their u either way


# --- how people are shown it ---------------------------------------------------------------------------


def test_a_table_has_u_between_what_is_in_it_and_what_is_not(found):
    table = budget_table(of(found["four spin-downs"].budget, "c32"))
    sources = [row.cells[0] for row in table.rows]
    middle = sources.index("combined: u")
    assert not any("(not in u)" in text for text in sources[:middle])
    assert all("(not in u)" in text for text in sources[middle + 1 :] if text != "u with all that is known")


def test_a_field_is_shown_in_the_units_of_the_laboratory(found):
    table = budget_table(of(found["a scan"].budget, "strength"))
    assert "mT cm" in table.title
    assert any("mm" in row.cells[2] for row in table.rows)


def test_budgets_are_folds_and_their_origins_are_said_once(found):
    budgets = found["a sweep"].budget
    blocks = budget_blocks(budgets)
    # what holds for both is said once
    assert [type(block) for block in blocks] == [Details, Details, Paragraph, Details]
    assert [type(block) for block in blocks[0].blocks] == [Tabular]
    assert len({block.blocks[0].name for block in blocks[:2]}) == 2

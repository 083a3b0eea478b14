"""What the fits mean: no sentence contradicts another."""

from dataclasses import replace

import numpy as np
from matplotlib.text import Text
from scipy.linalg import toeplitz

from analysis.spindown.drag import LAWS
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.spindown.document import SPINDOWN
from levilab.pipelines.spindown.figure import spindown_figure
from levilab.pipelines.spindown.report import count_table, meaning, spindown_part, spindown_tables
from levilab.pipelines.spindown.words import SYMBOLS
from levilab.present.document.blocks import Verdict
from levilab.present.numbers import with_uncertainty
from levilab.report.document import blocks_of_part
from levilab.report.reproduction import Asked
from levilab.texts.text import in_language

U = 0.027


def test_runs_whose_drag_differs_are_not_said_to_agree(tmp_path):
    analysis = undecided(tmp_path)
    scatter = meaning(analysis)[-1]
    assert SYMBOLS["c32"] in scatter
    assert "agree" not in scatter


def test_note_and_table_have_one_number_of_independent_readings(tmp_path):
    rng, residuals, time = np.random.default_rng(10), [], 10.0 * np.arange(12)
    for _ in time:
        residuals.append(0.9 * residuals[-1] + 0.19**0.5 * rng.normal() if residuals else rng.normal())
    spin = 40 * (1 + 2.34e-4 * np.sqrt(2 * np.pi * 40) * time / 2) ** -2 + 0.03 * np.array(residuals)
    np.savetxt(path := tmp_path / "my.csv", np.column_stack([time, spin]), delimiter=",", header="t,f", comments="")
    analysis = SPINDOWN.analyze([path])
    correlation = toeplitz(analysis.runs[0].correlation.value ** np.arange(12.0))
    worth = f"{12**2 / correlation.sum():.2g}"  # the variance of a reading over that of the mean
    assert f"12 readings are worth as much as {worth} independent ones" in " ".join(analysis.all_warnings)
    shown = count_table(analysis, symbols=True)
    assert f"{worth} of 12" in shown.rows[0].cells[-1]
    assert in_language(shown.title, "de").startswith("Was der Zähler vom Taumeln sieht, nach dem besten Gesetz. δ: ")


def test_text_figure_and_tables_have_one_verdict(tmp_path):
    """Also where the power law, of more constants, has the smallest criterion."""
    analysis = undecided(tmp_path)
    first = min(analysis.combined.fits, key=lambda fit: fit.statistics.difference or 0.0)
    assert len(LAWS[first.name].constants) > 1
    assert analysis.combined.best == "disc"
    assert "cannot be distinguished: disc has the fewest constants" in analysis.text
    assert "; disc is off by" in analysis.text
    assert "Messwerte schließen das Gesetz von Stokes und das Gesetz von Newton aus" in in_language(analysis.text, "de")
    figure = spindown_figure(analysis)
    written = [text.get_text() for text in figure.findobj(Text)]
    assert any("cannot be distinguished; disc has the fewest constants" in " ".join(one.split()) for one in written)
    assert not any("best" in one or "first" in one for one in written)
    assert any("less the disc law" in one for one in written)
    assert any("Run by run" in one.title and "fit of the disc law" in one.title for one in spindown_tables(analysis))


def test_a_law_that_is_no_better_is_not_as_good_in_german(sample_data):
    text = ANALYSES["spindown"].analyze([sample_data / "spin-down-1"]).text
    assert "No better than disc, with more constants: " in text
    assert "Nicht besser als das Scheibengesetz, aber mit mehr Konstanten: " in in_language(text, "de")


def test_the_report_begins_with_the_constant_and_its_u(tmp_path):
    analysis = undecided(tmp_path)
    c32 = analysis.combined.fit("disc").constants["c32"]
    value = f"the drag of the air grows as ω^(3/2), with {SYMBOLS['c32']} = {with_uncertainty(c32)}, known to 1"
    assert f"If the disc law holds, {value}" in analysis.text
    decided = replace(analysis.combined, verdict=replace(analysis.combined.verdict, decided=True))
    found = replace(analysis, combined=decided)
    assert found.text.startswith(f"The disc law fits best: {value}")
    (box,) = [one for one in result_of(found) if isinstance(one, Verdict)]
    assert box.text == found.text
    changed = replace(decided, verdict=replace(decided.verdict, describes=False, changed=(0,)))
    none = replace(analysis, combined=changed).text
    assert none.startswith("No law describes")
    assert SYMBOLS["c32"] not in none


def test_numbers_that_are_shown_fit_each_other_and_one_that_laws_share_is_shown_once(tmp_path):
    analysis = undecided(tmp_path)
    found = analysis.combined
    means = {"c32": replace(found.fit("disc").constants["c32"], value=2.3e-4, u=2.249e-6)}
    fits = [replace(fit, statistics=replace(fit.statistics, rms_residual=0.27)) for fit in found.fits]
    fits = tuple(replace(fit, constants=means) if fit.name == "disc" else fit for fit in fits)
    decided = replace(found.verdict, decided=True, excluded=("stokes", "newton"))
    text = replace(analysis, combined=replace(found, fits=fits, verdict=decided)).text
    assert "2.300(22)×10⁻⁴ (rad/s)^−½/s, known to 0.96 %." in text
    assert "The readings exclude Stokes and Newton, off by 0.27 Hz (rms);" in text


def result_of(analysis):
    section = blocks_of_part(ANALYSES["spindown"], analysis, spindown_part(analysis), Asked(crosscheck=False))[0]
    return section.blocks


def undecided(tmp_path):
    t, random = np.arange(0, 190, 10.0), np.random.default_rng(10)
    for c in (2.28e-4, 2.34e-4, 2.40e-4):
        f = (250**-0.5 + c * t / 2) ** -2 / (2 * np.pi) + random.normal(0, U, t.size)
        rows = "\n".join(f"{time},{spin},{U}" for time, spin in zip(t, f, strict=True))
        (tmp_path / f"{c}.csv").write_text(f"t,f,u\n{rows}\n", encoding="utf-8")
    return SPINDOWN.analyze(sorted(tmp_path.glob("*.csv")))

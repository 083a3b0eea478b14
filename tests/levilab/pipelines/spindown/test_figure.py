"""The figure: what its axes say, that nothing hides what the text points at, and that it is the same each time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from matplotlib.colors import to_hex

from levilab.pipelines.spindown.analysis import SpinDownAnalysis, SpinDownOptions, analyze_spindowns
from levilab.pipelines.spindown.figure import MOST_POINTS, STRAIGHT_LINES, spindown_figure
from levilab.pipelines.spindown.laws import SHOWN_LAWS
from levilab.present.style import as_svg
from support.spin_downs import spin_down_csv

COLOURS = {name: law.colour for name, law in SHOWN_LAWS.items()}

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def analysis_of(*paths: Path, u: float | None = None) -> SpinDownAnalysis:
    return analyze_spindowns(paths, SpinDownOptions(reading_u=u))


def panels(figure: Figure) -> tuple[Axes, list[Axes], list[Axes], list[Axes]]:
    """The spin, the residuals, the straight lines and the strips below them."""
    spin, *others = figure.axes
    laws, lines = len(COLOURS), len(STRAIGHT_LINES)
    return spin, others[:laws], others[laws : laws + lines], others[laws + lines :]


def curves(axes: Axes) -> list[str]:
    """The colours of the drawn lines, without the readings' marks."""
    return [to_hex(line.get_color()).upper() for line in axes.get_lines() if line.get_linestyle() != "None"]


def legend(axes: Axes) -> list[str]:
    shown = axes.get_legend()
    assert shown
    return [text.get_text() for text in shown.get_texts()]


def with_readings(path: Path, rows: Sequence[tuple[int, str]]) -> Path:
    lines = path.read_text(encoding="utf-8").split("\n")
    for line, text in rows:
        lines[line] = text
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def test_every_axis_says_quantity_and_unit(tmp_path: Path) -> None:
    spin, residuals, lines, strips = panels(spindown_figure(analysis_of(spin_down_csv(tmp_path / "a.csv"))))
    assert "Hz" in spin.get_ylabel()
    assert "[s]" in spin.get_xlabel()
    assert [axes.get_title(loc="left") for axes in residuals] == list(COLOURS)
    assert [axes.get_ylabel().split()[0] for axes in lines] == ["ln", "1/ω", "ω$^{−1/2}$"]
    assert all("rad" in axes.get_ylabel() for axes in lines)
    assert all("[s]" in axes.get_xlabel() for axes in (*residuals, *strips))


def test_straight_line_panels_show_angular_frequency_as_the_tables_do(tmp_path: Path) -> None:
    analysis = analysis_of(spin_down_csv(tmp_path / "a.csv"))
    lines = panels(spindown_figure(analysis))[2]
    drawn = next(line for line in lines[0].get_lines() if line.get_linestyle() == "None")
    assert np.asarray(drawn.get_ydata()) == pytest.approx(np.log(2 * np.pi * analysis.runs[0].frequency))


def test_each_law_has_its_own_residual_scale_and_says_so(tmp_path: Path) -> None:
    residuals = panels(spindown_figure(analysis_of(spin_down_csv(tmp_path / "a.csv"))))[1]
    tops = {axes.get_title(loc="left"): axes.get_ylim()[1] for axes in residuals}
    assert tops["stokes"] > 3 * tops["disc"]
    assert all(axes.get_ylim()[0] == -axes.get_ylim()[1] for axes in residuals)
    notes = [axes.get_title(loc="right") for axes in residuals]
    assert all("±" in note and "Hz" in note for note in notes)
    assert len(set(notes)) > 1


@pytest.mark.parametrize("known", [True, False])
def test_a_band_and_bars_of_u_are_there_where_u_is_known(tmp_path: Path, known: bool) -> None:
    residuals = panels(spindown_figure(analysis_of(spin_down_csv(tmp_path / "a.csv", u=known))))[1]
    for axes in residuals:
        bands = [patch.get_extents().transformed(axes.transData.inverted()) for patch in axes.patches]
        assert [(band.y0, band.y1) for band in bands] == ([pytest.approx((-0.03, 0.03))] if known else [])
        assert len(axes.collections) == int(known)


def test_bars_are_drawn_on_the_readings_where_one_can_see_them(tmp_path: Path) -> None:
    small, large = (spin_down_csv(tmp_path / f"{noise}.csv", noise=noise) for noise in (0.03, 0.5))
    assert [len(panels(spindown_figure(analysis_of(path)))[0].collections) for path in (small, large)] == [0, 1]


def test_an_outlier_squeezes_nothing_and_stands_at_the_edge_with_its_value(tmp_path: Path) -> None:
    path = with_readings(spin_down_csv(tmp_path / "a.csv"), [(6, "50.0,62.0,0.03"), (13, "120.0,3.5,0.03")])
    spin = panels(spindown_figure(analysis_of(path)))[0]
    low, high = spin.get_ylim()
    assert 20 < low < 22
    assert 40 < high < 42
    assert {text.get_text() for text in spin.texts} == {"62 Hz", "3.5 Hz"}
    marks = [line for line in spin.get_lines() if line.get_marker() in {"^", "v"} and line.get_color() == "red"]
    assert len(marks) == 2
    assert all(low < float(np.asarray(mark.get_ydata())[0]) < high for mark in marks)
    assert legend(spin).count("outlier") == 1


def test_of_one_run_every_law_is_drawn_and_named_and_the_best_is_on_top(tmp_path: Path) -> None:
    analysis = analysis_of(spin_down_csv(tmp_path / "a.csv"))
    spin = panels(spindown_figure(analysis))[0]
    assert curves(spin) == list(COLOURS.values())
    best = max((line for line in spin.get_lines() if line.get_linestyle() != "None"), key=lambda line: line.zorder)
    assert to_hex(best.get_color()).upper() == COLOURS[analysis.combined.best]
    assert best.get_linewidth() == max(line.get_linewidth() for line in spin.get_lines())
    names = legend(spin)
    assert [name.split()[0] for name in names[:5]] == list(COLOURS)
    assert "(excluded)" in names[0]
    assert any("(best)" in name for name in names) == analysis.combined.verdict.decided


def test_many_runs_are_one_mark_and_one_law_each(tmp_path: Path) -> None:
    analysis = analysis_of(*(spin_down_csv(tmp_path / f"{k}.csv", seed=k) for k in range(12)))
    spin = panels(spindown_figure(analysis))[0]
    best = COLOURS[analysis.combined.best]
    assert curves(spin).count(best) == 12
    assert len(curves(spin)) == 12 + 4
    marks = [line for line in spin.get_lines() if line.get_linestyle() == "None"]
    assert {line.get_marker() for line in marks} == {"o"}
    assert len({to_hex(line.get_color()) for line in marks}) == 12
    assert len(legend(spin)) == 6
    assert "12 runs" in legend(spin)


def test_the_legend_shows_short_names_and_takes_them_literally(tmp_path: Path) -> None:
    names = ["20261120T101500Z-spin-7f3a.csv", "_hidden.csv", "$a_{b$.csv", "中.csv"]
    paths = [spin_down_csv(tmp_path / name, seed=k) for k, name in enumerate(names)]
    figure = spindown_figure(analysis_of(*paths))
    as_svg(figure)
    assert legend(panels(figure)[0])[5:] == ["spin-7f3a.csv", " _hidden.csv", r"\$a_{b\$.csv", "□.csv"]


def test_many_readings_are_thinned_out_and_means_show_the_shape(tmp_path: Path) -> None:
    path = spin_down_csv(tmp_path / "a.csv", n=300, u=False)
    residuals = panels(spindown_figure(analysis_of(path, u=0.03)))[1]
    for axes in residuals:
        points = [len(np.asarray(line.get_xdata())) for line in axes.get_lines()]
        assert max(points) <= MOST_POINTS
        assert 40 in points


def test_the_same_results_are_drawn_as_the_same_bytes(sample_data: Path) -> None:
    analysis = analysis_of(sample_data)
    assert as_svg(spindown_figure(analysis)) == as_svg(spindown_figure(analysis))

"""The figure: what its axes say, that nothing hides what the text points at, and that it is the same each time."""

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex

from analysis.spindown.drag import LAWS
from levilab.pipelines.options import SpinDownOptions
from levilab.pipelines.spindown.document import SPINDOWN
from levilab.pipelines.spindown.figure import MOST_POINTS, spindown_figure
from levilab.present.looks import LOOKS
from levilab.present.style import as_svg
from support.figures import faults
from support.paths import SAMPLE_DATA
from support.spin_downs import spin_down_csv

COLOURS = {name: LOOKS[name].colour for name in LAWS}


def analysis_of(*paths, u=None):
    return SPINDOWN.analyze(paths, SpinDownOptions(reading_u=u, tilt="none"))


@pytest.fixture(scope="module")
def analysis(tmp_path_factory):
    """Of a run of twenty readings with their u."""
    return analysis_of(spin_down_csv(tmp_path_factory.mktemp("run") / "a.csv"))


@pytest.fixture(scope="module")
def figure(analysis):
    """Its figure, which no test changes."""
    return spindown_figure(analysis)


@pytest.fixture(scope="module")
def page(figure):
    """The same for a page."""
    return as_svg(figure, "x")


def test_laws_without_a_straight_line_have_no_panel_for_one(tmp_path, figure):
    path = spin_down_csv(tmp_path / "a.csv")
    drawn = spindown_figure(SPINDOWN.analyze([path], SpinDownOptions(laws=("mixed", "power"), tilt="none")))
    assert len(drawn.axes) == 3 + 2
    assert drawn.get_figheight() < figure.get_figheight()
    assert not faults(drawn)


def test_the_four_decimals_of_a_sharp_record_leave_room_for_the_label():
    assert not faults(spindown_figure(SPINDOWN.analyze([SAMPLE_DATA / "sway" / "phone.csv"], SpinDownOptions())))


def panels(figure):
    """The spin, the residuals, the straight lines and the strips below them."""
    spin, _, _, *others = figure.axes
    laws, lines = len(COLOURS), others[len(COLOURS) :]
    return spin, others[:laws], lines[::2], lines[1::2]


def differences(figure):
    return figure.axes[2]


def curves(axes):
    """The colours of the drawn lines, without the readings' marks."""
    return [to_hex(line.get_color()).upper() for line in axes.get_lines() if line.get_linestyle() != "None"]


def legend(axes):
    shown = axes.get_legend()
    return [text.get_text() for text in shown.get_texts()]


def with_readings(path, rows):
    lines = path.read_text(encoding="utf-8").split("\n")
    for line, text in rows:
        lines[line] = text
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


@pytest.mark.parametrize("seed", range(3))
def test_residuals_lie_inside_their_panels_in_units_that_are_not_seconds(tmp_path, seed):
    path = spin_down_csv(tmp_path / "a.csv", u=False, seed=seed)
    figure = spindown_figure(analysis_of(path))
    _, residuals, _, _ = panels(figure)
    assert residuals[0].get_ylabel() == "residual / scatter"
    for axes in residuals:
        low, high = axes.get_ylim()
        shown = np.concatenate([line.get_ydata() for line in axes.get_lines() if line.get_linestyle() == "None"])
        assert low < 0.95 * shown.min()
        assert 0.95 * shown.max() < high
        assert max(abs(shown)) * 1.1 < high


def test_every_axis_says_quantity_and_unit(figure):
    spin, residuals, lines, strips = panels(figure)
    assert "Hz" in spin.get_ylabel()
    assert "[s]" in spin.get_xlabel()
    assert [axes.get_title(loc="left") for axes in residuals] == [law.capitalize() for law in COLOURS]
    assert [axes.get_ylabel().split()[0] for axes in lines] == ["ln", "1/ω", "ω$^{−1/2}$"]
    assert all("rad" in axes.get_ylabel() for axes in lines)
    assert all("[s]" in axes.get_xlabel() for axes in (*residuals, *strips))


def test_straight_line_panels_show_angular_frequency_as_the_tables_do(analysis, figure):
    lines = panels(figure)[2]
    drawn = next(line for line in lines[0].get_lines() if line.get_linestyle() == "None")
    assert np.asarray(drawn.get_ydata()) == pytest.approx(np.log(2 * np.pi * analysis.runs[0].frequency))


def test_good_laws_share_a_scale_and_a_bad_one_says_that_it_has_its_own(figure):
    residuals = panels(figure)[1]
    tops = {axes.get_title(loc="left"): axes.get_ylim()[1] for axes in residuals}
    assert tops["Disc"] == tops["Mixed"] == tops["Power"]
    assert tops["Stokes"] > 3 * tops["Disc"]
    assert all(axes.get_ylim()[0] == -axes.get_ylim()[1] for axes in residuals)
    notes = {axes.get_title(loc="left"): axes.get_title(loc="right") for axes in residuals}
    assert notes == {"Stokes": "own scale", "Newton": "own scale", "Disc": "", "Mixed": "", "Power": ""}


@pytest.mark.parametrize("known", [True, False])
def test_residuals_are_in_units_of_u_or_of_the_scatter_with_bands(tmp_path, known):
    analysis = analysis_of(spin_down_csv(tmp_path / "a.csv", u=known))
    best = analysis.runs[0].fit(analysis.combined.best)
    residuals = panels(spindown_figure(analysis))[1]
    assert residuals[0].get_ylabel() == f"residual / {'u' if known else 'scatter'}"
    for axes in residuals:
        bands = [patch.get_extents().transformed(axes.transData.inverted()) for patch in axes.patches]
        assert [(band.y0, band.y1) for band in bands] == [pytest.approx((-2, 2)), pytest.approx((-1, 1))]
        assert len(axes.collections) == int(known)
    drawn = next(line for line in residuals[2].get_lines() if line.get_marker() == "o")
    fit = analysis.runs[0].fit("disc")
    u = 0.03 if known else best.statistics.rms_residual
    assert np.asarray(drawn.get_ydata()) == pytest.approx(fit.residuals / u)


def test_bars_are_drawn_on_the_readings_where_one_can_see_them(tmp_path):
    small, large = (spin_down_csv(tmp_path / f"{noise}.csv", noise=noise) for noise in (0.03, 0.5))
    assert [len(panels(spindown_figure(analysis_of(path)))[0].collections) for path in (small, large)] == [0, 1]


def test_an_outlier_squeezes_nothing_and_stands_at_the_edge_with_its_value(tmp_path):
    path = with_readings(spin_down_csv(tmp_path / "a.csv"), [(6, "50.0,62.0,0.03"), (13, "120.0,3.5,0.03")])
    spin = panels(spindown_figure(analysis_of(path)))[0]
    low, high = spin.get_ylim()
    assert 20 < low < 22
    assert 40 < high < 42
    assert {text.get_text() for text in spin.texts} == {"62 Hz", "3.5 Hz"}
    marks = [line for line in spin.get_lines() if line.get_marker() in {"^", "v"}]
    assert len(marks) == 2
    assert all(low < float(np.asarray(mark.get_ydata())[0]) < high for mark in marks)
    assert legend(spin).count("left out") == 1


def test_every_law_is_drawn_against_the_best_one_and_named_with_the_verdict(figure):
    assert curves(panels(figure)[0]) == [COLOURS["disc"]]
    axes = differences(figure)
    lines = [np.asarray(line.get_ydata()) for line in axes.get_lines() if line.get_linestyle() != "None"]
    drawn = dict(zip(curves(axes), lines, strict=True))
    assert set(drawn) == set(COLOURS.values())
    assert np.abs(drawn[COLOURS["disc"]]).max() == 0
    names = {text.partition(":")[0]: text for text in legend(axes)}
    assert set(names) == {law.capitalize() for law in COLOURS}
    assert names["Disc"] == "Disc: best, 2 u shaded"
    farthest = np.abs(drawn[COLOURS["stokes"]]).max()
    assert farthest > axes.get_ylim()[1]
    assert "excluded, to" in names["Stokes"]
    assert float(names["Stokes"].split()[-2].lstrip("+−")) == pytest.approx(farthest, rel=0.05)


def test_the_band_of_the_best_law_is_twice_its_u(analysis, figure):
    run = analysis.runs[0]
    (band,) = [one for one in differences(figure).collections if isinstance(one, PolyCollection)]
    u = run.fit("disc").u_spin_frequency(run.time[[0]])
    at_start = np.array([y for x, y in band.get_paths()[0].vertices.tolist() if x == run.time[0]])
    assert at_start.max() == pytest.approx(2 * u[0])


def test_many_runs_are_one_mark_and_one_law_each(tmp_path):
    analysis = analysis_of(*(spin_down_csv(tmp_path / f"{k}.csv", seed=k, n=10) for k in range(12)))
    figure = spindown_figure(analysis)
    spin = panels(figure)[0]
    assert curves(spin) == 12 * [COLOURS[analysis.combined.best]]
    marks = [line for line in spin.get_lines() if line.get_linestyle() == "None"]
    assert {line.get_marker() for line in marks} == {"o"}
    assert len({to_hex(line.get_color()) for line in marks}) == 12
    assert legend(spin)[1:] == ["readings of 12 runs"]
    assert faults(figure) == []


@pytest.mark.parametrize("rows", [3, 20])
def test_nothing_that_is_written_lies_over_anything_else(tmp_path, rows):
    path = spin_down_csv(tmp_path / "a.csv", n=rows)
    if rows > 12:
        with_readings(path, [(6, "50.0,62.0,0.03"), (13, "120.0,3.5,0.03")])
    assert faults(spindown_figure(analysis_of(path))) == []


def test_readings_answer_to_the_pointer_where_each_is_a_point(page):
    for name in ("readings-0", "residuals-best-0", "residuals-disc-0"):
        group = page[page.index(f'<g id="x-{name}">') :]
        assert group[: group.index("</g>\n   </g>")].count("<use") == 20


def test_the_legend_shows_short_names_and_takes_them_literally(tmp_path):
    names = ["20261120T101500Z-spin-7f3a.csv", "_hidden.csv", "$a_{b$.csv", "中.csv"]
    paths = [spin_down_csv(tmp_path / name, seed=k) for k, name in enumerate(names)]
    figure = spindown_figure(analysis_of(*paths))
    as_svg(figure)
    assert legend(panels(figure)[0])[1:] == ["spin-7f3a.csv", " _hidden.csv", r"\$a_{b\$.csv", "□.csv"]
    # of several runs the weight of an excluded law is 0 to the last bit; it is written as that of one run
    stokes, *_, mixed, _ = (text.get_text() for text in figure.axes[1].texts)
    assert stokes == "Stokes  <\u20090.01, excluded"
    assert mixed.startswith("Mixed  ")
    assert mixed.endswith(", needless")
    assert "Mixed: needless constants" in legend(differences(figure))


def test_many_readings_are_thinned_out_and_means_show_the_shape(tmp_path):
    path = spin_down_csv(tmp_path / "a.csv", n=300, step=0.6, u=False)
    residuals = panels(spindown_figure(analysis_of(path, u=0.03)))[1]
    for axes in residuals:
        points = [len(np.asarray(line.get_xdata())) for line in axes.get_lines()]
        assert max(points) <= MOST_POINTS
        assert 40 in points


def test_the_same_results_are_drawn_as_the_same_bytes(analysis, page):
    assert as_svg(spindown_figure(analysis), "x") == page

"""Figures of maps, drawn from maps that are made up: what is drawn, where, and what it says."""

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from levilab.errors import UsageError
from levilab.present.looks import LOOKS
from levilab.simulator.scene import preset
from levilab.sweeps.figure import KINDS, MOST_PANELS, map_figure
from levilab.sweeps.plan import Axis, Plan
from levilab.sweeps.store import Map
from support.figures import faults

UNDRIVEN, DRIVEN = preset("undriven"), preset("driven")
SPIN = Axis("start.spin_hz", np.linspace(18, 90, 37))
MASS = Axis("top.mass_kg", np.linspace(0.0246, 0.0257, 12))
HEIGHT = Axis("start.position_m.2", np.linspace(0.0695, 0.0765, 5))


def a_map(*axes, names=("survived", "lifetime_s"), scene=UNDRIVEN, adaptive=False):
    plan = Plan(scene, axes, names, 10.0)
    first = np.indices(plan.shape)[0]
    yes = first % 3 > 0
    values = {name: np.where(yes, np.nan, 1.0 + first) for name in names}
    values |= {name: yes for name in names if name in {"survived", "locked"}}
    filled = (first % 2 == 0) if adaptive else None
    return Map(plan, values, np.ones(plan.shape, dtype=np.bool_) if filled is None else ~filled, filled)


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def caption(figure):
    return " ".join(" ".join(text.get_text().split()) for text in figure.texts)


def upright_lines(figure):
    """Places of lines that stand upright in the first panel."""
    lines = [np.asarray(line.get_xdata(), dtype=np.float64) for line in figure.axes[0].lines]
    return {round(float(x[0]), 2) for x in lines if len(x) == 2 and x[0] == x[1]}


def test_spin_and_mass_have_both_windows_and_the_limits_of_the_thesis():
    figure = map_figure(a_map(MASS, SPIN))
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("spin at the start  [Hz]", "mass  [g]")
    assert {21.86, 61.0} <= upright_lines(figure)
    level = {round(float(line.get_ydata()[0]), 2) for line in axes.lines if list(line.get_xdata()) == [0, 1]}
    assert level == {24.74, 25.48}  # PHYSICS: masses from 24.742 to 25.485 g float
    curves = [
        line
        for line in axes.lines
        if line.get_color() == LOOKS["theory"].colour and not np.isnan(line.get_xdata()).all()
    ]
    edges = [np.interp(25.26, line.get_ydata(), line.get_xdata()) for line in curves[:2]]
    assert edges == pytest.approx([21.65, 80.6], abs=0.1)  # PHYSICS: at 7.30 cm, where 25.26 g float
    assert legend(figure)[:2] == ["still up after 10 s", "lost before"]
    assert "masses that float (adiabatic): 24.74 to 25.48 g" in legend(figure)
    assert "2 Hz (spin at the start) × 0.1 g (mass): a limit is known no better." in caption(figure)
    other = map_figure(a_map(MASS, SPIN, scene=UNDRIVEN.changed({"top.moment_a_m2": -0.715})))
    assert not any("thesis" in text for text in legend(other))


def test_spin_and_height_have_the_window_of_their_mass_as_upright_lines():
    figure = map_figure(a_map(SPIN, HEIGHT, scene=UNDRIVEN.changed({"top.mass_kg": 0.02526})))
    assert {21.65, 80.6} <= {round(x, 1) if x > 30 else x for x in upright_lines(figure)}
    assert "heights that are stable (adiabatic): 7.00 to 7.57 cm" in legend(figure)


def test_spins_the_other_way_round_have_their_window_there():
    figure = map_figure(a_map(Axis("start.spin_hz", np.linspace(-90, -18, 9)), HEIGHT))
    assert {-21.6, -80.6} <= {round(x, 1) for x in upright_lines(figure)}


def test_every_text_lies_inside_of_the_picture_and_off_the_map():
    fine = Axis(MASS.key, np.linspace(0.0248, 0.0252, 9))  # its ticks have two decimals
    for found in (a_map(fine, SPIN, adaptive=True), a_map(SPIN, fine, HEIGHT)):
        figure = map_figure(found, "lifetime_s", notes=["a sentence of a map that was refined " * 8])
        assert faults(figure) == []
        panels = [panel.get_window_extent() for panel in figure.axes]
        labels = [axis.label for panel in figure.axes for axis in (panel.xaxis, panel.yaxis)]
        for artist in [*figure.texts, *figure.legends, *labels]:
            assert not any(artist.get_window_extent().overlaps(panel) for panel in panels), artist


def test_lost_tops_are_hatched_and_only_these():
    found = a_map(MASS, SPIN)
    (axes,) = map_figure(found).axes
    (hatched,) = [one for one in axes.collections if one.get_hatch()]
    lost = ~found.values["survived"]
    widths = [np.ptp(path.vertices[:, 0]) for path in hatched.get_paths()]
    assert sum(widths) == pytest.approx(2.0 * np.count_nonzero(lost))  # a cell spans 2 Hz


def test_filled_points_are_paler_and_the_report_is_below():
    figure = map_figure(a_map(MASS, SPIN, adaptive=True), notes=["5 of 9 points were computed.", "Few are wrong."])
    assert legend(figure)[:4] == [
        "still up after 10 s", "filled in: still up", "lost before", "filled in: lost before",
    ]  # fmt: skip
    assert "5 of 9 points were computed. Few are wrong." in caption(figure)


def test_the_kinds_of_cells_differ_in_grey():
    grey = sorted(float(np.dot(to_rgb(kind.colour), [0.299, 0.587, 0.114])) for kind in list(KINDS.values())[:4])
    assert np.diff(grey).min() > 0.1


def test_a_map_of_lifetimes_has_blue_for_tops_that_are_still_up():
    figure = map_figure(a_map(MASS, SPIN), "lifetime_s")
    assert figure.axes[-1].get_ylabel() == "time until the fall  [s]"
    assert legend(figure)[0] == "still up after 10 s"
    assert "lost before" not in legend(figure)


def test_a_lock_map_tells_tops_that_slip_from_tops_that_are_lost():
    axes = (
        Axis("drive.frequency_hz", np.linspace(28, 32, 9)),
        Axis("drive.amplitude_t", np.geomspace(1e-5, 1e-3, 5), "log"),
    )
    found = a_map(*axes, names=("survived", "locked"), scene=DRIVEN)
    found.values["survived"] = found.values["locked"] | (np.indices(found.plan.shape)[1] > 2)
    figure = map_figure(found, "locked")
    assert legend(figure)[:3] == ["locked to the drive", "lost", "up, but not locked"]
    assert 30.03 in upright_lines(figure)
    assert figure.axes[0].get_yscale() == "log"
    assert figure.axes[0].get_ylim() == pytest.approx((1e-2 / 10**0.25, 10**0.25), rel=1e-9)  # [mT]
    assert "a factor 3.16 (amplitude of the drive)" in caption(figure)


def test_a_third_axis_gives_small_multiples_with_their_values():
    figure = map_figure(a_map(SPIN, MASS, HEIGHT))
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert len(titles) == 5
    assert titles[0] == "height at the start 6.95 cm"
    tilt = Axis("start.tilt_rad", np.linspace(0, 0.1, 20))
    many = map_figure(a_map(SPIN, Axis(MASS.key, np.linspace(0.025, 0.0252, 16)), tilt, names=("survived",)))
    assert len(many.axes) == MOST_PANELS
    assert many.axes[0].get_title(loc="left") == "mass 25 g"
    assert many.axes[0].get_ylabel() == "tilt at the start  [mrad]"
    assert "12 of 16 values of the third axis are shown." in caption(many)


def test_the_legend_has_lines_that_the_last_panel_does_not_have():
    masses = Axis(MASS.key, np.array([0.0250, 0.0256]))  # the second floats nowhere
    figure = map_figure(a_map(SPIN, masses, HEIGHT, names=("survived",)))
    assert len(figure.axes) == 2
    assert "slowest and fastest spin for small motions (linear)" in legend(figure)


def test_points_that_are_not_computed_yet_are_white_and_counted():
    found = a_map(MASS, SPIN)
    found.computed[:, :5] = False
    figure = map_figure(found)
    assert "not computed" in legend(figure)
    assert "60 of 444 points are not computed yet." in caption(figure)


def test_what_is_no_map_has_no_figure():
    with pytest.raises(UsageError, match="a figure needs two or three axes"):
        map_figure(a_map(SPIN))
    with pytest.raises(UsageError, match="observe = locked: the map has survived, lifetime_s"):
        map_figure(a_map(SPIN, MASS), "locked")


def test_an_error_of_zero_is_drawn_as_the_smallest_and_the_colour_bar_fits():
    found = a_map(SPIN, MASS, names=("energy_error",))
    found.values["energy_error"][...] = np.linspace(1e-3, 9e-3, found.computed.size).reshape(found.computed.shape)
    found.values["energy_error"][0, 0] = 0.0
    figure = map_figure(found, "energy_error")
    cells = figure.axes[0].collections[-1]
    assert not np.ma.getmaskarray(cells.norm(cells.get_array())).any()
    bounds = figure.axes[-1].get_tightbbox()
    assert bounds.x1 < figure.bbox.x1

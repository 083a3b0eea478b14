"""The calibration: a band that right ranks leave as often as it says, and wrong distributions that two moments hide."""

import numpy as np
import pytest
from scipy.stats import expon, t

from levilab.crosscheck.calibration import band_of, by_ranks, probability_within, ranks_of
from levilab.crosscheck.figure import calibration_figure
from levilab.crosscheck.study import Spread, Study, Verdict
from levilab.present.looks import BLUE, VERMILION


def quantiles(law, n=200):
    """Pulls at the middles of n equal parts of a distribution."""
    return tuple(law.ppf((np.arange(n) + 0.5) / n))


def test_uniform_numbers_leave_the_band_as_often_as_it_says():
    lower, upper = band_of(30, 0.05)
    ranks = np.sort(np.random.default_rng(1).random((20_000, 30)), axis=1)
    left = np.mean(np.any((ranks < lower) | (ranks > upper), axis=1))
    assert left == pytest.approx(0.05, abs=4 * np.sqrt(0.05 * 0.95 / 20_000))


def test_the_probability_within_bounds_is_exact():
    """The largest of three below ½: ½³; and the least above ¼ at the same time: (½ − ¼)³."""
    assert probability_within(np.zeros(3), np.full(3, 0.5)) == pytest.approx(0.5**3)
    assert probability_within(np.full(3, 0.25), np.full(3, 0.5)) == pytest.approx(0.25**3)


@pytest.mark.parametrize(
    ("pulls", "verdict"),
    [
        (quantiles(t(1e6)), Verdict.RIGHT),
        (tuple(np.array(quantiles(t(1e6))) * 1.4), Verdict.WRONG),
        (tuple(np.array(quantiles(t(1e6))) + 0.4), Verdict.WRONG),
        (tuple(np.array(quantiles(t(1e6))) / 1.6), Verdict.TOO_LARGE),
        (quantiles(expon(-1)), Verdict.WRONG),
    ],
)
def test_each_wrong_distribution_is_named(pulls, verdict):
    assert by_ranks(Spread("x", pulls)) is verdict


def test_a_skew_that_mean_and_width_hide_is_seen():
    skew = Spread("x", quantiles(expon(-1)))
    assert skew.mean == pytest.approx(0, abs=0.01)
    assert skew.deviation == pytest.approx(1, abs=0.02)
    assert skew.verdict is not Verdict.WRONG
    assert by_ranks(skew) is Verdict.WRONG


def test_ranks_of_few_degrees_of_freedom_are_by_student():
    pulls = quantiles(t(3))
    for spread in (Spread("x", pulls, freedom=3), Spread("x", tuple(np.array(pulls) / 1.1969), widened=3)):
        assert ranks_of(spread) == pytest.approx((np.arange(200) + 0.5) / 200, abs=1e-4)


@pytest.mark.parametrize(("law", "colour"), [(t(1e6), BLUE), (expon(-1), VERMILION)])
def test_the_figure_has_the_ranks_and_the_band_and_shows_what_is_wrong(law, colour):
    study = Study("made-up", "five", 200, 0, (Spread("x", quantiles(law)),))
    figure = calibration_figure([study])
    (axes,) = figure.axes
    line, band = axes.lines[0], axes.collections[0]
    assert line.get_color() == colour
    share = np.searchsorted(ranks_of(study.spreads[0]), line.get_xdata(), "right") / 200
    assert line.get_ydata() == pytest.approx(share - line.get_xdata())
    least, most = band_of(200, 0.01)
    at_half = band.get_paths()[0].vertices
    at_half = at_half[np.isclose(at_half[:, 0], 0.5)][:, 1]
    assert {round(float(one), 9) for one in at_half} == {
        round(float(np.mean(ends <= 0.5)) - 0.5, 9) for ends in (most, least)
    }
    assert ("do not lie about the truth" in figure.texts[0].get_text()) == (colour == VERMILION)

"""The rim and the base in pictures whose circles are known."""

import numpy as np
import pytest
from scipy.ndimage import shift as moved

from analysis.film.circles import Circle, coarse, find_base, find_top
from analysis.film.errors import NoTop
from analysis.film.rim import fit_rim
from analysis.film.view import compare_views
from levilab.animation.camera import BASE, RIM, Camera, Pictures
from support.flights import level_flight

CAMERA = Camera()
RADIUS = RIM / CAMERA.scale


@pytest.fixture(scope="module")
def shown():
    return Pictures(CAMERA, level_flight(1.0, 31.0))


def centre(time):
    """The rim's centre in the picture of a time [pixels]."""
    x, y, _, _ = level_flight(1.0, 31.0).at(np.array([time]))
    x0, y0 = CAMERA.middle
    return x0 + float(x[0]) / CAMERA.scale, y0 - float(y[0]) / CAMERA.scale


def test_the_rim_is_found_within_a_tenth_of_a_pixel_and_u_says_so(shown):
    errors, u = [], []
    for time in np.arange(60) / 61:
        x, y = centre(time)
        rim = fit_rim(shown.noisy(shown.take(time)), Circle(x + 0.8, y - 0.6, RADIUS))
        errors += [(rim.circle.x - x, rim.circle.y - y)]
        u += [rim.u[0]]
    assert np.abs(errors).max() < 0.1
    pulls = np.array(errors) / np.array(u)[:, None]
    assert np.abs(pulls.mean()) < 0.5  # 4 standard errors of a mean of 120 are 0.37; pixels pull by 0.1 u
    assert 0.8 < pulls.std() < 1.8  # the mark beside the rim adds half as much


def test_the_top_and_the_base_are_found_without_a_hint(shown):
    times = np.arange(30) / 90
    small = np.stack([coarse(shown.noisy(shown.take(time)), 2) for time in times])
    top = find_top(small)
    base = find_base(np.median(small, axis=0), top)
    assert base is not None
    for found, radius, place in ((top, RADIUS, centre(0.16)), (base, BASE / CAMERA.scale, CAMERA.middle)):
        big = found.scaled(2)
        assert (big.x, big.y, big.radius) == pytest.approx((*place, radius), abs=3)  # 1.5 pixels of the small picture


@pytest.mark.parametrize("kind", ["the base alone", "noise"])
def test_a_film_without_a_top_is_refused(shown, kind):
    random = np.random.default_rng(1)
    picture = shown.background if kind == "the base alone" else np.full((240, 320), 120.0)
    with pytest.raises(NoTop, match="no top was found at the beginning: nothing changes beyond the noise"):
        find_top(picture + random.normal(0, 5, (30, *picture.shape)))


def test_no_rim_is_seen_where_there_is_none(shown):
    rim = fit_rim(shown.noisy(shown.background), Circle(*CAMERA.middle, RADIUS))
    assert rim is None or rim.contrast < 5  # of 80


@pytest.mark.parametrize("shift", [0.0, 0.2, -0.7])
def test_a_shift_of_the_background_is_measured_whatever_the_light(shown, shift):
    random = np.random.default_rng(2)
    now = 0.9 * moved(shown.background, (0, shift), order=3, mode="nearest") + 12
    away = np.ones(now.shape, dtype=bool)
    before, now = (picture + random.normal(0, 1, picture.shape) for picture in (shown.background, now))
    view = compare_views(before, now, away)
    assert view.shift == pytest.approx(abs(shift), abs=0.05 + 4 * view.u)  # 0.05: the second order of a sharp edge
    assert view.covered < 0.01


def test_what_covers_the_background_is_measured(shown):
    now = shown.background.copy()
    now[:, :32] = 90.0
    view = compare_views(shown.background, now, np.ones(now.shape, dtype=bool))
    assert view.covered == pytest.approx(32 / now.shape[1], abs=0.01)

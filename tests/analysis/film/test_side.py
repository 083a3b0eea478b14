"""The side of a top in pictures in which its place, its lean and its mark are known."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.film.errors import NoTop
from analysis.film.mark import phases_of
from analysis.film.side import Side, find_side, fit_side
from levilab.animation.camera import BESIDE, RIM, THICK, Camera, Pictures
from support.flights import level_flight

CAMERA = Camera(pose=BESIDE, away=(5.3, -45), stem=0.02)
LEVEL = level_flight(1.0, 31.0)
#: It leans to the right by 10 mrad and rises and falls.
FLIGHT = replace(LEVEL, rise=5e-4 * np.sin(5 * LEVEL.times), lean=np.tile([0.01, 0.0], (LEVEL.times.size, 1)))
TIMES = np.arange(120) / 240
#: The mark hides an end of the side where it is nearer to it than this [turns].
HIDES = 0.13


@pytest.fixture(scope="module")
def pictures():
    shown = Pictures(CAMERA, FLIGHT)
    return np.stack([shown.noisy(shown.take(time)) for time in TIMES]).astype(float)


@pytest.fixture(scope="module")
def fits(pictures):
    side = find_side(pictures[::3])
    fits = []
    for one in pictures:
        fit = fit_side(one, side) or fit_side(one, side, width=3.0, rounds=6)
        fits.append(fit)
        side = replace(fit[1], radius=side.radius)
    return fits


def test_place_height_and_lean_are_found_where_the_mark_hides_no_end(fits):
    centre, body = FLIGHT.pose_at(TIMES)
    middle = centre - THICK / 2 * body[:, :, 2]
    x0, y0 = CAMERA.middle
    true = np.array([x0 + middle[:, 0] / CAMERA.scale, y0 - middle[:, 2] / CAMERA.scale])
    found = np.array([(side.x, side.y) for _, side in fits]).T
    behind = np.interp(TIMES, FLIGHT.times, FLIGHT.yaw) / (2 * np.pi)
    clear = np.abs((behind + 0.25) % 0.5 - 0.25) > HIDES
    errors, u = (found - true)[:, clear], np.array([rim.u for rim, _ in fits])[clear].T
    assert np.abs(errors).max() < 0.25  # pixels, of 0.5 mm: 4 standard uncertainties
    assert np.abs(errors.mean(axis=1)).max() < 0.05  # edges between pixels
    assert 0.4 < np.std(errors / u) < 1.3  # the noise of single pixels is less alike along an edge than that of a film
    assert np.array([side.turn for _, side in fits])[clear] == pytest.approx(0.01, abs=0.004)
    assert fits[0][1].radius == pytest.approx(RIM / CAMERA.scale, abs=0.3)


def test_the_mark_in_front_shows_the_phase_and_its_absence_is_told(fits):
    found = phases_of(np.stack([rim.profiles for rim, _ in fits]))
    angle = (found.phase + found.angle + 0.5) % 1 - 0.5
    true = -np.interp(TIMES, FLIGHT.times, FLIGHT.yaw) / (2 * np.pi) - 0.25  # clockwise, 0 in front
    true -= np.rint(true)
    front = np.abs(true) < 0.14
    assert angle[front] - true[front] == pytest.approx(0, abs=0.004)  # harmonics of the view from the side
    assert found.share[front].min() > 0.8
    assert found.share[np.abs(true) > 0.3].max() < 0.5


def test_pictures_without_a_top_are_refused(pictures):
    with pytest.raises(NoTop, match="nothing changes"):
        find_side(np.repeat(pictures[:1], 20, axis=0))
    assert fit_side(pictures[0], Side(60.0, 150.0, 30.0, 8.0)) is None

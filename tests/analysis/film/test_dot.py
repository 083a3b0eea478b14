"""The dot on the stem, and the line of the precession in how it leans."""

import numpy as np
import pytest

from analysis.film.circles import Circle
from analysis.film.dot import find_dot
from analysis.film.swing import swing_of
from levilab.animation.camera import phone_times


def test_a_dot_is_found_to_a_tenth_of_a_pixel():
    random = np.random.default_rng(31)
    rows, columns = np.mgrid[:80, :80]
    errors = []
    for x, y in random.uniform(36, 42, (40, 2)):
        away = np.hypot(columns - x, rows - y)
        hub = np.where(np.hypot(columns - 39, rows - 39) < 6, 40.0, 140.0)
        picture = hub + (235 - hub) / (1 + np.exp((away - 2.2) / 0.4)) + random.normal(0, 2.5, hub.shape)
        errors.append(find_dot(picture, Circle(39, 39, 30)) - complex(x, y))
    assert np.std(errors) < 0.1  # 0.06 pixels a coordinate: its half height crosses few pixels
    assert find_dot(hub + random.normal(0, 2.5, hub.shape), Circle(39, 39, 30)) is None


@pytest.mark.parametrize("sense", [1, -1])
def test_a_line_beside_slow_swings_scatters_as_its_u_says(sense):
    random = np.random.default_rng(32)
    times, pulls = phone_times(1.0), []
    for _ in range(100):
        frequency = sense * random.uniform(5, 9)
        slow = np.exp(2j * np.pi * (1.2 * times + random.uniform())) + 0.5 * np.exp(-2j * np.pi * 0.7 * times)
        noise = 0.15 * (random.normal(size=times.size) + 1j * random.normal(size=times.size))
        found = swing_of(times, slow + np.exp(2j * np.pi * frequency * times) + noise, (3.0, 20.0))
        pulls.append((found.frequency - frequency) / found.u)
    assert abs(np.mean(pulls)) < 0.4  # 4 standard errors of 100
    assert 0.6 < np.std(pulls) < 1.3  # u counts the residuals beside the line, too
    assert swing_of(times, slow + noise, (3.0, 20.0)) is None

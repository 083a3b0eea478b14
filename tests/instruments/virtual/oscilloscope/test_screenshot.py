"""What the picture of a screen shows."""

import numpy as np

from instruments.virtual.oscilloscope.screenshot import HEIGHT, WIDTH, draw


def test_a_jump_is_a_line_from_the_height_before_to_the_one_after():
    yellow = np.array([255, 255, 0])
    picture = draw({1: np.where(np.arange(WIDTH) < 300, 0.25, 0.75)}, columns=10)
    lit = (picture == yellow).all(axis=2).sum(axis=0)
    jump = round((HEIGHT - 1) / 2)  # from a quarter to three quarters, with both ends
    assert lit[300] in {jump, jump + 1, jump + 2}
    assert (np.delete(lit, 300) == 1).all()

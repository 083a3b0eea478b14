"""The colours of things: apart for the colour-blind, and apart in print without colours by colour or by form."""

from itertools import combinations

import numpy as np
import pytest

from levilab.present.looks import LOOKS, TOGETHER

#: What the colour-blind see of linear red, green and blue: Machado, Oliveira, Fernandes (IEEE TVCG 15, 1291, 2009),
#: severity 1.
SEEN = {
    "by all": np.eye(3),
    "without red": np.array([[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                             [-0.003882, -0.048116, 1.051998]]),
    "without green": np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                               [-0.011820, 0.042940, 0.968881]]),
}  # fmt: skip
TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
#: Differences in CIELAB: 2.3 is just to be seen side by side; thin lines apart from each other need more.
LEAST_DIFFERENCE = 15.0
#: In L* of 100: lines of equal form have to differ as much in print without colours.
LEAST_IN_GREY = 12.0


def linear(colour):
    rgb = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def lab(rgb):
    white = TO_XYZ @ np.ones(3)
    ratio = TO_XYZ @ np.clip(rgb, 0, 1) / white
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio * (29 / 6) ** 2 / 3 + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def in_grey(colour):
    return float(lab(np.full(3, TO_XYZ[1] @ linear(colour)))[0])


@pytest.mark.parametrize("eye", list(SEEN))
def test_things_of_one_figure_differ_in_colour_or_share_it_knowingly(eye):
    close = {}
    for family in TOGETHER:
        for a, b in combinations(family, 2):
            one, other = LOOKS[a], LOOKS[b]
            if one.colour == other.colour:
                continue
            difference = np.linalg.norm(lab(SEEN[eye] @ linear(one.colour)) - lab(SEEN[eye] @ linear(other.colour)))
            if difference < LEAST_DIFFERENCE:
                close[a, b] = round(float(difference), 1)
    assert close == {}


def test_things_of_one_figure_differ_in_form_or_in_grey():
    alike = [
        (a, b)
        for family in TOGETHER
        for a, b in combinations(family, 2)
        if (LOOKS[a].line, LOOKS[a].marker, LOOKS[a].hatch) == (LOOKS[b].line, LOOKS[b].marker, LOOKS[b].hatch)
        and abs(in_grey(LOOKS[a].colour) - in_grey(LOOKS[b].colour)) < LEAST_IN_GREY
    ]
    assert alike == []


def test_a_line_on_white_is_dark_enough_to_be_seen():
    pale = {name: round(in_grey(look.colour)) for name, look in LOOKS.items() if in_grey(look.colour) > 75}
    assert set(pale) <= {"lost"}  # an area, with a hatch


def test_letters_stand_out_from_white():
    contrast = {name: 1.05 / (float(TO_XYZ[1] @ linear(look.of_text)) + 0.05) for name, look in LOOKS.items()}
    assert min(contrast.values()) >= 4.49  # of colours in 256 steps
    assert LOOKS["readings"].of_text == "#000000"

"""What the picture of a screen shows."""

import io
import struct

import numpy as np
import pytest
from PIL import Image

from instruments.virtual.oscilloscope.screenshot import HEIGHT, WIDTH, draw, picture_file


def test_a_jump_is_a_line_from_the_height_before_to_the_one_after():
    yellow = np.array([255, 255, 0])
    picture = draw({1: np.where(np.arange(WIDTH) < 300, 0.25, 0.75)}, columns=10)
    lit = (picture == yellow).all(axis=2).sum(axis=0)
    jump = round((HEIGHT - 1) / 2)  # from a quarter to three quarters, with both ends
    assert lit[300] in {jump, jump + 1, jump + 2}
    assert (np.delete(lit, 300) == 1).all()


@pytest.mark.parametrize("form", ["BMP24", "BMP8"])
def test_a_bitmap_is_what_another_library_reads(form):
    picture = draw({1: np.linspace(0, 1, WIDTH)}, columns=10)
    data = picture_file(picture, form)
    assert struct.unpack_from("<H", data, 26) == (1,)  # planes: always one (Windows GDI, BITMAPINFOHEADER)
    read = np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))
    assert np.abs(read.astype(int) - picture).max() <= (0 if form == "BMP24" else 25)  # half a step of 51

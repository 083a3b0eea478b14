"""What the virtual oscilloscopes measure in a trace and round, and what the picture of a screen shows."""

import io
import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from instruments.virtual.oscilloscope.measure import MEASUREMENTS, Measured, measure
from instruments.virtual.oscilloscope.scope import one_two_five
from instruments.virtual.oscilloscope.screenshot import HEIGHT, WIDTH, draw, picture_file


@given(
    volts=st.lists(st.integers(-4, 4).map(float), min_size=1, max_size=50), name=st.sampled_from(sorted(MEASUREMENTS))
)
def test_every_trace_is_measured_or_not(volts, name):
    value = measure(name, Measured(np.array(volts), 1e-3, 0.0))
    assert value is None or math.isfinite(value)


@given(value=st.floats(1e-9, 1e9))
def test_the_series_of_scales_goes_up_and_has_only_1_2_and_5(value):
    up, near = one_two_five(value, up=True), one_two_five(value)
    assert value * (1 - 1e-8) <= up <= 2.5000001 * value
    assert near in {up, one_two_five(up / 2.4999, up=True), one_two_five(up / 2.0001, up=True)} or near < up
    assert f"{up:.0e}"[0] in "125"


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

"""What goes into files that programs read."""

from __future__ import annotations

import math

import numpy as np

from levilab.files import finite


def test_what_no_number_can_say_is_null_at_any_depth() -> None:
    value = {"a": [1.0, math.nan, {"b": (math.inf, np.float64("-inf"))}], "c": "nan", "d": True, "e": 2}
    assert finite(value) == {"a": [1.0, None, {"b": [None, None]}], "c": "nan", "d": True, "e": 2}

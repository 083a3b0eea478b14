"""Frozen dataclasses with arrays, compared attribute by attribute."""

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass

import numpy as np


def differences(one, other, path=""):
    """Return the paths at which two objects differ, to the last bit; NaN equals NaN."""
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return [] if np.array_equal(one, other, equal_nan=True) else [path]
    if is_dataclass(one) and type(one) is type(other):
        names = [field.name for field in fields(one)]
        return [at for n in names for at in differences(getattr(one, n), getattr(other, n), f"{path}.{n}")]
    if isinstance(one, Mapping) and isinstance(other, Mapping) and list(one) == list(other):
        return [at for name in one for at in differences(one[name], other[name], f"{path}[{name!r}]")]
    if isinstance(one, tuple | list) and type(one) is type(other) and len(one) == len(other):
        return [at for k, pair in enumerate(zip(one, other, strict=True)) for at in differences(*pair, f"{path}[{k}]")]
    if isinstance(one, float) and isinstance(other, float) and math.isnan(one):
        return [] if math.isnan(other) else [path]
    return [] if not isinstance(one, np.ndarray) and one == other else [f"{path}: {one!r} is {other!r}"]

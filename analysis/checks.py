"""Checks of columns that a caller gives: the error names the first value that is wrong."""

import numpy as np

from analysis.arrays import Array
from analysis.errors import NotFinite, NotPositive, TimesNotIncreasing


def check_finite(quantity: str, values: Array) -> None:
    """Raise NotFinite where a value, of shape (n,), is no number."""
    if (wrong := np.flatnonzero(~np.isfinite(values))).size:
        raise NotFinite(quantity=quantity, index=int(wrong[0]), value=float(values[wrong[0]]))


def check_positive(quantity: str, values: Array, unit: str = "Hz") -> None:
    """Raise NotPositive where a value, of shape (n,), is not above 0."""
    if (wrong := np.flatnonzero(values <= 0)).size:
        raise NotPositive(quantity=quantity, unit=unit, index=int(wrong[0]), value=float(values[wrong[0]]))


def check_increasing(times: Array, *, strictly: bool = True) -> None:
    """Raise TimesNotIncreasing where a time [s], of shape (n,), is before the time above it or, if strictly, at it."""
    apart = np.diff(times)
    if (wrong := np.flatnonzero(apart <= 0 if strictly else apart < 0)).size:
        i = int(wrong[0])
        raise TimesNotIncreasing(index=i + 1, before=float(times[i]), after=float(times[i + 1]))

"""A number of one top or one number for each of many: a formula takes either, and gives the same bits.

A formula is written once, for one top.  With `Numbers` in place of some of its floats it works on all tops at once,
element by element.  Where it branches, the tops must agree: if they do not, `Mixed` says which of them take the branch,
and `split` calls the formula again with each of the two groups.  So tops are grouped by the kind of their model without
a list of what makes a kind.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")
Indices = NDArray[np.intp]


class Mixed(Exception):
    """A condition holds for some tops and not for others.

    Attributes:
        holds: for each of them, shape (n,).
    """

    def __init__(self, holds: NDArray[np.bool_]) -> None:
        super().__init__("it holds for some tops and not for others")
        self.holds = holds


class Numbers(np.ndarray[Any, np.dtype[np.float64]]):
    """One number for each of many tops, shape (n,); as a condition it is true or false for all, or raises Mixed."""

    def __bool__(self) -> bool:
        holds = np.asarray(self) != 0
        if np.all(holds):
            return True
        if np.any(holds):
            raise Mixed(holds)
        return False


def numbers(values: Any) -> Numbers:
    """Return values, shape (n,), as numbers of as many tops."""
    return np.ascontiguousarray(values, dtype=np.float64).view(Numbers)


def split(where: Indices, formula: Callable[[Indices], T]) -> Iterator[tuple[Indices, T]]:
    """Yield the tops in groups whose members take the same branches of a formula, each with what it gives."""
    groups = [where]
    while groups:
        group = groups.pop()
        try:
            found = formula(group)
        except Mixed as mixed:
            groups += [group[~mixed.holds], group[mixed.holds]]
        else:
            yield group, found


def uniform(number: Any) -> Any:
    """Return the one value that a number has for all tops; raises Mixed if they have several."""
    if not isinstance(number, Numbers):
        return number
    same = np.asarray(number) == number[0]
    if not np.all(same):
        raise Mixed(same)
    return number[0].item()


def _any(values: Any) -> bool:
    return any(isinstance(value, Numbers) for value in values)


def _of_each(function: Callable[..., float]) -> Callable[..., Any]:
    """Return a function of `math` that takes Numbers, too: numpy's own differ from it in the last bit."""

    def apply(*values: Any) -> Any:
        if _any(values):
            return numbers(np.frompyfunc(function, len(values), 1)(*values))
        return function(*values)

    return apply


sin, cos, log, hypot = (_of_each(function) for function in (math.sin, math.cos, math.log, math.hypot))


def sqrt(x: Any) -> Any:
    """Return the root, which is exact to the last bit in either library."""
    return np.sqrt(x) if isinstance(x, Numbers) else math.sqrt(x)


def ceil(x: Any) -> Any:
    """Return the next whole number."""
    return np.ceil(x) if isinstance(x, Numbers) else math.ceil(x)


def copysign(x: Any, sign: Any) -> Any:
    """Return the size of one number with the sign of another."""
    return np.copysign(x, sign) if isinstance(x, Numbers) or isinstance(sign, Numbers) else math.copysign(x, sign)


def smallest(*values: Any) -> Any:
    """Return the smallest, for each top."""
    return np.minimum.reduce(np.broadcast_arrays(*values)).view(Numbers) if _any(values) else min(values)


def largest(*values: Any) -> Any:
    """Return the largest, for each top."""
    return np.maximum.reduce(np.broadcast_arrays(*values)).view(Numbers) if _any(values) else max(values)


def length(vector: Any) -> Any:
    """Return the length of a vector of three numbers."""
    x, y, z = vector
    return sqrt(x * x + y * y + z * z)


def row(*values: Any) -> Any:
    """Return numbers side by side: shape (k,), or (n, k) if some of them are Numbers of n tops."""
    if _any(values):
        return np.stack(np.broadcast_arrays(*values), axis=-1).view(Numbers)
    return np.array(values, dtype=np.float64)


def numbers_of(model: Any) -> list[Any]:
    """Return the floats and Numbers of a model, in its order; arrays are shared by all tops and left out."""
    if isinstance(model, tuple):
        return [number for inner in model for number in numbers_of(inner)]
    return [model] if isinstance(model, float | int | Numbers) else []


def template_of(model: Any) -> Any:
    """Return a model with the first of its Numbers in place of each: its types, and the arrays that all tops share."""
    if isinstance(model, tuple):
        inner = [template_of(part) for part in model]
        return type(model)(*inner) if hasattr(model, "_fields") else tuple(inner)
    return model[0].item() if isinstance(model, Numbers) else model

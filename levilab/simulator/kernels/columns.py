"""Models whose numbers differ from top to top: the numbers of each in a column, beside those that all share."""

from typing import Any

from numba.core import types
from numba.extending import overload

from levilab.simulator.kernels.compiled import PART_OPTIONS

#: Tops that a kernel advances together.  A constant, because the compiler must see that the rows of a block do not
#: overlap; 16 are two registers of eight doubles, so that the latency of one hides behind the other.
LANES = 16


def of_lane(model: Any, numbers: Any, j: Any) -> Any:
    """Return the model of lane j: like the given one, with its numbers from column j of a flat block."""
    raise NotImplementedError("it exists inside of kernels only")


def _expression(kind: Any, path: str, names: dict[str, Any], count: list[int]) -> str:
    """Return the construction of a model of this type, as an expression of Python."""
    if isinstance(kind, types.Float | types.Integer):
        count[0] += 1
        return f"numbers[{(count[0] - 1) * LANES} + j]"
    if isinstance(kind, types.BaseTuple):
        elements: Any = getattr(kind, "types", ())
        inner = "".join(f"{_expression(k, f'{path}[{i}]', names, count)}, " for i, k in enumerate(elements))
        if not hasattr(kind, "instance_class"):
            return f"({inner})"
        names[kind.instance_class.__name__] = kind.instance_class
        return f"{kind.instance_class.__name__}({inner})"
    return path  # None, or an array that all lanes share


def _of_lane(model: Any, numbers: Any, j: Any) -> Any:
    # numba has no way to walk through tuples of different types: the expression is written out once for each type
    names: dict[str, Any] = {}
    text = _expression(model, "model", names, [0])
    exec(f"def put_together(model, numbers, j):\n    return {text}", names)  # noqa: S102
    return names["put_together"]


overload(of_lane, jit_options=PART_OPTIONS, strict=False)(_of_lane)

"""Parts of the simulator's kernels, which Python cannot call."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numba

if TYPE_CHECKING:
    from collections.abc import Callable


def callable_part(part: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function around a part, compiled with nothing in it but a call of the part."""

    @numba.njit
    def call(*arguments: Any) -> Any:
        return part(*arguments)

    return call

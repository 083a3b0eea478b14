"""Parts of the simulator's kernels, which Python cannot call."""

import numba


def callable_part(part):
    """Return a function around a part, compiled with nothing in it but a call of the part."""

    @numba.njit
    def call(*arguments):
        return part(*arguments)

    return call

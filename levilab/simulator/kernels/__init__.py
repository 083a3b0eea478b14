"""The compiled code of the simulator and nothing else, so that no other change compiles it again."""

from importlib.util import find_spec

from levilab.errors import LevilabError
from levilab.software import how_to_install


class MissingCompiler(LevilabError):
    """What the simulator needs is not installed."""


if missing := [name for name in ("numba", "zarr") if find_spec(name) is None]:
    raise MissingCompiler(
        "simulations, and the theory beside limits, need the extra simulate "
        f"({' and '.join(missing)}, not installed): {how_to_install('simulate')}"
    )

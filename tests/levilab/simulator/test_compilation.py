"""What is said of the compiler, by the events that numba sends."""

import re
from contextlib import suppress

import pytest
from numba.core.event import trigger_event

from levilab.simulator.compilation import announce_compilation
from levilab.simulator.kernels.splitting import advance


@pytest.mark.parametrize("failure", [None, KeyboardInterrupt, ValueError])
def test_only_a_kernel_that_is_compiled_is_said_to_be(failure):
    said = []
    with (
        suppress(KeyboardInterrupt, ValueError),
        announce_compilation(said.append),
        trigger_event("numba:compile", {"dispatcher": advance}),
    ):
        if failure:
            raise failure
    assert said.pop(0) == "compiling for this kind of scene: a few seconds, once"
    assert re.fullmatch("" if failure else r"compiled in \d+\.\d s", "".join(said))

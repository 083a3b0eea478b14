"""PyVISA finds the virtual bench here: ``pyvisa.ResourceManager("@levilab")``.

The library is `instruments.virtual.bench.visa_library`; asked for by its name it stands for a bench with a top of its
own.  Time-outs cost virtual time only; ``"realtime@levilab"`` keeps to the wall clock.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from instruments.clock import WallClock
from instruments.virtual.bench.visa_library import LevilabVisaLibrary
from levilab.world.bench import own_world, virtual_bus

if TYPE_CHECKING:
    from instruments.virtual.bench.bus import Bus

#: What stands before the @ for a bench that is never faster than the wall clock, for programs that sleep between
#: their questions.
REALTIME = "realtime"


class PracticeBench(LevilabVisaLibrary):
    """The library that PyVISA makes of a name such as ``"@levilab"``: a fresh bench with a top of its own."""

    def default_bench(self) -> Bus:
        """A top to practise with behind all four instruments."""
        return virtual_bus(own_world(WallClock() if str(self.library_path) == REALTIME else None))


WRAPPER_CLASS = PracticeBench

"""PyVISA finds the virtual bench here: ``pyvisa.ResourceManager("@levilab")``.

The library is `instruments.virtual.bench.visa_library`; asked for by its name it stands for a bench with a top of its
own.  Time-outs cost virtual time only; ``"realtime@levilab"`` keeps to the wall clock.  Other models
than the usual ones stand before the @, too: ``"CNT-91,DSOX1000@levilab"``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from instruments.clock import WallClock
from instruments.virtual.bench.visa_library import LevilabVisaLibrary
from levilab.bench.config import ConfigError
from levilab.world.bench import MODELS, own_world, virtual_bus

if TYPE_CHECKING:
    from instruments.virtual.bench.bus import Bus

#: What stands before the @ for a bench that is never faster than the wall clock, for programs that sleep between
#: their questions.
REALTIME = "realtime"
#: What PyVISA puts there itself if nothing does.
DEFAULT = "levilab"


class PracticeBench(LevilabVisaLibrary):
    """The library that PyVISA makes of a name such as ``"@levilab"``: a fresh bench with a top of its own."""

    def default_bench(self) -> Bus:
        """A top to practise with behind all four instruments."""
        words = [word.strip() for word in str(self.library_path).split(",")]
        models = {kind_of(word): word for word in words if word not in {REALTIME, DEFAULT}}
        return virtual_bus(own_world(WallClock() if REALTIME in words else None), models)


def kind_of(model: str) -> str:
    """The kind of instrument of a virtual model, in any case.  Raises ConfigError."""
    for kind, models in MODELS.items():
        if model.upper() in {name.upper() for name in models}:
            return kind
    known = ", ".join(name for models in MODELS.values() for name in models)
    raise ConfigError(f"there is no virtual instrument {model!r}: known are {REALTIME}, {known}")


WRAPPER_CLASS = PracticeBench

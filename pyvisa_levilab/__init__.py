"""PyVISA finds the virtual bench here: ``pyvisa.ResourceManager("@levilab")``.

The library is `instruments.virtual.bench.visa_library`; asked for by its name it stands for a bench with a top of its
own.  Time-outs cost virtual time only; ``"realtime@levilab"`` keeps to the wall clock.  Models other than the first of
their kind stand there, too: ``"CNT-91,DSOX1000@levilab"``, ``"realtime,CNT-91@levilab"``.
"""

from instruments.catalogue import CATALOGUE
from instruments.clock import WallClock
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import LevilabVisaLibrary
from levilab.bench.config import ConfigError
from levilab.world.bench import practice_world, virtual_bus

#: What stands before the @ for a bench that is never faster than the wall clock, for programs that sleep between
#: their questions.
REALTIME = "realtime"


class PracticeBench(LevilabVisaLibrary):
    """The library that PyVISA makes of a name such as ``"@levilab"``: a fresh bench with a top of its own."""

    def default_bench(self) -> VirtualBench:
        """Return a bench whose top is to practise with.  Raises ConfigError for a word that is no model."""
        words = [word.strip() for word in str(self.library_path).split(",")]
        clock = WallClock() if REALTIME in words else None
        models = [word for word in words if word not in {REALTIME, *map(str, self.get_library_paths())}]
        return virtual_bus(practice_world(clock), dict(map(kind_and_name, models)))


def kind_and_name(model: str) -> tuple[str, str]:
    """Return the kind of a model, and its name, given in any case.  Raises ConfigError for an unknown model.

    >>> kind_and_name("cnt-91")
    ('counter', 'CNT-91')
    """
    known = {row.name: kind for kind, rows in CATALOGUE.items() for row in rows}
    for name, kind in known.items():
        if name.upper() == model.upper():
            return kind, name
    raise ConfigError(f"{model!r} before @levilab is no model: known are {REALTIME}, {', '.join(known)}")


WRAPPER_CLASS = PracticeBench

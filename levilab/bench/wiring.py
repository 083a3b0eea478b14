"""How a program reaches the instruments of a bench: the one thing in which a virtual bench and a real one differ."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock, WallClock
from levilab.bench.config import BenchConfig, ConfigError, InstrumentSettings, Limits
from levilab.bench.kinds import COUNTER, GENERATOR, KINDS
from levilab.bench.person import Person, ask_no_person
from levilab.telemetry.messages import Poses

#: Kind of instrument → what can be done without one.
_INSTEAD = {
    COUNTER.name: ', or count_with = "oscilloscope" at its top',
    GENERATOR.name: ", or spin the top by hand: --set drive_waveform=NONE, for spin-down and lower limit",
}


@dataclass(frozen=True)
class Wiring:
    """Where the instruments are and what leads to them.

    instruments: kind → model and address, for those that the bench has; limits: what the coil stands; library:
    PyVISA's, or a virtual one; clock: of the bench; count_with: the kind of instrument that counts; person: who stands
    at it; poses: of a virtual bench: first time [s], step [s], number → where its top is, for a view; camera: the
    same → the places of that top in films from above and from the side, shape (n, 3) [m]; signals: what an oscilloscope
    would show → the same → its voltages, shape (n,) [V], for a view.
    """

    instruments: Mapping[str, InstrumentSettings]
    limits: Limits
    library: Any
    clock: Clock
    count_with: str = "counter"
    person: Person = ask_no_person
    poses: Callable[[float, float, int], Poses] | None = None
    camera: Callable[[float, float, int], NDArray[np.float64]] | None = None
    signals: Mapping[str, Callable[[float, float, int], NDArray[np.float64]]] = field(default_factory=dict)

    def describe(self, kind: str) -> InstrumentSettings:
        """Return the settings of an instrument, of the one that counts for a counter.

        Raises ConfigError: it is not described, or has no driver.
        """
        kind = self.count_with if kind == COUNTER.name else kind
        if kind not in self.instruments:
            instead = _INSTEAD.get(kind, "")
            raise ConfigError(
                "the bench file describes no {kind}: add a table [{kind}] with model and address{instead}",
                kind=kind,
                instead=instead,
            )
        settings = self.instruments[kind]
        KINDS[kind].model(settings.model)
        return settings


def described_wiring(config: BenchConfig, person: Person = ask_no_person) -> Wiring:
    """Return the wiring of the bench that a bench file describes."""
    # a measurement waits by the wall clock, so a virtual bench that jumps from answer to answer would stand still
    library = "realtime@levilab" if config.visa_library == "@levilab" else config.visa_library
    return Wiring(config.instruments(), config.limits, library, WallClock(), config.count_with, person)

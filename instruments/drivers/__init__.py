"""The drivers: the near end of the wire."""

from collections.abc import Mapping
from typing import Any, ClassVar, Protocol

from instruments.clock import Clock
from instruments.links.transport import Transport

Value = bool | float | str


class Instrument(Protocol):
    """What every driver offers.

    MODELS: what the model field of ``*IDN?`` matches, whole (regular expression); SERIAL: how the instrument's serial
    line is set when it leaves the factory, empty for one without; last_set: the last value of each setting that was set
    since the last reset, unit at the end of the name.
    """

    MODELS: ClassVar[str]
    SERIAL: ClassVar[Mapping[str, Any]]
    transport: Transport
    last_set: dict[str, Value]

    def __init__(self, transport: Transport, *, clock: Clock | None = None) -> None:
        """Drive the instrument at this link.  clock: of the bench, for what is waited for; by default the wall's."""

    def identity(self) -> str:
        """Return maker, model, serial number and firmware.  Raises WrongInstrument when another model answers."""

    def settings(self) -> dict[str, Value]:
        """Return the instrument's present settings, with the unit at the end of each name."""

    def changed_settings(
        self, now: Mapping[str, Value] | None = None, *, since: Mapping[str, Value] | None = None
    ) -> dict[str, tuple[object, object]]:
        """Return the settings that differ from earlier answers, or from the values set: name → (then, now)."""

    def forget_errors(self) -> None:
        """Empty the error queue."""

    def close(self) -> None:
        """Give the instrument back."""

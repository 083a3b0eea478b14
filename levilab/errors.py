"""What goes wrong in ways that a person can mend: told in one line, never as a traceback."""

from __future__ import annotations

from typing import ClassVar


class LevilabError(Exception):
    """A known failure. The text says what was seen, what was expected and what to do."""

    exit_code: ClassVar[int] = 1


class DataError(LevilabError):
    """A data file or run folder that cannot be used as it is."""


class SimulationError(LevilabError):
    """A simulation that cannot be carried out."""


class LeftRange(SimulationError):
    """A motion that cannot be followed on because its numbers leave their range, as at the base's edges."""

"""What a simulation can be refused for."""

from __future__ import annotations

from levilab.errors import LevilabError


class SimulationError(LevilabError):
    """A simulation that cannot be carried out."""

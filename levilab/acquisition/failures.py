"""Ways in which a drive fails."""

from __future__ import annotations

from levilab.acquisition.session import ExperimentFailed
from levilab.texts.text import Text


class DidNotFollow(ExperimentFailed):
    """The drive did not bring the top to where it should."""


class NoLight(ExperimentFailed):
    """The counter counts nothing."""


class NotHeld(Exception):
    """The top does not spin with the drive; what is seen instead.

    Attributes:
        spin: [Hz]; None where no top is seen.
        drive: [Hz].
    """

    def __init__(self, spin: float | None, drive: float) -> None:
        self.spin, self.drive = spin, drive
        seen = "no top seen" if spin is None else Text("a spin of {spin:.2f} Hz", spin=spin)
        super().__init__(Text("{seen} under a drive of {drive:.2f} Hz", seen=seen, drive=drive))

"""Ways in which a drive fails."""

from __future__ import annotations

from levilab.acquisition.session import ExperimentFailed


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
        seen = "no top seen" if spin is None else f"a spin of {spin:.2f} Hz"
        super().__init__(f"{seen} under a drive of {drive:.2f} Hz")

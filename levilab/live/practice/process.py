"""The process of the bench for practice."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from multiprocessing.connection import Connection


@dataclass(frozen=True)
class PracticeOptions:
    """How the bench begins.

    Attributes:
        out: where run folders are made.
        scene: name or file of the scene of the top.
        seed: of the light's noise.
    """

    out: str
    scene: str
    seed: int


def work(options: PracticeOptions, pipe: Connection) -> None:
    """Be the bench until the far end of the pipe is closed."""
    raise NotImplementedError

"""A chapter: a name, and a function that makes its findings and what is drawn and said about them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.present.document.blocks import Block
    from levilab.reproduce.check import Finding


@dataclass(frozen=True)
class Found:
    """What a chapter found.

    Attributes:
        findings: in their order.
        blocks: figures, and what is said about them.
        said: what the chapter says in a sentence or two, above its table.
        synthetic: what in it was made up or simulated, and how; empty where nothing stands for a measurement.
    """

    findings: tuple[Finding, ...]
    blocks: tuple[Block, ...]
    said: str
    synthetic: str = ""


@dataclass(frozen=True)
class Chapter:
    """A chapter.

    Attributes:
        name: by which it is chosen.
        title: its heading.
        make: computes it.
    """

    name: str
    title: str
    make: Callable[[], Found]

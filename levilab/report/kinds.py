"""Inputs of a report that are no measurement, such as simulated motions and sweeps: a row for each kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from levilab.present.document.blocks import Section


@dataclass(frozen=True)
class Kind:
    """A kind of input.

    Attributes:
        name: of one, such as "simulation"; the plural has an s.
        find: the inputs of this kind at or below a path, by name; none where there are none.
        sections: what the report says of the inputs found, one section each; raises DataError.
        is_synthetic: whether no instrument measured them.
    """

    name: str
    find: Callable[[Path], Sequence[Path]]
    sections: Callable[[Sequence[Path]], tuple[Section, ...]]
    is_synthetic: bool = True


KINDS: tuple[Kind, ...] = ()

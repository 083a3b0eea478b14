"""The marks of tables, for formats that take a table out of its document."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from levilab.present.document.blocks import Details, Section, Tabular

if TYPE_CHECKING:
    from collections.abc import Iterable

    from levilab.present.document.blocks import Block

B = TypeVar("B", bound="Block")


def with_marks(blocks: Iterable[B], mark: str) -> list[B]:
    """Return the blocks; each table in them that has no mark of its own gets this one.

    Args:
        blocks: of a document.
        mark: what of them is synthetic, see `Tabular`.

    >>> from levilab.present.tables import table
    >>> own, other = (Tabular("laws", table("", ["law"], []), mark=mark) for mark in ("", None))
    >>> (section,) = with_marks([Section("Result", (own, other))], "SYNTHETIC.")
    >>> [block.mark for block in section.blocks]
    ['', 'SYNTHETIC.']
    """
    return [_with_mark(block, mark) for block in blocks]


def _with_mark(block: B, mark: str) -> B:
    if isinstance(block, Tabular):
        return block if block.mark is not None else replace(block, mark=mark)
    if isinstance(block, Section | Details):
        return replace(block, blocks=tuple(with_marks(block.blocks, mark)))
    return block

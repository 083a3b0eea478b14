"""Remarks of an analysis as notes: the sentence of each kind stands in a table."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from analysis.remarks import Remark
from levilab.present.numbers import filled
from levilab.texts.note import Note, Weight

#: Of few readings about a law or a line.
FEW_LEFT = "{n:.0f} readings hardly show their scatter: a 68 % interval is {width:.2g} u to each side (Student's t)"


@dataclass(frozen=True)
class Weighed:
    """A sentence in a table of remarks that is no plain warning; see `note_of`."""

    text: str | Callable[..., str]
    weight: Weight


def note_of(of: Remark, table: Mapping[str, str | Callable[..., str] | Weighed], *values: Any, **named: Any) -> Note:
    """Return a remark as a note, whose sentence stands in a table by its kind, or is made there of values.

    The fields of a sentence are the remark's values in their order, but for its ``{name}`` and ``{law}``.
    """
    row = table[of.kind]
    said, weight = (row.text, row.weight) if isinstance(row, Weighed) else (row, "warning")
    if not isinstance(said, str):
        text = said(*values, **named)
    else:
        text = filled(said, of.values, name=of.name, law=of.law) if "{" in said else said
    return Note(f"{of.kind}:{of.law} {of.name}", text, weight=weight)

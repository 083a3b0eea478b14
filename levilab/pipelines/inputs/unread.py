"""Runs and files that are not taken, each with the reason, for people and for programs."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeGuard

from levilab.errors import DataError, DoesNotSuit
from levilab.formats.columns import Ambiguous, NoSuchColumn
from levilab.formats.kinds import AUDIO, OTHER, Kind, kind_of
from levilab.formats.table import FEWEST
from levilab.formats.waveforms.audio import advice_on_sound
from levilab.formats.waveforms.record import SEARCHED
from levilab.texts.note import Note
from levilab.texts.text import Sentences, Text, how_many, text_of


@dataclass(frozen=True)
class SkippedRuns:
    """Runs of an experiment that the analysis is not for."""

    experiment: str
    count: int

    def __str__(self) -> str:
        return how_many(self.count, f"{self.experiment} run")


@dataclass(frozen=True)
class Skipped:
    """A run or a file that is not taken.

    Attributes:
        reason: why, with its path.
        kind: skipped ones of one kind are alike.
        path: of what cannot be used.
        noted: whether the result of the analysis has a note on it.
        answer: `columns` that answer the question of a table, where the reason is one; else empty.
    """

    reason: str
    kind: str = ""
    path: Path | None = None
    noted: bool = field(default=True, compare=False)
    answer: str = field(default="", compare=False)

    @property
    def note(self) -> Note:
        """A note on it."""
        text = Text("skipped {things}", things=self.reason)
        return Note(f"skipped {self.kind}".rstrip(), text, names_input=True)


def skip(error: DataError, path: Path, kind: str = "") -> Skipped:
    """Return an input that an error makes unusable, with the answer to the question that the error asks."""
    doubt = error.doubt if isinstance(error, NoSuchColumn | Ambiguous) else None
    return Skipped(text_of(error), kind, path, answer=doubt.answer if doubt else "")


@dataclass(frozen=True)
class LeftOut:
    """A file of a folder that no analysis which was asked for reads.

    Attributes:
        kind: of file, with what to do.
        why: the reason of the one analysis that was asked for, of a table with columns that it reads; else empty.
    """

    path: Path
    kind: Kind = field(compare=False)
    why: str = field(default="", compare=False)


#: What lies in a folder and is no input of an analysis.
NotTaken = SkippedRuns | Skipped | LeftOut


class NoneUsable(DataError):
    """Inputs, or a folder, without anything that an analysis can use.

    Attributes:
        skipped: its inputs.
    """

    def __init__(self, text: str, skipped: Sequence[Skipped]) -> None:
        self.skipped = skipped
        super().__init__(text)


class NothingSuits(DoesNotSuit):
    """A folder without anything for an analysis.

    Attributes:
        left_out: the files in it.
    """

    def __init__(self, text: str, left_out: Sequence[LeftOut]) -> None:
        self.left_out = left_out
        super().__init__(text)


#: Of texts and spreadsheets.
OTHER_COLUMNS = Kind("a table with other columns", "name one to see why", plural="tables with other columns")

#: A text of sentences.
PROSE = Kind("a text without readings", "name it if it holds a table", plural="texts without readings",
             may_hold_readings=False)  # fmt: skip
_BEGINNING, _WORDS = 10_000, re.compile(r"[^\W\d_]{2,}( [^\W\d_]{2,}){2}")
_NUMBER = re.compile(r"\s*[\"']?[-+]?[.,]?\d")

#: Of the right columns, as of a top that does not fall.
UNSUITABLE = Kind("a table that does not suit", "name one to see why", plural="tables that do not suit")

#: Files of a kind that are named beside their number, and files of a folder with names at all, and what to do.
_NAMED, FEW = 2, 8


def in_words(left_out: Sequence[LeftOut]) -> str:
    """Return the files that hold nothing to analyze, as one line."""
    return Text("nothing to analyze in {files}", files=files_by_kind(left_out))


def _by_kind(left_out: Sequence[LeftOut]) -> dict[Kind, list[str]]:
    kinds: dict[Kind, list[str]] = {}
    for one in left_out:
        kinds.setdefault(one.kind, []).append(one.path.name)
    return kinds


def number_by_kind(left_out: Sequence[LeftOut]) -> tuple[str, ...]:
    """Return the number of files of each kind."""
    return tuple(
        Text("{n} {things}", n=len(names), things=kind.several) if len(names) > 1 else kind.name
        for kind, names in _by_kind(left_out).items()
    )


def files_by_kind(left_out: Sequence[LeftOut]) -> str:
    """Return the files by kind and number, with what to do."""
    kinds = _by_kind(left_out)
    texts = []
    for (kind, names), count in zip(kinds.items(), number_by_kind(left_out), strict=True):
        named = ", ".join([*names[:_NAMED], *["…"] * (len(names) > _NAMED)])
        with_advice = "{count} ({names:s}: {advice})" if kind.advice else "{count} ({names:s})"
        texts.append(Text(with_advice, count=count, names=named, advice=kind.advice))
    if max(map(len, kinds.values()), default=0) > _NAMED:
        texts.append(Text("levilab analyze --json names all"))
    return Sentences(*texts, between="; ")


def kind_of_unused(file: Path) -> Kind:
    """Return the kind of a file that no analysis reads."""
    try:
        kind = kind_of(file)
    except OSError as error:
        return Kind(
            f"a file that cannot be read ({error.strerror})", plural=f"files that cannot be read ({error.strerror})"
        )
    if kind is AUDIO:
        return replace(kind, advice=advice_on_sound())
    if kind is OTHER and file.suffix.casefold() == ".txt":
        with file.open(encoding="utf-8", errors="replace") as stream:
            kind = PROSE if _is_prose(stream.read(_BEGINNING)) else kind
    return OTHER_COLUMNS if kind is OTHER and file.suffix.casefold() in SEARCHED else kind


def _is_prose(text: str) -> bool:
    """Return whether a text has words in a row, and too few lines that begin with a number for a table."""
    return bool(_WORDS.search(text)) and sum(map(bool, map(_NUMBER.match, text.splitlines()))) < FEWEST


def noted(one: NotTaken) -> TypeGuard[Skipped]:
    """Return whether the result of the analysis has a note on an input."""
    return isinstance(one, Skipped) and one.noted


def skipped_by_all(of_each: Sequence[Sequence[NotTaken]]) -> list[NotTaken]:
    """Join what several analyses did not take; runs and files that were left out count only if all of them did."""
    each_once = dict.fromkeys(sorted((one for those in of_each for one in those), key=noted, reverse=True))
    paths = {one.path for one in each_once if isinstance(one, Skipped)}
    joined = [one for one in each_once if isinstance(one, Skipped) or all(one in those for those in of_each)]
    joined = [one for one in joined if not (isinstance(one, LeftOut) and one.path in paths)]
    if len(of_each) == 1:
        return joined
    return [LeftOut(one.path, OTHER_COLUMNS) if isinstance(one, LeftOut) and one.why else one for one in joined]


def left_out_of(skipped: Sequence[NotTaken]) -> list[dict[str, str]]:
    """Return the files that are left out, for programs."""
    return [
        {"path": one.path.as_posix(), "kind": one.kind.name.partition(" ")[2], "advice": one.why or one.kind.advice}
        for one in skipped
        if isinstance(one, LeftOut)
    ]


def texts_of(skipped: Sequence[NotTaken]) -> list[str]:
    """Return lines of text: runs and files that are left out in one, a few files by name in their own."""
    left_out = [one for one in skipped if isinstance(one, LeftOut)]
    few, unexplained = len(left_out) <= FEW, [one for one in left_out if not one.why]
    things = (*(str(one) for one in skipped if isinstance(one, SkippedRuns)), *number_by_kind([] if few else left_out))
    said = "skipped {things}" if few else "skipped {things} (levilab analyze --json names the files)"
    return [
        *(one.note for one in skipped if isinstance(one, Skipped)),
        *([Text(said, things=things)] if things else []),
        *(Skipped(one.why).note for one in left_out if few and one.why),
        *([in_words(unexplained)] if few and unexplained else []),
    ]

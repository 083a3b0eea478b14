"""The texts of worksheets: in English in texts.toml, in other languages by `levilab.texts`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from levilab.files import parse_toml
from levilab.texts.text import in_language, language_of

if TYPE_CHECKING:
    from collections.abc import Mapping

_TEXTS = Path(__file__).parent / "texts.toml"


@dataclass(frozen=True)
class Sheet:
    """An experiment's worksheet.

    Attributes:
        experiment, analysis: their names.
        settings: of the experiment, as one types them: a class has an hour.
    """

    experiment: str
    analysis: str
    settings: tuple[str, ...] = ()

    def commands(self, group: str, seed: int) -> tuple[str, ...]:
        """Return what a group types."""
        chosen = "".join(f" --set {one}" for one in self.settings)
        return (
            f'levilab acquire {self.experiment} --mock --group "{group}" --seed {seed} --out class{chosen}',
            f"levilab analyze {self.analysis} class",
            "levilab report class -o report.html",
        )


#: Number of tops of the worksheet on limits.
TOPS = 10
SHEETS = MappingProxyType({
    sheet.experiment: sheet
    for sheet in (
        Sheet("spin", "spindown"),
        Sheet("limit", "limit", (f"limit.repetitions={TOPS}",)),
        Sheet("field", "field"),
        Sheet("precession", "precession"),
    )
})  # fmt: skip


@dataclass(frozen=True)
class Texts:
    """The texts of a worksheet."""

    title: str
    aim: str
    tasks: tuple[str, ...]
    answers: tuple[str, ...]


@dataclass(frozen=True)
class Language:
    """A language.

    Attributes:
        code: of the language, such as "de".
        words: of all worksheets, by their keys.
        sheets: experiment → its texts.
    """

    code: str
    words: Mapping[str, str]
    sheets: Mapping[str, Texts]


def read_language(code: str) -> Language:
    """Return a language.  Raises UsageError."""
    language_of(code)
    table = parse_toml(_TEXTS.read_text(encoding="utf-8"))
    sheets = {}
    for name in SHEETS:
        title, aim = in_language(table[name]["title"], code), in_language(table[name]["aim"], code)
        tasks, answers = (tuple(in_language(text, code) for text in table[name][part]) for part in ("tasks", "answers"))
        sheets[name] = Texts(title, aim.replace("{tops}", str(TOPS)), tasks, answers)
    return Language(code, {key: in_language(text, code) for key, text in table["words"].items()}, sheets)

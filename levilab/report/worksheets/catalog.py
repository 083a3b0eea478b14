"""The texts of worksheets, a file for each language in `texts`."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from types import MappingProxyType
from typing import TYPE_CHECKING

from levilab.errors import UsageError
from levilab.files import parse_toml

if TYPE_CHECKING:
    from collections.abc import Mapping

_TEXTS = files("levilab.report.worksheets") / "texts"


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
        code: of the file, such as "de".
        name: in the language itself.
        words: of all worksheets, by their keys.
        sheets: experiment → its texts.
    """

    code: str
    name: str
    words: Mapping[str, str]
    sheets: Mapping[str, Texts]


def languages() -> tuple[str, ...]:
    """Return the codes of the languages that there are."""
    return tuple(sorted(one.name.removesuffix(".toml") for one in _TEXTS.iterdir() if one.name.endswith(".toml")))


def read_language(code: str) -> Language:
    """Return a language.  Raises UsageError."""
    if code not in languages():
        raise UsageError("language", f"one of {', '.join(languages())} is expected", value=code)
    table = parse_toml((_TEXTS / f"{code}.toml").read_text(encoding="utf-8"))
    sheets = {
        name: Texts(own["title"], own["aim"].replace("{tops}", str(TOPS)), tuple(own["tasks"]), tuple(own["answers"]))
        for name in SHEETS
        for own in (table[name],)
    }
    return Language(code, table["language"], table["words"], sheets)

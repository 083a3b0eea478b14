"""A worksheet and its key as documents."""

from __future__ import annotations

from typing import TYPE_CHECKING

from levilab.present.document.blocks import (
    Banner,
    Code,
    Document,
    Fact,
    Facts,
    Listing,
    Paragraph,
    Section,
    Tabular,
)
from levilab.present.numbers import column
from levilab.present.tables import table
from levilab.report.groups.document import truth_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    from levilab.report.groups.beside import Class
    from levilab.report.worksheets.catalog import Language, Sheet

#: Where a student writes, and how many such lines an answer has.
_BLANK, _LINES = "…" * 20, 3


def worksheet(sheet: Sheet, language: Language, seeds: Mapping[str, int]) -> Document:
    """Return a worksheet.

    Args:
        sheet: of an experiment.
        language: of its texts.
        seeds: group → its seed; the first is the example.
    """
    words, texts = language.words, language.sheets[sheet.experiment]
    group, seed = next(iter(seeds.items()))
    told = words["each_seed"].replace("{group}", group).replace("{seed}", str(seed))
    listed = table("", (words["group"], words["seed"]), [(name, str(k)) for name, k in seeds.items()])
    questions = [
        (f"{number}.  {task}", "\n".join([_BLANK] * _LINES)) for number, task in enumerate(texts.tasks, start=1)
    ]
    asked = table("", (words["question"], words["answer"]), questions)
    return Document(
        title=texts.title,
        lead=words["worksheet"],
        byline=f"{words['name']} {_BLANK}  {words['date']} {_BLANK[:12]}",
        blocks=(
            Section(words["aim"], (Paragraph(texts.aim),)),
            Section(words["commands"], (Code("\n".join(sheet.commands(group, seed))),)),
            Section(words["clicks"], (Paragraph(words["with_clicks"]),)),
            Section(words["seeds"], (Paragraph(told), Listing("seeds", listed, rows_in_a_piece=5))),
            Section(words["tasks"], (Tabular("tasks", asked, wraps=asked.heads, first_column_wraps=True),)),
        ),
        language=language.code,
    )


def key(sheet: Sheet, language: Language, seeds: Mapping[str, int], found: Class) -> Document:
    """Return the key of a worksheet.

    Args:
        sheet: of an experiment.
        language: of its texts.
        seeds: group → its seed.
        found: what the runs of these seeds give.
    """
    words, texts = language.words, language.sheets[sheet.experiment]
    answers = zip(texts.tasks, texts.answers, strict=True)
    facts = tuple(Fact(str(k), (task, f"→ {answer}")) for k, (task, answer) in enumerate(answers, start=1))
    return Document(
        title=texts.title,
        lead=words["key"],
        banner=Banner("SYNTHETIC.", f"{words['numbers']} {words['synthetic']}"),
        blocks=(
            Section(words["answers"], (Facts(facts),)),
            Section(words["numbers"], (_numbers(language, seeds, found),)),
        ),
        language=language.code,
    )


def _numbers(language: Language, seeds: Mapping[str, int], found: Class) -> Tabular:
    """Return each group's values with u, and the truths of its seed."""
    words = language.words
    heads = [words["group"], words["seed"]]
    columns = [[*seeds], [*map(str, seeds.values())]]
    for one in found.quantities:
        estimates = [one.show(each.value, each.u) if each else None for each in one.estimates]
        columns += [column(estimates), [*map(truth_text, map(one.show, one.truths), estimates)]]
        heads += [one.head, f"{words['truth']}, {one.symbol}"]
    rows = [tuple(row) for row in zip(*columns, strict=True)]
    return Tabular(
        "numbers", table("", heads, rows, numbers=heads[1:]), words["about_numbers"], first_column_wraps=True
    )

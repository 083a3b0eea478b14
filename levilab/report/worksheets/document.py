"""Worksheets and their keys, in the language of a class: texts, documents, files."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from tempfile import TemporaryDirectory

from levilab.acquisition.loop import acquire_one_of_many
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.errors import UsageError, check_language
from levilab.files import parse_toml, replace_atomically, writing
from levilab.pipelines.catalogue import ANALYSES
from levilab.present.document.blocks import (
    Banner,
    Code,
    Document,
    Listing,
    Paragraph,
    Question,
    Section,
    Tabular,
    in_language_of_reader,
)
from levilab.present.numbers import column
from levilab.present.tables import table
from levilab.report.beside import Class, class_of
from levilab.report.groups.document import truth_text
from levilab.report.page import FORMATS
from levilab.report.worksheets.sheets import SHEETS, TOPS, Sheet
from levilab.texts.text import ENGLISH, Text, how_many, in_language

_TEXTS = Path(__file__).parent / "texts.toml"


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
    check_language(code)
    table = parse_toml(_TEXTS.read_text(encoding="utf-8"))
    sheets = {}
    for name in SHEETS:
        title, aim = in_language(table[name]["title"], code), in_language(table[name]["aim"], code)
        tasks, answers = (tuple(in_language(text, code) for text in table[name][part]) for part in ("tasks", "answers"))
        sheets[name] = Texts(title, aim.replace("{tops}", str(TOPS)), tasks, answers)
    return Language(code, {key: in_language(text, code) for key, text in table["words"].items()}, sheets)


#: Where a student writes the name.
_BLANK = "…" * 12


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
    spoken = "" if language.code == ENGLISH else f" --language {language.code}"
    live = (Code(f"levilab live --mock --seed {seed}{spoken} --out class"),) * (sheet.clicks == "with_clicks")
    clicks = Paragraph(words[sheet.clicks], f"{words['clicks']}:")
    questions = (Question(f"{k}.", task) for k, task in enumerate(texts.tasks, start=1))
    return Document(
        title=texts.title,
        lead=words["worksheet"],
        byline=f"{words['name']} {_BLANK}  {words['date']} {_BLANK[:7]}",
        blocks=(
            Paragraph(texts.aim),
            Section(words["commands"], (Code("\n".join(sheet.commands(group, seed, spoken))), clicks, *live)),
            Section(words["seeds"], (Paragraph(told), Listing("seeds", listed, rows_in_a_piece=5))),
            Section(words["tasks"], (Paragraph(words["notation"]), *questions)),
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
    tasks = enumerate(zip(texts.tasks, texts.answers, strict=True), start=1)
    answers = (Question(f"{k}.", task, answer=answer) for k, (task, answer) in tasks)
    return Document(
        title=texts.title,
        lead=words["key"],
        banner=Banner("SYNTHETIC.", f"{words['numbers']} {words['synthetic']}"),
        blocks=(
            Section(words["answers"], tuple(answers)),
            Section(words["numbers"], (Paragraph(words["whose"]), *_numbers(sheet, language, seeds, found))),
        ),
        language=language.code,
    )


def _numbers(sheet: Sheet, language: Language, seeds: Mapping[str, int], found: Class) -> Iterator[Tabular]:
    """Yield each group's values with u: first those with the truths of its seed beside them, then those without."""
    words = language.words
    known = [one for one in found.quantities if any(truth is not None for truth in one.truths)]
    others = [one for one in found.quantities if one not in known]
    for part, about in ((known, "about_numbers"), (others, "about_others")):
        heads = [words["group"], words["seed"]]
        columns = [[*seeds], [*map(str, seeds.values())]]
        for one in part:
            estimates = [one.show(each.value, each.u) if each else None for each in one.estimates]
            columns.append(column(estimates))
            heads.append(one.head.replace(one.symbol, in_language(one.symbol, language.code)))
            if part is known:
                columns.append([*map(truth_text, map(one.show, one.truths), estimates)])
                heads.append(words["truth"])
        if part:
            if part is known:  # written by hand
                columns.append([_BLANK[:6]] * len(seeds))
                heads.append(words["grade"])
            rows = [tuple(row) for row in zip(*columns, strict=True)]
            shown = table("", heads, rows, numbers=[head for head in heads[1:] if head != words["grade"]])
            said = [words[about], *[words["about_clicks"]] * (part is known and sheet.clicks == "with_clicks")]
            yield Tabular(about.replace("_", "-"), shown, " ".join(said), first_column_wraps=True)


def write_worksheets(
    experiments: Sequence[str],
    out: Path,
    seeds: Mapping[str, int],
    *,
    language: str = "en",
    ending: str = ".html",
    keys: bool = True,
    tell: Callable[[str], None] = lambda _: None,
) -> list[Path]:
    """Write a worksheet, and its key, for each experiment.

    Args:
        experiments: their names; none: all that have a worksheet.
        out: the folder, which is made.
        seeds: group → its seed.
        language: of the texts.
        ending: of the files, .html or .pdf.
        keys: whether keys are written, for which each seed's run is acquired and analyzed.
        tell: called with a line before the runs of an experiment are made.

    Returns:
        The files.

    Raises:
        UsageError: there is no such worksheet or language.
        NoTypst: PDF, and the extra `pdf` is not installed.
        CannotWrite: of the folder.
    """
    texts, form = read_language(language), FORMATS[ending]
    form.check()
    for name in experiments:
        if name not in SHEETS:
            near = get_close_matches(name, SHEETS, n=1)
            known = f"did you mean {near[0]}?" if near else f"one of {', '.join(SHEETS)} is expected"
            raise UsageError("experiment", known, value=name)
    files = []
    for sheet in (SHEETS[name] for name in experiments or SHEETS):
        contents = {sheet.experiment: worksheet(sheet, texts, seeds)}
        if keys:
            runs = how_many(len(seeds), "run")
            tell(Text("the key of {sheet:s}: {runs} on the virtual bench", sheet=sheet.experiment, runs=runs))
            contents[f"{sheet.experiment}-key"] = key(sheet, texts, seeds, measure(sheet, seeds))
        with writing(out):
            out.mkdir(parents=True, exist_ok=True)
            for name, document in contents.items():
                files.append(out / f"{name}-{language}{ending}")
                replace_atomically(files[-1], form.content(in_language_of_reader(document, language)))
    return files


def measure(sheet: Sheet, seeds: Mapping[str, int]) -> Class:
    """Return what the runs of the seeds give, as students find it by the commands of the worksheet."""
    analysis = ANALYSES[sheet.analysis]
    with TemporaryDirectory() as folder:
        runs = []
        for group, seed in seeds.items():
            options = AcquisitionOptions(mock=True, seed=seed, group=group, out=Path(folder), settings=sheet.settings)
            runs.append(acquire_one_of_many(request_for(sheet.experiment, options)).folder)
        return class_of(analysis, analysis.analyze(runs), sheet.asked)

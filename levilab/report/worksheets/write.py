"""Worksheets and their keys are written; the numbers of a key are those that the virtual bench gives for each seed."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from levilab.acquisition.loop import acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.errors import UsageError
from levilab.files import replace_atomically, writing
from levilab.pipelines.catalogue import ANALYSES
from levilab.present.progress import Display
from levilab.report.groups.beside import class_of
from levilab.report.page import FORMATS
from levilab.report.worksheets.catalog import SHEETS, read_language
from levilab.report.worksheets.document import key, worksheet

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from levilab.report.groups.beside import Class
    from levilab.report.worksheets.catalog import Sheet


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
            tell(f"the key of {sheet.experiment}: {len(seeds)} runs on the virtual bench")
            contents[f"{sheet.experiment}-key"] = key(sheet, texts, seeds, measure(sheet, seeds))
        with writing(f"{out}: could not be written"):
            out.mkdir(parents=True, exist_ok=True)
            for name, document in contents.items():
                files.append(out / f"{name}-{language}{ending}")
                replace_atomically(files[-1], form.content(document))
    return files


def measure(sheet: Sheet, seeds: Mapping[str, int]) -> Class:
    """Return what the runs of the seeds give, as students find it by the commands of the worksheet."""
    analysis = ANALYSES[sheet.analysis]
    with TemporaryDirectory() as folder:
        runs = []
        for group, seed in seeds.items():
            options = AcquisitionOptions(mock=True, seed=seed, group=group, out=Path(folder), settings=sheet.settings)
            runs.append(acquire(request_for(sheet.experiment, options), Display()).folder)
        return class_of(analysis, analysis.analyze(runs, analysis.options_from({})))

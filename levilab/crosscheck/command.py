"""`levilab crosscheck`: makes the trials, prints the table, writes JSON and the figure."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING

from rich.markup import escape

from levilab.crosscheck.catalogue import SUBJECTS
from levilab.crosscheck.own.stored import as_text, store
from levilab.crosscheck.own.study import OWN, TRIALS, check_own, in_words, own_table
from levilab.crosscheck.study import as_document, crosscheck
from levilab.crosscheck.table import crosscheck_table, failures_in_words
from levilab.errors import UsageError
from levilab.files import replace_atomically, writing
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.suits import recall_suiting
from levilab.present.progress import ShareBar
from levilab.present.terminal import draw, terminal

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from levilab.crosscheck.own.study import OwnCheck
    from levilab.crosscheck.study import Checked
    from levilab.pipelines.result import Place

JSON, FIGURE = "crosscheck.json", "crosscheck.png"


def check(names: Sequence[str], trials: int | None, seed: int) -> list[Checked]:
    """Make the trials of some subjects, or of all where none is named.  Raises UsageError for an unknown name."""
    for name in names:
        if name not in SUBJECTS:
            raise UsageError("subject", f"known are {', '.join(SUBJECTS)}", value=name)
    found = []
    for name in names or SUBJECTS:
        subject = SUBJECTS[name]
        progress = ShareBar(f"cross-checking {name}")
        try:
            found.append(crosscheck(subject, trials or subject.trials, seed, progress))
        finally:
            progress.close()
    return found


def check_like(names: Sequence[str], paths: Sequence[Path], trials: int | None) -> list[tuple[OwnCheck, Place]]:
    """Make trials with the parameters of results, of the named analyses or of all, with its place.

    Raises UsageError for a name that is unknown, DataError for what cannot be analyzed.
    """
    for name in names:
        if name not in OWN:
            raise UsageError("subject", f"with `like` known are {', '.join(OWN)}", value=name)
    if names:
        found = [(ANALYSES[name], ANALYSES[name].recall(paths, ANALYSES[name].options_from({}))) for name in names]
    else:
        found = recall_suiting(paths, {})
    done = []
    for analysis, result in found:
        progress = ShareBar(f"cross-checking {analysis.name}")
        try:
            settings = analysis.settings_of(result)
            done.append((check_own(analysis.name, result, settings, trials or TRIALS, progress), result.place))
        finally:
            progress.close()
    return done


def like_as_json(checked: Sequence[tuple[OwnCheck, Place]]) -> str:
    """Return the trials as a document."""
    return as_text([one for one, _ in checked])


def print_like(checked: Sequence[tuple[OwnCheck, Place]]) -> None:
    """Print the table of each result, and a sentence."""
    console = terminal()
    for one, _ in checked:
        shown = ANALYSES[one.analysis].symbols
        console.print(draw(replace(own_table(one, shown), title=f"{one.analysis}: pulls, (estimate − truth)/u")))
        console.print(escape(in_words(one, shown)))


def store_like(checked: Sequence[tuple[OwnCheck, Place]], out: Path | None) -> list[Path]:
    """Write crosscheck.json beside each result, or into a folder; returns the files.  Raises CannotWrite."""
    files = []
    for one, place in checked:
        there = replace(place, folder=out) if out else place
        with writing(f"{there.folder}: the result cannot be written"):
            there.folder.mkdir(parents=True, exist_ok=True)
        files.append(store([one], there))
    return list(dict.fromkeys(files))


def as_json(checked: Sequence[Checked]) -> str:
    """Return the trials as a document."""
    return json.dumps(as_document(checked), indent=2, allow_nan=False)


def print_checked(checked: Sequence[Checked]) -> None:
    """Print the table, and the trials without an estimate."""
    console = terminal()
    console.print(draw(crosscheck_table(checked)))
    for text in failures_in_words(checked):
        console.print(f"[yellow]note:[/yellow] {escape(text)}")


def write(checked: Sequence[Checked], out: Path) -> list[Path]:
    """Write JSON and figure into a folder; returns the files.  Raises CannotWrite."""
    # matplotlib, which a cross-check that is not written does not need
    from levilab.crosscheck.figure import crosscheck_figure
    from levilab.present.style import save_png

    with writing(f"{out}: the result cannot be written"):
        out.mkdir(parents=True, exist_ok=True)
        replace_atomically(out / JSON, as_json(checked) + "\n")
        save_png(crosscheck_figure(checked), out / FIGURE)
    return [out / JSON, out / FIGURE]

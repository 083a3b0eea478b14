"""`levilab crosscheck`: makes the trials, prints the table, writes JSON and the figure."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from rich.markup import escape

from levilab.crosscheck.catalogue import ROWS, subject_of
from levilab.crosscheck.own.study import OWN, TRIALS, study_result
from levilab.crosscheck.stored import NAME, as_json, store
from levilab.crosscheck.study import Judge, Study, by_pulls, study_world
from levilab.crosscheck.table import as_text, crosscheck_table, failures_as_text
from levilab.errors import UsageError
from levilab.files import replace_atomically, writing
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.recall import recall_suiting
from levilab.pipelines.result import Place
from levilab.present.progress import ShareBar
from levilab.present.terminal import draw, terminal

FIGURE, RANKS = "crosscheck.png", "calibration.png"
#: Number of trials of a calibration: a distribution function that is 0.12 off is seen (Kolmogorov: 1.63/√n at 1 %).
CALIBRATION = 200


def study_worlds(names: Sequence[str], trials: int | None, seed: int) -> list[Study]:
    """Make the trials of some subjects, or of all where none is named.  Raises UsageError for an unknown name."""
    _check(names, ROWS, "known are")
    found = []
    for name in names or ROWS:
        subject = subject_of(name)
        progress = ShareBar(f"cross-checking {name}")
        try:
            found.append(study_world(subject, trials or subject.trials, seed, progress))
        finally:
            progress.close()
    return found


def study_results(names: Sequence[str], paths: Sequence[Path], trials: int | None) -> list[tuple[Study, Place]]:
    """Make the trials with the parameters of results; of analyses that are named, or of all.

    Returns:
        The trials, and where each result lies.

    Raises:
        UsageError: a name is unknown.
        DataError: a path cannot be analyzed.
    """
    _check(names, OWN, "with `like` known are")
    found = [(ANALYSES[name], ANALYSES[name].recall(paths)) for name in names] if names else recall_suiting(paths, {})
    done = []
    for analysis, result in found:
        progress = ShareBar(f"cross-checking {analysis.name}")
        try:
            settings = analysis.settings_of(result)
            done.append((study_result(analysis.name, result, settings, trials or TRIALS, progress), result.place))
        finally:
            progress.close()
    return done


def _check(names: Iterable[str], known: Iterable[str], words: str) -> None:
    for name in names:
        if name not in known:
            raise UsageError("subject", f"{words} {', '.join(known)}", value=name)


def print_studies(studies: Sequence[Study], judge: Judge = by_pulls) -> None:
    """Print the tables: one of all worlds, with a note on failures; one of each result, with its text."""
    console = terminal()
    worlds = [one for one in studies if not one.inputs]
    if worlds:
        console.print(draw(crosscheck_table(worlds, judge=judge)))
    for one in worlds:
        for text in failures_as_text(one):
            console.print(f"[yellow]note:[/yellow] {escape(f'{one.name}: {text}')}")
    for one in studies:
        if one.inputs:
            symbols = ANALYSES[one.name].symbols
            console.print(draw(crosscheck_table([one], symbols)))
            console.print(escape(as_text(one, symbols)))


def store_beside(found: Sequence[tuple[Study, Place]], out: Path | None) -> list[Path]:
    """Write crosscheck.json beside each result, or into a folder; returns the files.  Raises CannotWrite."""
    files = []
    for one, place in found:
        there = replace(place, folder=out) if out else place
        with writing(f"{there.folder}: the result cannot be written"):
            there.folder.mkdir(parents=True, exist_ok=True)
        files.append(store([one], there))
    return list(dict.fromkeys(files))


def write(studies: Sequence[Study], out: Path, *, calibrate: bool = False) -> list[Path]:
    """Write JSON and figure into a folder; returns the files.  Raises CannotWrite."""
    # matplotlib, which a cross-check that is not written does not need
    from levilab.crosscheck.figure import calibration_figure, crosscheck_figure
    from levilab.present.style import save_png

    with writing(f"{out}: the result cannot be written"):
        out.mkdir(parents=True, exist_ok=True)
        replace_atomically(out / NAME, as_json(studies) + "\n")
        save_png(crosscheck_figure(studies), out / FIGURE)
        if calibrate:
            save_png(calibration_figure(studies), out / RANKS)
    return [out / NAME, out / FIGURE, *[out / RANKS] * calibrate]

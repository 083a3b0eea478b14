"""`levilab crosscheck`: makes the trials, prints the table, writes JSON and the figure."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from rich.markup import escape

from levilab.crosscheck.catalogue import SUBJECTS
from levilab.crosscheck.study import as_document, crosscheck
from levilab.crosscheck.table import crosscheck_table, failures_in_words
from levilab.errors import UsageError
from levilab.files import replace_atomically, writing
from levilab.present.progress import ShareBar
from levilab.present.terminal import draw, terminal

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from levilab.crosscheck.study import Checked

JSON, FIGURE = "crosscheck.json", "crosscheck.png"


def check(names: Sequence[str], trials: int | None, seed: int) -> list[Checked]:
    """The trials of some subjects, or of all where none is named.  Raises UsageError for a name that is unknown."""
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


def as_json(checked: Sequence[Checked]) -> str:
    """What was found, as a document."""
    return json.dumps(as_document(checked), indent=2, allow_nan=False)


def print_checked(checked: Sequence[Checked]) -> None:
    """The table, and what came to no estimate."""
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

"""The runs in a folder, as scripts and notebooks use them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from levilab.notebook.run import RecordedRun
from levilab.present.html import facts_as_html, table_as_html
from levilab.runs.listing import Listed, list_runs

if TYPE_CHECKING:
    from collections.abc import Sequence
    from os import PathLike

    import pandas as pd

#: Columns that a notebook's cell shows.
_SHOWN = ("path", "group", "experiment", "status", "readings", "note")


class RunList(list[RecordedRun]):
    """Runs, oldest first, with the table that `levilab runs` prints.

    Attributes:
        listed: a row for each, those that cannot be read included.
    """

    def __init__(self, listed: Sequence[Listed]) -> None:
        self.listed = tuple(listed)
        super().__init__(RecordedRun.load(Path(one.path)) for one in listed if not one.problem)

    def to_dataframe(self) -> pd.DataFrame:
        """Return the table."""
        import pandas as pd

        return pd.DataFrame([vars(one) for one in self.listed], columns=[*Listed.__dataclass_fields__])

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows."""
        rows = [[str(getattr(one, name)) for name in _SHOWN] for one in self.listed]
        return facts_as_html(f"{len(rows)} runs", [], table_as_html(_SHOWN, rows, texts=len(_SHOWN)))


def runs_in(folder: str | PathLike[str], last: int | None) -> RunList:
    """Return the runs at or below a folder.  Raises DataError."""
    found = list_runs(Path(folder))
    return RunList(found if last is None else found[max(len(found) - last, 0) :])

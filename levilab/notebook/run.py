"""A run as scripts and notebooks use it, and the list of all runs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import levilab
from levilab.errors import UsageError
from levilab.notebook.analysis import analyze_data
from levilab.notebook.labels import dataset_of_contents
from levilab.notebook.names import CHOOSE, Exportable, Helpful, bare, meant
from levilab.notebook.quantity import NoSuchName
from levilab.present.html import facts_as_html, table_as_html
from levilab.report.export.contents import contents_of_results
from levilab.runs.listing import Listed, list_runs
from levilab.runs.run import Run
from levilab.texts.text import how_many

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from os import PathLike

    import pandas as pd
    import xarray

    from levilab.notebook.figure import Axes
    from levilab.notebook.result import AnalysisResult
    from levilab.present.style import Figure


@dataclass(frozen=True, repr=False)
class RecordedRun(Exportable, Run):
    """A run folder whose readings are columns by their names, as those of a DataFrame; each is an attribute, too."""

    also: ClassVar[Mapping[str, Any]] = {
        "time": lambda run: run["time_s"],
        "data": "df",
        "columns": "df.columns",
        "keys": "df.keys",
        **{name: f"df.{name}" for name in ("head", "tail", "describe", "info", "dtypes", "shape", "loc", "iloc")},
        "metadata": "record",
        "experiment": "record.experiment",
        "note": "record.note",
        "name": "folder.name",
        **{name: lambda run, name=name: getattr(run.to_xarray(), name) for name in ("sel", "isel")},
    }

    @property
    def _contents(self) -> Mapping[str, Any]:
        frame, _ = self._frame_or_problem()
        return {} if frame is None else dict(frame)

    @classmethod
    def of(cls, run: Run) -> Self:
        """Return a run as notebooks use it."""
        return cls(run.folder, run.record, run.status)

    @property
    def path(self) -> Path:
        """Its folder."""
        return self.folder

    @property
    def df(self) -> pd.DataFrame:
        """Its readings, as `to_dataframe` returns them."""
        return self.to_dataframe()

    instead: ClassVar[Mapping[str, str]] = {
        "values": "df.to_numpy(), or analyze().values",
        "truth": "record.synthetic_how",
        "duration": "time.iloc[-1], or record.ended_utc",
        "id": "name",
        "attrs": "record",
        **dict.fromkeys(("settings", "parameters", "config"), "record.configuration"),
    }

    def _elsewhere(self, name: str) -> str:
        return next((f"record.{one}" for one in type(self.record).model_fields if name in {one, one.split("_")[0]}), "")

    @bare
    def __getitem__(self, column: object) -> Any:
        frame = self.df
        if isinstance(column, list | slice):
            return frame[column]
        if column not in frame:
            advice = (
                meant(column, map(str, frame.columns)) if isinstance(column, str) else "df.iloc[0] is the first reading"
            )
            raise NoSuchName(str(column), f"is no column of {self.folder.name}; {advice}")
        return frame[column]

    def __iter__(self) -> Iterator[str]:
        return iter(self.df.columns)

    def __len__(self) -> int:
        return len(self.df)

    def __bool__(self) -> bool:
        return True  # a run without readings is one, too

    def _ipython_key_completions_(self) -> list[str]:
        return [*self]

    @bare
    def plot(  # type: ignore[override]
        self,
        what: str | None = None,
        *,
        ax: Axes | None = None,
        title: str | None = None,
        logy: bool = False,
        figsize: tuple[float, float] | None = None,
    ) -> Figure | Axes:
        """Return the readings as they are, a panel for each channel; or one column in a panel.

        Args:
            what: the column, by default the first one where another argument is given.
            ax: axes into which it is drawn, and which are returned.
            title: of the panel.
            logy: whether the ordinate is logarithmic.
            figsize: width and height [inch].

        Raises:
            UsageError: there is no such column.
            DataError: the readings cannot be read.
        """
        from levilab.notebook.figure import draw_column, drawn  # with matplotlib
        from levilab.present.style import for_notebooks

        if what is None and ax is None and title is None and not logy:
            return for_notebooks(super().plot(), figsize)

        frame = self.df
        x = next((name for name in ("height_m", "time_s") if name in frame), str(frame.columns[0]))
        y = what or next(str(name) for name in frame.columns if name != x)
        self[y]
        return drawn(
            lambda axes: draw_column(axes, x, y, frame, "."),
            ax,
            title=title,
            logy=logy,
            figsize=figsize,
            synthetic=[self.record.synthetic],
        )

    def to_xarray(self) -> xarray.Dataset:
        """Return readings and traces as a Dataset, as `export` writes them to netCDF; needs xarray.

        Raises:
            DataError: the readings cannot be read.
            MissingXarray: it is not installed.
        """
        return dataset_of_contents(contents_of_results(self.folder, self, []))

    @bare
    def analyze(self, kind: str | None = None, **options: Any) -> AnalysisResult:
        """Analyze it; the same as `levilab.analyze(run, kind, …)`."""
        return analyze_data(self, kind, options)

    def report(self, output: str | PathLike[str] = "report.html", **options: Any) -> Path:
        """Write its report; the same as `levilab.report(run, output, …)`."""
        return levilab.report(self, output, **options)


#: Columns that a notebook's cell shows.
_SHOWN = ("path", "group", "experiment", "status", "readings", "note")


class RunList(Helpful, list[RecordedRun]):
    """Runs, oldest first, each by its number or its name, with the table that `levilab runs` prints.

    Attributes:
        listed: a row for each, those that cannot be read included.
    """

    def __init__(self, listed: Sequence[Listed]) -> None:
        self.listed = tuple(listed)
        super().__init__(RecordedRun.load(Path(one.path)) for one in listed if not one.problem)

    also: ClassVar[Mapping[str, Any]] = {name: f"df.{name}" for name in ("head", "tail", "columns")}
    instead: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("filter", "query", "sel", "where", "select"), CHOOSE),
        **dict.fromkeys(("names", "paths", "index_of"), "[run.name for run in runs], or df"),
        **dict.fromkeys(("groupby", "experiment", "kind", "status"), "df, a table with a row for each"),
        "analyze": "levilab.analyze(runs, kind)",
    }

    @bare
    def __getitem__(self, which: Any) -> Any:
        if not isinstance(which, str):
            try:
                return super().__getitem__(which)
            except TypeError:
                advice = "a number or a name is expected: [run for run in runs if …] chooses"
                raise UsageError("runs", advice, value=type(which).__name__) from None
        for run in self:
            if which in {run.folder.name, str(run.folder)}:
                return run
        raise NoSuchName(which, f"is none of these runs; {meant(which, [run.folder.name for run in self])}")

    def to_dataframe(self) -> pd.DataFrame:
        """Return the table."""
        import pandas as pd

        return pd.DataFrame([vars(one) for one in self.listed], columns=[*Listed.__dataclass_fields__])

    df = property(to_dataframe)

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows."""
        rows = [[str(getattr(one, name)) for name in _SHOWN] for one in self.listed]
        return facts_as_html(how_many(len(rows), "run"), [], table_as_html(_SHOWN, rows, texts=len(_SHOWN)))


def runs_in(folder: str | PathLike[str], last: int | None) -> RunList:
    """Return the runs at or below a folder.  Raises DataError."""
    found = list_runs(Path(folder))
    return RunList(found if last is None else found[max(len(found) - last, 0) :])

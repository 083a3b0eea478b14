"""A run, as scripts and notebooks use it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

from levilab.notebook.analysis import analyze_data
from levilab.notebook.labels import as_dataset
from levilab.runs.run import Run

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import pandas as pd
    import xarray

    from levilab.notebook.result import AnalysisResult


@dataclass(frozen=True, repr=False)
class RecordedRun(Run):
    """A run folder whose readings are columns by their names, as those of a DataFrame."""

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

    def __getitem__(self, column: str) -> pd.Series[Any]:
        return self.df[column]

    def __iter__(self) -> Iterator[str]:
        return iter(self.df.columns)

    def __len__(self) -> int:
        return len(self.df)

    def __bool__(self) -> bool:
        return True  # a run without readings is one, too

    def _ipython_key_completions_(self) -> list[str]:
        return [*self]

    def to_xarray(self) -> xarray.Dataset:
        """Return the readings as a Dataset with units; needs xarray.  Raises DataError, MissingXarray."""
        return as_dataset(self.df, "reading")

    def analyze(self, kind: str | None = None, **options: Any) -> AnalysisResult:
        """Analyze it; the same as `levilab.analyze(run, kind, …)`."""
        return analyze_data(self, kind, options)

"""The result of an analysis, as scripts and notebooks use it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from analysis.uncertainty import Estimate
from levilab.errors import UsageError, unquote
from levilab.files import CannotWrite, replace_atomically
from levilab.pipelines.catalogue import print_analysis
from levilab.pipelines.result import Place
from levilab.pipelines.suits import save as save_result
from levilab.present.numbers import in_one_line
from levilab.report.page import render_part

if TYPE_CHECKING:
    from collections.abc import Mapping
    from os import PathLike

    import pandas as pd

    from levilab.pipelines.catalogue import Analysis
    from levilab.pipelines.result import Result, Value
    from levilab.present.style import Figure

TableName = Literal["values", "models", "readings"]
#: Values that the short form of a result shows.
MOST_VALUES = 4
_ELSEWHERE = "choose another `folder`"


@dataclass(frozen=True, repr=False)
class Quantity(Estimate):
    """A quantity with its standard uncertainty: `value`, `u` (None where not determined), `unit`, and `interval`.

    It prints as value(u), and `float` takes its value.

    >>> Quantity(0.003262, 2.3e-5, "1/s")
    0.003262(23) 1/s
    """

    def __repr__(self) -> str:
        return in_one_line(self)

    def __float__(self) -> float:
        return float("nan") if self.value is None else self.value


def _quantity(value: Value) -> Quantity:
    return Quantity(value.value, value.u, value.unit, value.interval_68)


@dataclass(frozen=True, eq=False, repr=False)
class AnalysisResult:
    """What an analysis found of one or several inputs.  Nothing is written unless `save` is called.

    Attributes:
        analysis: the row of the catalogue.
        found: its result, with the readings.
        copies: data files that DataFrames were written to, which `save` writes beside the result.
    """

    analysis: Analysis[Any]
    found: Any
    copies: tuple[Path, ...] = ()

    @property
    def kind(self) -> str:
        """The analysis: spindown, spin, field, limit or precession."""
        return self.analysis.name

    @property
    def inputs(self) -> tuple[str, ...]:
        """The inputs, by names as short as tells them apart."""
        return tuple(source.name for source in self.found.sources)

    @property
    def synthetic(self) -> bool:
        """Whether any of the inputs is known to be synthetic."""
        return any(source.synthetic for source in self.found.sources)

    @property
    def verdict(self) -> str:
        """The answer of the data, in a few sentences."""
        return str(self.found.text)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the numbers."""
        return tuple(unquote(text) for text in self.found.all_warnings)

    @cached_property
    def document(self) -> dict[str, Any]:
        """All of it, as `save` writes it into result.json."""
        content: dict[str, Any] = self._written.as_dict()
        return content

    @cached_property
    def _written(self) -> Result:
        return self.analysis.result.of(self.found, Place(Path()))  # type: ignore[no-any-return]

    @cached_property
    def values(self) -> Mapping[str, Quantity]:
        """Name → quantity, with u and unit: of the only input, or of all together where the analysis combines them."""
        return {name: _quantity(value) for name, value in self._written.values.items()}

    @cached_property
    def by_input(self) -> Mapping[str, Mapping[str, Quantity]]:
        """Name of the input → name → quantity."""
        return {
            name: {of: _quantity(value) for of, value in run.values.items()}
            for name, run in zip(self.inputs, self._written.runs, strict=True)
        }

    @property
    def _first_of_each(self) -> dict[str, Quantity]:
        """The first value of each input, where nothing is combined."""
        return {f"{of} {name}": one for of, own in self.by_input.items() for name, one in [*own.items()][:1]}

    def __repr__(self) -> str:
        of = self.inputs[0] if len(self.inputs) == 1 else f"{len(self.inputs)} inputs"
        values = self.values or self._first_of_each
        shown = [f"  {name} = {quantity!r}" for name, quantity in [*values.items()][:MOST_VALUES]]
        more = len(values) - MOST_VALUES
        ends = [f"{more} more in values"] * (more > 0 and bool(self.values))
        ends += [f"{len(self.warnings)} warning{'s' * (len(self.warnings) > 1)}"] * bool(self.warnings)
        return "\n".join(
            [
                f"<{self.kind} of {of}{', SYNTHETIC' if self.synthetic else ''}",
                *shown,
                f"  {'; '.join([*ends, 'summary() says all'])}>",
            ]
        )

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows: a report with its figure; nothing is fetched from elsewhere."""
        return render_part(self.analysis, self.found)

    def summary(self) -> str:
        """Return the tables and sentences that `levilab analyze` prints."""
        from levilab.present.terminal import as_text  # with rich

        return as_text(lambda console: print_analysis(self.analysis, self.found, console=console))

    def to_dataframe(self, table: TableName = "values") -> pd.DataFrame:
        """Return the result as a table.

        Args:
            table: "values", a row for each quantity of each input (columns input, name, value, u, unit), and of several
                inputs those of all together first, whose input is "together"; "models", a row for each parameter of
                each model, such as the drag laws, of all inputs together; "readings", a row for each reading, with its
                residual and the unit in the columns' names, as in data files.

        Raises:
            UsageError: there is no such table.
        """
        import pandas as pd

        if table == "readings":
            columns = self.analysis.columns(self.found)
            frames = [pd.DataFrame(dict(one)) for one in columns]
            for name, frame in zip(self.inputs, frames, strict=True):
                frame.insert(0, "input", name)
            return pd.concat(frames, ignore_index=True)
        if table == "models":
            return self._models()
        if table != "values":
            raise UsageError("table", "values, models or readings is expected", value=table)
        together = {"together": self.values} if len(self.inputs) > 1 and self.values else {}
        rows = [
            (of, name, one.value, one.u, one.unit)
            for of, values in (together | dict(self.by_input)).items()
            for name, one in values.items()
        ]
        frame = pd.DataFrame(rows, columns=["input", "name", "value", "u", "unit"])
        return frame.astype({"value": float, "u": float})

    def _models(self) -> pd.DataFrame:
        import pandas as pd

        rows = [
            (model["name"], name, one["value"], one["u"], one["unit"])
            for model in self.document["models"]
            for name, one in model["parameters"].items()
        ]
        frame = pd.DataFrame(rows, columns=["model", "name", "value", "u", "unit"])
        return frame.astype({"value": float, "u": float})

    def plot(self) -> Figure:
        """Draw the figure; it needs no display, a notebook shows it, and `savefig` writes it."""
        from levilab.present.style import for_notebooks  # with matplotlib

        return for_notebooks(self.analysis.figure(self.found))

    def save(self, folder: str | PathLike[str]) -> list[Path]:
        """Write result.json and the figure into a folder, and beside them the DataFrames that were analyzed.

        Returns the files.  Raises CannotWrite.
        """
        place, found = Path(folder), self.found
        written = []
        for path in self.copies:
            copy = _copy(path, place)
            written.append(copy)
            sources = [replace(one, path=copy, data=copy) if one.path == path else one for one in found.sources]
            name = copy.name if len(sources) == 1 else found.place.name
            found = replace(found, sources=tuple(sources), place=replace(found.place, name=name))
        try:
            return [*written, *save_result(self.analysis, found, place)]
        except CannotWrite as error:
            raise CannotWrite(error.problem, _ELSEWHERE) from error


def _copy(path: Path, folder: Path) -> Path:
    """Copy a file into a folder, by a name that replaces no other content.  Raises CannotWrite."""
    content, number, to = path.read_bytes(), 1, folder / path.name
    try:
        while to.exists() and to.read_bytes() != content:
            number += 1
            to = folder / f"{path.stem}-{number}{path.suffix}"
        folder.mkdir(parents=True, exist_ok=True)
        replace_atomically(to, content)
    except OSError as error:
        raise CannotWrite(f"{to}: could not be written ({error.strerror or error})", _ELSEWHERE) from error
    return to

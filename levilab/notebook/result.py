"""The result of an analysis, as scripts and notebooks use it."""

from __future__ import annotations

import base64
import shutil
import tempfile
import weakref
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

import levilab
from levilab.errors import UsageError, unquote
from levilab.files import CannotWrite, as_json, check_folder, replace_atomically, writing
from levilab.notebook.fit import FIT, INSTEAD, LEAST_CORRELATION, METHODS, FittedModel, axes_of
from levilab.notebook.labels import dataset_of_contents
from levilab.notebook.names import Exportable, bare, meant
from levilab.notebook.quantity import Named, Quantity, correlate
from levilab.pipelines.catalogue import ANALYSES, print_analysis
from levilab.pipelines.result import Place, Result, Value
from levilab.pipelines.suits import save as save_result
from levilab.present.html import facts_as_html, fold, head_as_html, paragraphs, table_as_html
from levilab.present.numbers import plain, without_unit
from levilab.present.units import unit
from levilab.report.export.contents import contents_of_readings, readings_of
from levilab.report.export.write import FORMATS
from levilab.report.page import render_part
from levilab.report.tables.latex import to_latex
from levilab.texts.text import how_many

if TYPE_CHECKING:
    from collections.abc import ItemsView, Iterator, KeysView, Mapping
    from os import PathLike

    import pandas as pd
    import xarray
    from numpy.typing import ArrayLike

    from levilab.notebook.figure import Axes
    from levilab.pipelines.document import Analysis
    from levilab.present.style import Figure

TableName = Literal["values", "models", "readings"]
#: Values that the short form of a result shows.
MOST_VALUES = 4
#: Rows that a cell of a notebook shows: of values, of inputs, of readings.
_MOST_ROWS, _MOST_INPUTS, _MOST_READINGS = 20, 20, 5
_ELSEWHERE = "choose another `folder`"
#: Statistics of a model in a fit report: key in result.json → as people write it.
_STATISTICS = {
    "n": "n", "reduced_chi_square": "reduced χ²", "rms_residual": "rms residual", "aicc": "AICc", "weight": "weight",
}  # fmt: skip


class _Name(str):
    """A value's name in a loop over a result; taken for the result of an input, it says where that is."""

    __slots__ = ()

    @bare
    def __getitem__(self, key: Any) -> str:
        if isinstance(key, str):
            expected = "a loop over a result gives names of its values: for one in result.by_input.values(): one['c32']"
            raise UsageError("name", expected, value=f"{self}[{key!r}]")
        return super().__getitem__(key)


@dataclass(frozen=True, eq=False, repr=False)
class AnalysisResult(Exportable):
    """What an analysis found of one or several inputs.  Nothing is written unless `save` is called.

    It is a mapping of its values: `result["c32"]`, `dict(result)`; each is an attribute, too.

    Attributes:
        analysis: the row of the catalogue.
        found: its result, with the readings.
        copies: data files that DataFrames were written to, which `save` writes beside the result.
    """

    analysis: Analysis[Any]
    found: Any
    copies: tuple[Path, ...] = ()

    also: ClassVar[Mapping[str, str]] = {
        **{name: f"fit.{name}" for name in (*FIT, *METHODS)},
        "residual": "residuals",
        "df": "to_dataframe()",
        "message": "verdict",
        "notes": "warnings",
    }
    instead: ClassVar[Mapping[str, str]] = {
        "savefig": "plot().savefig(path)",
        **dict.fromkeys(("figure", "fig", "ax", "axes"), "plot(), which returns the figure, or plot().axes"),
        **dict.fromkeys(("stats", "statistics"), "fit.statistics"),
        "laws": "models",
        "compare": "to_dataframe('models'), with the weight of each law",
        "quantities": "values",
        "units": "the unit of a quantity, as result['c32'].unit, or to_dataframe()",
        "version": "document['software']['levilab']",
        "provenance": "document, with inputs, options and software",
        "plot_fit": "plot('fit')",
        "plot_residuals": "plot('residuals')",
        **INSTEAD,
        "pretty_print": "print(….fit_report())",
        "ci_out": "conf_interval()",
        "uvars": "params, which calculate as numbers of uncertainties do",
        "userkws": "document['settings']",
        **dict.fromkeys(("dump", "dumps"), "to_json(), or save(folder)"),
        **dict.fromkeys(("pull", "pulls"), "data, which has residuals and u of each reading"),
        **dict.fromkeys(("x", "y", "t", "f", "frequency", "spin"), "time, or data, which has all readings"),
        **dict.fromkeys(
            ("u", "errors", "stderr", "perr", "bse", "uncertainties"), "u of a quantity, as result['c32'].u"
        ),
        **dict.fromkeys(("head", "describe", "to_numpy", "to_markdown"), "to_dataframe(), which has it"),
        **dict.fromkeys(("rms", "rmse"), "fit.rms_residual"),
        **dict.fromkeys(("show", "print"), "plot(), or print(….summary())"),
        **dict.fromkeys(("sel", "isel", "interp", "coords", "dims", "data_vars", "attrs"), "to_xarray(), which has it"),
    }

    @property
    def _contents(self) -> Mapping[str, Any]:
        return self.values

    def _elsewhere(self, name: str) -> str:
        return self.values._elsewhere(name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, AnalysisResult) and self._identity == other._identity

    def __hash__(self) -> int:
        return hash(self._identity)

    @cached_property
    def _identity(self) -> tuple[str, ...]:
        """The analysis, digests of its inputs, its settings and numbers: equal results have the same."""
        found = [self.document[name] for name in ("settings", "values", "models")]
        return self.kind, *(source.sha256 for source in self.found.sources), as_json(found)

    def __getstate__(self) -> dict[str, Any]:
        """Return what a pickle holds: the analysis by its name, and the DataFrames' files with their content."""
        return {
            "analysis": self.analysis.name,
            "found": self.found,
            "copies": [(path, path.read_bytes()) for path in self.copies],
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        found, copies = state["found"], []
        if state["copies"]:
            folder = temporary_folder(self)
            for path, content in state["copies"]:
                copies.append(folder / path.name)
                copies[-1].write_bytes(content)
                found = _with_copy(found, path, copies[-1])
        vars(self).update(analysis=ANALYSES[state["analysis"]], found=found, copies=tuple(copies))

    @property
    def kind(self) -> str:
        """Name of the analysis: an argument `kind` of `levilab.analyze`."""
        return self.analysis.name

    @property
    def inputs(self) -> tuple[str, ...]:
        """The inputs, each by the shortest name that no other one has."""
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
        return self.analysis.result_of(self.found, Place(Path()))

    @cached_property
    def models(self) -> Named[FittedModel]:
        """Model → parameter → quantity: every drag law that was fitted, whichever is the best; of all inputs together.

        Each has its fit: statistics, curve, intervals.
        """
        return self._models_of(self._written, "this result", None if len(self.inputs) > 1 else 0)

    @cached_property
    def models_by_input(self) -> Mapping[str, Named[FittedModel]]:
        """Name of the input → the same of that input alone."""
        runs = enumerate(zip(self.inputs, self._written.runs, strict=True))
        return Named({name: self._models_of(run, name, number) for number, (name, run) in runs}, "the inputs")

    def _models_of(self, part: Any, of: str, number: int | None) -> Named[FittedModel]:
        """Return the models of a part of the result, by their names; number: of the input, None of several together."""
        models = {}
        for model in part.models:
            quantities = correlate([_quantity(value) for value in model.parameters.values()], model.covariance)
            values = dict(zip(model.parameters, quantities, strict=True))
            models[model.name] = FittedModel(values, model, self, number)
        return Named(models, f"the models of {of}")

    @property
    def fit(self) -> FittedModel:
        """The best model, with the names that lmfit has: `redchi`, `covar`, `eval(t)`, `conf_interval()` and so on.

        Each of them is an attribute of the result, too.  Raises UsageError where no model was fitted.
        """
        if self.best_model not in self.models:
            raise UsageError("fit", f"a result of {self.kind} has none: its values come from no model of the readings")
        return self.models[self.best_model]

    @property
    def best_model(self) -> str:
        """The drag law that describes the readings best, or the model that the values come from; empty: none is."""
        values = self.document["values"]
        return str(
            self.document.get("best_model")
            or next((name for name, of in self.models.items() if of.keys() <= values.keys()), "")
        )

    @property
    def params(self) -> Mapping[str, Quantity]:
        """The parameters of the best model, as lmfit names them."""
        return self.fit

    @cached_property
    def values(self) -> Named[Quantity]:
        """Name → quantity, with u and unit: of the only input, or of all together where the analysis combines them.

        Constants are those of the best law; `models` has all laws.
        """
        values = self._values_of(self._written, self.models, "models", "the values of this result")
        of_fit: Mapping[str, Quantity] = self.models.get(self.best_model, {}) if len(self.inputs) == 1 else {}
        values.update({name: one for name, one in of_fit.items() if name not in values})  # as the start
        places = {key: f"by_input[{name!r}]" for k, name in enumerate(self.inputs) for key in (name, k)}
        values.elsewhere = {**places, **values.elsewhere}
        return values

    @cached_property
    def by_input(self) -> Mapping[str, Mapping[str, Quantity]]:
        """Name of the input → name → quantity."""
        return Named(
            {
                name: self._values_of(run, self.models_by_input[name], f"models_by_input[{name!r}]", f"those of {name}")
                for name, run in zip(self.inputs, self._written.runs, strict=True)
            },
            "the inputs",
        )

    def _values_of(self, part: Any, models: Named[FittedModel], where: str, what: str) -> Named[Quantity]:
        """Return the values of a part of the result, the same numbers as the parameters of its best model."""
        best = getattr(part, "best_model", None) or next(iter(models), "")
        fitted: Mapping[str, Quantity] = models.get(best, {})
        values = {name: _quantity(value) for name, value in part.values.items()}
        values |= {name: fitted[name] for name, value in values.items() if fitted.get(name) == value}
        law = f" (its best law is {best})" if hasattr(part, "best_model") else ""
        elsewhere = {
            key: f"{where}[{model!r}][{name!r}]"
            for model, of in reversed(models.items())  # the first law that has it
            for name in of
            for key in (self.analysis.symbols.get(name, name), name)
        }
        elsewhere |= {model: f"{where}[{model!r}]" for model in models}
        named = Named(values, f"{what}{law}", elsewhere)
        named.symbols = self.analysis.symbols
        return named

    @bare
    def __getitem__(self, name: str) -> Quantity:
        return self.values[name]

    def get(self, name: str, default: Any = None) -> Any:
        """Return a value, or what is given in its place."""
        return self.values.get(name, default)

    def keys(self) -> KeysView[str]:
        """Return the names of the values."""
        return self.values.keys()

    def items(self) -> ItemsView[str, Quantity]:
        """Return names and values."""
        return self.values.items()

    def __len__(self) -> int:
        return len(self.values)

    def __bool__(self) -> bool:
        return True  # a result without values is one, too

    def __contains__(self, name: object) -> bool:
        return name in self.values

    def __iter__(self) -> Iterator[str]:
        return map(_Name, self.values)

    def _ipython_key_completions_(self) -> list[str]:
        return [*self.values]

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
        ends += [how_many(len(self.warnings), "warning")] * bool(self.warnings)
        return "\n".join(
            [
                f"<{self.kind} of {of}{', SYNTHETIC' if self.synthetic else ''}",
                *(f"  {unquote(text)}" for text in self.found.doubts or [self.verdict.partition(". ")[0]]),
                *shown,
                f"  {'; '.join([*ends, 'summary() says all'])}>",
            ]
        )

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows, at most 30 kB: the answer, and parts that fold.

        It fetches nothing from elsewhere, and what people typed is no markup.
        """
        of = self.inputs[0] if len(self.inputs) == 1 else f"{len(self.inputs)} inputs"
        title = f"{self.kind} of {of}{' (SYNTHETIC)' * self.synthetic}"
        return facts_as_html(
            title, [], paragraphs([*map(unquote, self.found.doubts), self.verdict]) + "".join(_parts(self))
        )

    def to_html(self) -> str:
        """Return the whole report as HTML for another page, with its figure: some hundred kB."""
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
            columns = readings_of(self.analysis, self.found).columns
            return pd.DataFrame({column.name: column.values for column in columns})
        together = {"together": self.values} if len(self.inputs) > 1 and self.values else {}
        parts: dict[str, tuple[str, Mapping[str, Mapping[str, Quantity]]]]
        parts = {"values": ("input", together | dict(self.by_input)), "models": ("model", self.models)}
        if table not in parts:
            raise UsageError("table", "values, models or readings is expected", value=table)
        whose, quantities = parts[table]
        rows = [
            (of, name, one.value, one.u, one.unit) for of, values in quantities.items() for name, one in values.items()
        ]
        frame = pd.DataFrame(rows, columns=[whose, "name", "value", "u", "unit"])
        return frame.astype({"value": float, "u": float})

    @property
    def data(self) -> pd.DataFrame:
        """The readings with their residuals, as `to_dataframe("readings")` returns them."""
        return self.to_dataframe("readings")

    @property
    def time(self) -> np.ndarray:
        """Times of the readings [s], shape (n,).  Raises UsageError where they have none."""
        frame = self.data
        if "time_s" not in frame:
            columns = ", ".join(map(str, frame.columns))
            raise UsageError("time", f"the readings of a result of {self.kind} have none: data has {columns}")
        return frame["time_s"].to_numpy()

    @property
    def budget(self) -> pd.DataFrame:
        """What each u is made of, a row a component; `contribution` is in the unit of the quantity."""
        import pandas as pd

        columns = ["quantity", "component", "source", "kind", "u", "unit", "contribution", "included", "note"]
        rows = [
            (of.quantity, one.name, one.source, one.kind, one.u, one.unit, one.contribution, one.included, one.note)
            for of in self.found.budget
            for one in of.components
        ]
        return pd.DataFrame(rows, columns=columns)

    def to_dict(self) -> dict[str, dict[str, Any]]:
        """Return name → value, u, unit, in plain types."""
        return {name: {"value": one.value, "u": one.u, "unit": one.unit} for name, one in self.items()}

    def to_json(self, path: str | PathLike[str] | None = None) -> str:
        """Return the text of result.json, which has all of it; write it into a file, too, where one is named."""
        text = as_json(self.document)
        if path is not None:
            with writing(Path(path)):
                Path(path).write_text(text, "utf-8")
        return text

    def to_latex(self) -> str:
        """Return the values as a small table of LaTeX; `levilab.report(result, …, tables=True)` writes all tables."""
        symbols = self.analysis.symbols
        rows = [
            rf"  {to_latex(symbols.get(name, name.replace('_', ' ')))} & {one._repr_latex_()} \\"
            for name, one in self.items()
        ]
        return "\n".join([r"\begin{tabular}{ll}", *rows, r"\end{tabular}"])

    def report(self, output: str | PathLike[str] = "report.html", **options: Any) -> Path:
        """Write its report; the same as `levilab.report(result, output, …)`."""
        return levilab.report(self, output, **options)

    def to_xarray(self) -> xarray.Dataset:
        """Return readings and residuals, values and models as a Dataset, as `export` writes it; needs xarray.

        Raises:
            MissingXarray: it is not installed.
        """
        data = dataset_of_contents(contents_of_readings(self.analysis, self.found))
        return data if len(self.inputs) == 1 else data.set_coords("input")

    @property
    def residuals(self) -> np.ndarray:
        """Reading less the best model, shape (n,), in SI; NaN for readings that are not used.  Raises UsageError."""
        frame = self.to_dataframe("readings")
        return frame[self._residual_column(frame)].to_numpy()

    def _residual_column(self, frame: pd.DataFrame) -> str:
        """Return the name of the residuals' column in the table of readings.  Raises UsageError."""
        for name in frame.columns:
            if name.startswith("residual"):
                return str(name)
        raise UsageError("residuals", f"a result of {self.kind} has none: its values come from pulses or pictures")

    @bare
    def predict(self, x: ArrayLike, model: str | None = None, *, input: str | None = None) -> np.ndarray:  # noqa: A002
        """Return a fitted curve at other places, in SI, in the shape of x.

        Args:
            x: times [s] of a spin-down, heights [m] of a field scan, drive frequencies [Hz] of a precession sweep.
            model: a drag law; None: the best one.
            input: which one, of several; its name in `inputs`.

        Raises:
            UsageError: there is no such curve.
        """
        if self.analysis.curve is None:
            has = [name for name, one in ANALYSES.items() if one.curve]
            raise UsageError("predict", f"a result of {self.kind} has no curve; those of {', '.join(has)} have")
        if input is None and len(self.inputs) > 1:
            raise UsageError("input", f"each of several has its own curve: say one of {', '.join(self.inputs)}")
        if input is not None and input not in self.inputs:
            raise UsageError("input", f"known are {', '.join(self.inputs)}", value=input)
        number = self.inputs.index(input) if input else 0
        chosen = self.best_model if model is None else model
        if chosen not in self.models:
            raise UsageError("model", f"known are {', '.join(self.models)}", value=model)
        if x is None:
            raise UsageError("x", "a number or an array of numbers in SI is expected", value=x)
        return self.models_by_input[self.inputs[number]][chosen].eval(x)

    @bare
    def fit_report(
        self, model: str | None = None, of: FittedModel | None = None, *, min_correl: float = LEAST_CORRELATION
    ) -> str:
        """Return the fits as text: each model's statistics, the parameters of one, and their correlations.

        Args:
            model: the law; None: the statistics of all, and the parameters of the best one.
            of: its fit, where that is not the one in `models`.
            min_correl: the weakest correlation that is named.

        Raises:
            UsageError: there is no such law.
        """
        if model is not None and model not in self.models:
            raise UsageError("model", meant(model, self.models), value=model)
        lines = [f"{self.kind} of {', '.join(self.inputs)}{', SYNTHETIC' * self.synthetic}", ""]
        shown = self.models if model is None else {model: of or self.models[model]}
        for name, fit in shown.items():
            known = {key: value for key in _STATISTICS if (value := fit.statistics.get(key)) is not None}
            best = " (best)" if name == self.best_model and len(self.models) > 1 else ""
            lines.append(f"{name}{best}: {', '.join(f'{_STATISTICS[key]} = {one:.4g}' for key, one in known.items())}")
        fitted = shown.get(model or self.best_model, self.values)
        priors = getattr(fitted, "priors", ())
        marks = dict.fromkeys(priors, " (prior: known of tops beforehand)")
        lines += ["", *(f"  {name} = {one!r}{marks.get(name, '')}" for name, one in fitted.items()), ""]
        pairs = [pair for pair in _correlations(fitted) if abs(pair[2]) >= min_correl]
        lines += [f"  correlation of {one} and {other} = {r:+.3f}" for one, other, r in pairs]
        return "\n".join(lines).strip()

    @bare
    def plot(
        self,
        what: Literal["all", "fit", "residuals"] | None = None,
        *,
        ax: Axes | None = None,
        title: str | None = None,
        model: str | None = None,
        logy: bool = False,
        figsize: tuple[float, float] | None = None,
    ) -> Figure | Axes:
        """Draw the figure; it needs no display, a notebook shows it, and `savefig` writes it.

        Args:
            what: "all", as `levilab analyze` draws it, by default; "residuals", a small one: the readings and their
                residuals; "fit": the readings with the curve, by default where another argument is given.
            ax: axes into which one panel is drawn, and which are returned.
            title: of the panel.
            model: whose curve and residuals; None: the best one.
            logy: whether the ordinate is logarithmic.
            figsize: width and height of one panel, the fit where none is named [inch].

        Raises:
            UsageError: there is no such figure.
        """
        from levilab.notebook.figure import draw_fit, drawn  # with matplotlib
        from levilab.present.style import for_notebooks

        of_panel = ax is not None or title is not None or model is not None or logy
        what = what or ("fit" if of_panel or figsize else "all")
        if what not in {"all", "fit", "residuals"}:
            raise UsageError("what", meant(what, ("all", "fit", "residuals")), value=what)
        if what == "all":
            if of_panel or figsize:
                expected = "ax, title, model, logy and figsize go with one panel: fit or residuals"
                raise UsageError("what", expected, value=what)
            return for_notebooks(self.analysis.figure(self.found))
        if not of_panel and what == "residuals":
            return for_notebooks(self._residuals_figure(), figsize)
        panel = self._panel(model)
        look: Any = {"title": title, "logy": logy, "figsize": figsize, "synthetic": self._synthetic}
        return drawn(lambda axes: draw_fit(axes, what, *panel), ax, **look)

    def _panel(self, model: str | None) -> tuple[pd.DataFrame, str, dict[str, Any]]:
        """Return the readings with a model's residuals, their column, and its curves.  Raises UsageError."""
        frame, curve, chosen = self.data, self.analysis.curve, model or self.best_model
        residual = self._residual_column(frame)
        if model is not None and (curve is None or model not in self.models):
            raise UsageError("model", f"known are {', '.join(self.models) or 'none'}", value=model)
        curves = {name: curve(self.found, k, chosen) if curve else None for k, name in enumerate(self.inputs)}
        if model is not None:
            x, y = axes_of(frame, residual)
            parts = [(frame[frame["input"] == name], of) for name, of in curves.items() if of]
            left = np.concatenate([own[y].to_numpy(float) - of(own[x].to_numpy(float)) for own, of in parts])
            frame[residual] = np.where(frame[residual].notna(), left, np.nan)
        return frame, residual, curves

    def _residuals_figure(self) -> Figure:
        from levilab.notebook.figure import residuals_figure  # with matplotlib

        best = self.best_model
        title = f"{self.kind}{f', {best}' * bool(best)}: readings, and residuals"
        if getattr(self.found, "is_doubtful", False):
            title = self.verdict
        frame, residual, curves = self._panel(None)
        return residuals_figure(frame, residual, title, self._synthetic, curves)

    @property
    def _synthetic(self) -> list[bool]:
        return [source.synthetic for source in self.found.sources]

    @bare
    def save(self, folder: str | PathLike[str]) -> list[Path]:
        """Write result.json and the figure into a folder, and beside them the DataFrames that were analyzed.

        Returns the files.  Raises CannotWrite; UsageError: the folder has the name of a file that `export` writes.
        """
        place, found = Path(folder), self.found
        if place.suffix.lower() in FORMATS and not place.is_dir():
            raise UsageError("folder", f"a folder is expected; export({place.name!r}) writes such a file", value=folder)
        check_folder("folder", place)
        written = []
        for path in self.copies:
            copy = _copy(path, place)
            written.append(copy)
            found = _with_copy(found, path, copy)
        try:
            return [*written, *save_result(self.analysis, found, place)]
        except CannotWrite as error:
            raise CannotWrite(error.problem, _ELSEWHERE) from error


def _quantity(value: Value) -> Quantity:
    return Quantity(value.value, value.u, value.unit, value.interval_68)


def _correlations(fitted: Mapping[str, Quantity]) -> Iterator[tuple[str, str, float]]:
    """Yield pairs of quantities with the correlation of their estimates."""
    from uncertainties import correlation_matrix

    for (one, first), (other, second) in combinations(fitted.items(), 2):
        if first.u and second.u:
            yield one, other, float(correlation_matrix([first.to_ufloat(), second.to_ufloat()])[0, 1])


# --- the HTML of a cell -----------------------------------------------------------------------------------


def _parts(result: AnalysisResult) -> Iterator[str]:
    """Yield what stands below the answer, each part with a line to fold it."""
    yield _values(result.values)
    if len(result.inputs) > 1:
        shown = [*result.by_input.items()][:_MOST_INPUTS]
        rows = [(name, "; ".join(f"{of} = {one}" for of, one in [*values.items()][:3])) for name, values in shown]
        more = [("…", f"{len(result.inputs) - len(shown)} more in by_input")] * (len(shown) < len(result.inputs))
        yield fold("each input", table_as_html((), [*rows, *more], texts=2))
    yield fold("readings and residuals", _picture(result), opened=True)
    yield fold("models", _models(result))
    warnings = result.warnings
    yield fold(how_many(len(warnings), "note"), paragraphs(warnings[:_MOST_INPUTS]))
    frame = result.to_dataframe("readings")
    yield fold(how_many(len(frame), "reading"), head_as_html(frame, _MOST_READINGS))
    yield fold(
        "how it was made",
        paragraphs(
            f"{source.name}: {source.run.record.synthetic_how or 'not said how'}"
            for source in result.found.sources[:_MOST_INPUTS]
            if source.run and source.run.record.synthetic
        ),
    )
    yield paragraphs(["values, models, residuals, fit_report(), plot(), to_dataframe(), save(folder) have the rest"])


def _values(values: Mapping[str, Quantity]) -> str:
    rows = [(name, _as_text(quantity)) for name, quantity in [*values.items()][:_MOST_ROWS]]
    more = [("…", f"{len(values) - _MOST_ROWS} more")] * (len(values) > _MOST_ROWS)
    return table_as_html((), [*rows, *more], texts=2)


def _as_text(quantity: Quantity) -> str:
    return f"{without_unit(quantity)} {unit(quantity.unit).text}".strip()


def _models(result: AnalysisResult) -> str:
    """Return a table of the models; nothing where there is none."""
    rows = []
    for model in result.document["models"]:
        name, statistics = model["name"], model.get("statistics", {})
        found = ", ".join(f"{of} = {_as_text(one)}" for of, one in result.models[name].items())
        numbers = (statistics.get(key) for key in ("reduced_chi_square", "weight"))
        best = " (best)" if name == result.best_model else ""
        rows.append((f"{name}{best}", found, *("" if one is None else plain(one, 3) for one in numbers)))
    return table_as_html(("model", "parameters", "χ²/dof", "weight"), rows, texts=2) if rows else ""


def _picture(result: AnalysisResult) -> str:
    """Return the readings and residuals as a picture; nothing where there are none."""
    from levilab.notebook.figure import small_png  # with matplotlib

    try:
        picture = base64.b64encode(small_png(result._residuals_figure())).decode("ascii")
    except UsageError:  # a result without residuals
        return ""
    return f'<img alt="readings and residuals" style="max-width: 100%" src="data:image/png;base64,{picture}">'


# --- files -------------------------------------------------------------------------------------------------


def temporary_folder(of: object) -> Path:
    """Return a new folder that goes with an object: a long record is read again when it is drawn."""
    folder = Path(tempfile.mkdtemp(prefix="levilab-"))
    weakref.finalize(of, shutil.rmtree, folder, ignore_errors=True)
    return folder


def _with_copy(found: Any, path: Path, copy: Path) -> Any:
    """Return what was found, with a copy in the place of a file."""
    sources = [replace(one, path=copy, data=copy) if one.path == path else one for one in found.sources]
    name = copy.name if len(sources) == 1 else found.place.name
    return replace(found, sources=tuple(sources), place=replace(found.place, name=name))


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

"""A sweep of a scene over its parameters, as scripts and notebooks use it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, cast

from levilab.errors import UsageError
from levilab.notebook.labels import dataset_of
from levilab.notebook.names import Exportable, bare
from levilab.notebook.quantity import Named
from levilab.notebook.scene import chosen_scene, in_seconds, whole_key
from levilab.present.html import facts_as_html, fold, head_as_html
from levilab.report.export.contents import attributes_of, contents_of
from levilab.sweeps.adaptive import is_adaptive, run_adaptive
from levilab.sweeps.axes import axis_of, parse_axis
from levilab.sweeps.keys import value_at
from levilab.sweeps.plan import ROWS, Axis
from levilab.sweeps.request import SweepRequest, store_for
from levilab.sweeps.run import compile_for, run, workers_for
from levilab.sweeps.store import Store
from levilab.sweeps.summary import axes_lines, columns_table, headline, summarise
from levilab.texts.text import how_many

if TYPE_CHECKING:
    from os import PathLike

    import numpy as np
    import pandas as pd
    import xarray

    from levilab.present.style import Figure
    from levilab.simulator.scene import Scene

#: Rows of a table that a notebook's cell shows.
_MOST_ROWS = 10


@dataclass(frozen=True, eq=False, repr=False)
class SimulatedMap(Exportable):
    """What a sweep found at each point; what was observed, and the axes, are attributes, too.

    Attributes:
        store: that holds it, in a folder or in memory.
    """

    store: Store

    also: ClassVar[Mapping[str, Any]] = {
        "df": "to_dataframe()",
        "data": "to_xarray()",
        "coords": "axes",
        "keys": "values.keys",
    }
    instead: ClassVar[Mapping[str, str]] = dict.fromkeys(("shape", "dims", "sizes"), "to_xarray().sizes")

    @property
    def _contents(self) -> Mapping[str, Any]:
        short = {key.rpartition(".")[2]: key for key in self.axes}
        return {**{name: self.axes[key] for name, key in short.items() if self._key(name) == key}, **self.values}

    def _key(self, name: str) -> str:
        """Return the key of the only axis that ends in a name; the name itself where none or several do."""
        found = [key for key in self.axes if f".{key}".endswith(f".{name}")]
        return found[0] if len(found) == 1 else name

    @property
    def path(self) -> Path | None:
        """The folder of the store; None: it is in memory."""
        return self.store.path

    @property
    def values(self) -> Mapping[str, np.ndarray]:
        """Observable → values, in the shape of the axes; NaN, False or 0 where a point is not computed."""
        return self.store.load().values

    @property
    def axes(self) -> Mapping[str, np.ndarray]:
        """Key → its values."""
        return {axis.key: axis.values for axis in self.store.plan.axes}

    @bare
    def __getitem__(self, name: str) -> np.ndarray:
        found: Mapping[str, np.ndarray] = Named({**self.values, **self.axes}, "what was observed")
        return found[self._key(name)]

    def __repr__(self) -> str:
        return f"<SimulatedMap: {headline(summarise(self.store))}>"

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows."""
        frame = self.to_dataframe()
        rows = head_as_html(frame, _MOST_ROWS, texts=0)
        facts = [("axis", line) for line in axes_lines(summarise(self.store))]
        return facts_as_html(
            headline(summarise(self.store)), facts, fold(how_many(len(frame), "point"), rows, opened=True)
        )

    def summary(self) -> str:
        """Return the text that `levilab sweep` prints."""
        from levilab.present.terminal import as_text, draw  # with rich

        table = columns_table(summarise(self.store))
        return f"{headline(summarise(self.store))}\n{as_text(lambda console: console.print(draw(table)))}"

    def to_dataframe(self) -> pd.DataFrame:
        """Return a row for each point: its place on the axes, and what was observed."""
        import pandas as pd

        return pd.DataFrame(self.store.load().columns())

    def to_xarray(self) -> xarray.Dataset:
        """Return a Dataset with the axes as coordinates, and units; needs xarray.  Raises MissingXarray."""
        contents = contents_of(self.store)
        keys = [axis.name for axis in contents.axes] or [ROWS]
        places = [([axis.name], axis) for axis in contents.axes]
        places += [(keys, one) for one in contents.arrays or contents.tables[0].columns]
        variables = {
            one.name: (over, one.values, {"units": one.unit, "long_name": one.meaning}) for over, one in places
        }
        data = dataset_of(variables, attributes_of(contents))
        for axis in contents.axes:
            data[axis.name].encoding["_FillValue"] = None  # CF: coordinates are never missing
        return data

    @bare
    def sel(self, at: Mapping[str, Any] | None = None, /, **named: Any) -> xarray.Dataset:
        """Return the points at values of axes, by keys or their last parts, spin_hz=24; options are xarray's."""
        return self._part("sel", {**(at or {}), **named})

    @bare
    def isel(self, at: Mapping[str, Any] | None = None, /, **named: Any) -> xarray.Dataset:
        """Return the points at places on axes, counted from 0; see `sel`."""
        return self._part("isel", {**(at or {}), **named})

    def _part(self, how: str, at: Mapping[str, Any]) -> xarray.Dataset:
        part = getattr(self.to_xarray(), how)
        try:
            return cast("xarray.Dataset", part(**{self._key(name): value for name, value in at.items()}))
        except (KeyError, ValueError, IndexError, TypeError):
            asked = ", ".join(f"{name} = {value}" for name, value in at.items())
            axes = "; ".join(f"{key} = {', '.join(map(str, values))}" for key, values in self.axes.items())
            nearest = ", or method='nearest'" if how == "sel" else ""
            raise UsageError(how, f"values of an axis are expected{nearest}: {axes}", value=asked) from None

    @bare
    def plot(self, column: str | None = None, *, figsize: tuple[float, float] | None = None) -> Figure:
        """Draw an observable, by default the first one: a curve over one axis, a map over more.

        Args:
            column: the observable.
            figsize: width and height of a curve [inch].

        Raises:
            UsageError: there is no such observable, or a table of points, which is no map.
        """
        from levilab.notebook.figure import draw_column, drawn  # with matplotlib
        from levilab.present.style import for_notebooks  # with matplotlib
        from levilab.sweeps.figure import has_figure, map_figure

        names = [*self.values]
        if column is not None and column not in names:
            raise UsageError("column", f"known are {', '.join(names)}", value=column)
        plan = self.store.plan
        if len(plan.axes) == 1 and not plan.is_table:
            frame, y = self.to_dataframe(), column or names[0]
            title = headline(summarise(self.store))
            figure = drawn(
                lambda axes: draw_column(axes, plan.axes[0].key, y, frame, ".-"), None, title=title, figsize=figsize
            )
            return cast("Figure", figure)
        if not has_figure(plan):
            raise UsageError("plot", "a table of points is no map: draw columns of to_dataframe()")
        if figsize:
            raise UsageError("figsize", "a map has its own size: savefig(path, dpi=300) makes it larger", value=figsize)
        return for_notebooks(map_figure(self.store.load(), column or names[0]))


def stored_map(path: str | PathLike[str]) -> SimulatedMap:
    """Return the map in a store.  Raises DataError."""
    return SimulatedMap(Store.open(Path(path)))


def sweep_scene(
    scene: Scene | str | PathLike[str],
    axes: Mapping[str, Any] | Sequence[str],
    by_name: Mapping[str, Any],
    settings: Mapping[str, Any],
    out: str | PathLike[str] | None,
    *,
    observe: str | Sequence[str],
    duration: float | str,
    resume: bool,
    cores: int | None,
    **given: Any,
) -> SimulatedMap:
    """Compute a sweep; see `levilab.sweep`.

    Args:
        scene: that is simulated.
        axes: key → values, or texts KEY=FROM:TO:N.
        by_name: last part of a key → values.
        settings: changes of the scene by dotted keys.
        out: folder of the store; None: it stays in memory.
        observe: names of what is observed, in a text with commas between them.
        duration: of each motion [s], or with its unit.
        resume: go on with the store that is there.
        cores: processes; None: one for each core, where that pays.
        given: the other attributes of a `SweepRequest`.

    Raises:
        UsageError: an argument is wrong.
        SceneError, SimulationError: a scene of the sweep cannot be simulated.
    """
    chosen = chosen_scene(scene, settings, {})
    if not isinstance(axes, Mapping | Sequence):
        raise UsageError("sweep", "keys with their values are expected, as {'spin_hz': [20, 30]}", value=axes)
    named: Mapping[str, Any] = axes if isinstance(axes, Mapping) else {}
    spans = [] if named else [parse_axis(text) for text in ([axes] if isinstance(axes, str) else axes)]
    spans += [_axis(chosen, whole_key(chosen, key), values) for key, values in {**named, **by_name}.items()]
    names = observe.split(",") if isinstance(observe, str) else observe
    lasts = in_seconds(duration)
    request = SweepRequest(chosen, sweep=spans, settings=settings, observe=names, duration=lasts, **given)
    store = store_for(request, None if out is None else Path(out), resume=resume)
    carry_out = partial(run_adaptive if is_adaptive(store) else run, store)
    with store.lock():
        compile_for(store.plan)
        carry_out(workers_for(store.plan, cores))
    return SimulatedMap(store)


def _axis(scene: Scene, key: str, values: Any) -> Axis:
    """Return an axis of values, or of a text FROM:TO:N.  Raises UsageError."""
    value_at(scene, key, 0.0)  # a key that is wrong is named before its values
    return parse_axis(f"{key}={values}") if isinstance(values, str) else axis_of(key, values)

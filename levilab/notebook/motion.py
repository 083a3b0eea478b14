"""A simulated motion, as scripts and notebooks use it."""

from __future__ import annotations

import base64
import sys
import tempfile
import warnings
from dataclasses import dataclass, fields
from functools import partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from levilab.animation.request import AnimationRequest, animate, check_request
from levilab.errors import DoubtWarning, UsageError
from levilab.motion.simulation import COLUMNS, SimulationRequest, kept_rows, run_simulation, write_motion
from levilab.motion.summary import Summary, as_document
from levilab.motion.table import headline, print_motion
from levilab.notebook.labels import dataset_of_contents
from levilab.notebook.names import Exportable, bare, meant
from levilab.notebook.quantity import Named
from levilab.present.html import facts_as_html
from levilab.present.terminal import as_text
from levilab.report.export.contents import Contents, table_of
from levilab.simulator.scene import remarks
from levilab.simulator.trajectory import Trajectory

if TYPE_CHECKING:
    from collections.abc import Mapping
    from os import PathLike

    import pandas as pd
    import xarray

    from levilab.notebook.figure import Axes
    from levilab.present.style import Figure
    from levilab.simulator.scene import Scene


#: What people call a quantity that is drawn → its column.
_COLUMNS = {
    "x": "x_m",
    "y": "y_m",
    "z": "z_m",
    "height": "z_m",
    "spin": "spin_frequency_hz",
    "spin_hz": "spin_frequency_hz",
    "energy": "energy_j",
    "tilt": "tilt_rad",
}


@dataclass(frozen=True, repr=False)
class SimulatedMotion(Exportable, Trajectory):
    """A trajectory with what `levilab simulate` says of it; the columns of its table are attributes, too.

    Attributes:
        found: the motion in numbers, with all samples that its spectrum needed.
        folder: of the run, None if none was written.
        request: what was asked for.
    """

    found: Summary | None = None
    request: SimulationRequest | None = None
    folder: Path | None = None

    also: ClassVar[Mapping[str, Any]] = {
        "t": "time",
        "height": "z",
        "energy": "energies",
        "spin": "spin_hz",
        "spin_frequency": "spin_hz",
        "omega": lambda motion: 2 * np.pi * motion.spin_hz,
        "df": "to_dataframe()",
        "data": "to_dataframe()",
        "notes": "warnings",
        "theta": "tilt",
        "lines": "found.lines.lines",
        **{name: lambda motion, name=name: getattr(motion.to_xarray(), name) for name in ("sel", "isel", "interp")},
    }
    instead: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("coords", "dims"), "to_xarray(), which has it"),
        "spectrum": "found.lines.spectrum, frequencies [Hz] and amplitudes [rad] of the axis; lines are its peaks",
        **dict.fromkeys(("success", "message"), "survived, values['tolerance_reached'], or print(….summary())"),
        **dict.fromkeys(("samples", "dt", "step"), "time; rate=… of simulate chooses the states per second"),
    }

    @property
    def _contents(self) -> Mapping[str, Any]:
        return {name: values(self) for name, _, _, values in COLUMNS}

    @bare
    def __getitem__(self, name: str) -> np.ndarray:
        columns: Mapping[str, np.ndarray] = Named(self._contents, "the columns of this motion")
        return columns[name]

    @property
    def _found(self) -> Summary:
        assert self.found
        return self.found

    @property
    def x(self) -> np.ndarray:
        """Position of the top across [m]."""
        return self.position[:, 0]

    @property
    def y(self) -> np.ndarray:
        """Position of the top across [m]."""
        return self.position[:, 1]

    @property
    def z(self) -> np.ndarray:
        """Height of the top above the base [m]."""
        return self.position[:, 2]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about the numbers."""
        return self._found.notes

    @property
    def values(self) -> dict[str, Any]:
        """The motion in numbers by names that have the unit, with the estimated errors of its end."""
        return as_document(self._found)

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows."""
        found = self._found
        error = f"{self.accuracy.position:.1g} m, {self.accuracy.axis:.1g} rad of the axis (estimated)"
        facts = [
            ("spin", found.spin),
            ("height", found.heights),
            ("error at the end", error),
            ("states", f"{len(self.time)}"),
            *(("note", note) for note in found.notes),
        ]
        return facts_as_html(headline(found), facts)

    def summary(self) -> str:
        """Return the text that `levilab simulate` prints: end, heights, spin, the lines of the axis, the errors."""
        return as_text(partial(print_motion, self._found))

    def to_dataframe(self) -> pd.DataFrame:
        """Return the states, a row each, with the columns of states.csv: time_s, x_m, …, energy_j."""
        import pandas as pd

        return pd.DataFrame({name: values(self) for name, _, _, values in COLUMNS})

    def to_xarray(self) -> xarray.Dataset:
        """Return the states as a Dataset over time_s, with units; needs xarray.  Raises MissingXarray."""
        return dataset_of_contents(self.contents)

    @property
    def contents(self) -> Contents:
        """What is exported of it."""
        name, about = self.scene.name, {"source": "levilab simulate, simulated", "synthetic": "true"}
        return Contents(name, headline(self._found), (table_of(self.to_dataframe(), "states", "a state"),), about)

    @bare
    def plot(
        self,
        what: str | None = None,
        *,
        ax: Axes | None = None,
        title: str | None = None,
        logy: bool = False,
        figsize: tuple[float, float] | None = None,
    ) -> Figure | Axes:
        """Draw path, height, spin, tilt and energy in time, and the spectrum of the axis; it needs no display.

        Args:
            what: one quantity alone, in time: a column of the table, "z", "spin", "energy" or "tilt"; by default the
                height where another argument is given.
            ax: axes into which it is drawn, and which are returned.
            title: of the panel.
            logy: whether the ordinate is logarithmic.
            figsize: width and height of one panel, the height where none is named [inch].

        Raises:
            UsageError: there is no such quantity.
        """
        if what is not None or ax is not None or title is not None or logy or figsize:
            from levilab.notebook.figure import draw_column, drawn  # with matplotlib

            column = _COLUMNS.get(what or "z", what or "z")
            frame = self.to_dataframe().assign(tilt_rad=self.tilt)
            if column not in frame:
                raise UsageError("what", meant(column, [*_COLUMNS, *map(str, frame.columns)]), value=what)
            look: Any = {"title": title, "logy": logy, "figsize": figsize}
            return drawn(lambda axes: draw_column(axes, "time_s", column, frame), ax, **look)
        from levilab.motion.figure import motion_figure  # with matplotlib
        from levilab.present.style import for_notebooks

        return for_notebooks(motion_figure(self._found))

    def write(self, folder: Path) -> Path:
        """Return its run folder, which is made in this one where there is none yet.  Raises CannotWrite."""
        assert self.request
        return self.folder or write_motion(self._found, self.request, folder)

    def animate(
        self,
        path: str | PathLike[str] | None = None,
        *,
        start: float | None = None,
        stop: float | None = None,
        speed: float | None = None,
    ) -> Animation:
        """Show the top in slow motion: a page to turn and to scrub, or a film.

        Args:
            path: of the file, which ends in .html, .gif or .mp4; None writes none, and a notebook shows the page.
            start: of the span that is shown [s].
            stop: of it [s].
            speed: part of the real one.

        Raises:
            UsageError: an argument is wrong.
            MissingThree, MissingEncoder: a library is missing.
            CannotWrite: the file cannot be written.
        """
        with tempfile.TemporaryDirectory(prefix="levilab-") as folder:
            file = Path(folder, "animation.html") if path is None else Path(path)
            request = AnimationRequest(file, start, stop, speed)
            check_request(request, self.scene, self._found.duration)
            print(f"animating {self._found.duration:.3g} s …", file=sys.stderr)  # noqa: T201 - it takes seconds
            shown = animate(request, self._found, lambda _: None)
            return Animation(file.read_bytes(), file.suffix.lower(), shown, None if path is None else file)


#: Ending of an animation's file → how a notebook shows it, with the content as base64.
_SHOWN_AS = {
    ".html": '<iframe src="data:text/html;base64,{}" title="{}" width="100%" height="640" style="border: 0"></iframe>',
    ".gif": '<img src="data:image/gif;base64,{}" alt="{}">',
    ".mp4": '<video src="data:video/mp4;base64,{}" title="{}" controls loop></video>',
}


@dataclass(frozen=True, repr=False)
class Animation:
    """An animation, which a notebook shows.

    Attributes:
        content: of the file.
        ending: of its name, which says its kind.
        text: a description.
        path: of the file; None: none was written.
    """

    content: bytes
    ending: str
    text: str
    path: Path | None

    def __repr__(self) -> str:
        return f"<Animation of {self.text}{f', in {self.path}' if self.path else ''}>"

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows."""
        content = base64.b64encode(self.content).decode("ascii")
        return _SHOWN_AS[self.ending].format(content, escape(self.text, quote=True))


def simulate_motion(
    scene: Scene,
    duration: float,
    *,
    tolerance: float,
    rate: float,
    out: str | PathLike[str] | None,
    animate: str | PathLike[str] | None,
) -> SimulatedMotion:
    """Simulate a scene; settings without effect are warnings of Python, too.

    Raises UsageError, SimulationError, CannotWrite.
    """
    for text in remarks(scene):
        warnings.warn(text, DoubtWarning, stacklevel=4)  # this, `simulate` and `bare` stand before the person's line
    if animate is not None:
        check_request(AnimationRequest(Path(animate)), scene, duration)
    request = SimulationRequest(scene, duration, tolerance, rate, None if out is None else Path(out))
    done = run_simulation(request, lambda _: None, uses_states=True)
    motion = done.summary.motion
    rows = kept_rows(motion, done.samples_per_state)
    own = {one.name: getattr(motion, one.name) for one in fields(motion)}
    own |= {"states": motion.states[rows]}
    simulated = SimulatedMotion(**own, found=done.summary, folder=done.folder, request=request)
    if animate is not None:
        simulated.animate(animate)
    return simulated

"""The lab application for experiments on the Levitron.

For scripts and notebooks, each with `help`:

    run = levilab.acquire("spin", mock=True)     # an experiment → a run
    run = levilab.load("runs/…")                 # a run of earlier; levilab.runs() lists them
    result = levilab.analyze(run)                # a run, a file, a DataFrame or arrays → a result
    levilab.report(result, "report.html")        # its report
    motion = levilab.simulate("undriven", 5)     # a scene → a trajectory; levilab.scenes() lists them
    levilab.sweep("undriven", spin_hz=…)         # a scene over its parameters → a map
    levilab.stability("undriven")                # where its top floats
    levilab.export(run, "run.nc")                # readings, traces and result for other programs
    levilab.crosscheck("spindown")               # are its numbers and uncertainties right?

What they need is imported when they are called.  Known failures are `levilab.LevilabError`s.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any, Literal

from levilab.errors import LevilabError
from levilab.notebook.names import NoSuchAttribute, bare, border, meant

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from os import PathLike
    from pathlib import Path

    import pandas as pd
    from numpy.typing import ArrayLike

    from levilab.bench.person import Task
    from levilab.crosscheck.study import Study
    from levilab.notebook.motion import SimulatedMotion
    from levilab.notebook.result import AnalysisResult
    from levilab.notebook.run import RecordedRun, RunList
    from levilab.notebook.stability import FloatingTop
    from levilab.notebook.sweep import SimulatedMap
    from levilab.pipelines.options import Correlation, Method, Tilt
    from levilab.runs.run import Run
    from levilab.simulator.scene import Scene

#: Arguments of `analyze` that are data, and no options.
_DATA = {"data", "kind", "u", "time", "frequency", "light"}

__all__ = [
    "LevilabError", "acquire", "analyze", "crosscheck", "export", "load", "open_sweep", "report", "runs", "scenes",
    "simulate", "stability", "sweep",
]  # fmt: skip


#: What other libraries call the functions → our names.
_INSTEAD = {
    "read": "load", "open": "load, for a run, or analyze, for a data file",
    "load_run": "load", "fit": "analyze", "read_csv": "analyze", "run": "runs",
    "save": "export", "plot": "load(…).plot() or analyze(…).plot()", "version": "__version__",
}  # fmt: skip


class _FrontDoor(ModuleType):
    """This package, whose functions stay where the import system would put rooms of their names."""

    def __dir__(self) -> list[str]:
        return [*__all__, *(name for name in vars(self) if name.startswith("__")), "__version__"]

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") and name != "__version__":
            raise AttributeError(f"module 'levilab' has no attribute {name!r}")
        if name != "__version__":
            with border:
                instead = f"did you mean {_INSTEAD[name]}?" if name in _INSTEAD else meant(name, __all__)
                raise NoSuchAttribute(f"levilab has no {name!r}: {instead}")
        from importlib.metadata import version

        return version("levilab")

    def __setattr__(self, name: str, value: object) -> None:
        if name in __all__ and isinstance(value, ModuleType):
            function = getattr(self, name)
            vars(value)["__wrapped__"] = function.__wrapped__  # for its signature
            function.__dict__ = vars(value)  # levilab.report.page is found at the function, too
        else:
            super().__setattr__(name, value)


@bare
def acquire(
    experiment: Literal["spin", "trace", "field", "limit", "precession", "hold", "sway"],
    *,
    mock: bool = False,
    bench: str | PathLike[str] | None = None,
    counter: str | None = None,
    scope: str | None = None,
    out: str | PathLike[str] = "runs",
    seed: int | None = None,
    scene: str | PathLike[str] | None = None,
    group: str | None = None,
    note: str = "",
    temperature: float | str | None = None,
    washers: str | None = None,
    realtime: bool = False,
    resume: str | PathLike[str] | Run | None = None,
    settings: Mapping[str, Any] | None = None,
    wire_log: bool = False,
    person: Callable[[Task], str] | None = None,
) -> RecordedRun:
    """Run an experiment on the bench, and write a run folder.

    Ctrl-C ends it after the reading under way: outputs go off, and the run is kept and returned; its `status` is then
    "interrupted" instead of "finished", and `resume` goes on with it.

    Args:
        experiment: its name.
        mock: on the virtual bench, which needs no hardware.
        bench: file that describes the bench, by default bench.toml; with `mock` only its settings count.
        counter: model or address of a counter that takes the place of the bench's: "phyphox" with `mock`, or
            "phyphox://HOST:8080".
        scope: the same of an oscilloscope.
        out: folder in which the run folder is made.
        seed: makes a virtual run repeatable.
        scene: with `mock`, a top in full motion: the name of a scene, such as "spindown", or its TOML file.
        group: who measures, as "Group 7": the name of the run in tables and figures.
        note: kept with the run.
        temperature: of the magnets [°C], or with its unit: "70 F"; kept with the run.
        washers: on the top, as "0.06+0.1 g"; kept with the run.
        realtime: keeps the virtual bench to the wall clock.
        resume: an interrupted run to go on with, with the settings that it was begun with.
        settings: of the experiment, by dotted keys, as {"limit.which": "upper"}; `levilab acquire NAME --settings`
            lists all, with units and ranges.
        wire_log: keeps all bytes sent and received.
        person: carries out what a real bench has to ask for, such as placing the probe, and returns the answer; by
            default `input` asks for it.

    Returns:
        The run: `to_dataframe()`, `plot()`, `folder`, `status`, `record`.

    Raises:
        LevilabError: known failures; `UsageError` for a wrong argument.
        instruments.errors.InstrumentError: an instrument did not answer, or wrongly.
    """
    from pathlib import Path

    from levilab.acquisition.request import AcquisitionOptions
    from levilab.notebook.acquisition import acquire_run, as_path, ask_with_input, assignments

    options = AcquisitionOptions(
        mock=mock,
        bench=as_path(bench),
        counter=counter,
        scope=scope,
        out=Path(out),
        seed=seed,
        scene=None if scene is None else str(scene),
        group=group,
        note=note,
        temperature=None if temperature is None else str(temperature),
        washers=washers,
        realtime=realtime,
        resume=as_path(resume),
        wire_log=wire_log,
        person=person or ask_with_input,
        settings=assignments(settings or {}),
    )
    return acquire_run(experiment, options)


@bare
def load(path: str | PathLike[str]) -> RecordedRun | AnalysisResult:
    """Return the run in a run folder, or the result in a result.json.

    Args:
        path: of the folder, or the name of a run in runs/; or of a file that `save` or `levilab analyze` has written.

    Returns:
        The run: `to_dataframe()`, `plot()`, `folder`, `status`, `record`, `events()`, `traces()`; or the result, as
        `analyze` returns it.

    Raises:
        DataError: there is neither, it is damaged, or the readings of the result have changed.
    """
    from levilab.notebook.acquisition import load_any

    return load_any(path)


@bare
def analyze(
    data: Run
    | str
    | PathLike[str]
    | pd.DataFrame
    | ArrayLike
    | Mapping[str, ArrayLike]
    | Sequence[Run | str | PathLike[str] | pd.DataFrame] = (),
    kind: Literal["spindown", "spin", "field", "limit", "precession", "sway", "hold", "video"] | None = None,
    u: ArrayLike | None = None,
    *,
    time: ArrayLike | None = None,
    frequency: ArrayLike | None = None,
    light: ArrayLike | None = None,
    columns: Mapping[str, str | int] | str | None = None,
    skip_doubtful: bool | None = None,
    channel: str | None = None,
    rate: float | None = None,
    reading_u: float | None = None,
    keep_outliers: bool = False,
    tilt: Tilt = "auto",
    correlation: Correlation = "fitted",
    between: tuple[float, float] | str | None = None,
    laws: Sequence[str] | str | None = None,
    method: Method = "auto",
    orthogonal: bool = False,
    device: str | PathLike[str] | None = None,
    height_m: float | None = None,
    height_u_m: float | None = None,
    clock_u: float | None = None,
    near: float | None = None,
    drive: float | None = None,
    distance_m: float | None = None,
    distance_u_m: float | None = None,
    below_m: float | None = None,
    moment_a_m2: float | None = None,
    scan: str | PathLike[str] | None = None,
    side: str | PathLike[str] | None = None,
    spin_hz: float | None = None,
    sensor_m: float | None = None,
    spindown: str | PathLike[str] | None = None,
    rim_m: float | None = None,
    base_m: float | None = None,
    scale_m: float | None = None,
    camera_m: float | None = None,
    beside: bool = False,
    stem_m: float | None = None,
    start_s: float | None = None,
    stop_s: float | None = None,
    line_time_s: float | None = None,
) -> AnalysisResult:
    """Analyze runs, data files or DataFrames.  Nothing is written; `save(folder)` of the result does.

    >>> import levilab
    >>> result = levilab.analyze("sample_data/spin-down-1")  # or a file, a DataFrame; arrays: levilab.analyze(t, f, u)
    >>> result["c32"], result.best_model
    (0.0002369(4) (rad/s)^-1/2/s, 'disc')
    >>> figure = result.plot()  # in a notebook the last line of a cell shows it

    Args:
        data: a run, the path of a run folder, of a data file or of a folder to search, a pattern of paths, a DataFrame
            with columns as in data files (`time_s`, `spin_frequency_hz`, …, or titles that files may have, with their
            units), or several; a dictionary of such columns, a Series with its index in seconds, an object of xarray;
            or arrays: (times [s], spin frequencies [Hz]) and, third, their standard uncertainties, one or an array; of
            the kinds "spin" (times, light), "field" (heights [m], flux densities [T]) and "precession" (drive,
            precession [Hz]), or limits alone [Hz].  Arrays of `uncertainties` have their u with them.
        kind: the analysis; None for the one that is made for the data; or the second of two arrays.
        u: standard uncertainty of the readings beside two arrays, one or an array.
        time: times of readings [s], which with frequency take the place of data.
        frequency: spin frequencies at these times [Hz].
        light: signal of a detector at these times, in the place of frequency; its kind is "spin".
        columns: of a file or a DataFrame, where titles are not known: {"t": "Zeit", "f": "Drehzahl [rpm]"}, or as text
            "t=Zeit,f=Drehzahl [rpm]"; numbers count columns from 1.
        skip_doubtful: leave out the rows of a table in which a cell is no plain number, as 35.8? or ca. 40; None: as a
            correction beside the file says.
        channel: of a record with several (spindown, spin).
        rate: samples per second [Hz], of files that do not say it (spindown, spin); pictures, in slow motion (video).
        reading_u: standard uncertainty of every reading [Hz], in the place of what the data say (spindown, limit,
            precession).
        keep_outliers: fit readings that look like miscounts, too (spindown, precession).
        tilt: whether counts hold the tilt of the top's moment: "auto" as "fitted", but for a mock run whose top only
            spins; "none" for a top that only spins (spindown).
        correlation: whether the noise of neighbouring readings may be correlated; "none": it is white (spindown).
        between: fit only the readings between two spins [Hz], as (30, 24) (spindown).
        laws: fit only these drag laws, as ("disc", "stokes") (spindown).
        method: how pulses are found: edges is the fastest, likelihood for weak ones (spin).
        orthogonal: let the uncertainty of the drive's frequency count, too (precession).
        device: file that describes base and top, as sample_data/device.toml (spindown, field, sway).
        height_m: where the top was seen to float [m]; its moment follows, if its mass is known (field).
        height_u_m: standard uncertainty of it [m]; by default that of the scan's heights (field).
        clock_u: relative standard uncertainty of the clock that counts or samples, for the budgets (not field, sway).
        near: about where the spin of a magnetometer's record is at first, to 10 % [Hz] (spindown, spin, limit, video).
        drive: frequency of the drive meanwhile, for whether the top is locked to it [Hz] (spin).
        distance_m: of a magnetometer from the top's axis, horizontally [m]; the moment's tilt follows (spin).
        distance_u_m: standard uncertainty of distance_m and below_m [m] (spin).
        below_m: height of the top above the magnetometer [m] (spin).
        moment_a_m2: moment of the top [A m²]; the angle of its tilt follows (spin).
        scan: a Hall scan of the base, a run or a file (sway).
        side: track of a film from beside, of the same time, for the heights (sway).
        spin_hz: spin of the top where no column has it [Hz] (sway).
        sensor_m: of a record of the field: distance of the top from the phone above it, or from two probes (sway).
        spindown: a spin-down of the same top, a run or a file, that is compared (hold).
        rim_m: scale of a film: diameter of the top's rim [m] (video).
        base_m: scale of a film: outer diameter of the base [m] (video).
        scale_m: scale of a film: length of a pixel [m] (video).
        camera_m: its distance from the base, with base_m or rim_m, and height_m, here of the rim [m] (video).
        beside: the camera is beside the top, at its height (video).
        stem_m: height of a light dot on the stem above the rim [m] (video).
        start_s: time from which readings count, or the top of a film floats [s] (spindown, video).
        stop_s: time until which [s] (spindown, video).
        line_time_s: from a row of the sensor to the next one [s] (video).

    Returns:
        The result: `values`, `verdict`, `warnings`, `summary()`, `to_dataframe()`, `plot()`, `save(folder)`.

    Raises:
        UsageError: an argument is wrong, or the data suit several analyses equally.
        DataError: the data suit none, or cannot be used; the text names file and line.
    """
    options = {name: value for name, value in locals().items() if name not in _DATA}
    from levilab.notebook.analysis import analyze_data

    if light is not None:
        return analyze_data((time, light), kind or "spin", options, u)
    return analyze_data(data if time is None and frequency is None else (time, frequency), kind, options, u)


@bare
def simulate(
    scene: Scene | str | PathLike[str],
    duration: float | str = 30.0,
    *,
    settings: Mapping[str, Any] | None = None,
    tolerance: float = 1e-7,
    rate: float = 100.0,
    out: str | PathLike[str] | None = None,
    animate: str | PathLike[str] | None = None,
    **changes: Any,
) -> SimulatedMotion:
    """Simulate the motion of a top.  The first call for a kind of scene compiles for some seconds.

    Args:
        scene: the name of one that ships (`levilab.scenes()`), a TOML file, or a `levilab.simulator.Scene`.
        duration: how much is simulated [s], or with its unit: "2min".
        settings: changes of the scene by dotted keys, as {"top.mass_kg": 0.0255} or {"top.mass_kg": "25.5 g"}.
        tolerance: wanted error at the end, of the place [m] and of the axis [rad].
        rate: states per second [1/s].
        out: folder in which a run folder is made; None writes nothing.
        animate: file of an animation in slow motion, .html, .gif or .mp4; `animate()` of the trajectory has more.
        **changes: of the scene by the last parts of keys, as mass_kg=0.0255.

    Returns:
        The trajectory: `time`, `position`, `axis`, `spin_hz`, `tilt`, …, `summary()`, `to_dataframe()`, `plot()`,
        `values`, `warnings`.

    Raises:
        SceneError: the scene, or a key of it.
        UsageError: another argument.
        SimulationError: the motion cannot be followed.
    """
    from levilab.notebook.motion import simulate_motion
    from levilab.notebook.scene import chosen_scene, in_seconds

    chosen, lasts = chosen_scene(scene, settings or {}, changes), in_seconds(duration)
    return simulate_motion(chosen, lasts, tolerance=tolerance, rate=rate, out=out, animate=animate)


def scenes() -> dict[str, str]:
    """Return the scenes that come with levilab: name → description."""
    from levilab.notebook.scene import list_scenes

    return list_scenes()


@bare
def sweep(
    scene: Scene | str | PathLike[str],
    sweep: Mapping[str, ArrayLike | Sequence[str] | str] | Sequence[str] = (),
    *,
    observe: str | Sequence[str] = ("survived", "lifetime_s"),
    duration: float | str = 30.0,
    settings: Mapping[str, Any] | None = None,
    tolerance: float = 1e-6,
    out: str | PathLike[str] | None = None,
    resume: bool = False,
    adaptive: bool = False,
    seed: int = 0,
    cores: int | None = None,
    **axes: ArrayLike | Sequence[str] | str,
) -> SimulatedMap:
    """Simulate a scene over two or three of its parameters.

    Args:
        scene: its name (`levilab.scenes()`), a TOML file, or a `levilab.simulator.Scene`.
        sweep: key of the scene, whole or its last part, → values that increase, as {"top.mass_kg": [0.0249, 0.025]}, or
            with units, ["24.9 g", "25 g"]; or a text "20:40:21".
        observe: names of what is observed at each point; `levilab sweep --help` lists them.
        duration: of each motion [s], or with its unit: "2min".
        settings: changes of the scene by dotted keys.
        tolerance: wanted error at the end, of the place [m] and of the axis [rad].
        out: folder STORE.zarr, which xarray.open_zarr reads, too; None keeps the map in memory.
        resume: go on with an interrupted store.
        adaptive: compute points along the boundary alone, and fill in the rest.
        seed: of the points that `adaptive` checks at random.
        cores: processes; None: one for each core, where that pays.
        **axes: axes by the last parts of keys, as spin_hz=np.linspace(20, 40, 21).

    Returns:
        The map: `values`, `axes`, `to_dataframe()`, `to_xarray()`, `plot(column)`, `summary()`.

    Raises:
        UsageError: an argument is wrong.
        SceneError: a key of the scene, or the scene.
        SimulationError: a motion cannot be followed.
    """
    given: dict[str, Any] = {"observe": observe, "duration": duration, "resume": resume, "cores": cores}
    from levilab.notebook.sweep import sweep_scene

    return sweep_scene(
        scene, sweep, axes, settings or {}, out, adaptive=adaptive, seed=seed, tolerance=tolerance, **given
    )


@bare
def open_sweep(path: str | PathLike[str]) -> SimulatedMap:
    """Return the map in a store that `sweep` or `levilab sweep` has written.

    Args:
        path: of its folder, NAME.zarr.

    Returns:
        The map: `values`, `axes`, `to_dataframe()`, `to_xarray()`, `plot(column)`, `summary()`.

    Raises:
        DataError: there is no store, or it is damaged.
    """
    from levilab.notebook.sweep import stored_map

    return stored_map(path)


@bare
def stability(
    scene: Scene | str | PathLike[str], *, settings: Mapping[str, Any] | None = None, **changes: Any
) -> FloatingTop:
    """Find where the top of a scene floats: heights, masses and spins.

    Args:
        scene: its name (`levilab.scenes()`), a TOML file, or a `levilab.simulator.Scene`.
        settings: changes of the scene by dotted keys, as {"top.mass_kg": 0.0255}.
        **changes: the same by the last parts of keys, as mass_kg=0.0255 or mass_kg="25.5 g".

    Returns:
        What was found: `floats`, `height`, `spins`, `values`, `summary()`.

    Raises:
        SceneError: the scene, or a key of it.
    """
    from levilab.notebook.scene import chosen_scene
    from levilab.notebook.stability import floating_top

    return floating_top(chosen_scene(scene, settings or {}, changes))


@bare
def runs(folder: str | PathLike[str] = "runs", *, last: int | None = None) -> RunList:
    """Return the runs at or below a folder, oldest first; as the last line of a notebook's cell they are a table.

    Args:
        folder: that is searched.
        last: the number of runs, the latest ones; None: all.

    Raises:
        DataError: there is no such folder.
    """
    from levilab.notebook.run import runs_in

    return runs_in(folder, last)


@bare
def report(
    data: Run | AnalysisResult | SimulatedMotion | str | PathLike[str] | Sequence[Any],
    output: str | PathLike[str] = "report.html",
    *,
    tables: bool = False,
    crosscheck: bool = True,
    short: bool = False,
    language: str = "en",
    title: str = "",
    course: str = "",
    author: str = "",
    date: str = "",
) -> Path:
    """Write the report of runs, data files, folders, results or motions.

    Args:
        data: one of them, or several.
        output: the file; its ending, .html or .pdf, chooses the format.
        tables: write the tables of results, too, into a folder beside it.
        crosscheck: make a cross-check with the result's own parameters where none is stored and it takes seconds.
        short: answer, values, figure and notes alone.
        language: of the report, "en" or "de".
        title: in place of the report's own.
        course: below the title, as "Physics lab 2".
        author: names, below the title.
        date: below the title, as it is to stand there.

    Returns:
        The file.

    Raises:
        DataError: there is nothing to report.
        UsageError: an argument is wrong.
        CannotWrite: the file cannot be written.
    """
    from levilab.notebook.report import report_on
    from levilab.report.reproduction import Heading

    heading = Heading(title, course, author, date)
    return report_on(data, output, language, tables=tables, crosscheck=crosscheck, short=short, heading=heading)


@bare
def export(
    data: Run | AnalysisResult | SimulatedMotion | SimulatedMap | str | PathLike[str] | Sequence[Any],
    output: str | PathLike[str],
    *,
    creator: str = "",
    licence: str = "",
    force: bool = False,
) -> list[Path]:
    """Write a run, a data file, a result, a motion or a map for other programs.

    Args:
        data: one of them, a list of runs or paths, which are analyzed together, or one of results of unlike kinds;
            readings, traces in volts and seconds, and results with their uncertainties are written.
        output: the file; its ending chooses the format: .nc (netCDF), .h5 (HDF5), .csv, .xlsx, .zip (a data package).
        creator: who measured; by default the run's group.
        licence: under which others may use the data, as "CC-BY-4.0".
        force: replace files that are there.

    Returns:
        The files; of .csv one for each table.

    Raises:
        UsageError: an argument is wrong.
        DataError: there is nothing to export.
        CannotWrite: a file is there already, or cannot be written.
    """
    from levilab.notebook.export import export_data

    return export_data(data, output, creator=creator, licence=licence, force=force)


@bare
def crosscheck(*subjects: str, trials: int | None = None, seed: int = 0) -> list[Study]:
    """Check analyses against known truths, in worlds at random.

    Args:
        *subjects: names, as `levilab crosscheck --help` lists them; none: all, which takes minutes.
        trials: of each; by default 40.
        seed: of the first trial; the next have the next.

    Returns:
        A study for each: `holds`, `spreads` of its quantities, `failures`.

    Raises:
        UsageError: there is no such subject, or too few trials.
    """
    from levilab.crosscheck.command import study_worlds

    return study_worlds(subjects, trials, seed)


sys.modules[__name__].__class__ = _FrontDoor

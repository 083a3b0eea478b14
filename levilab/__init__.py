"""The lab application for experiments on the Levitron.

For scripts and notebooks, each with `help`:

    run = levilab.acquire("spin", mock=True)     # an experiment → a run
    run = levilab.load("runs/…")                 # a run of earlier
    result = levilab.analyze(run)                # a run, a file or a DataFrame → a result
    motion = levilab.simulate("undriven", 5)     # a scene → a trajectory

What they need is imported when they are called.  Known failures are `levilab.LevilabError`s.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from levilab.errors import LevilabError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from os import PathLike

    import pandas as pd

    from levilab.bench.person import Task
    from levilab.notebook.motion import SimulatedMotion
    from levilab.notebook.result import AnalysisResult
    from levilab.notebook.run import RecordedRun
    from levilab.pipelines.options import Method, Tilt
    from levilab.runs.run import Run
    from levilab.simulator.scene import Scene

__all__ = ["LevilabError", "acquire", "analyze", "load", "simulate"]


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
    group: str = "",
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


def load(path: str | PathLike[str]) -> RecordedRun:
    """Return the run in a run folder.

    Args:
        path: of the folder, or the name of a run in runs/.

    Returns:
        The run: `to_dataframe()`, `plot()`, `folder`, `status`, `record`, `events()`, `traces()`.

    Raises:
        DataError: there is no run, or its record is damaged.
    """
    from levilab.notebook.acquisition import load_run

    return load_run(path)


def analyze(
    data: Run | str | PathLike[str] | pd.DataFrame | Sequence[Run | str | PathLike[str] | pd.DataFrame],
    kind: Literal["spindown", "spin", "field", "limit", "precession", "sway", "hold", "video"] | None = None,
    *,
    columns: Mapping[str, str | int] | str | None = None,
    channel: str | None = None,
    rate: float | None = None,
    reading_u: float | None = None,
    keep_outliers: bool = False,
    tilt: Tilt = "auto",
    method: Method = "auto",
    orthogonal: bool = False,
    device: str | PathLike[str] | None = None,
    height_m: float | None = None,
    height_u_m: float | None = None,
    free_radii: bool = False,
    clock_u: float | None = None,
    near: float | None = None,
    drive: float | None = None,
    distance_m: float | None = None,
    distance_u_m: float | None = None,
    below_m: float | None = None,
    moment_a_m2: float | None = None,
    scan: str | PathLike[str] | None = None,
    spin_hz: float | None = None,
    spindown: str | PathLike[str] | None = None,
    rim_m: float | None = None,
    base_m: float | None = None,
    scale_m: float | None = None,
    camera_m: float | None = None,
    start_s: float | None = None,
    stop_s: float | None = None,
    line_time_s: float | None = None,
) -> AnalysisResult:
    """Analyze runs, data files or DataFrames.  Nothing is written; `save(folder)` of the result does.

    Args:
        data: a run, the path of a run folder, of a data file or of a folder to search, a DataFrame with columns as in
            data files (`time_s`, `spin_frequency_hz`, …, or titles that files may have, with their units), or several.
        kind: the analysis; None for the one that is made for the data.
        columns: of a file or a DataFrame, where titles are not known: {"t": "Zeit", "f": "Drehzahl [rpm]"}, or as text
            "t=Zeit,f=Drehzahl [rpm]"; numbers count columns from 1.
        channel: of a record with several (spindown, spin).
        rate: samples per second [Hz], of files that do not say it (spindown, spin); pictures, in slow motion (video).
        reading_u: standard uncertainty of every reading [Hz], in the place of what the data say (spindown, limit,
            precession).
        keep_outliers: fit readings that look like miscounts, too (spindown, precession).
        tilt: whether counts hold the tilt of the top's moment: "auto" as "fitted", but for a mock run whose top only
            spins; "none" for a top that only spins (spindown).
        method: how pulses are found: edges is the fastest, likelihood for weak ones (spin).
        orthogonal: let the uncertainty of the drive's frequency count, too (precession).
        device: file that describes base and top, as sample_data/device.toml (spindown, field, sway).
        height_m: where the top was seen to float [m]; its moment follows, if its mass is known (field).
        height_u_m: standard uncertainty of it [m]; by default that of the scan's heights (field).
        free_radii: let the scan move the radii, within what the calliper says (field).
        clock_u: relative standard uncertainty of the clock that counts or samples, for the budgets (not field, sway).
        near: about where the spin of a magnetometer's record is at first, to 10 % [Hz] (spindown, spin, limit, video).
        drive: frequency of the drive meanwhile, for whether the top is locked to it [Hz] (spin).
        distance_m: of a magnetometer from the top's axis, horizontally [m]; the moment's tilt follows (spin).
        distance_u_m: standard uncertainty of distance_m and below_m [m] (spin).
        below_m: height of the top above the magnetometer [m] (spin).
        moment_a_m2: moment of the top [A m²]; the angle of its tilt follows (spin).
        scan: a Hall scan of the base, a run or a file (sway).
        spin_hz: spin of the top where no column has it [Hz] (sway).
        spindown: a spin-down of the same top, a run or a file, that is compared (hold).
        rim_m: scale of a film: diameter of the top's rim [m] (video).
        base_m: scale of a film: outer diameter of the base [m] (video).
        scale_m: scale of a film: length of a pixel [m] (video).
        camera_m: its distance from the base, with base_m and height_m, here of the rim [m] (video).
        start_s: time in the film from which the top floats [s] (video).
        stop_s: time until which [s] (video).
        line_time_s: from a row of the sensor to the next one [s] (video).

    Returns:
        The result: `values`, `verdict`, `warnings`, `summary()`, `to_dataframe()`, `plot()`, `save(folder)`.

    Raises:
        UsageError: an argument is wrong, or the data suit several analyses equally.
        DataError: the data suit none, or cannot be used; the text names file and line.
    """
    options = {name: value for name, value in locals().items() if name not in {"data", "kind"}}
    from levilab.notebook.analysis import analyze_data

    return analyze_data(data, kind, options)


def simulate(
    scene: Scene | str | PathLike[str],
    duration: float = 30.0,
    *,
    settings: Mapping[str, Any] | None = None,
    tolerance: float = 1e-7,
    rate: float = 100.0,
    out: str | PathLike[str] | None = None,
) -> SimulatedMotion:
    """Simulate the motion of a top.  The first call for a kind of scene compiles for some seconds.

    Args:
        scene: the name of one that ships (`levilab.simulator.presets()`), a TOML file, or a `levilab.simulator.Scene`.
        duration: how much is simulated [s].
        settings: changes of the scene by dotted keys, as {"top.mass_kg": 0.0255}.
        tolerance: wanted error at the end, of the place [m] and of the axis [rad].
        rate: states per second [1/s].
        out: folder in which a run folder is made; None writes nothing.

    Returns:
        The trajectory: `time`, `position`, `axis`, `spin_hz`, `tilt`, …, `summary()`, `to_dataframe()`, `plot()`,
        `values`, `warnings`.

    Raises:
        SceneError: the scene, or a key of it.
        UsageError: another argument.
        SimulationError: the motion cannot be followed.
    """
    from levilab.notebook.motion import simulate_motion

    return simulate_motion(scene, duration, settings=settings or {}, tolerance=tolerance, rate=rate, out=out)

"""The command of sweeps.  Heavy imports happen where they are needed."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from levilab.cli.options import SCENES, Json, Settings, argument, flag, named_scene, option, place, quantity
from levilab.cli.output import interruptible, message, print_json, result
from levilab.errors import DataError, UsageError, WorkersLost, as_typed
from levilab.texts.text import Text, in_language

if TYPE_CHECKING:
    from levilab.simulator.scene import Scene
    from levilab.sweeps.store import Store

#: Interval between lines of progress where standard error is no terminal [s].
LINE_EVERY_S = 60.0


def sweep(
    scene: Annotated[
        str | None,
        argument(
            "SCENE|STORE",
            f"The scene: {SCENES}, or a file.  "
            "Or the store of a sweep, NAME.zarr, which is shown, and with --resume continued.",
            show_default=False,
            callback=named_scene,
        ),
    ] = None,
    sweep: Annotated[
        list[str] | None,
        option(
            "KEY=FROM:TO:N",
            "An axis: N values of a key of the scene, in its unit; :log behind N spaces them logarithmically.  "
            "Repeatable, up to three.",
        ),
    ] = None,
    points: Annotated[
        Path | None,
        option("FILE.csv", "A table of points instead: its columns are named by keys, its rows are points."),
    ] = None,
    observe: Annotated[
        str | None,
        option(
            "NAME,…",
            "What is observed: survived, lifetime_s, fall_spin_hz, end_spin_hz, energy_error, position_error_m, "
            "highest_spin_hz, height_spread_m, locked, lines.",
            show_default="survived,lifetime_s",
        ),
    ] = None,
    duration: Annotated[
        float | None, quantity("S", "s", "Seconds that are simulated at each point.", show_default="30")
    ] = None,
    tolerance: Annotated[
        float | None,
        quantity("X", "", "Wanted error at the end, of the place in m and of the axis in rad.", show_default="1e-6"),
    ] = None,
    settings: Settings = None,
    seed: Annotated[
        int | None, option("N", "Seed of the points that --adaptive checks at random.", min=0, show_default="0")
    ] = None,
    out: Annotated[Path | None, place("STORE.zarr", "Where the results go.", show_default="NAME.zarr")] = None,
    cores: Annotated[int | None, option("N", "Processes on this machine.", min=1, show_default="one a core")] = None,
    scheduler: Annotated[
        str | None, option("ADDRESS", r"Compute on a Dask cluster, as tcp://10.0.0.1:8786; needs levilab\[cluster].")
    ] = None,
    adaptive: Annotated[
        bool,
        flag(
            "Compute points along the boundary of survival (or of the first observable that is yes or no), "
            "fill in the rest, and say what that may have missed.",
            "--adaptive",
        ),
    ] = False,
    resume: Annotated[bool, flag("Continue a store that was interrupted.", "--resume")] = False,
    as_json: Json = False,
) -> None:
    """Map a scene over its parameters."""
    given = {
        "sweep": sweep, "points": points, "observe": observe, "duration": duration, "tolerance": tolerance,
        "settings": settings, "seed": seed, "out": out, "adaptive": adaptive or None,
    }  # fmt: skip
    if scheduler is not None and cores is not None:
        raise UsageError("cores", "a cluster has its own workers: leave it out, or leave out `scheduler`")
    name = str(scene)
    shown = _is_store(name)
    store = _open_store(Path(name), given, resume=resume) if shown else _begin_store(name, given, resume=resume)
    computed = (resume or not shown) and _compute(store, cores, scheduler)
    pictures = _show(store, as_json=as_json)
    for path in [store.path, *pictures] if computed else pictures:
        message(Text("wrote {path:s}", path=path))


def _is_store(scene: str) -> bool:
    return Path(scene).suffix == ".zarr" or (Path(scene) / "zarr.json").exists()


def _open_store(path: Path, given: dict[str, Any], *, resume: bool) -> Store:
    """Open the store of a path; its plan determines what is computed."""
    if wrong := [name for name, value in given.items() if value is not None]:
        raise UsageError(wrong[0], f"{path} has its own: leave it out, or name a scene for another sweep")
    from levilab.sweeps.store import Store

    if not path.exists():
        raise DataError(f"{path}: there is no such store; levilab sweep SCENE with `out` = {path} makes one")
    return Store.open(path, writable=resume)


def _begin_store(name: str, given: dict[str, Any], *, resume: bool) -> Store:
    """Return a new store, or the existing one if it has the same plan."""
    from levilab.cli.simulate import chosen_scene

    scene = chosen_scene(name, given["settings"])
    _look_at_names(scene, given)

    from levilab.simulator.keys import parse_setting
    from levilab.sweeps.axes import parse_axis
    from levilab.sweeps.request import SweepRequest, store_for

    given = {name: value for name, value in given.items() if value is not None}
    given["sweep"] = tuple(map(parse_axis, given.get("sweep", ())))
    given["settings"] = {parse_setting(one)[0] for one in given.get("settings", ())}
    if "observe" in given:
        given["observe"] = given["observe"].split(",")
    out = given.pop("out", None) or Path(f"{Path(name).stem}.zarr")
    request = SweepRequest(scene, **given)
    with interruptible("nothing was written"):
        return store_for(request, out, message, resume=resume)


def _look_at_names(scene: Scene, given: dict[str, Any]) -> None:
    """Refuse keys and observables that are not there, before what takes long is imported.  Raises UsageError."""
    from levilab.sweeps.keys import value_at
    from levilab.sweeps.quantities import columns_of

    for axis in given["sweep"] or ():
        key, equals, _ = axis.partition("=")
        if key.strip() and equals:  # any other form is refused where it is read
            value_at(scene, key.strip(), 1.0)
    columns_of(filter(None, (one.strip() for one in (given["observe"] or "").split(","))))


def _compute(store: Store, cores: int | None, scheduler: str | None) -> bool:
    """Compute the chunks that are missing; return whether any was."""
    from levilab.present.progress import ShareBar
    from levilab.simulator.compilation import announce_compilation
    from levilab.sweeps.adaptive import is_adaptive, run_adaptive
    from levilab.sweeps.run import compile_for, run, workers_for

    total = store.plan.chunk_count
    if store.done == total:
        message(Text("{path:s} is complete: nothing is left to compute", path=store.path))
        return False
    if store.done:
        message(Text("going on: {n} of {all} chunks are done", n=store.done, all=total))
    for note in store.notes():
        message(f"note: {note}")

    def what_is_kept() -> str:
        done = "what was computed is" if is_adaptive(store) else f"{store.done} of {total} chunks are"
        return f"{done} kept in {store.path}; go on with: levilab sweep {store.path} --resume"

    workers = workers_for(store.plan, cores, scheduler)
    bar = ShareBar(f"{store.plan.size} points", first=store.done / total, line_every=LINE_EVERY_S)
    with interruptible(what_is_kept), store.lock(), contextlib.closing(bar):
        with announce_compilation(message):
            compile_for(store.plan)
        try:
            if is_adaptive(store):
                run_adaptive(store, workers, bar)
            else:
                run(store, workers, bar)
        except WorkersLost as lost:
            raise WorkersLost(f"{lost}; {what_is_kept()}") from lost
    return True


def _show(store: Store, *, as_json: bool) -> list[Path]:
    """Print the summary; draw the figures and return their paths."""
    from levilab.sweeps.adaptive import report_in
    from levilab.sweeps.report import draw_figures
    from levilab.sweeps.summary import (
        FEW_POINTS,
        as_document,
        axes_lines,
        columns_table,
        headline,
        points_table,
        summarise,
    )

    summary, report = summarise(store), report_in(store)
    pictures = draw_figures(store)
    if as_json:
        figures = [str(picture) for picture in pictures]
        print_json(as_document(summary) | {"adaptive": report, "store": str(store.path), "figures": figures})
        return pictures
    from levilab.present.terminal import draw, terminal
    from levilab.sweeps.adaptive import in_words

    result(headline(summary))
    for line in axes_lines(summary):
        result(Text("  {line}", line=line))
    console = terminal()
    console.print(draw(columns_table(summary)))
    if len(store.plan.shape) == 1 and store.plan.size <= FEW_POINTS:
        console.print(draw(points_table(store.load())))
    for sentence in in_words(report, store.plan) if report else ():
        console.print(f"• {in_language(sentence)}", markup=False)
    if summary.points < store.plan.size:
        message(
            Text(
                "{n} of {all} points are known; levilab sweep {path:s} --resume goes on",
                n=summary.points, all=store.plan.size, path=as_typed(store.path),
            )
        )  # fmt: skip
    return pictures

"""The command of sweeps.  Heavy imports happen where they are needed."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from levilab.cli.options import Json, Settings
from levilab.cli.output import interruptible, message, print_json, result
from levilab.errors import DataError, UsageError

if TYPE_CHECKING:
    from levilab.sweeps.store import Store

#: So often a line says how far the work is where no bar can be seen [s].
LINE_EVERY_S = 60.0


def sweep(
    scene: Annotated[
        str,
        typer.Argument(
            metavar="SCENE|STORE",
            help="What is swept: undriven, friction, tilted, driven, loose-washers, precession, spindown, or a file.  "
            "Or the store of a sweep, NAME.zarr, which is shown, and with --resume continued.",
        ),
    ],
    sweep: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=FROM:TO:N",
            help="An axis: N values of a key of the scene, in its unit; :log behind N spaces them logarithmically.  "
            "Repeatable, up to three.",
        ),
    ] = None,
    points: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.csv", help="A table of points instead: its columns are named by keys, its rows are points."
        ),
    ] = None,
    observe: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,…", help="What is observed; a wrong name lists them all.", show_default="survived,lifetime_s"
        ),
    ] = None,
    duration: Annotated[
        float | None, typer.Option(metavar="S", help="Seconds that are simulated at each point.", show_default="30")
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(
            metavar="X", help="Wanted error at the end, of the place in m and of the axis in rad.", show_default="1e-6"
        ),
    ] = None,
    settings: Settings = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Of what is random.", show_default="0")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="STORE.zarr", help="Where the results go.", show_default="NAME.zarr")
    ] = None,
    cores: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Processes on this machine.", show_default="one a core")
    ] = None,
    adaptive: Annotated[
        bool,
        typer.Option(
            "--adaptive",
            help="Compute points along the boundary of survival (or of what is observed and yes or no), fill in the "
            "rest, and say what that may have missed.",
        ),
    ] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with a store that is there, where it was interrupted.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Map a scene over its parameters."""
    given = {
        "sweep": sweep, "points": points, "observe": observe, "duration": duration, "tolerance": tolerance,
        "settings": settings, "seed": seed, "out": out, "adaptive": adaptive or None,
    }  # fmt: skip
    shown = _is_store(scene)
    store = _opened(Path(scene), given, resume=resume) if shown else _begun(scene, given, resume=resume)
    if resume or not shown:
        _computed(store, cores)
    _shown(store, as_json=as_json)


def _is_store(scene: str) -> bool:
    return Path(scene).suffix == ".zarr" or (Path(scene) / "zarr.json").exists()


def _opened(path: Path, given: dict[str, Any], *, resume: bool) -> Store:
    """The store of a path, which says itself what is computed."""
    if wrong := [name for name, value in given.items() if value is not None]:
        raise UsageError(wrong[0], f"{path} has its own: leave it out, or name a scene for another sweep")
    from levilab.sweeps.store import Store

    if not path.exists():
        raise DataError(f"{path}: there is no such store; levilab sweep SCENE with `out` = {path} makes one")
    return Store.open(path, writable=resume)


def _begun(name: str, given: dict[str, Any], *, resume: bool) -> Store:
    """A new store, or the one that is there if it has the same plan."""
    from levilab.cli.simulate import chosen_scene

    scene = chosen_scene(name, given["settings"])

    from levilab.sweeps.request import SweepRequest, store_for

    out = given.pop("out") or Path(f"{scene.name or 'sweep'}.zarr")
    request = SweepRequest(scene, **{name: value for name, value in given.items() if value is not None})
    with interruptible("nothing was written"):
        return store_for(request, out, message, resume=resume)


def _computed(store: Store, cores: int | None) -> None:
    """Compute what is missing."""
    from levilab.present.progress import ShareBar
    from levilab.simulator.compilation import announce_compilation
    from levilab.sweeps.adaptive import is_adaptive, run_adaptive
    from levilab.sweeps.run import compile_for, run, workers_for

    total = store.plan.chunk_count
    if store.done == total:
        message(f"{store.path} is complete: nothing is left to compute")
        return
    if store.done:
        message(f"going on: {store.done} of {total} chunks are done")
        for note in store.notes():
            message(f"note: {note}")

    def kept() -> str:
        done = f"{store.done} of {total} chunks are" if not is_adaptive(store) else "what was computed is"
        done += f" kept in {store.path}"
        return f"{done}; go on with: levilab sweep {store.path} --resume"

    bar = ShareBar(f"{store.plan.size} points", first=store.done / total, line_every=LINE_EVERY_S)
    with interruptible(kept), store.locked(), contextlib.closing(bar):
        with announce_compilation(message):
            compile_for(store.plan)
        workers = workers_for(store.plan, cores)
        if is_adaptive(store):
            run_adaptive(store, workers, bar)
        else:
            run(store, workers, bar)


def _shown(store: Store, *, as_json: bool) -> None:
    """Print the summary."""
    from levilab.sweeps.summary import as_document, summarise

    summary = summarise(store)
    if as_json:
        print_json(as_document(summary) | {"store": str(store.path)})
        return
    from levilab.present.terminal import draw, terminal
    from levilab.sweeps.table import FEW_POINTS, axes_lines, columns_table, headline, points_table

    result(headline(summary))
    for line in axes_lines(summary):
        result(f"  {line}")
    console = terminal()
    console.print(draw(columns_table(summary)))
    if len(store.plan.shape) == 1 and store.plan.size <= FEW_POINTS:
        console.print(draw(points_table(store.load())))
    if summary.points < store.plan.size:
        message(f"{summary.chunks} of {store.plan.chunk_count} chunks are done; levilab sweep {store.path} --resume")

"""The request for a sweep → its plan, and its store: a new one, or an existing one."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from levilab.errors import UsageError, as_typed
from levilab.simulator.scene import Scene
from levilab.simulator.single import LONGEST_S
from levilab.sweeps.adaptive import begin_adaptive, is_adaptive
from levilab.sweeps.axes import check_axes, read_points
from levilab.sweeps.observables import check_observables, cut
from levilab.sweeps.plan import Axis, Plan
from levilab.sweeps.quantities import columns_of
from levilab.sweeps.run import with_step
from levilab.sweeps.store import Store, differences


@dataclass(frozen=True)
class SweepRequest:
    """A request for a sweep.

    Attributes:
        scene: with its settings.
        sweep: its axes, of `axes.parse_axis` or `axes.axis_of`.
        points: a table of points instead.
        settings: keys that are set in the scene.
        observe: names of what is observed.
        duration: of each motion [s].
        tolerance: wanted error of place [m] and axis [rad].
        seed: of the random choices.
        adaptive: whether points are computed along a boundary alone.
    """

    scene: Scene
    sweep: Sequence[Axis] = ()
    points: Path | None = None
    settings: Collection[str] = ()
    observe: Sequence[str] = ("survived", "lifetime_s")
    duration: float = 30.0
    tolerance: float = 1e-6
    seed: int = 0
    adaptive: bool = False


def plan_of(request: SweepRequest) -> Plan:
    """Return the plan of a request, without its step.  Raises UsageError."""
    if request.sweep and request.points:
        raise UsageError("points", "a table has all axes: leave out `sweep`, or make it a column of the table")
    for name, value in (("duration", request.duration), ("tolerance", request.tolerance)):
        if not 0 < value <= LONGEST_S:
            raise UsageError(name, f"a number above 0 and up to {LONGEST_S:.0e} is expected", value=value)
    if request.seed and not request.adaptive:
        raise UsageError("seed", "goes with `adaptive` alone: nothing else of a sweep is left to chance")
    names = tuple(dict.fromkeys(filter(None, (name.strip() for name in request.observe))))
    columns_of(names)
    if not names:
        raise UsageError("observe", "names are expected, such as survived,lifetime_s", value=",".join(request.observe))
    axes = read_points(request.points) if request.points else tuple(request.sweep)
    check_axes(request.scene, axes, request.settings)
    plan = Plan(request.scene, axes, names, request.duration, tolerance=request.tolerance, seed=request.seed)
    check_observables(plan)
    return cut(plan)


def store_for(
    request: SweepRequest, path: Path | None, message: Callable[[str], None] = lambda _: None, *, resume: bool = False
) -> Store:
    """Return the store of a request, ready to be computed.

    Args:
        request: for the sweep.
        path: of its folder; None: in memory.
        message: called with a line before something that takes a moment.
        resume: go on with the store that is there, if one is.

    Raises:
        UsageError: the request cannot be carried out, or what is at the path is not its store.
        CannotWrite, DataError: the store cannot be made or read.
    """
    plan = plan_of(request)
    if path is not None and path.exists():
        return _existing_store(request, plan, path, resume=resume)
    if not request.adaptive:
        return Store.create(path, with_step(plan, message))
    begin = partial(begin_adaptive, observable=_boundary(plan))
    Store.create(None, plan, begin)  # raises what it has to before the step is chosen
    return Store.create(path, with_step(plan, message), begin)


def _existing_store(request: SweepRequest, plan: Plan, path: Path, *, resume: bool) -> Store:
    shows = f"levilab sweep {as_typed(path)} shows it, `resume` goes on with it"
    there = f"it is there already: {shows}; or take another place"
    if not resume and not (path / "zarr.json").exists():
        raise UsageError("out", "it is there already, and no store of a sweep: take another place", value=path)
    store = Store.open(path, writable=True)
    other = differences(store.plan, plan)
    if is_adaptive(store) != request.adaptive:
        other.append(f"adaptive is {is_adaptive(store)} there and {request.adaptive} here")
    if not resume and (other or store.done or request.adaptive):  # one that is begun and empty is no loss
        raise UsageError("out", there, value=path)
    if other:
        more = f" (and {len(other) - 3} more)" if len(other) > 3 else ""
        raise UsageError(
            "resume",
            f"{path} is of another sweep: {'; '.join(other[:3])}{more}.  Take `out` for another store, or levilab "
            f"sweep {path} --resume to go on with that one",
        )
    return store


def _boundary(plan: Plan) -> str:
    """Return the observable whose boundary is refined: the first that is yes or no."""
    flags = [column.name for column in columns_of(plan.observables) if column.dtype == "bool"]
    return next(iter(flags), plan.observables[0])

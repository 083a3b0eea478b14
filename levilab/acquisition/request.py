"""From the words of a command line to what is to be acquired."""

from __future__ import annotations

import secrets
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import ValidationError

from instruments.clock import VirtualClock
from levilab.acquisition.loop import Order
from levilab.bench.config import BenchConfig, ConfigError, read_bench, within_limits
from levilab.errors import LevilabError
from levilab.runs.run import Run, find_run
from levilab.settings import in_one_line
from levilab.world.bench import scene_world
from levilab.world.spin_world import SpinScene, SpinWorld, drawn

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.bench.config import SpinSettings
    from levilab.simulator.scene import Scene

HOW = (
    "acquired on the virtual bench: the drivers are the real ones, the instruments wire-level models, the top {top}, "
    "and no real top was measured"
)
_SPIN_ONLY = "a spin that decays by the {law}; drag and fall were drawn by the seed"
_IN_MOTION = "that of the scene {name}, simulated in full motion"


class CannotResume(LevilabError):
    """This run cannot be gone on with."""


class ContradictoryOptions(LevilabError):
    """Options that do not go together; wrong usage."""

    exit_code = 2


def spin_order(
    *,
    mock: bool,
    bench: Path | None,
    out: Path,
    seed: int | None,
    note: str,
    realtime: bool,
    resume: Path | None,
    wire_log: bool,
    scene: str | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> Order:
    """What `levilab acquire spin` is to do; tell: is told what takes long before it begins.

    Raises ConfigError, CannotResume, ContradictoryOptions, DataError, SceneError.
    """
    run = _resumable(find_run(resume, out)) if resume else None
    virtual = mock or bool(run and run.record.seed is not None)
    if seed is not None and (run or not mock):
        raise ContradictoryOptions("--seed goes with --mock, and not with --resume: a run keeps its seed")
    if scene is not None and (run or not mock):
        raise ContradictoryOptions("--scene goes with --mock, and not with --resume: a run keeps its scene")
    if realtime and not virtual:
        raise ContradictoryOptions("--realtime goes with --mock: a real bench always keeps to the wall clock")
    config = _as_it_was(run) if run else BenchConfig()
    if bench or not virtual:
        described = read_bench(bench or Path("bench.toml"))
        # a run is gone on with as it was begun; only where the instruments are may have changed
        addresses = {kind: getattr(described, kind) for kind in ("visa_library", "counter", "generator", "limits")}
        config = config.model_copy(update=addresses) if run else described
    within_limits(config)
    if not virtual:
        if run:
            run.elapsed()  # before the bench is touched
        return Order("spin", config, out=out, note=note, wire_log=wire_log, resume=run)
    seed = run.record.seed if run else secrets.randbelow(1 << 31) if seed is None else seed
    order = Order("spin", config, out=out, seed=seed, note=note, wire_log=wire_log, resume=run)
    moving = _scene(scene, run)
    if moving is None:
        return _of_a_spin(order, drawn(seed or 0), realtime=realtime)
    return replace(
        order,
        config=config.model_copy(update={"visa_library": "@levilab"}),
        world=lambda: scene_world(moving, lambda: VirtualClock(realtime=realtime), tell, seed=seed or 0),
        how=HOW.format(top=_IN_MOTION.format(name=moving.name)),
        scene=moving.as_table(),
    )


def _scene(name: str | None, run: Run | None) -> Scene | None:
    """The scene that was asked for, or that a run was begun with."""
    begun = run.record.configuration.get("scene") if run else None
    if name is None and begun is None:
        return None
    from levilab.simulator.scene import SceneError, read_scene, scene_of

    scene = scene_of(begun) if begun is not None else read_scene(str(name))
    if scene.top.aligned:
        raise SceneError(
            f"scene {scene.name}: no drive can hold a top whose moment lies along its axis (top.moment_tilt.0 = 0): "
            "take spindown, or give it a part across, such as top.moment_tilt = [0.03, 0.97]"
        )
    return scene


def _of_a_spin(order: Order, scene: SpinScene, *, realtime: bool) -> Order:
    """The order with a world in which the top only spins."""
    spin = _with_uncertainty(order.config.spin, scene)
    return replace(
        order,
        config=order.config.model_copy(update={"visa_library": "@levilab", "spin": spin}),
        world=lambda: SpinWorld(scene, VirtualClock(realtime=realtime)),
        how=HOW.format(top=_SPIN_ONLY.format(law=_law_in_words(scene))),
    )


def _with_uncertainty(settings: SpinSettings, scene: SpinScene) -> SpinSettings:
    """The scene's jitter is what one pulse scatters by: a reading over a gate T scatters by √2 jitter/T."""
    u = settings.reading_u_hz or round(2**0.5 * scene.jitter / settings.gate_s, 6)
    return settings.model_copy(update={"reading_u_hz": u})


def _law_in_words(scene: SpinScene) -> str:
    constants = ", ".join(f"{c:.4e}" for c in scene.constants)
    return f"{scene.drag} law with {constants} (SI), falling at {scene.fall_hz:.2f} Hz"


def _as_it_was(run: Run) -> BenchConfig:
    """The configuration that a run was begun with."""
    bench = {key: value for key, value in run.record.configuration.items() if key != "scene"}
    try:
        return BenchConfig.model_validate(bench)
    except ValidationError as error:
        raise ConfigError(f"{run.folder}/run.json: configuration: {in_one_line(error)}") from error


def _resumable(folder: Path) -> Run:
    run = Run.load(folder)
    if run.record.experiment != "spin":
        raise CannotResume(f"{folder}: holds a {run.record.experiment} run, levilab acquire spin resumes spin runs")
    if run.status in {"running", "finished"}:
        raise CannotResume(f"{folder}: is {run.status}, only an interrupted or failed run can be resumed")
    if run.record.time_zero_utc is None or not run.count():
        raise CannotResume(f"{folder}: ended before its first reading, there is nothing to go on with: start anew")
    return run

"""From the words of a command line to what is to be acquired."""

from __future__ import annotations

import secrets
from typing import TYPE_CHECKING

from levilab.clock import VirtualClock
from levilab.config import BenchConfig, SpinSettings, read_bench
from levilab.errors import LevilabError
from levilab.record import Order
from levilab.run import Run
from levilab.simulator.world import SpinScene, SpinWorld, drawn

if TYPE_CHECKING:
    from pathlib import Path

HOW = (
    "acquired on the virtual bench: the drivers are the real ones, the instruments wire-level models, the top a "
    "spin that decays as a laminar disc's, {law}, with scatter drawn by the seed; no real top was measured"
)


class CannotResume(LevilabError):
    """This run cannot be gone on with."""


def spin_order(
    *,
    mock: bool,
    bench: Path,
    out: Path,
    seed: int | None,
    note: str,
    realtime: bool,
    resume: Path | None,
    wire_log: bool,
) -> Order:
    """What `levilab acquire spin` is to do.  Raises ConfigError, CannotResume, DataError."""
    run = _resumable(resume) if resume else None
    if run and run.record.synthetic:
        mock, seed = True, run.record.seed
    if not mock:
        return Order("spin", read_bench(bench), out=out, note=note, wire_log=wire_log, resume=run)
    seed = secrets.randbelow(1 << 31) if seed is None else seed
    scene = drawn(seed)
    # the scene's jitter is what one pulse scatters by: a reading over a gate T scatters by √2 jitter/T
    settings = SpinSettings(reading_u_hz=round(2**0.5 * scene.jitter / SpinSettings().gate_s, 6))
    return Order(
        "spin",
        BenchConfig(visa_library="@levilab", spin=settings),
        out=out,
        world=lambda: SpinWorld(scene, VirtualClock(realtime=realtime)),
        how=HOW.format(law=_law_in_words(scene)),
        seed=seed,
        note=note,
        wire_log=wire_log,
        resume=run,
    )


def _law_in_words(scene: SpinScene) -> str:
    constants = ", ".join(f"{c:.4e}" for c in scene.constants)
    return f"{scene.drag} law with {constants} (SI), falling at {scene.fall_hz:.2f} Hz"


def _resumable(folder: Path) -> Run:
    run = Run.load(folder)
    if run.record.experiment != "spin":
        raise CannotResume(f"{folder}: holds a {run.record.experiment} run, levilab acquire spin resumes spin runs")
    if run.status in {"running", "finished"}:
        raise CannotResume(f"{folder}: is {run.status}, only an interrupted or failed run can be resumed")
    return run

"""The one acquisition loop: bench → run folder.

Whatever ends it, the outputs are off, the run is kept and says how it ended.
"""

from __future__ import annotations

import contextlib
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from instruments.errors import InstrumentError
from levilab.acquisition.experiments.spin import EXPERIMENTS, Experiment
from levilab.acquisition.session import (
    Missed,
    Session,
)
from levilab.bench.bench import check_described, open_bench
from levilab.files import CannotWrite
from levilab.interruption import Interrupted, Stop, watching_for_interruption
from levilab.runs.run import Run, RunRecord, utc_now
from levilab.runs.writer import RunWriter
from levilab.software import software_versions
from levilab.world.bench import VIRTUAL

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.bench.config import BenchConfig
    from levilab.present.progress import Show
    from levilab.runs.run import Status
    from levilab.world.spin_world import World


@dataclass(frozen=True)
class Order:
    """What is to be acquired.  world: what the virtual bench measures, None for the real one.

    how: if anything is simulated, how, in words; scene: of the full motion, as a table; resume: the run to go on with.
    """

    experiment: str
    config: BenchConfig
    out: Path = Path("runs")
    world: Callable[[], World] | None = None
    how: str | None = None
    scene: dict[str, Any] | None = None
    seed: int | None = None
    note: str = ""
    wire_log: bool = False
    resume: Run | None = None


def acquire(order: Order, show: Show) -> Run:
    """Run an experiment.  Returns the run, finished or interrupted; other ends raise, the run kept all the same.

    A bench that could not be opened leaves no run, unless it was to be logged.
    """
    experiment = EXPERIMENTS[order.experiment]
    if order.world is None:
        check_described(order.config, experiment.kinds)
    with watching_for_interruption() as stop, _writer(order) as writer, contextlib.closing(show):
        try:
            _at_the_bench(experiment, order, writer, show, stop)
            status: Status = "finished"
        except Interrupted as interruption:
            text = f"interrupted by {interruption.by}, outputs are off"
            writer.event(None, "interrupted", text)
            show.message(text)
            status = "interrupted"
        except Exception as error:
            # the disk may be full: what is told is the first thing that went wrong
            with contextlib.suppress(CannotWrite):
                writer.event(None, "failed", f"{type(error).__name__}: {error}")
                writer.finish("failed")
            if not writer.record.instruments and not order.wire_log:
                writer.discard()
            raise
        writer.finish(status)
    return Run.load(writer.folder)


def _writer(order: Order) -> RunWriter:
    if order.resume is None:
        return RunWriter.create(order.out, _record(order))
    return RunWriter.reopen(order.resume, note=order.note)


def _at_the_bench(experiment: Experiment, order: Order, writer: RunWriter, show: Show, stop: Stop) -> None:
    """The steps of the experiment, between opening the bench and leaving it."""
    world = order.world() if order.world else None
    log = writer.wire if order.wire_log else None
    with open_bench(order.config, experiment.kinds, world=world, log=log, check=stop.check) as bench:
        session = Session(bench, experiment.settings(order.config), writer, show, stop)
        try:
            _note_instruments(session, "start")
            experiment.connect(session)
            _begin(experiment, session, order)
            _read_until_the_end(experiment, session)
        finally:
            stop.shield()
            bench.outputs_off()
            with contextlib.suppress(CannotWrite):  # if the disk is full, what failed first is told
                _note_instruments(session, "end")


def _begin(experiment: Experiment, session: Session, order: Order) -> None:
    """Bring the top to where reading begins, or take up a run where it was left."""
    if order.resume:
        _catch_up(experiment, session, order, order.resume)
    else:
        experiment.start(session)
        session.zero = session.bench.clock.now()
        session.writer.update(time_zero_utc=utc_now())


def _catch_up(experiment: Experiment, session: Session, order: Order, run: Run) -> None:
    """A real top has gone on meanwhile, a virtual one is brought there again."""
    frame = run.readings().frame
    session.rows = [{str(k): float(v) for k, v in row.items()} for row in frame.to_dict("records")]
    if order.world:
        session.replaying = True
        experiment.start(session)
        session.replaying = False
        session.zero = session.bench.clock.now()
        session.wait(float(frame["time_s"].iloc[-1]))
    else:
        session.zero = session.bench.clock.now() - run.elapsed()
    session.event("resumed", f"resumed after {len(frame)} reading{'s' * (len(frame) != 1)}, without driving again")


def _read_until_the_end(experiment: Experiment, session: Session) -> None:
    settings = session.settings
    k = int(session.now() // settings.interval_s) + 1 if session.rows else 0
    while True:
        session.wait(k * settings.interval_s - session.now())
        session.asked = session.now()
        got = experiment.read(session)
        k += 1
        if isinstance(got, Missed):
            session.missed.append(got)
            if got is Missed.LOST:  # what was missed meanwhile is missed: it is not caught up with
                k = max(k, math.ceil(session.now() / settings.interval_s))
            if end := experiment.over(session):
                session.event(*end)
                return
        else:
            session.keep(got, experiment.remaining([*session.rows, got]))
        if session.now() > settings.longest_s:
            session.event("longest", f"{settings.longest_s:g} s are over ({experiment.name}.longest_s)")
            return


def _note_instruments(session: Session, moment: str) -> None:
    """Identity and settings of each instrument go into run.json; a virtual one makes the run synthetic."""
    noted = {kind: dict(about) for kind, about in session.writer.record.instruments.items()}
    for kind, instrument in session.bench.instruments.items():
        about = noted.setdefault(kind, {})
        about["address"] = instrument.transport.address
        about["driver"] = type(instrument).__name__
        try:
            about["identity"] = instrument.identity()
            about[f"settings_{moment}"] = instrument.settings()
        except InstrumentError as error:
            about[f"settings_{moment}"] = {"unknown": str(error)}
    changes: dict[str, Any] = {"instruments": noted}
    virtual = [kind for kind, about in noted.items() if "VIRTUAL" in str(about.get("identity"))]
    if virtual and not session.writer.record.synthetic:
        changes |= {"synthetic": True, "synthetic_how": f"virtual instruments answered: {', '.join(virtual)}"}
    session.writer.update(**changes)


def _record(order: Order) -> RunRecord:
    experiment = EXPERIMENTS[order.experiment]
    config = order.config if order.world is None else order.config.model_copy(update=dict(VIRTUAL))
    return RunRecord(
        experiment=order.experiment,
        status="running",
        started_utc=utc_now(),
        command_line=sys.argv,
        channels=[vars(channel) for channel in experiment.channels(experiment.settings(order.config))],
        configuration=config.model_dump(mode="json") | ({"scene": order.scene} if order.scene else {}),
        software=software_versions(),
        seed=order.seed,
        note=order.note,
        synthetic=order.world is not None,
        synthetic_how=order.how,
    )

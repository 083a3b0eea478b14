"""The one acquisition loop: bench → run folder.

Whatever ends it, the outputs are off, the run is kept and says how it ended.
"""

from __future__ import annotations

import contextlib
import itertools
import sys
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from instruments.errors import InstrumentError
from levilab.bench import VIRTUAL, Bench, open_bench
from levilab.errors import DataError
from levilab.experiment import EXPERIMENTS, Experiment, Row
from levilab.interruption import Interrupted, Stop, watching_for_interruption
from levilab.run import CannotWrite, Run, RunRecord, RunWriter, Status, utc_now

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.config import BenchConfig, SpinSettings
    from levilab.progress import Show
    from levilab.simulator.world import World

#: So long is slept at a stretch before looking whether somebody asked for the end [s].
_NAP_S = 0.2


@dataclass
class Session:
    """An acquisition under way: what the steps of an experiment act on.

    zero: bench time of time_s = 0 [s], None before it is reached.
    """

    bench: Bench
    settings: SpinSettings
    writer: RunWriter
    show: Show
    stop: Stop
    zero: float | None = None
    rows: list[Row] = field(default_factory=list)

    def now(self) -> float:
        """Seconds since time zero."""
        return self.bench.clock.now() - (self.zero or 0.0)

    def wait(self, duration: float) -> None:
        """Let bench time pass [s].  Raises Interrupted if somebody asks for the end."""
        end = self.bench.clock.now() + duration
        while True:
            self.stop.check()
            left = end - self.bench.clock.now()
            if left <= 0:
                return
            self.bench.clock.sleep(min(left, _NAP_S))

    def event(self, kind: str, text: str, **data: Any) -> None:
        """Write down and show what happened."""
        self.writer.event(None if self.zero is None else self.now(), kind, text, **data)
        self.show.message(text)

    def keep(self, row: Row, remaining: float) -> None:
        """Write a reading down, then show it: what was shown is on the disk."""
        self.writer.reading(row)
        self.rows.append(row)
        self.show.reading(_in_words(row), float(row["time_s"] or 0.0), remaining)


def _in_words(row: Row) -> str:
    return f"{row['time_s']:8.2f} s  {row['spin_frequency_hz']:9.4f} Hz"


@dataclass(frozen=True)
class Order:
    """What is to be acquired.  world: what the virtual bench measures, None for the real one.

    how: if anything is simulated, how, in words; resume: the run to go on with.
    """

    experiment: str
    config: BenchConfig
    out: Path = Path("runs")
    world: Callable[[], World] | None = None
    how: str | None = None
    seed: int | None = None
    note: str = ""
    wire_log: bool = False
    resume: Run | None = None


def acquire(order: Order, show: Show) -> Run:
    """Run an experiment.  Returns the run, finished or interrupted; other ends raise, the run kept all the same."""
    experiment = EXPERIMENTS[order.experiment]
    settings = order.config.spin
    writer = RunWriter.reopen(order.resume) if order.resume else RunWriter.create(order.out, _record(order))
    with watching_for_interruption() as stop, writer, contextlib.closing(show):
        try:
            world = order.world() if order.world else None
            log = writer.wire if order.wire_log else None
            with open_bench(order.config, experiment.kinds, world=world, log=log) as bench:
                _run(experiment, Session(bench, settings, writer, show, stop), order)
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
            raise
        writer.finish(status)
    return Run.load(writer.folder)


def _run(experiment: Experiment, session: Session, order: Order) -> None:
    """The steps of the experiment; the bench is open."""
    try:
        _note_instruments(session, "start")
        experiment.connect(session)
        if order.resume:
            _catch_up(experiment, session, order)
        else:
            experiment.start(session)
            _start_time(session, session.bench.clock.now())
        _read_until_the_end(experiment, session)
    finally:
        session.stop.shield()
        session.bench.outputs_off()
        with contextlib.suppress(CannotWrite):  # if the disk is full, what failed first is told
            _note_instruments(session, "end")


def _start_time(session: Session, zero: float) -> None:
    session.zero = zero
    session.writer.update(time_zero_utc=utc_now())


def _read_until_the_end(experiment: Experiment, session: Session) -> None:
    settings = session.settings
    first = int(session.now() // settings.interval_s) + 1 if session.rows else 0
    for k in itertools.count(first):
        session.wait(k * settings.interval_s - session.now())
        asked = session.now()
        row = experiment.read(session)
        if row is None:
            session.event("reading missed", f"no reading at {asked:.1f} s, asking once more")
            row = experiment.read(session)
        if row is None:
            last = session.rows[-1]["time_s"] if session.rows else 0.0
            session.event("fell", f"no light pulses any more: the top fell between {last:.1f} s and {asked:.1f} s")
            return
        session.keep(row, experiment.remaining([*session.rows, row]))
        if session.now() > settings.longest_s:
            session.event("longest", f"{settings.longest_s:g} s are over (spin.longest_s)")
            return


def _catch_up(experiment: Experiment, session: Session, order: Order) -> None:
    """Take up a run where it was left: the real top has gone on meanwhile, a virtual one is brought there again."""
    assert order.resume
    frame = order.resume.readings().frame
    session.rows = [{str(k): float(v) for k, v in row.items()} for row in frame.to_dict("records")]
    zero_utc = order.resume.record.time_zero_utc
    if zero_utc is None:
        raise DataError(
            f"{order.resume.folder}: ended before its first reading, there is nothing to resume: start anew"
        )
    if order.world:
        experiment.start(session)
        session.zero = session.bench.clock.now()
        session.wait(float(frame["time_s"].iloc[-1]) if len(frame) else 0.0)
    else:
        elapsed = (datetime.now(UTC) - datetime.fromisoformat(zero_utc)).total_seconds()
        session.zero = session.bench.clock.now() - elapsed
    session.event("resumed", f"resumed after {len(frame)} readings")


def _note_instruments(session: Session, moment: str) -> None:
    """Identity and settings of each instrument go into run.json."""
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
    session.writer.update(instruments=noted)


def _record(order: Order) -> RunRecord:
    experiment = EXPERIMENTS[order.experiment]
    return RunRecord(
        experiment=order.experiment,
        status="running",
        started_utc=utc_now(),
        command_line=sys.argv,
        channels=_channels(experiment, order.config.spin),
        configuration=_configuration(order),
        software=software_versions(),
        seed=order.seed,
        note=order.note,
        synthetic=order.world is not None,
        synthetic_how=order.how,
    )


def _channels(experiment: Experiment, settings: SpinSettings) -> list[dict[str, str]]:
    """The columns; there is none for an uncertainty that nobody knows."""
    known = settings.reading_u_hz is not None
    return [vars(channel) for channel in experiment.channels if known or "_u_" not in channel.name]


def _configuration(order: Order) -> dict[str, Any]:
    config = order.config if order.world is None else replace_instruments(order.config)
    return config.model_dump(mode="json")


def replace_instruments(config: BenchConfig) -> BenchConfig:
    """The configuration with the virtual instruments in the place of the real ones."""
    return config.model_copy(update=dict(VIRTUAL))


def software_versions() -> dict[str, str]:
    """Versions of what a result may depend on."""
    import platform
    from importlib.metadata import version

    names = ("levilab", "numpy", "scipy", "pandas", "lmfit", "pyvisa", "pyvisa-py")
    return {"python": platform.python_version(), "platform": platform.platform()} | {n: version(n) for n in names}

"""An experiment carried out: bench → run folder.

Whatever ends it, the outputs are off, the run is kept and says how it ended.
"""

import contextlib
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from threading import Event
from typing import Any, Literal

from instruments.errors import InstrumentError
from levilab.acquisition.onlooker import Watch, publishing
from levilab.acquisition.session import Earlier, Session
from levilab.acquisition.table import EXPERIMENTS, settings_of
from levilab.bench.bench import OutputMayBeOn, open_bench
from levilab.bench.config import BenchConfig
from levilab.bench.guard import guard_drive
from levilab.bench.kinds import GENERATOR, estimates_u
from levilab.bench.wiring import Wiring
from levilab.computer import utc_now
from levilab.errors import LevilabError
from levilab.files import CannotWrite
from levilab.interruption import Interrupted, Stop, watching_for_interruption
from levilab.present.progress import Display
from levilab.runs.channel import Channel
from levilab.runs.events import RunEvent
from levilab.runs.run import Run, RunRecord, Status
from levilab.runs.writer import RunWriter
from levilab.software import software_versions
from levilab.texts.text import Text, text_of

#: What is said where an acquisition ends before it could see that the drive is off.
_NOT_SEEN_OFF = Text(
    "the generator was not reached: if a run was killed before, THE DRIVE MAY STILL BE ON, switch it off by hand"
)


@dataclass(frozen=True)
class AcquisitionRequest:
    """What is to be acquired.

    Attributes:
        experiment: its name.
        config: the bench and the settings of the experiments, as they stand in run.json.
        wiring: makes the wiring of the bench, real or virtual.
        out: the folder in which the run folder is made.
        synthetic_how: description of the simulated part, if there is any.
        world: of a virtual bench, if its top only spins.
        scene: of the full motion, as a table.
        seed: of what is drawn by chance on a virtual bench.
        group, note: kept with the run.
        temperature_c: of the magnets [°C]; None: not known.
        washers_kg: on the top [kg]; None: not known.
        wire_log: whether all bytes on the wire are kept.
        resume: the run to go on with.
        named: kind → model or address of the instruments that a person named in place of the bench's.
    """

    experiment: str
    config: BenchConfig
    wiring: Callable[[], Wiring]
    out: Path = Path("runs")
    synthetic_how: str | None = None
    world: Literal["spin"] | None = None
    scene: dict[str, Any] | None = None
    seed: int | None = None
    group: str = ""
    note: str = ""
    temperature_c: float | None = None
    washers_kg: tuple[float, ...] | None = None
    wire_log: bool = False
    resume: Run | None = None
    named: Mapping[str, str] = field(default_factory=dict)

    @property
    def columns(self) -> tuple[Channel, ...]:
        """The columns of the readings."""
        experiment = EXPERIMENTS[self.experiment]
        return experiment.columns(settings_of(self.config, experiment.name), estimated=estimates_u(self.config))


def acquire(request: AcquisitionRequest, show: Display, watch: Watch = publishing) -> Run:
    """Run an experiment.  Returns the run, finished or interrupted; other ends raise, and the run is kept, too.

    A bench that could not be opened leaves no new run, unless it was to be logged.

    Args:
        request: what is to be acquired.
        show: the terminal.
        watch: what others see of it; by default it is published for views.
    """
    off = Event()
    try:
        with watching_for_interruption() as stop:
            return _acquire(request, show, stop, watch=watch, off=off)
    except OutputMayBeOn:  # which says it itself
        off.set()
        raise
    finally:
        if not off.is_set() and request.synthetic_how is None and GENERATOR.name in _kinds(request):
            show.message(_NOT_SEEN_OFF)


def acquire_one_of_many(request: AcquisitionRequest) -> Run:
    """Run a mock experiment, one of many.  Raises KeyboardInterrupt at any signal: it is meant for all of them."""
    with watching_for_interruption() as stop:
        run = _acquire(request, Display(), stop)
    if stop.by:  # it may have come after the last reading
        raise KeyboardInterrupt
    return run


def _acquire(
    request: AcquisitionRequest, show: Display, stop: Stop, *, watch: Watch = publishing, off: Event | None = None
) -> Run:
    """Acquire, and set `off` once the outputs are seen to be off."""
    off = off or Event()
    with _writer(request, show) as writer, contextlib.closing(show):
        try:
            with stop.let_second_signal_through():
                _at_the_bench(request, writer, show, stop, watch=watch, off=off.set)
            status: Status = "finished"
        except Interrupted as interruption:
            seen = (
                "interrupted by {by}, outputs are off"
                if off.is_set()
                else "interrupted by {by} before the bench was open"
            )
            text = Text(seen, by=interruption.key)
            writer.event(None, RunEvent.INTERRUPTED, text)
            show.close()  # its picture of the bench is from before the outputs went off
            show.message(text)
            status = "interrupted"
        except Exception as error:
            # the disk may be full: the first thing that went wrong is what counts
            with contextlib.suppress(CannotWrite):
                writer.event(None, RunEvent.FAILED, _reason_of(error))
                writer.finish("failed")
            if not writer.record.instruments and not request.wire_log:
                writer.discard()
            raise
        writer.finish(status)
    return Run.load(writer.folder)


def _reason_of(error: Exception) -> str:
    """Return the reason that ended a run: the text of a known failure, with the class of an unexpected one."""
    known = isinstance(error, LevilabError | InstrumentError)
    return text_of(error) if known else f"{type(error).__name__}: {error}"


def _writer(request: AcquisitionRequest, show: Display) -> RunWriter:
    if request.resume is None:
        return RunWriter.create(request.out, _record(request), tell=show.message)
    return RunWriter.reopen(request.resume, note=request.note, tell=show.message)


def _kinds(request: AcquisitionRequest) -> tuple[str, ...]:
    """Return the kinds of instruments that the experiment needs."""
    experiment = EXPERIMENTS[request.experiment]
    return experiment.kinds(settings_of(request.config, experiment.name))


def _at_the_bench(
    request: AcquisitionRequest,
    writer: RunWriter,
    show: Display,
    stop: Stop,
    *,
    watch: Watch,
    off: Callable[[], object],
) -> None:
    """Carry out the experiment, between opening the bench and leaving it."""
    experiment = EXPERIMENTS[request.experiment]
    settings = settings_of(request.config, experiment.name)
    earlier = _earlier(request)
    log = writer.wire if request.wire_log else None
    wiring = replace(request.wiring(), count_with=request.config.count_with)
    kinds = _kinds(request)
    guarded = guard_drive(wiring) if GENERATOR.name in kinds else contextlib.nullcontext()
    with guarded, open_bench(wiring, kinds, log=log, check=stop.check, off=off) as bench:
        session: Session[Any] = Session(
            bench,
            settings,
            request.columns,
            writer,
            show,
            stop,
            person=wiring.person,
            earlier=earlier,
            rows=list(earlier.rows) if earlier else [],
            called=experiment.called,
        )
        try:
            _note_instruments(session, "start")
            with watch(session, wiring) as look, _look_meanwhile(look, session):
                experiment.run(session)
        finally:
            stop.shield()
            bench.outputs_off()
            with contextlib.suppress(CannotWrite):  # if the disk is full, what failed first counts
                _note_instruments(session, "end")


@contextlib.contextmanager
def _look_meanwhile(look: Callable[[], None], session: Session[Any]) -> Iterator[None]:
    """Let an onlooker see whatever happens, and how time passes."""
    clock = session.bench.clock
    before = clock.meanwhile
    clock.meanwhile = session.look = look
    try:
        yield
    finally:
        clock.meanwhile = before
        session.look = lambda: None


def _earlier(request: AcquisitionRequest) -> Earlier | None:
    """Return the earlier part of a run that is resumed."""
    if request.resume is None:
        return None
    columns = request.resume.readings().columns
    rows = [
        {name: value for name, value in zip(columns, row, strict=True) if not math.isnan(value)}
        for row in zip(*(c.tolist() for c in columns.values()), strict=True)
    ]
    return Earlier(request.resume, rows, replay=request.synthetic_how is not None)


def _note_instruments(session: Session[Any], moment: str) -> None:
    """Write identity and settings of each instrument into run.json; a virtual one makes the run synthetic."""
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


def _record(request: AcquisitionRequest) -> RunRecord:
    experiment = EXPERIMENTS[request.experiment]
    return RunRecord(
        experiment=experiment.name,
        status="running",
        started_utc=utc_now(),
        command_line=sys.argv,
        channels=[vars(channel) for channel in request.columns],
        configuration=request.config.model_dump(mode="json")
        | ({"scene": request.scene} if request.scene else {})
        | ({"named": dict(request.named)} if request.named else {}),
        software=software_versions(),
        seed=request.seed,
        group=request.group,
        note=request.note,
        temperature_c=request.temperature_c,
        washers_kg=request.washers_kg,
        synthetic=request.synthetic_how is not None,
        synthetic_how=request.synthetic_how,
        synthetic_says=request.synthetic_how.as_table() if isinstance(request.synthetic_how, Text) else None,
        world=request.world,
    )

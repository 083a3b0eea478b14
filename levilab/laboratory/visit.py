"""A laboratory carried out: acquire, resume, analyze, and judge all that was seen."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from random import Random
from typing import Any

from analysis.errors import AnalysisError
from instruments.errors import InstrumentError
from levilab.acquisition.loop import AcquisitionRequest, acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.acquisition.session import Row, Session
from levilab.acquisition.table import EXPERIMENTS
from levilab.bench.config import Limits
from levilab.bench.wiring import Wiring
from levilab.computer import at_another_computer
from levilab.errors import LevilabError
from levilab.laboratory import judge
from levilab.laboratory.bench import LaboratoryBench, LaboratoryClock, LaboratoryPerson, laboratory_wiring
from levilab.laboratory.disk import SimulatedComputer
from levilab.laboratory.events import EVENTS
from levilab.laboratory.fate import Event, Fate, Killed
from levilab.laboratory.judge import Finding, Life
from levilab.laboratory.plan import MOST_LIVES, Plan
from levilab.pipelines.suits import analyze_suiting
from levilab.present.progress import Display
from levilab.report.document import document_of
from levilab.report.html.page import page_of
from levilab.runs.find import find_runs
from levilab.runs.listing import list_runs
from levilab.runs.run import Run
from levilab.simulator.scene import read_scene
from levilab.world.bench import scene_world, virtual_instruments
from levilab.world.spin_world import SpinWorld, World

#: Where the runs are, the bench file of a bench that goes on between processes, and the command of each run.
_RUNS, _BENCH, _COMMAND = Path("runs"), Path("bench.toml"), ["levilab", "acquire"]

#: Of this number of laboratories one has a report, whose figure takes longer than all the rest; in one of the second
#: number the analyses are repeated, where one of the first files, of the third number, cannot be read.
_REPORTED, _ANALYZED_AGAIN, _READ_BY_ANALYSIS = 20, 5, 7


class _Screen(Display):
    """Remembers what a person has seen."""

    def __init__(self, life: Life, visit: Visit) -> None:
        self._life, self._visit = life, visit

    def reading(self, text: str, elapsed: float, remaining: tuple[float, float]) -> None:
        session = self._visit.session
        assert session is not None
        self._life.shown.append(dict(session.rows[-1]))
        visit = self._visit
        height, now = visit.person.height_m, visit.clock.now()
        self._life.truth += judge.compare_at_once(session.rows[-1], visit.plan, visit.world, height, now)
        self._life.driven += visit.plan.experiment == "spin" and judge.drives(visit.bench)
        visit.fate.step(f"shows {text}")

    def message(self, text: str) -> None:
        session = self._visit.session
        self._life.messages.append(text)
        visit = self._visit
        self._life.spinning += judge.is_false_fall(text, visit.plan, visit.world, visit.clock.now())
        if session is not None and session.doing.text == text:
            self._life.events.append(text)
        self._visit.fate.step(f"says {text}")


@dataclass
class Visit:
    """A laboratory that is carried out.

    Attributes:
        plan: of it.
        status_of: the exit status of a known failure; None for a defect.
        fate: its steps.
        computer, clock, person, bench, world: as they are at present.
        session: of the present process.
        lives: its processes.
        removed: the folder that the person has removed last.
    """

    plan: Plan
    status_of: Callable[[Exception], int | None]
    fate: Fate = field(init=False)
    computer: SimulatedComputer = field(init=False)
    clock: LaboratoryClock = field(init=False)
    person: LaboratoryPerson = field(init=False)
    bench: LaboratoryBench = field(init=False)
    world: World = field(init=False)
    wiring: Wiring | None = None
    session: Session[Any] | None = None
    lives: list[Life] = field(default_factory=list)
    removed: Path | None = None

    def __post_init__(self) -> None:
        self.fate = Fate(self._strike, lambda: self.computer.passed_s)
        self.computer = SimulatedComputer(self.fate, Random(f"computer {self.plan.seed}"))
        self.clock = LaboratoryClock(self.fate, self.computer)

    def _strike(self, event: Event) -> None:
        EVENTS[event.what].act(self, event.value)

    def remove_folder(self) -> None:
        """Remove the folder of the present run, as a person does with a file manager."""
        if self.session is not None:
            self.removed = self.session.writer.folder
            self.computer.forget(self.removed)

    # --- the processes ---

    def carry_out(self) -> None:
        """Acquire, and resume as long as there is something to go on with."""
        with self._at_the_place():
            for number in range(MOST_LIVES):
                life = self._live(number)
                self.lives.append(life)
                self.fate.trace.append(f"= {number} {life.ended} {life.status} {life.text}")
                if life.ended in {"finished", "broken"}:
                    break
                self.computer.room = float("inf")  # the person has made room
                self.clock.let_pass(self.plan.pauses_s[number])

    @contextlib.contextmanager
    def _at_the_place(self) -> Iterator[None]:
        argv = sys.argv
        sys.argv = [*_COMMAND, self.plan.experiment]  # as the record of the run has it
        try:
            with at_another_computer(self.computer), self.computer.may_fail_to_read():
                yield
        finally:
            sys.argv = argv

    def _live(self, number: int) -> Life:
        life = Life(number)
        self.session = None
        self._wiring_of()
        self.fate.begin((EVENTS[event.what].kind, event) for event in self.plan.events)
        try:
            run = acquire(self._request(life), _Screen(life, self), self._watch(life))
        except Killed:
            life.ended = "killed"
        except Exception as error:  # noqa: BLE001 - each of them is judged
            self._note_failure(life, error)
        else:
            life.ended, life.status = run.status, 130 if run.status == "interrupted" else 0
            life.folder = run.folder
        self._leave(life)
        return life

    def _leave(self, life: Life) -> None:
        """Note what a process has left behind, and let it be gone."""
        if self.session is not None:
            life.folder, life.zero = self.session.writer.folder, self.session.zero
            life.gone = self.fate.dead and life.folder == self.removed
            life.truth += judge.compare_spins(self.session, self.world, self.plan, life.first)
        life.output_on = judge.drives(self.bench)
        self.bench.end_process()
        if self.plan.mock:
            self.wiring = None
        self.computer.end_process(power=self.fate.power)
        self.fate.dead = False
        with contextlib.suppress(LevilabError):
            life.left = Run.load(life.folder).status if life.folder else ""

    def _note_failure(self, life: Life, error: Exception) -> None:
        life.error, life.text = error, str(error)
        life.status = self.status_of(error)
        if life.status is None:
            life.ended = "broken"
            life.text = "".join(traceback.format_exception(error))
        else:
            life.ended = "failed" if self.session is not None or self.fate.counts else "refused"

    def _request(self, life: Life) -> AcquisitionRequest:
        plan = self.plan
        resume = self._run_to_resume()
        settings = plan.settings if resume is None else ()
        typed: dict[str, Any] = dict(plan.typed) if life.number == 0 else {}
        if "settings" in typed:
            settings = (*settings, typed.pop("settings"))
        models = plan.models if plan.mock and resume is None else {}  # a bench file names them
        options = AcquisitionOptions(
            mock=plan.mock,
            bench=None if plan.mock else _BENCH,
            counter=models.get("counter"),
            scope=models.get("oscilloscope"),
            out=_RUNS,
            seed=plan.seed if plan.mock and resume is None else None,
            settings=settings,
            resume=resume,
            **typed,
        )
        return replace(request_for(plan.experiment, options), wiring=self._wiring_of)

    def _run_to_resume(self) -> Path | None:
        """Return the run that the person goes on with; None where a new one is to be begun."""
        last = self.lives[-1] if self.lives else None
        if last is None or last.ended == "refused" or last.folder is None:
            return None
        with contextlib.suppress(LevilabError):
            run = Run.load(last.folder)
            if run.record.time_zero_utc is not None and run.status != "finished" and run.count():
                return last.folder
        return None

    def _wiring_of(self) -> Wiring:
        """Return the wiring of the bench: a mock's is made in each process."""
        if self.wiring is None:
            if self.plan.mock:
                self.clock = LaboratoryClock(self.fate, self.computer)
            self.person = LaboratoryPerson(self.fate, self.clock, Random(f"person {self.plan.seed}"))
            self.world = self._make_world()
            self.bench, self.wiring = laboratory_wiring(self.world, self.fate, self.plan.models, self.person, Limits())
        return self.wiring

    def _make_world(self) -> World:
        """Return the top of the plan, or the full motion of an experiment that needs it."""
        scene = EXPERIMENTS[self.plan.experiment].mock_scene
        if scene is None:
            return SpinWorld(self.plan.scene, self.clock)
        return scene_world(read_scene(scene), lambda: self.clock, lambda _: None, seed=self.plan.seed)

    def _watch(self, life: Life) -> Any:
        @contextlib.contextmanager
        def watch(session: Session[Any], _: Wiring) -> Iterator[Callable[[], None]]:
            self.session, life.first = session, len(session.rows)
            yield lambda: None

        return watch

    def last_rows(self) -> list[Row]:
        """Return the rows of the run that was finished."""
        with self._at_the_place():
            return judge.rows_in(self.lives[-1].folder)

    # --- the analyses ---

    def judge(self) -> list[Finding]:
        """Analyze every run that is left, and return all that is wrong."""
        with self._at_the_place():
            folders = sorted(find_runs(_RUNS)) if _RUNS.exists() else []
            found = [*judge.lives(self.plan, self.lives, folders)]
            self.fate.trace += [f"~ {one}" for one in list_runs(_RUNS)] if folders else []
            for folder in folders:
                found += self._judge_analyses(folder)
                if self.plan.seed % _ANALYZED_AGAIN == 1:
                    self.computer.unread = 1 + self.plan.seed % _READ_BY_ANALYSIS
                    found += self._judge_analyses(folder)
                    self.computer.unread = 0
        return found

    def _judge_analyses(self, folder: Path) -> Iterator[Finding]:
        """Analyze a run; yield what is wrong with the results, or with the failure."""
        try:
            for analysis, result in analyze_suiting([folder], {}):
                document = analysis.document(result, folder)
                text = json.dumps(document, sort_keys=True, allow_nan=False)
                analysis.tables(result)
                self.fate.trace.append(
                    f"~ {analysis.name} {result.text} {hashlib.sha256(text.encode()).hexdigest()[:12]}"
                )
                yield from judge.values(self.plan, analysis.name, result)
                if self.plan.seed % _REPORTED == 0:
                    page = page_of(document_of([(analysis, result)]))
                    self.fate.trace.append(f"~ report {hashlib.sha256(page.encode()).hexdigest()[:12]}")
                    yield from judge.report(page)
        except (LevilabError, AnalysisError, InstrumentError) as error:
            self.fate.trace.append(f"~ {error}")
            yield from judge.message(str(error), "analysis")
        except Exception as error:  # noqa: BLE001 - it would be a traceback
            yield Finding("traceback", "".join(traceback.format_exception(error)))


@dataclass(frozen=True)
class Told:
    """What became of a laboratory.

    Attributes:
        plan: of it.
        findings: what is wrong.
        trace: a line for each step.
        story: a line for each process, and for what struck it.
    """

    plan: Plan
    findings: tuple[Finding, ...]
    trace: tuple[str, ...]
    story: tuple[str, ...]

    @property
    def digest(self) -> str:
        """A hash of the trace: the same for the same seed, in each process."""
        return hashlib.sha256("\n".join(self.trace).encode(errors="replace")).hexdigest()


def visit(plan: Plan, status_of: Callable[[Exception], int | None]) -> Told:
    """Carry a laboratory out, in a folder of its own, and judge it."""
    here = Path.cwd()
    memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None  # noqa: S108 - mkdtemp makes a folder of its own
    place = Path(tempfile.mkdtemp(prefix="levilab-laboratory-", dir=memory))
    os.chdir(place)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a worker ignores Ctrl-C, and so do its children
    try:
        _BENCH.write_text(_bench_file(plan), encoding="utf-8")
        laboratory = Visit(plan, status_of)
        laboratory.carry_out()
        found = laboratory.judge()
        if plan.mock and plan.is_calm and plan.events and laboratory.lives[-1].ended == "finished":
            rows = laboratory.last_rows()
            shutil.rmtree(_RUNS, ignore_errors=True)
            unbroken = Visit(replace(plan, events=()), status_of)
            unbroken.carry_out()
            found += judge.same_rows(plan, rows, unbroken.last_rows())
        return Told(plan, tuple(found), tuple(laboratory.fate.trace), tuple(_story(laboratory)))
    finally:
        signal.signal(signal.SIGINT, before)
        os.chdir(here)
        shutil.rmtree(place, ignore_errors=True)


def _bench_file(plan: Plan) -> str:
    lines = ['visa_library = "@levilab"']
    for kind, settings in virtual_instruments(plan.models).items():
        lines += [f"[{kind}]", f'model = "{settings.model}"', f'address = "{settings.address}"']
        lines += ['trigger = "rising"'] * (kind == "generator")
    return "\n".join(lines) + "\n"


def _story(laboratory: Visit) -> Iterator[str]:
    plan = laboratory.plan
    models = ", ".join(f"{kind} {model}" for kind, model in plan.models.items())
    yield (
        f"seed {plan.seed}: {plan.experiment} {' '.join(plan.settings)} on a {'mock' if plan.mock else 'real'} bench"
        + (f" with {models}" if models else "")
        + "".join(f", {name} typed as {text!r}" for name, text in plan.typed.items())
    )
    struck = laboratory.fate.struck
    for life in laboratory.lives:
        for event in (event for event in struck if event.life == life.number):
            what = EVENTS[event.what]
            words = what.words.format(what.about(event.value))
            yield f"  {'task' if what.kind == 'task' else 'step'} {event.at}: {words}"
        rows = len(life.shown)
        status = "" if life.status is None else f", status {life.status}"
        text = life.text.strip().rpartition("\n")[2]
        yield f"process {life.number + 1}: {rows} readings shown; {life.ended}{status}{': ' * bool(text)}{text}"

"""The process of the bench for practice: one thread, one clock, the real drivers on virtual instruments.

Whatever waits, waits by the clock, and the clock calls `PracticeProcess.look` every 50 ms of the wall: there commands
are carried out, the drive's frequency moves on, and views are served, also in the middle of a count.
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import astuple, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from instruments.clock import PacedClock
from instruments.errors import InstrumentError
from levilab.acquisition.loop import acquire
from levilab.acquisition.onlooker import Sent, counting_of, state_of
from levilab.acquisition.request import AcquisitionOptions, request_at
from levilab.acquisition.session import DidNotFollow, ExperimentFailed, NoLight, Session, last_count
from levilab.bench.bench import Bench, open_bench
from levilab.errors import LevilabError
from levilab.interruption import End, watching_for_end
from levilab.live.practice import commands as ask
from levilab.live.practice.commands import CommandRefused, Voice
from levilab.live.practice.drive import GATE_S, TRIGGER_V, PracticeDrive
from levilab.live.practice.experiments import PRACTICE, PracticeExperiment, settings_for
from levilab.live.practice.fall import cause_of_fall, masses_that_float
from levilab.live.practice.seeds import keys_of_seed
from levilab.live.practice.tasks import TASKS, Look, Tasks
from levilab.live.practice.top import PracticeTop
from levilab.pipelines.inputs.names import seed_of_group
from levilab.pipelines.spindown.readings import release_of
from levilab.runs.events import RunEvent
from levilab.simulator.scene import Scene, read_scene
from levilab.telemetry.messages import Count, State
from levilab.telemetry.publisher import Publisher
from levilab.texts.text import Text, text_of
from levilab.world.bench import scene_world

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from multiprocessing.connection import Connection

    from levilab.bench.wiring import Wiring
    from levilab.world.motion_world import MotionWorld

#: Experiments for which a top has to be up when they begin; for `limit` the virtual person puts one back.
NEED_A_TOP = frozenset({"spin", "hold", "precession", "trace"})
#: Commands that are carried out while a run is recorded, too.
ALWAYS = (ask.SetSpeed, ask.Pause, ask.StopRun)
#: Failures of a run after which a person can do this here: there is no bench file, and the settings are the page's.
FAILED, ADVICE = (DidNotFollow, NoLight), "put the top back if it is down, and record once more"


@dataclass(frozen=True)
class PracticeOptions:
    """How the bench begins.

    Attributes:
        out: where run folders are made.
        scene: name or file of the scene of the top.
        seed: draws the top, the base and the noise of the light; of the first group, where groups have numbers.
        rests: whether its time stands still while no view looks and no run is recorded.
    """

    out: str
    scene: str
    seed: int
    rests: bool = False


def plan_of(command: ask.RecordRun) -> PracticeExperiment:
    """Return the experiment that a command wants: a row of PRACTICE, or one with settings of its own."""
    if not command.settings and command.experiment in PRACTICE:
        return PRACTICE[command.experiment]
    return PracticeExperiment(command.experiment, "", command.experiment, command.settings, 0.0)


def work(options: PracticeOptions, pipe: Connection) -> None:
    """Run the bench until the far end of the pipe is closed, or a signal asks for the end."""
    voice, text = Voice(pipe), "the bench is switched off"
    with watching_for_end() as end:
        try:
            clock, scene = PacedClock(1.0), read_scene(options.scene)
            scene = scene.changed(keys_of_seed(scene, options.seed))
            world = scene_world(scene, lambda: clock, voice.message, seed=options.seed)
            with Publisher() as publisher:
                PracticeProcess(options, scene, world, voice, publisher=publisher, end=end).run()
        except (LevilabError, InstrumentError) as error:
            text = text_of(error)
        except Exception as error:
            text = f"{type(error).__name__}: {error}"
            raise
        finally:
            voice.report("ended", text)


class PracticeProcess:
    """The bench between runs and in them, and what a person asks for.

    Attributes:
        clock: on which all waits.
        top, drive, tasks: what is on the bench, and what a person does with it.

    Args:
        options: how it begins.
        scene: of the top.
        world: with the top, on a clock that is paced.
        voice: with the pipe to the process that holds the bench.
        publisher: to the views.
        end: whether a signal asked for the end.
    """

    def __init__(
        self,
        options: PracticeOptions,
        scene: Scene,
        world: MotionWorld,
        voice: Voice,
        *,
        publisher: Publisher,
        end: End,
    ) -> None:
        assert isinstance(world.clock, PacedClock)
        self.clock = world.clock
        self._options, self._voice, self._publisher, self._end = options, voice, publisher, end
        self.top = PracticeTop(options.scene, scene, world, options.seed, voice)
        self.drive = PracticeDrive(self.top.wiring.limits, self.clock.now, voice)
        self.tasks = Tasks(options.seed)
        self._sent = Sent()
        self._spin: float | None = None  # what the instruments answered last, between runs
        self._field: float | None = None
        self._count: Count | None = None
        self._session: Session[Any] | None = None  # of the run that is recorded
        self._folder = ""
        self._fell = ""  # why the top fell in that run
        self._wanted: ask.RecordRun | None = None
        self._number: int | None = None  # of the command that wanted it
        self._stopped = ""  # why the run that is recorded is to end
        self._over = False
        self._paused = False  # by a person
        self._is_ready = False  # whether the instruments have answered
        self._acts: dict[type[Any], Callable[[Any], None]] = {
            ask.SetSpeed: lambda command: setattr(self.clock, "speed", command.speed),
            ask.Pause: lambda command: setattr(self, "_paused", command.on),
            ask.StopRun: self._stop_run,
            ask.RecordRun: self._want_run,
            ask.PutBack: self._put_back,
            ask.ChangeBench: self._change_bench,
            ask.TakeSeed: self._take_seed,
            ask.BeginTask: self._begin_task,
            ask.AnswerTask: self._answer_task,
            ask.MatchDrive: lambda _: self.drive.match(self._spin),
            ask.TuneDrive: self.drive.tune,
            ask.SwitchDrive: lambda command: self.drive.switch(self._spin, on=command.on),
        }

    # --- the bench ---

    def run(self) -> None:
        """Run the bench until the end."""
        address = self._publisher.address
        said: dict[str, Any] = {"port": address.port, "token": address.token.hex()} if address else {}
        while not self._over:
            wiring = self.top.wiring
            with open_bench(wiring, tuple(wiring.instruments)) as bench, self._looking_at(bench):
                bench.counter.prepare(gate_s=GATE_S, trigger_level_v=TRIGGER_V)
                bench.magnetometer.prepare(range_t=None)
                if not self._is_ready:
                    scene = self.top.scene
                    self._voice.report("ready", f"the top of the scene {scene.name}", scene=scene.as_table(), **said)
                    self._is_ready = True
                while not self._is_called_away():
                    self._measure(bench)
            if self._wanted and not self._over:
                self._record(self._wanted)
            self._wanted = None

    def _is_called_away(self) -> bool:
        """Return whether a run is to be recorded, or the bench is to end; a command may say so during a count."""
        return self._over or self._wanted is not None

    @contextlib.contextmanager
    def _looking_at(self, bench: Bench) -> Iterator[None]:
        self.drive.bench, self.clock.meanwhile = bench, self.look
        try:
            yield
        finally:
            self.clock.meanwhile = None
            self.drive.leave()
            self._voice.text = ""

    def _measure(self, bench: Bench) -> None:
        """Read each instrument once."""
        self._spin = spin = bench.counter.frequency()
        self._count = last_count(bench, spin)
        self.top.spin_hz = self.top.spin_hz if spin is None else spin
        if spin is not None and (self.drive.yields or self.drive.follows):
            self.top.take_drive(spin)
        self._look_at_top()
        self._look_at_task()
        self.drive.take_count(spin)
        if not self.drive.yields:  # while it does no other instrument keeps it waiting
            self._field = bench.magnetometer.flux_density()

    def _look_at_top(self) -> None:
        """See whether the top has fallen since the last look, and say why."""
        after, runs = self.top.look(), self._session is not None
        if after is None:
            return
        hides, held = bool(self.tasks.name), self.drive.lose()
        seen = None if runs else after  # the run says in its own words when that was
        # of a top that swings too far the counter misses pulses
        spin = None if self.top.spin_hz is None else self.top.world.spin_of_fall()
        changed = self.top.looked - self.top.changed
        why = cause_of_fall(self.top.scene, spin, seen, changed_s=changed, held=held, hides=hides)
        if runs:
            self._fell = why
        else:
            self._voice.say(why)
        self._look_at_task(fell_after=after)

    def _look_at_task(self, answer: float | None = None, fell_after: float | None = None) -> None:
        """See whether the goal of the task under way is reached."""
        drive, now = self.drive, self.clock.now()
        look = Look(now, self.top.floats(), self._spin, drive.output_hz, drive.follows, answer, fell_after)
        self.tasks.reach_at_once(look)
        if task := self.tasks.look(look):
            found = task.found(self.top.scene)
            if found:  # its top stays as a person made it float
                self.tasks.begin("")
            else:
                self._leave_task()
            self._voice.say(Text("reached: {title}. It shows: {teaches}", title=task.title, teaches=task.teaches), "")
            if found:
                self._voice.say(found)

    def _leave_task(self) -> None:
        """End the task under way; what it hid is taken away again."""
        self.tasks.begin("")
        if self.top.hides:
            self.top.hide({})
            if not self.top.floats():
                self.top.put_back()

    # --- what goes on meanwhile ---

    def look(self) -> None:
        """Carry out commands, move the drive, serve the views; the clock calls this while time passes."""
        self.clock.meanwhile = None  # an instrument that obeys takes its time, in a pause, too
        try:
            self._read_commands()
            self._look_meanwhile()
            self.drive.move()
            self._publish()
            self._rest()
        finally:
            self.clock.meanwhile = self.look

    def _look_meanwhile(self) -> None:
        """See whether the top has fallen while a run is recorded."""
        if self._session is None or self.clock.now() < self.top.looked + GATE_S:
            return
        self.top.spin_hz = self._session.doing.seen.get("spin_frequency_hz", self.top.spin_hz)
        self._look_at_top()

    def _rest(self) -> None:
        """Let time stand still where a person says so, and while no view looks, lest the top be down when one comes."""
        is_idle = self._is_ready and self._session is None and self._wanted is None
        alone = self._options.rests and is_idle and not self._publisher.is_watched
        self.clock.paused = not self._over and (self._paused or alone)

    def _read_commands(self) -> None:
        if self._end.by:
            self._finish(f"the signal {self._end.by}")
        try:
            while not self._over and self._voice.pipe.poll():
                self._answer(*self._voice.pipe.recv())
        except (EOFError, OSError):
            self._finish("the end of the program")

    def _finish(self, why: str) -> None:
        """End all: a run is kept, and time passes at once."""
        self._over = True
        self._stop(why)
        self.clock.speed = math.inf

    def _stop(self, why: str) -> None:
        """End the run that is recorded, also one that has not begun."""
        self._stopped = self._stopped or why
        if self._session is not None:
            self._session.stop.by = self._session.stop.by or self._stopped

    def _answer(self, number: int, command: ask.Command) -> None:
        """Carry out a command, and report that it was done, or why not."""
        try:
            if not isinstance(command, ALWAYS) and (self._wanted is not None or self.drive.bench is None):
                raise CommandRefused("a run is being recorded, and the bench is its own: stop the run first, or wait")
            self._acts[type(command)](command)
        except (LevilabError, InstrumentError) as error:
            self._voice.report("refused", text_of(error), number)
        else:
            if command is self._wanted:
                self._number = number
            self._voice.report("done", "", number)

    def _publish(self) -> None:
        if not self._publisher.is_due():
            return
        self._publisher.send(self.state())
        records = {} if self._session is None else self._session.doing.records
        self._sent.send_scope(self._publisher, records, self.top.wiring.signals, self.clock.now())
        self._sent.send_poses(self._publisher, self.top.wiring.poses, self.clock.now())

    def state(self) -> State:
        """Return the state for the views."""
        top, drive, tasks = self.top, self.drive, self.tasks
        speed = self.clock.speed if math.isfinite(self.clock.speed) else None
        here: dict[str, Any] = {"virtual": True, "speed": speed, "paused": self._paused, "seed": top.seed}
        here |= {"took_hold": drive.took_hold, "tuned_up": drive.tuned_up, "what_if": dict(top.what_if)}
        here |= {"task": tasks.name, "task_share": tasks.share, "tasks_done": tuple(tasks.done)}
        if self._session is not None:
            return replace(state_of(self._session, virtual=True), busy=True, **here)
        seen = {"spin_frequency_hz": self._spin, "flux_density_t": self._field}
        here |= {"last": {name: value for name, value in seen.items() if value is not None}, "count": self._count}
        counting = counting_of(drive.bench) if drive.bench else None
        here |= {"counting": counting, "goal_hz": drive.goal_hz}
        return State(self.clock.now(), text=self._voice.text, drive=drive.state(), **here)

    # --- commands: each may raise CommandRefused or InstrumentError ---

    def _stop_run(self, _: ask.StopRun) -> None:
        if self._wanted is None:
            raise CommandRefused("no run is being recorded: nothing to stop")
        self._stop(Text("the button End run"))

    def _want_run(self, command: ask.RecordRun) -> None:
        plan = plan_of(command)
        self._request(plan, command)  # raises where it is not possible
        if plan.experiment in NEED_A_TOP and not plan.scene and not self.top.floats():
            raise CommandRefused("the top is down, and this run begins with one that floats: put the top back first")
        self._wanted, self._stopped, self._paused = command, "", False

    def _change_bench(self, command: ask.ChangeBench) -> None:
        if command.values or self.tasks.name:
            self.top.change(command.values)
            if "washers_g" in command.values and not self.tasks.name:
                self._voice.text = masses_that_float(self.top.scene)
        else:
            self.top.hide({})  # with a top that a task has left
            self._voice.text = ""

    def _put_back(self, _: ask.PutBack) -> None:
        self.drive.lose()  # the next top was never held
        self.top.put_back()

    def _take_seed(self, command: ask.TakeSeed) -> None:
        seed = seed_of_group(command.group, self._options.seed or 1) if command.seed is None else command.seed
        if seed is None or seed == self.top.seed:
            return
        task = self.tasks.name
        self._leave_task()
        self.drive.lose()  # the other top was never held
        self.top.take_seed(seed)
        self._voice.message(Text("seed {seed} has drawn another top and another base: the top floats", seed=seed))
        if task:
            self._begin_task(ask.BeginTask(task=task))

    def _begin_task(self, command: ask.BeginTask) -> None:
        self._leave_task()
        self.tasks.begin(command.task)
        if hides := self.tasks.hidden:
            self.top.hide(hides)
        if command.task:
            if self.drive.output_hz is not None:
                self._voice.message("the drive is switched off: a task begins without it")
            self.drive.switch(None, on=False)
        if hides or (command.task and not self.top.floats()):
            self.top.put_back()

    def _answer_task(self, command: ask.AnswerTask) -> None:
        if self.tasks.is_right(command.value):
            self._look_at_task(command.value)
            return
        task = self.tasks.name
        self._begin_task(ask.BeginTask(task=task))  # else the third guess would be right
        raise CommandRefused(TASKS[task].wrong(command.value))

    # --- runs ---

    def _request(self, plan: PracticeExperiment, command: ask.RecordRun) -> Any:
        scene = self.top.scene_for(plan)
        options = AcquisitionOptions(
            mock=True,
            out=Path(self._options.out),
            seed=self.top.seed,
            group=self.tasks.label(command.group.strip(), on_the_bench=not (plan.scene or plan.moves_probe)) or None,
            note=command.note,
            settings=settings_for(plan, scene),
        )
        return request_at(self.top.wiring, scene, plan.experiment, options)

    def _record(self, command: ask.RecordRun) -> None:
        """Carry out an experiment; whatever ends it, the bench goes on."""
        plan = plan_of(command)
        self._spin = self._field = self._count = None
        self._folder = self._fell = ""  # a run may fail before it has a folder
        try:
            with self.top.lent_to(plan):
                run = acquire(self._request(plan, command), self._voice, self._watching)
                self.top.release = release_of(run.events())
        except (LevilabError, InstrumentError) as error:
            text, status, folder = text_of(error), "failed", self._folder
        else:
            text = Text("{status}: {count} readings", status=run.status, count=run.count())
            status, folder = run.status, str(run.folder)
            self.tasks.take_run(run.record.experiment)
        scene = self.top.scene.as_table()
        self._voice.report("recorded", text, self._number, status=status, folder=folder, scene=scene)
        if self._fell and not self.top.floats():
            self._voice.say(self._fell)

    @contextlib.contextmanager
    def _watching(self, session: Session[Any], wiring: Wiring) -> Iterator[Callable[[], None]]:
        """Yield the function that session and clock call while a run is recorded."""
        self._session, self._folder = session, str(session.writer.folder)
        if self._stopped:
            session.stop.by = self._stopped
        scene, name = self.top.scene.as_table(), session.writer.record.experiment
        self._voice.report("recording", name, self._number, folder=self._folder, scene=scene)
        if (before := self.top.release) and name in NEED_A_TOP:
            said = Text("the drive has held this top before, from {spin:.2f} Hz on, for {time:.0f} s", *astuple(before))
            numbers = {"frequency_hz": before.spin_hz, "driven_s": round(before.driven_s, 1)}
            session.event(RunEvent.DRIVEN_BEFORE, said, **numbers)
        try:
            yield self.look
        except ExperimentFailed as failed:
            advice = ADVICE if isinstance(failed, FAILED) else failed.advice
            raise ExperimentFailed(failed.observed, advice) from failed
        finally:
            if session.stop.by and session.stop.by.startswith("SIG"):
                self._over = True
            self._session = None

"""The process of the bench for practice: one thread, one clock, the real drivers on virtual instruments.

Whatever waits, waits by the clock, and the clock calls `PracticeProcess.look` every 50 ms of the wall: there commands
are carried out, the drive's frequency moves on, and views are served, also in the middle of a count.
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass, replace
from functools import partial, singledispatchmethod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from instruments.clock import PacedClock
from instruments.errors import InstrumentError
from levilab.acquisition.failures import DidNotFollow, NoLight
from levilab.acquisition.grip import COUNTS, Grip
from levilab.acquisition.loop import acquire
from levilab.acquisition.onlooker import Sent, counting_of, drive_of, state_of
from levilab.acquisition.request import AcquisitionOptions, request_at
from levilab.acquisition.session import ExperimentFailed, last_count
from levilab.bench.bench import open_bench
from levilab.bench.config import Limits
from levilab.errors import LevilabError
from levilab.interruption import watching_for_end
from levilab.live.practice.commands import (
    AnswerTask,
    BeginTask,
    ChangeBench,
    CommandRefused,
    MatchDrive,
    Pause,
    PlaceProbe,
    PracticeEvent,
    PutBack,
    RecordRun,
    SetSpeed,
    StopRun,
    SwitchDrive,
    TakeSeed,
    TuneDrive,
)
from levilab.live.practice.experiments import PRACTICE, PracticeExperiment, settings_for
from levilab.live.practice.fall import cause_of_fall
from levilab.live.practice.seeds import keys_of_seed, seed_of_group
from levilab.live.practice.tasks import TASKS, Look, Progress, exponent_of
from levilab.live.practice.what_if import USUAL, WHAT_IF, keys_of
from levilab.present.progress import Display
from levilab.simulator.compilation import announce_compilation
from levilab.simulator.scene import read_scene
from levilab.telemetry.messages import State
from levilab.telemetry.publisher import Publisher
from levilab.texts.text import Text, text_of
from levilab.world.bench import scene_world, virtual_wiring

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from multiprocessing.connection import Connection

    from levilab.acquisition.session import Session
    from levilab.bench.bench import Bench
    from levilab.bench.wiring import Wiring
    from levilab.interruption import End
    from levilab.live.practice.commands import Command, EventKind
    from levilab.simulator.scene import Scene
    from levilab.telemetry.messages import Count
    from levilab.world.motion_world import MotionWorld

#: Between runs the counter counts for so long [s], as the light of the tape passes this level [V].
GATE_S, TRIGGER_V = 0.5, 0.6
#: The drive's frequency moves in even steps of about this time [s]; with uneven ones the top swings about the drive.
RAMP_STEP_S = 0.5
#: The drive can take hold of a top that spins as fast as it is set, within this [Hz].
CATCHES_WITHIN_HZ = 1.0
#: A top that the drive took hold of swings about it by less than this [Hz], on the ramp, too.  One that is not held
#: loses 0.1 Hz/s to the air: it is compared this long after the drive has yielded [s], and lost beyond this [Hz].
SWINGS_HZ, COMPARED_S, LOST_HZ = 0.4, 6.0, 1.0
#: A top that follows the drive this far above where it took hold was tuned up [Hz].
TUNED_UP_HZ = 0.5
#: Experiments for which a top has to be up when they begin; for `limit` the virtual person puts one back.
NEED_A_TOP = frozenset({"spin", "precession", "trace"})
#: Experiments that move the magnetometer's probe: where it stands, their readings say.
MOVE_THE_PROBE = frozenset({"field"})
#: How fast the bench's time passes once a run is over, if it was faster: while it is analyzed nothing moves that is
#: worth a processor [seconds of the bench in one of the wall].
AFTER_A_RUN = 1.0
#: The drive before a person has changed it.
FIRST_HZ, FIRST_VPP, FIRST_WAVEFORM, FIRST_RAMP = 30.0, 10.0, "SQU", 0.1


@dataclass(frozen=True)
class PracticeOptions:
    """How the bench begins.

    Attributes:
        out: where run folders are made.
        scene: name or file of the scene of the top.
        seed: draws the top, the base and the noise of the light; of the first group, where groups have numbers.
        speed: seconds of the bench in one of the wall; infinite: it does not wait, for tests.
        rests: whether its time stands still while no view looks and no run is recorded.
    """

    out: str
    scene: str
    seed: int
    speed: float = 1.0
    rests: bool = False


@dataclass
class Knobs:
    """The drive as a person set it.

    Attributes:
        frequency_hz: where the frequency is, or is going [Hz].
        amplitude_vpp: peak to peak [V].
        waveform: SIN, SQU or TRI.
        ramp_hz_per_s: how fast the frequency goes there while the output is on [Hz/s].
        on: whether the output is on.
    """

    frequency_hz: float = FIRST_HZ
    amplitude_vpp: float = FIRST_VPP
    waveform: str = FIRST_WAVEFORM
    ramp_hz_per_s: float = FIRST_RAMP
    on: bool = False


@dataclass
class Hold:
    """The drive and the top, from the moment the drive is to take hold of it.

    Attributes:
        asked_hz: where the drive was set when it was switched on [Hz].
        grip: while the drive yields to the top; None: it waits for the next count.
        since: when the drive stood still, bench time [s].
        at_hz: where the top was first seen to follow [Hz]; None before.
        is_lost: whether it follows no more.
    """

    asked_hz: float
    grip: Grip | None = None
    since: float | None = None
    at_hz: float | None = None
    is_lost: bool = False

    @property
    def is_under_way(self) -> bool:
        """Whether the drive's frequency is for the top to say, and not for the ramp."""
        return self.since is None


#: What a person can do at this bench about a run that failed.
ADVICE: dict[type[ExperimentFailed], str] = {
    DidNotFollow: "put the top back if it is down, and record once more",
    NoLight: "put the top back, and record once more",
}
#: What a person can do about a top that the drive lost on the way up, on the way down, and where it stood still.
AGAIN = {
    1: "switch it off, match the spin, and go up more slowly",
    -1: "switch it off, match the spin, and go down more slowly",
    0: "switch it off, match the spin, and drive with more volts",
}


def plan_of(command: RecordRun) -> PracticeExperiment:
    """Return the experiment that a command wants: a row of PRACTICE, or one with settings of its own."""
    if not command.settings and command.experiment in PRACTICE:
        return PRACTICE[command.experiment]
    return PracticeExperiment(command.experiment, "", command.experiment, command.settings, 0.0)


def _changeable(scene: Scene) -> dict[str, Any]:
    """Return the keys of a scene that a person or a task can change, with their values."""
    table = scene.as_table()
    keys = {"temperature_rise_k": table["temperature_rise_k"], "base.tilt_rad": table["base"]["tilt_rad"]}
    keys |= {f"top.{key}": table["top"][key] for key in ("mass_kg", "moment_tilt")}
    return keys | {f"drag.{key}": table["drag"][key] for key in ("law", "coefficient")}


def _in_words(spin: float | None) -> str:
    return "no light pulses" if spin is None else Text("{spin:.2f} Hz", spin=spin)


def work(options: PracticeOptions, pipe: Connection) -> None:
    """Run the bench until the far end of the pipe is closed, or a signal asks for the end."""
    with watching_for_end() as end:
        try:
            scene = read_scene(options.scene)
            clock = PacedClock(options.speed)
            scene = scene.changed(keys_of_seed(scene, options.seed))
            world = scene_world(scene, lambda: clock, partial(_report, pipe, "message"), seed=options.seed)
            with Publisher() as publisher:
                PracticeProcess(options, scene, world, pipe, publisher=publisher, end=end).run()
        except (LevilabError, InstrumentError) as error:
            _report(pipe, "ended", text_of(error))
        except Exception as error:
            _report(pipe, "ended", f"{type(error).__name__}: {error}")
            raise
        else:
            _report(pipe, "ended", "the bench is switched off")


def _report(pipe: Connection, kind: EventKind, text: str, number: int | None = None, **about: Any) -> None:
    """Send an event to the process that holds the bench; where that is gone, to nowhere."""
    with contextlib.suppress(OSError):
        pipe.send(PracticeEvent(kind, text, number, **about))


class LinesToReport(Display):
    """The display of a run that is recorded: its messages go to the person at the bench."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell = tell

    def message(self, text: str) -> None:
        """Report a line."""
        self._tell(text)


class PracticeProcess:
    """The bench, its top, and what a person asks for.

    Args:
        options: how it begins.
        scene: of the top.
        world: with the top, on a clock that is paced.
        pipe: to the process that holds the bench.
        publisher: to the views.
        end: whether a signal asked for the end.
    """

    def __init__(
        self,
        options: PracticeOptions,
        scene: Scene,
        world: MotionWorld,
        pipe: Connection,
        *,
        publisher: Publisher,
        end: End,
    ) -> None:
        assert isinstance(world.clock, PacedClock)
        self.world, self.clock = world, world.clock
        self._seed = options.seed
        self.scene = self._usual_scene = scene  # as it is now, and as it was at first or by a task
        self._what_if = dict(USUAL)
        self._task: Progress | None = None
        self._task_share = 0.0
        self._tasks_done: list[str] = []
        self._chance = np.random.default_rng(options.seed)
        self._options, self._pipe, self._publisher, self._end = options, pipe, publisher, end
        self._report = partial(_report, pipe)
        self._wiring: Wiring = virtual_wiring(world, Limits())
        self._knobs, self._sent = Knobs(), Sent()
        self._seen: dict[str, float] = {}  # channel → what the instruments answered last, between runs
        self._count: Count | None = None  # the last count, between runs
        self._bench: Bench | None = None  # open between runs
        self._session: Session[Any] | None = None  # of the run that is recorded
        self._folder = ""
        self._wanted: RecordRun | None = None
        self._number: int | None = None  # of the command that wanted it
        self._stopped = ""  # why the run that is recorded is to end
        self._over = False
        self._looking = False  # whether `look` is under way: its work may wait, too
        self._hold: Hold | None = None  # of the drive, while it is on near the top's spin
        self._took_hold = self._tuned_up = False  # whether a person has come so far
        self._paused = False  # by a person
        self._is_ready = False  # whether the instruments have answered
        self._text = ""  # what the drive does, for the page
        self._moved = 0.0  # bench time of the last step of the drive's frequency [s]
        self._tops = 0
        self._up_since: float | None = 0.0  # when the top that floats was put there, bench time [s]
        self._last_spin: float | None = None  # of that top [Hz]
        self._looked = 0.0  # when it was looked at, bench time [s]
        self._fell = ""  # why it fell while a run was recorded
        self._probe_m: float | None = None

    # --- the bench ---

    def run(self) -> None:
        """Run the bench until the end."""
        address = self._publisher.address
        said: dict[str, Any] = {"port": address.port, "token": address.token.hex()} if address else {}
        self._place_probe(None)  # in the top's place it would be hit
        while not self._over:
            with open_bench(self._wiring, tuple(self._wiring.instruments)) as bench, self._looking_at(bench):
                self._set_up(bench)
                if not self._is_ready:
                    text = f"the top of the scene {self.scene.name}"
                    self._report("ready", text, scene=self.scene.as_table(), **said)
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
        self._bench, self.clock.meanwhile = bench, self.look
        try:
            yield
        finally:
            self._bench, self.clock.meanwhile = None, None
            self._knobs.on = False
            self._hold, self._text = None, ""

    def _set_up(self, bench: Bench) -> None:
        bench.counter.prepare(gate_s=GATE_S, trigger_level_v=TRIGGER_V)
        bench.magnetometer.prepare(range_t=None)

    def _measure(self, bench: Bench) -> None:
        """Read each instrument once."""
        spin = bench.counter.frequency()
        self._saw("spin_frequency_hz", spin)
        self._count = last_count(bench, spin)
        self._last_spin = self._last_spin if spin is None else spin  # of one that leans the counter sees no light
        self._look_at_top()
        self._look_at_task()
        self._go_on_with_hold(bench, spin)
        if self._hold is not None and self._hold.grip is not None and self._hold.is_under_way:
            return  # the drive yields to the top: no other instrument keeps it waiting
        self._saw("flux_density_t", bench.magnetometer.flux_density())

    def _look_at_top(self) -> None:
        """See whether the top has fallen since the last look, and say why."""
        floats, now = self._floats(), self.clock.now()
        self._looked = now
        if self._up_since is None:
            self._up_since = now if floats else None
        elif not floats:
            after, self._up_since = now - self._up_since, None
            driven = self._hold is not None and not self._hold.is_lost
            if self._hold is not None:
                self._hold.is_lost = True
            hides = self._task is not None
            runs = self._session is not None
            text = cause_of_fall(self.scene, self._last_spin, None if runs else after, driven=driven, hides=hides)
            if runs:
                self._fell = text  # the run says in its own words when that was
            else:
                self._say(text)

    def _look_at_task(self, answer: float | None = None) -> None:
        """See whether the goal of the task under way is reached."""
        if self._task is None or self._bench is None:
            return
        spin, drive = self._seen.get("spin_frequency_hz"), self._frequency(self._bench) if self._knobs.on else None
        follows = self._hold is not None and self._hold.at_hz is not None and not self._hold.is_lost
        look = Look(self.clock.now(), self._floats(), spin, drive, follows, answer)
        self._task_share = self._task.share(look)
        if self._task_share >= 1:
            task = TASKS[self._task.name]
            self._tasks_done += [self._task.name] * (self._task.name not in self._tasks_done)
            self._say(Text("reached: {title}. It shows: {teaches}", title=task.title, teaches=task.teaches), "")
            self._leave_task()

    def _leave_task(self) -> None:
        """End the task under way; what it hid is taken away again."""
        if self._task is None:
            return
        hid = TASKS[self._task.name].hidden(self._task.chance)
        self._task, self._task_share = None, 0.0
        if hid:
            self._usual_scene = self._scene_of_seed(self._options.scene)
            self._change(dict(USUAL))
            if not self._floats():
                self._put_back()

    def _scene_of_seed(self, name: str) -> Scene:
        """Return a scene with what the seed makes of it."""
        scene = read_scene(name)
        return scene.changed(keys_of_seed(scene, self._seed))

    def _change(self, values: dict[str, float]) -> None:
        """Give the top and its surroundings these values.  Raises CommandRefused, SceneError."""
        keys = keys_of(self._usual_scene, values)
        with announce_compilation(partial(self._report, "message")):
            self.world.change_scene({**_changeable(self._usual_scene), **keys})
        self.scene, self._what_if = self._usual_scene.changed(keys), values

    def _saw(self, channel: str, value: float | None) -> None:
        if value is None:
            self._seen.pop(channel, None)
        else:
            self._seen[channel] = value

    # --- what goes on meanwhile ---

    def look(self) -> None:
        """Carry out commands, move the drive, serve the views; the clock calls this while time passes."""
        if self._looking:
            return
        self._looking = True
        try:
            self._read_commands()
            self._look_meanwhile()
            self._move_drive()
            self._publish()
            self._rest()
        finally:
            self._looking = False

    def _look_meanwhile(self) -> None:
        """See whether the top has fallen while a run is recorded."""
        if self._session is None or self.clock.now() < self._looked + GATE_S:
            return
        self._last_spin = self._session.doing.seen.get("spin_frequency_hz", self._last_spin)
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
            while not self._over and self._pipe.poll():
                self._answer(*self._pipe.recv())
        except (EOFError, OSError):
            self._finish("the end of the program")

    def _finish(self, why: str) -> None:
        """End all: a run is kept, and time passes at once."""
        self._over, self._stopped = True, self._stopped or why
        self.clock.speed, self.clock.paused = math.inf, False  # and `_rest` leaves it so
        if self._session is not None:
            self._session.stop.by = self._session.stop.by or self._stopped

    def _answer(self, number: int, command: Command) -> None:
        try:
            text = self._carry_out(command)
        except (LevilabError, InstrumentError) as error:
            self._report("refused", text_of(error), number)
        else:
            if command is self._wanted:
                self._number = number
            self._report("done", text, number)

    def _publish(self) -> None:
        if not self._publisher.is_due():
            return
        self._publisher.send(self.state())
        records = {} if self._session is None else self._session.doing.records
        self._sent.send_scope(self._publisher, records, self._wiring.signals, self.clock.now())
        self._sent.send_poses(self._publisher, self._wiring.poses, self.clock.now())

    def state(self) -> State:
        """Return the state for the views."""
        speed = self.clock.speed if math.isfinite(self.clock.speed) else None
        here: dict[str, Any] = {"virtual": True, "speed": speed, "paused": self._paused, "probe_m": self._probe_m}
        here |= {"took_hold": self._took_hold, "tuned_up": self._tuned_up, "what_if": dict(self._what_if)}
        here |= {"seed": self._seed, "task_share": self._task_share, "tasks_done": tuple(self._tasks_done)}
        here["task"] = self._task.name if self._task else ""
        if self._session is not None:
            if self._session.writer.record.experiment in MOVE_THE_PROBE:
                here["probe_m"] = None
            return replace(state_of(self._session, virtual=True), busy=True, **here)
        drive = drive_of(self._bench) if self._bench else None
        counting = counting_of(self._bench) if self._bench else None
        if drive and not drive.output:  # what comes when it is switched on
            knobs = self._knobs
            drive = replace(
                drive, waveform=knobs.waveform, frequency_hz=knobs.frequency_hz, amplitude_vpp=knobs.amplitude_vpp
            )
        here |= {"last": dict(self._seen), "drive": drive, "counting": counting, "count": self._count}
        return State(self.clock.now(), text=self._text, **here)

    # --- commands ---

    @singledispatchmethod
    def _carry_out(self, command: Command) -> str:
        """Carry out a command.  Returns a text of what was done; raises CommandRefused and InstrumentError."""
        raise CommandRefused(Text("{command}: this bench cannot do that", command=repr(command)))

    @_carry_out.register
    def _(self, command: SetSpeed) -> str:
        self.clock.speed = command.speed
        return f"{command.speed:g} seconds of the bench in a second"

    @_carry_out.register
    def _(self, command: Pause) -> str:
        self._paused = command.on
        return "the bench's time stands still" if command.on else "the bench's time goes on"

    @_carry_out.register
    def _(self, command: StopRun) -> str:
        if self._session is None and self._wanted is None:
            raise CommandRefused("no run is being recorded: nothing to stop")
        self._stopped = "the stop button"
        if self._session is not None:
            self._session.stop.by = self._stopped
        return "the run ends after the reading under way"

    @_carry_out.register
    def _(self, command: RecordRun) -> str:
        self._free_bench()
        plan = plan_of(command)
        self._request(plan, command)  # raises where it is not possible
        if plan.experiment in NEED_A_TOP and not plan.scene and not self._floats():
            raise CommandRefused(
                Text(
                    "the top is down, and a {experiment} run begins with one that floats: put the top back first",
                    experiment=plan.experiment,
                )
            )
        self._wanted, self._stopped = command, ""
        return f"the run begins: {plan.title}"

    @_carry_out.register
    def _(self, command: PutBack) -> str:
        self._free_bench()
        self._put_back()
        return "the top floats again"

    @_carry_out.register
    def _(self, command: ChangeBench) -> str:
        self._free_bench()
        self._change(self._what_if | command.values if command.values else dict(USUAL))
        changed = {name: value for name, value in self._what_if.items() if value != USUAL[name]}
        return (
            ", ".join(f"{WHAT_IF[name].title} {value:g} {WHAT_IF[name].unit}" for name, value in changed.items())
            or "all as usual"
        )

    @_carry_out.register
    def _(self, command: TakeSeed) -> str:
        self._free_bench()
        seed = seed_of_group(command.group, self._options.seed or 1) if command.seed is None else command.seed
        if seed is None or seed == self._seed:
            return Text("the top is that of seed {seed}", seed=self._seed)
        self._leave_task()
        self._seed = seed
        self._usual_scene = self._scene_of_seed(self._options.scene)
        self.world.take_top()
        self.world.take_seed(seed)
        self.world.change_scene(keys_of_seed(read_scene(self._options.scene), seed))
        self._change(dict(USUAL))
        self._put_back()
        text = Text("seed {seed} has drawn another top and another base: the top floats", seed=seed)
        self._report("message", text)
        return text

    @_carry_out.register
    def _(self, command: BeginTask) -> str:
        self._free_bench()
        if command.task and command.task not in TASKS:
            raise CommandRefused(
                Text("{name}: one of {known} is expected", name=f"task = {command.task}", known=", ".join(TASKS))
            )
        self._leave_task()
        if not command.task:
            return "the task is left"
        self._task = Progress(command.task, float(self._chance.uniform()))
        if hides := TASKS[command.task].hidden(self._task.chance):
            self._usual_scene = self._usual_scene.changed(hides)
            self._change(dict(USUAL))
        if hides or not self._floats():
            self._put_back()
        return f"the task: {TASKS[command.task].does}"

    @_carry_out.register
    def _(self, command: AnswerTask) -> str:
        if self._task is None or not TASKS[self._task.name].answers:
            raise CommandRefused("no task asks for an answer: begin one that does")
        truth = exponent_of(self._task.chance)
        if command.value != truth:
            raise CommandRefused(
                Text("n = {value:g} is not it: put the top back, and watch it once more", value=command.value)
            )
        self._look_at_task(command.value)
        return f"n = {truth:g} is right"

    def _put_back(self) -> None:
        self._tops += 1
        self.world.take_top()
        self.world.float_top(self._tops)
        self._up_since, self._last_spin, self._text = self.clock.now(), None, ""

    def _floats(self) -> bool:
        """Return whether the top is up now, as a person at the bench sees; the counter knows it a second later."""
        poses = self._wiring.poses
        return poses is not None and bool(poses(self.clock.now(), RAMP_STEP_S, 1).up[0])

    @_carry_out.register
    def _(self, command: PlaceProbe) -> str:
        self._free_bench()
        self._place_probe(command.height_m)
        if command.height_m is None:
            return "the probe lies in its chamber"
        return f"the probe stands {1e3 * command.height_m:.1f} mm above the base"

    def _place_probe(self, height_m: float | None) -> None:
        self.world.place_probe(height_m)
        self._probe_m = height_m

    @_carry_out.register
    def _(self, command: MatchDrive) -> str:
        spin = self._seen.get("spin_frequency_hz")
        if spin is None:
            raise CommandRefused("the counter sees no top whose spin the drive could be set to: put the top back first")
        if self._knobs.on:
            raise CommandRefused(
                "the drive is on, and changes its frequency only slowly, so it cannot be set to the spin at once: "
                "switch it off, then match"
            )
        return self._carry_out(TuneDrive(frequency_hz=round(spin, 2)))

    @_carry_out.register
    def _(self, command: TuneDrive) -> str:
        bench, knobs = self._free_bench(), self._knobs
        changes = {name: value for name, value in command.model_dump(exclude={"do"}).items() if value is not None}
        wanted = replace(knobs, **changes)
        self._check(wanted)
        self._knobs = wanted
        if self._hold is not None and self._hold.grip is None:
            pass  # the drive comes on with it
        elif wanted.on and command.waveform is not None and command.waveform != knobs.waveform:
            self._switch_on(bench, self._frequency(bench))
        elif wanted.on and command.amplitude_vpp is not None:
            bench.generator.amplitude = wanted.amplitude_vpp
        return f"{wanted.frequency_hz:g} Hz, {wanted.amplitude_vpp:g} Vpp, {wanted.waveform}"

    @_carry_out.register
    def _(self, command: SwitchDrive) -> str:
        bench, knobs = self._free_bench(), self._knobs
        if not command.on:
            bench.outputs_off()
            self._hold, self._text, knobs.on = None, "", False
            return "the drive is off"
        if knobs.on:
            return f"the drive is on at {knobs.frequency_hz:g} Hz already"
        self._check(knobs)
        knobs.on = True
        spin = self._seen.get("spin_frequency_hz")
        if spin is not None and abs(spin - knobs.frequency_hz) <= CATCHES_WITHIN_HZ:
            self._hold = Hold(knobs.frequency_hz)
            return f"the drive comes on after the next count, at the top's spin, {spin:.2f} Hz"
        self._switch_on(bench, knobs.frequency_hz)
        beside = "the counter sees no top" if spin is None else Text("the top spins at {spin:.2f} Hz", spin=spin)
        takes = "it takes hold of one that spins as fast"
        self._say(
            Text(
                "drive on at {frequency_hz:g} Hz, but {beside}: {takes}",
                frequency_hz=knobs.frequency_hz,
                beside=beside,
                takes=takes,
            ),
            Text("the drive holds no top: {takes}", takes=takes),
        )
        return f"the drive is on at {knobs.frequency_hz:g} Hz"

    def _say(self, text: str, lasting: str = "") -> None:
        """Say something to the person at the bench, and leave it in the head of the page.

        Args:
            text: with the numbers of this moment.
            lasting: what stands in the head, where those numbers would grow old; empty: the text itself.
        """
        self._text = lasting or text
        self._report("message", text)

    def _free_bench(self) -> Bench:
        """Return the open bench.  Raises CommandRefused while a run is recorded."""
        if self._session is not None or self._wanted is not None or self._bench is None:
            raise CommandRefused("a run is being recorded, and the bench is its own: stop the run first, or wait")
        return self._bench

    def _check(self, knobs: Knobs) -> None:
        """Raise CommandRefused beyond the limits of the bench."""
        found = self._wiring.limits.of_the_drive().beyond(
            frequency_hz=knobs.frequency_hz, amplitude_vpp=knobs.amplitude_vpp
        )
        if found:
            unit = "Vpp" if found.name == "drive_amplitude_vpp" else "Hz"
            allowed = "at most" if found.is_highest else "at least"
            raise CommandRefused(
                Text(
                    "{value:g} {unit}: the coil of this bench stands {allowed} {limit:g} {unit}",
                    value=found.value,
                    unit=unit,
                    allowed=allowed,
                    limit=found.limit,
                )
            )

    # --- the drive ---

    def _switch_on(self, bench: Bench, frequency: float) -> None:
        knobs = self._knobs
        bench.generator.prepare(waveform=knobs.waveform, frequency_hz=frequency, amplitude_vpp=knobs.amplitude_vpp)
        bench.generator.output = True
        self._moved = self.clock.now()

    def _go_on_with_hold(self, bench: Bench, spin: float | None) -> None:
        """Go on with taking hold of the top, or see whether it follows, just after a count.

        Args:
            bench: that is open.
            spin: that was counted [Hz]; None: no light pulses.
        """
        hold = self._hold
        if hold is None or hold.is_lost:
            return
        if hold.grip is None:
            self._begin_to_hold(bench, hold, spin)
        elif hold.since is None:
            self._yield(bench, hold, hold.grip, spin)
        elif self.clock.now() - hold.since >= COMPARED_S:
            self._compare(bench, hold, spin)

    def _begin_to_hold(self, bench: Bench, hold: Hold, spin: float | None) -> None:
        if spin is None:
            self._hold, self._knobs.on = None, False
            self._say("no light pulses: the drive has no top to take hold of")
            return
        self._switch_on(bench, spin)
        hold.grip = Grip(spin, bench.generator.limits.drive_lowest_hz, bench.generator.limits.drive_frequency_hz)
        within = COUNTS * GATE_S + COMPARED_S
        self._say(
            Text(
                "drive on at the top's spin, {spin:.2f} Hz; it takes hold within about {within:.0f} s",
                spin=spin,
                within=within,
            )
        )

    def _yield(self, bench: Bench, hold: Hold, grip: Grip, spin: float | None) -> None:
        bench.generator.frequency = grip.follow(spin)
        if grip.is_lost:
            self._give_up(bench, spin, grip.drive)
        elif grip.is_over:
            hold.since = self._moved = self.clock.now()
            if self._knobs.frequency_hz == hold.asked_hz:  # else a person has tuned it on meanwhile
                self._knobs.frequency_hz = grip.drive

    def _compare(self, bench: Bench, hold: Hold, spin: float | None) -> None:
        """Compare the spin with the drive: it follows, was tuned up, or was lost."""
        drive = self._frequency(bench)
        off = math.inf if spin is None else abs(spin - drive)
        if hold.at_hz is None:
            if off > SWINGS_HZ:
                self._give_up(bench, spin, drive)
                return
            hold.at_hz, self._took_hold = drive, True
            self._say(Text("the top follows the drive at {drive:.2f} Hz", drive=drive), "the top follows the drive")
        elif off > LOST_HZ:
            hold.is_lost = True
            again = AGAIN[int(np.sign(self._knobs.frequency_hz - drive))]
            self._say(
                Text(
                    "the drive has lost the top, {spin} under a drive of {drive:.2f} Hz: {again}",
                    spin=_in_words(spin),
                    drive=drive,
                    again=again,
                ),
                Text("the drive has lost the top: {again}", again=again),
            )
        elif off <= SWINGS_HZ and drive >= hold.at_hz + TUNED_UP_HZ and not self._tuned_up:
            self._tuned_up = True
            self._say(
                Text("the top follows the drive up, to {drive:.2f} Hz by now", drive=drive),
                "the top follows the drive up",
            )

    def _give_up(self, bench: Bench, spin: float | None, drive: float) -> None:
        bench.outputs_off()
        self._hold, self._knobs.on = None, False
        self._say(
            Text(
                "the drive does not hold the top, {spin} under a drive of {drive:.2f} Hz, and it is "
                "off: match the spin and switch it on again, with more volts",
                spin=_in_words(spin),
                drive=drive,
            )
        )

    @staticmethod
    def _frequency(bench: Bench) -> float:
        """Return the drive's frequency as it was commanded last [Hz]."""
        return float(bench.generator.last_set.get("frequency_hz", 0.0))

    def _move_drive(self) -> None:
        """Move the drive's frequency towards its goal, as far as the ramp has gone since the last move."""
        since = self.clock.now() - self._moved
        yields = self._hold is not None and self._hold.is_under_way
        if self._bench is None or not self._knobs.on or yields or since < RAMP_STEP_S:
            return
        self._moved += since
        here = self._frequency(self._bench)
        way = self._knobs.frequency_hz - here
        if not way:
            return
        step = math.copysign(min(abs(way), self._knobs.ramp_hz_per_s * since), way)
        with contextlib.suppress(InstrumentError):  # the virtual one is always there; the next step comes
            self._bench.generator.frequency = round(here + step, 6)

    # --- runs ---

    def _request(self, plan: PracticeExperiment, command: RecordRun) -> Any:
        scene = self._scene_of_seed(plan.scene) if plan.scene else self.scene
        options = AcquisitionOptions(
            mock=True,
            out=Path(self._options.out),
            seed=self._seed,
            group=command.group.strip() or None,
            note=command.note,
            settings=settings_for(plan, scene),
        )
        return request_at(self._wiring, scene, plan.experiment, options)

    def _record(self, command: RecordRun) -> None:
        """Carry out an experiment; whatever ends it, the bench goes on."""
        plan = plan_of(command)
        self._seen.clear()
        self._count = None
        self._folder = ""  # a run may fail before it has one
        try:
            with self._top_for(plan):
                request = self._request(plan, command)
                run = acquire(request, LinesToReport(partial(self._report, "message")), self._watching)
        except (LevilabError, InstrumentError) as error:
            text, status, folder = text_of(error), "failed", self._folder
        else:
            text, status, folder = (
                Text("{status}: {count} readings", status=run.status, count=run.count()),
                run.status,
                str(run.folder),
            )
        self._report("recorded", text, self._number, status=status, folder=folder, scene=self.scene.as_table())
        if self._floats():
            self._up_since = self.clock.now() if self._up_since is None else self._up_since
        elif self._fell:
            self._say(self._fell)
            self._up_since = None
        self._fell = ""
        self._place_probe(self._probe_m)  # a run may have moved it
        if AFTER_A_RUN < self.clock.speed < math.inf:
            self.clock.speed = AFTER_A_RUN
            text = Text("the run is over: speed {speed:g}\u00a0× again", speed=AFTER_A_RUN)
            self._report("message", text)  # not in the page's head: the speed may be changed

    @contextlib.contextmanager
    def _top_for(self, plan: PracticeExperiment) -> Iterator[None]:
        """Have the top of an experiment on the bench meanwhile, or none where its probe goes; then the usual one."""
        if plan.experiment in MOVE_THE_PROBE:
            self.world.take_top()
            self._up_since = None
            self._report("message", "the top is taken off: the probe goes where it floats")
        usual = self.world, self.scene, self._wiring
        if plan.scene:
            self.scene = self._scene_of_seed(plan.scene)
            tell = partial(self._report, "message")
            self.world = scene_world(self.scene, lambda: self.clock, tell, seed=self._seed)
            self._wiring = virtual_wiring(self.world, Limits())
            self._up_since = self.clock.now()
        try:
            yield
        finally:
            self.world, self.scene, self._wiring = usual
            if (plan.scene or plan.experiment in MOVE_THE_PROBE) and not self._over:
                self._put_back()
                if plan.scene:
                    self._report("message", "the run had a top of its own; the usual one floats again")

    @contextlib.contextmanager
    def _watching(self, session: Session[Any], wiring: Wiring) -> Iterator[Callable[[], None]]:
        """Yield the function that session and clock call while a run is recorded."""
        self._session, self._folder = session, str(session.writer.folder)
        if self._stopped:
            session.stop.by = self._stopped
        experiment = session.writer.record.experiment
        self._report("recording", experiment, self._number, folder=self._folder, scene=self.scene.as_table())
        try:
            yield self.look
        except ExperimentFailed as failed:
            # no bench file is at hand here, and the settings are the page's
            raise ExperimentFailed(failed.observed, ADVICE.get(type(failed), failed.advice)) from failed
        finally:
            if session.stop.by and session.stop.by.startswith("SIG"):
                self._over = True
            self._session = None

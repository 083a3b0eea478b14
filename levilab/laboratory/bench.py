"""The bench of a laboratory: each message and each wait is a step, and the instruments outlive a process."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from instruments.clock import VirtualClock
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.core.status import POWER_ON
from levilab.bench.person import FloatTop, PlaceProbe, ShieldProbe, Task
from levilab.world.bench import virtual_bus, virtual_wiring

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from random import Random

    from instruments.virtual.bench.session import Session
    from instruments.virtual.core.device import VirtualInstrument
    from levilab.bench.config import Limits
    from levilab.bench.wiring import Wiring
    from levilab.laboratory.disk import SimulatedComputer
    from levilab.laboratory.fate import Fate
    from levilab.world.spin_world import World

#: Time that a person takes for a task [s].
_TASK_S = (4.0, 40.0)
#: What a person types who is not at his best.
TYPED = ("61 5", "high", "??", "-", "7e1", "1000 mm mm", "100000")


class LaboratoryClock(VirtualClock):
    """The bench's time, with which the computer's goes on; a wait is a step."""

    def __init__(self, fate: Fate, computer: SimulatedComputer) -> None:
        super().__init__()
        self._fate, self._computer = fate, computer

    def sleep(self, duration: float) -> None:
        """See `Clock`."""
        if duration > 0:
            self._fate.step(f"wait {duration:.6f}")
        super().sleep(duration)

    def let_pass(self, duration: float) -> None:
        """Let time pass while the process sleeps, or is none [s]."""
        self._pass(self._now + duration)

    def _pass(self, end: float) -> None:
        self._computer.passed_s += max(0.0, end - self._now)
        super()._pass(end)


class LaboratoryBench(VirtualBench):
    """The instruments of a laboratory.

    Attributes:
        fate: of the process.
        sessions: that are open.
        at_next_message: called before an instrument gets the next message.
    """

    fate: Fate
    at_next_message: Callable[[], None] | None = None
    sessions: list[Session]

    @classmethod
    def around(cls, bus: VirtualBench, fate: Fate) -> LaboratoryBench:
        """Return the bench with the instruments of another one."""
        bench = cls(bus.instruments)
        bench.fate, bench.sessions = fate, []
        return bench

    def session(self, device: VirtualInstrument, *, stream: bool) -> Session:
        """See `VirtualBench`."""
        session = super().session(device, stream=stream)
        sound, name = session.write, device.identity.split(",")[1]

        def write(data: bytes, *, end: bool = True) -> None:
            self.fate.step(f"{name} > {data!r:.120}")
            if self.at_next_message is not None:
                act, self.at_next_message = self.at_next_message, None
                act()
            sound(data, end=end)

        session.write = write  # type: ignore[method-assign]
        self.sessions.append(session)
        return session

    # --- what happens to it ---

    def device(self, value: float) -> VirtualInstrument:
        """Return one of the instruments, by a number from 0 to 1."""
        devices = [*self.instruments.values()]
        return devices[int(value * len(devices))]

    def pull_cable(self, device: VirtualInstrument, duration: float) -> None:
        """Pull the cable of an instrument for some time [s]."""
        self.unreachable_until[id(device)] = device.clock.now() + duration
        for session in self.sessions:
            if session.device is device:
                session.lost_after = 0

    def pull_plug(self, device: VirtualInstrument, duration: float) -> None:
        """Take an instrument's power away for some time [s]."""
        device.reset()
        device.status.events |= POWER_ON
        self.pull_cable(device, duration)

    def end_process(self) -> None:
        """End all links, as an operating system does for a process that is gone."""
        for session in self.sessions:
            session.close()
        self.sessions.clear()


class LaboratoryPerson:
    """Who puts the probe where it should be, floats tops, takes time, and makes slips.

    Attributes:
        slip: set by an event, for the next task: "mistypes", "types a height", "misses" the height or is "late".
        height_m: where the person believes the probe to be; None: in its chamber, or 3 mm off without knowing it.
        world: with the probe and the top.
    """

    def __init__(self, fate: Fate, clock: LaboratoryClock, random: Random) -> None:
        self._fate, self._clock, self._random = fate, clock, random
        self.slip = ""
        self.height_m: float | None = None
        self.world: World | None = None

    def __call__(self, task: Task) -> str:
        """Carry out a task."""
        self._fate.step(f"asks: {task.text}", "task")
        slip, self.slip = self.slip, ""
        self._clock.let_pass(3000.0 if slip == "late" else self._random.uniform(*_TASK_S))
        if slip == "mistypes":
            return self._random.choice(TYPED)
        world, answer = self.world, ""
        assert world is not None
        match task:
            case FloatTop():
                world.float_top(task.number)
            case PlaceProbe():
                height = task.height_m
                if slip == "types a height":
                    height = round(height + self._random.uniform(-2e-3, 2e-3), 4)
                    answer = f"{1e3 * height:.1f}".replace(".", self._random.choice(".,"))
                self.height_m = None if slip == "misses" else height
                world.place_probe(height + (3e-3 if slip == "misses" else 0.0))
            case ShieldProbe():
                self.height_m = None
                world.place_probe(None)
        return answer


def laboratory_wiring(
    world: World, fate: Fate, models: Mapping[str, str], person: LaboratoryPerson, limits: Limits
) -> tuple[LaboratoryBench, Wiring]:
    """Return a bench in a world, and the wiring that leads to it."""
    bench = LaboratoryBench.around(virtual_bus(world, models), fate)
    person.world = world
    wiring: Any = virtual_wiring(world, limits, models)
    return bench, replace(wiring, library=library_for(bench), person=person, poses=None, signals={})

"""What goes wrong in a laboratory: a row each."""

from __future__ import annotations

import errno
import signal
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TypeVar

from instruments.virtual.bench.faults import FAULTS
from instruments.virtual.bench.faults import Fault as LinkFault

if TYPE_CHECKING:
    from collections.abc import Callable

    from levilab.laboratory.bench import LaboratoryBench, LaboratoryClock, LaboratoryPerson
    from levilab.laboratory.disk import SimulatedComputer
    from levilab.laboratory.fate import Fate
    from levilab.world.spin_world import World

T = TypeVar("T")

#: Links fail in one of these ways.
_LINK = tuple(FAULTS)
#: How long a cable or a plug is out, from a moment to longer than levilab waits for it [s].
_OUT_S = (0.5, 3.0, 15.0, 100.0)
#: How far a clock of a computer is set [s].
_SET_S = (-3600.0, -90.0, -2.0, 2.0, 90.0, 3600.0)
#: Errors of a disk.
_ERRORS = (errno.EIO, errno.EDQUOT, errno.EROFS, errno.EACCES)
#: The file that cannot be read is one of the next ones that are opened; their number.
_READS = 3
#: Room that is left on a full disk, at most [bytes].
_ROOM = 3000


def _choose(values: tuple[T, ...], value: float) -> T:
    return values[min(int(value * len(values)), len(values) - 1)]


class Place(Protocol):
    """What events act on."""

    fate: Fate
    computer: SimulatedComputer
    clock: LaboratoryClock
    person: LaboratoryPerson
    bench: LaboratoryBench
    world: World

    def remove_folder(self) -> None:
        """Remove the folder of the present run, as a person does with a file manager."""


@dataclass(frozen=True)
class What:
    """A kind of event.

    Attributes:
        words: as the story has it; `{}` is what `about` says.
        act: carries it out, with the value that the event has drawn.
        about: what the value stands for.
        kind: of the steps that are counted for it.
        of_bench: whether the readings may differ from those without it.
    """

    words: str
    act: Callable[[Place, float], None]
    about: Callable[[float], object] = lambda _: ""
    kind: str = "step"
    of_bench: bool = True


def _fail_link(place: Place, value: float) -> None:
    place.bench.faults.append(LinkFault(_choose(_LINK, value), times=1 + int(100 * value) % 3))


def out_s(value: float) -> float:
    """Return how long a cable or a plug of this value is out [s]."""
    return _choose(_OUT_S, value * 7 % 1)


def _pull(place: Place, value: float, *, plug: bool) -> None:
    bench = place.bench
    pull = bench.pull_plug if plug else bench.pull_cable
    pull(bench.device(value), out_s(value))


def _press_ctrl_c(times: int) -> None:
    """Press Ctrl-C, as the handler sees it: the signal itself is blocked in a worker."""
    handler = signal.getsignal(signal.SIGINT)
    assert callable(handler)
    for _ in range(times):
        handler(signal.SIGINT, None)


def _take_top(place: Place, _: float) -> None:
    place.bench.at_next_message = place.world.take_top  # a count under way is worked out ahead, to its end


def _slip(name: str) -> Callable[[Place, float], None]:
    def act(place: Place, _: float) -> None:
        place.person.slip = name

    return act


def _set_clock(place: Place, value: float) -> None:
    place.computer.offset_s += _choose(_SET_S, value)


def _fail_disk(place: Place, value: float) -> None:
    place.computer.fault = _choose(_ERRORS, value)


def _fail_to_read(place: Place, value: float) -> None:
    place.computer.unread = 1 + int(value * _READS)


def _fill_disk(place: Place, value: float) -> None:
    place.computer.room = int(value * _ROOM)


EVENTS: dict[str, What] = {
    "kill": What("the process is killed", lambda place, _: place.fate.die(), of_bench=False),
    "power": What("the computer loses its power", lambda place, _: place.fate.die(power=True), of_bench=False),
    "ctrl-c": What("the person presses Ctrl-C", lambda *_: _press_ctrl_c(1), of_bench=False),
    "ctrl-c twice": What("the person presses Ctrl-C twice", lambda *_: _press_ctrl_c(2), of_bench=False),
    "disk full": What("the disk has room for {} bytes more", _fill_disk, lambda v: int(v * _ROOM), of_bench=False),
    "disk error": What(
        "the disk answers {}", _fail_disk, lambda v: errno.errorcode[_choose(_ERRORS, v)], of_bench=False
    ),
    "unreadable": What("a file cannot be read", _fail_to_read, of_bench=False),
    "slow disk": What("the disk takes {:.0f} s", lambda place, v: place.clock.let_pass(30 * v), lambda v: 30 * v),
    "folder": What("the person removes the run's folder", lambda place, _: place.remove_folder(), of_bench=False),
    "clock": What("the computer's clock is set by {:+.0f} s", _set_clock, lambda v: _choose(_SET_S, v)),
    "lid": What("the lid is closed for {:.0f} s", lambda place, v: place.clock.let_pass(2000 * v), lambda v: 2000 * v),
    "link": What("the next answer of an instrument: {}", _fail_link, lambda v: _choose(_LINK, v)),
    "cable": What("a cable is out for {:g} s", lambda place, v: _pull(place, v, plug=False), out_s),
    "plug": What("an instrument has no power for {:g} s", lambda place, v: _pull(place, v, plug=True), out_s),
    "top taken": What("the person takes the top out of the air", _take_top),
    "mistypes": What("the person mistypes", _slip("mistypes"), kind="task"),
    "types a height": What("the person types another height", _slip("types a height"), kind="task"),
    "misses": What("the person puts the probe 3 mm too high", _slip("misses"), kind="task"),
    "late": What("the person answers 50 min late", _slip("late"), kind="task"),
}

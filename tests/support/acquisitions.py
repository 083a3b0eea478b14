"""Acquisitions on the virtual bench, as tests make them."""

import shutil
import signal
from dataclasses import replace

from instruments.clock import VirtualClock
from levilab.acquisition.experiments.spin import SpinSettings
from levilab.acquisition.loop import AcquisitionRequest, acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.acquisition.table import Configuration, with_settings
from levilab.present.progress import Display
from levilab.world.bench import virtual_wiring
from levilab.world.spin_world import SpinWorld

#: Counts before the drive is off: the spin at first, 27 while the drive takes hold, every 10 s of 25 on the way up, and
#: at the end of it.
BEFORE = 31

#: A held top is counted for 20 s, and driven up for 200 s: two thirds of what an acquisition costs.
LET_GO_AT_ONCE = ("spin.hold_s=0",)
#: From 30 Hz to 35 Hz, and down again in 150 s.  A top in full motion would swing about the drive after it.
RAISED_QUICKLY = (*LET_GO_AT_ONCE, "spin.ramp_hz_per_s=0.2", "spin.drive_frequency_hz=35")
#: The same on the command line.
QUICKLY = [word for setting in RAISED_QUICKLY for word in ("--set", setting)]


class Silent(Display):
    """Shows nothing, remembers what it was to show."""

    def __init__(self):
        self.readings = []
        self.messages = []
        self.left = []
        self.closed = False
        self.after_close = []

    def reading(self, text, elapsed, remaining):
        self.readings.append(text)
        self.left.append(remaining[1])

    def message(self, text):
        self.messages.append(text)
        if self.closed:
            self.after_close.append(text)

    def close(self):
        self.closed = True


class Meanwhile(Silent):
    """Does something after a number of readings."""

    def __init__(self, after, do):
        super().__init__()
        self.after, self.do = after, do

    def reading(self, text, elapsed, remaining):
        super().reading(text, elapsed, remaining)
        if len(self.readings) == self.after:
            self.do()


class Impatient(Meanwhile):
    """Presses Ctrl-C, or sends another signal, after a number of readings."""

    def __init__(self, most, number=signal.SIGINT):
        super().__init__(most, lambda: signal.raise_signal(number))


def mock(out, seed=1, **changes):
    """A spin-down on the virtual bench, as the command line asks for it, but let go at once."""
    of_a_new_run = LET_GO_AT_ONCE if "scene" in changes else RAISED_QUICKLY
    settings = () if "resume" in changes else of_a_new_run
    return asked("spin", out=out, seed=seed, settings=settings, **changes)


def asked(experiment, **options):
    """An experiment on the virtual bench, as the command line asks for it."""
    return request_for(experiment, AcquisitionOptions(mock=True, **options))


def acquired(experiment, show=None, **options):
    """The run of an experiment on the virtual bench."""
    return acquire(asked(experiment, **options), show or Silent())


def cut(run, into, readings):
    """The folder of a copy of this run, interrupted after a number of readings."""
    shutil.copytree(run.folder, into)
    record = run.record.model_copy(update={"status": "interrupted"})
    (into / "run.json").write_text(record.as_json(), encoding="utf-8")
    rows = (into / "readings.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    (into / "readings.csv").write_text("".join(rows[: 1 + readings]), encoding="utf-8")
    return into


def kinds(run):
    """The kinds of all events of a run."""
    return [event["kind"] for event in run.events()]


def events(run, *kinds):
    """The events of these kinds."""
    return [event for event in run.events() if event["kind"] in kinds]


def texts(run, *kinds):
    """The texts of the events of these kinds."""
    return [event["text"] for event in events(run, *kinds)]


def in_world(request, world):
    """The same at the virtual bench of this world."""
    return replace(request, wiring=lambda: virtual_wiring(world, request.config.limits, request.named))


def of_scene(out, scene, settings=None):
    """A spin-down of a top that only spins."""
    config = with_settings(Configuration(), "spin", settings or SpinSettings(hold_s=0))
    request = AcquisitionRequest("spin", config, wiring=NotImplemented, out=out, synthetic_how="a test")
    return in_world(request, SpinWorld(scene, VirtualClock()))

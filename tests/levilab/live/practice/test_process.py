"""The bench for practice in one process, on a clock that does not wait: what a student sees in two minutes."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from instruments.clock import PacedClock
from levilab.interruption import End
from levilab.live.practice.commands import (
    Command,
    MatchDrive,
    PlaceProbe,
    PutBack,
    RecordRun,
    StopRun,
    SwitchDrive,
    TuneDrive,
    to_bytes,
)
from levilab.live.practice.process import PracticeOptions, PracticeProcess
from levilab.runs.run import Run
from levilab.simulator.scene import read_scene
from levilab.telemetry.publisher import Publisher
from levilab.world.bench import scene_world

if TYPE_CHECKING:
    from levilab.telemetry.messages import State


@dataclass
class Script:
    """The far end of the pipe: sends each command at its bench time [s]; None closes it."""

    clock: PacedClock
    commands: list[tuple[float, Command | None]]
    events: list[dict[str, Any]] = field(default_factory=list)
    states: list[State] = field(default_factory=list)
    process: PracticeProcess | None = None
    sent: int = 0

    def poll(self) -> bool:
        if self.process:
            self.states.append(self.process.state())
        return self.clock.now() >= self.commands[0][0]

    def recv_bytes(self) -> bytes:
        command = self.commands[0][1]
        if command is None:
            raise EOFError
        del self.commands[0]
        self.sent += 1
        return to_bytes(self.sent, command)

    def send_bytes(self, data: bytes) -> None:
        self.events.append(json.loads(data))

    def said(self, kind: str) -> list[str]:
        return [event["text"] for event in self.events if event["kind"] == kind]

    def spins(self, start: float, stop: float) -> list[tuple[float, float, float]]:
        """Time [s], frequency of the drive [Hz], 0 while it is off, and the spin that was counted last [Hz]."""
        found = [state for state in self.states if start <= state.time_s < stop]
        return [
            (
                state.time_s,
                state.drive.frequency_hz if state.drive and state.drive.output else 0.0,
                state.last.get("spin_frequency_hz", math.nan),
            )
            for state in found
        ]


def carry_out(out: Path, *commands: tuple[float, Command | None], start_hz: float = 30.0) -> Script:
    """Carry out a script at a bench that does not wait."""
    scene = read_scene("practice").changed({"start.spin_hz": start_hz})
    clock = PacedClock(math.inf)
    script = Script(clock, [*commands])
    world = scene_world(scene, lambda: clock, lambda _: None)
    options = PracticeOptions(str(out), "practice", 1)
    with Publisher() as publisher:
        script.process = PracticeProcess(options, scene, world, script, publisher=publisher, end=End())  # type: ignore[arg-type]
        script.process.run()
    return script


QUICK = ("spin.drive_frequency_hz=31", "spin.hold_s=2", "spin.interval_s=2", "spin.gate_s=0.5")


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Script:
    """Match, lock, raise, lose, record and stop, record and leave."""
    return carry_out(
        tmp_path_factory.mktemp("runs"),
        (2.0, MatchDrive()),
        (2.1, SwitchDrive(on=True)),
        (2.2, TuneDrive(frequency_hz=33.0, ramp_hz_per_s=0.1)),
        (3.0, TuneDrive(frequency_hz=333.0)),
        (3.0, TuneDrive(amplitude_vpp=11.0)),
        (3.0, StopRun()),
        (40.0, TuneDrive(amplitude_vpp=0.5)),
        (55.0, SwitchDrive(on=False)),
        (58.0, PutBack()),
        (58.0, PlaceProbe(height_m=0.05)),
        (62.0, RecordRun(experiment="dance")),
        (62.0, RecordRun(experiment="spin", settings=("spin.gate_s=-1",))),
        (62.0, RecordRun(experiment="spin", settings=QUICK, note="<b>first</b>")),
        (63.0, SwitchDrive(on=True)),
        (63.0, RecordRun(experiment="field")),
        (125.0, StopRun()),
        (135.0, RecordRun(experiment="field")),
        (140.0, None),
    )


def test_a_top_that_is_locked_rises_with_its_drive(session: Script) -> None:
    course = session.spins(8.0, 40.0)
    assert max(drive for _, drive, _ in course) == 33.0
    # half a hertz is what a drive of 0.4 mT can hold at most; the count is of up to a second ago, 0.1 Hz
    assert max(abs(spin - drive) for _, drive, spin in course) < 0.6


def test_the_drive_takes_hold_with_a_light_pulse_and_says_so(session: Script) -> None:
    said = session.said("message")
    assert said[0].startswith("drive on at the top's spin, 29.")
    assert said[1].startswith("the top follows the drive at ")


def test_a_drive_that_does_not_hold_the_top_is_tried_with_the_top_turned_otherwise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("levilab.live.practice.process.TURNS_LATER", (0.5, 0.75, 0.0, 0.25))  # the best ones last
    script = carry_out(tmp_path, (2.0, MatchDrive()), (2.1, SwitchDrive(on=True)), (50.0, None))
    said = [text.partition(",")[0] for text in script.said("message")]
    assert said[-1].startswith("the top follows the drive")
    assert said[:3] == ["drive on at the top's spin", "the drive does not hold the top", "drive on at the top's spin"]
    last = script.spins(45.0, 50.0)[-1]
    assert last[2] == pytest.approx(last[1], abs=0.5)


def test_a_drive_far_from_the_spin_says_why_it_holds_nothing(tmp_path: Path) -> None:
    script = carry_out(tmp_path, (2.0, TuneDrive(frequency_hz=40.0)), (2.1, SwitchDrive(on=True)), (3.0, None))
    (text,) = script.said("message")
    assert text.startswith("drive on at 40 Hz, but the top spins at 29.")


def test_a_drive_that_is_too_weak_for_the_air_loses_the_top(session: Script) -> None:
    course = session.spins(52.0, 55.0)
    assert {drive for _, drive, _ in course} == {33.0}
    assert all(31.0 < spin < 32.4 for _, _, spin in course)  # 0.11 Hz/s since 40 s


def test_a_top_falls_near_the_edge_and_is_put_back(tmp_path: Path) -> None:
    script = carry_out(tmp_path, (33.0, PutBack()), (39.0, None), start_hz=25.0)
    counted = [spin for _, _, spin in script.spins(0.0, 33.0) if spin > 0]
    # the light of a top that leans passes the counter's lens by; it leaves its place at 22.3 Hz
    assert 22.3 < counted[-1] < 24.5
    assert math.isnan(script.spins(30.0, 33.0)[-1][2])
    assert script.said("done") == ["the top floats again"]
    assert script.spins(36.0, 39.0)[-1][2] == pytest.approx(25.0, abs=0.5)


def test_what_the_bench_cannot_do_is_refused_with_what_to_do(session: Script) -> None:
    assert [text[:60] for text in session.said("refused")] == [
        "333 Hz: the coil of this bench stands at most 100 Hz",
        "11 Vpp: the coil of this bench stands at most 10 Vpp",
        "no run is being recorded: nothing to stop",
        "the top floats: it can be put back once it has fallen",
        "experiment = dance: one of spin, trace, field, limit, precession is expected"[:60],
        "settings = spin.gate_s=-1: a number above 0 [s] is expected;",
        "a run is being recorded, and the bench is its own: stop the ",
        "a run is being recorded, and the bench is its own: stop the ",
    ]


def test_each_command_has_one_answer(session: Script) -> None:
    answers = [event["number"] for event in session.events if event["kind"] in {"done", "refused"}]
    assert sorted(answers) == list(range(1, session.sent + 1))


def test_the_probe_is_where_it_was_put(session: Script) -> None:
    before, after = ([s for s in session.states if a < s.time_s < b][-1] for a, b in ((50, 57), (59, 62)))
    assert (before.probe_m, after.probe_m) == (0.072, 0.05)
    assert abs(after.last["flux_density_t"]) > abs(before.last["flux_density_t"]) * 1.2


def test_a_run_that_is_stopped_is_kept_and_the_bench_goes_on(session: Script) -> None:
    first, second = (event for event in session.events if event["kind"] == "recorded")
    run = Run.load(Path(first["folder"]))
    assert (run.status, run.record.synthetic, run.record.note) == ("interrupted", True, "<b>first</b>")
    assert run.count() > 3
    assert run.record.configuration["scene"]["name"] == "practice"
    assert run.record.instruments["generator"]["settings_end"]["output"] is False
    assert [event["text"] for event in run.events()][-1] == "interrupted by the stop button, outputs are off"
    assert session.spins(131.0, 135.0)[-1][2] > 20
    # the program that held the bench ended in the middle of the second one
    assert (second["status"], Run.load(Path(second["folder"])).status) == ("interrupted", "interrupted")


def test_the_outputs_are_off_at_the_end(session: Script) -> None:
    process = session.process
    assert process
    field_ = process.world.coil_field(process.clock.now(), 1e-3, 100)
    assert not field_.any()

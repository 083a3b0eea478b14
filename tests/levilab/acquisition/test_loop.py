"""The acquisition: from the virtual bench into a run folder, and every way out of it."""

import dataclasses
import itertools
import json
import signal
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

from analysis.spindown.fall import FALLS_BETWEEN_HZ
from instruments.clock import VirtualClock
from instruments.drivers.counter.keysight_53230a import Keysight53230A
from instruments.drivers.generator.keysight_33500b import Keysight33500B
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from levilab.acquisition.counting import is_plausible
from levilab.acquisition.experiments.spin import SpinSettings, time_left
from levilab.acquisition.loop import AcquisitionRequest, acquire
from levilab.acquisition.session import ExperimentFailed
from levilab.acquisition.table import Configuration
from levilab.bench.bench import OutputMayBeOn
from levilab.bench.wiring import Wiring
from levilab.computer import Computer, at_another_computer
from levilab.files import CannotWrite
from levilab.pipelines.spindown.document import SPINDOWN
from levilab.runs.run import Run
from levilab.runs.writer import RunWriter
from levilab.simulator import preset
from levilab.simulator.laws import LAWS
from levilab.simulator.spin import DECAYS
from levilab.world.bench import VIRTUAL, virtual_bus
from levilab.world.spin_world import Phase, SpinScene, SpinWorld, random_scene
from support.acquisitions import BEFORE, Impatient, Meanwhile, Silent, asked, cut, events, in_world, mock, of_scene


def watch_outputs(patch):
    """What the generator's output is set to from now on, in order."""
    seen = []
    on_change = Virtual33500B.on_change

    def watched(self, name):
        if name == "1:output":
            seen.append(bool(self.settings["1:output"]))
        on_change(self, name)

    patch.setattr(Virtual33500B, "on_change", watched)
    return seen


@pytest.fixture
def outputs(monkeypatch):
    """What the generator's output was set to, in order."""
    return watch_outputs(monkeypatch)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A run that nothing disturbs, what was shown of it, and what the generator's output was set to."""
    show = Silent()
    with pytest.MonkeyPatch.context() as patch:
        outputs = watch_outputs(patch)
        run = acquire(mock(tmp_path_factory.mktemp("usual"), note="first try", wire_log=True), show)
    return SimpleNamespace(run=run, show=show, outputs=outputs)


@pytest.fixture
def usual(whole):
    return whole.run


def test_a_spin_down_is_read_every_ten_seconds_until_the_top_falls(whole):
    run = whole.run
    frame = run.readings().frame
    assert run.status == "finished"
    assert 13 <= len(frame) <= 18  # about 145 s; the fall scatters by 0.25 Hz, which is 3 s, the drag by 2 %, 3 s
    assert np.allclose(np.diff(frame["time_s"]), 10, atol=0.06)  # the gate waits for an edge, 1/22 s at the most
    assert frame["spin_frequency_hz"].iloc[0] == pytest.approx(35, abs=0.2)  # 0.5 s after the drive, 0.1 Hz/s
    assert 21 < frame["spin_frequency_hz"].iloc[-1] < 24
    assert (frame["spin_frequency_u_hz"] == 0.03).all()
    assert whole.outputs[-1] is False
    assert [event["kind"] for event in run.events()] == ["drive on", "locked", "drive off", "asked again", "fell"]


@pytest.fixture(scope="module")
def ten_runs(tmp_path_factory):
    """Worlds with the readings that were taken in each, seeds 0 to 9."""
    out, found = tmp_path_factory.mktemp("ten"), []
    for seed in range(10):
        world = SpinWorld(random_scene(seed), VirtualClock())
        found.append((world, acquire(in_world(mock(out, seed), world), Silent()).readings().frame))
    return found


def test_the_readings_follow_the_law_of_the_world_within_their_uncertainty(ten_runs):
    """χ² over ten runs about the true curve: only the gate's finite length (2e-5 Hz) and the start come between."""
    chi_square, n = 0.0, 0
    for world, frame in ten_runs:
        c = world.scene.constants[0]
        # free of the start: ν^(−1/2) of the law is a straight line of known slope
        y, t = frame["spin_frequency_hz"].to_numpy() ** -0.5, frame["time_s"].to_numpy()
        slope = c * np.sqrt(2 * np.pi) / 2
        u = 0.5 * frame["spin_frequency_hz"].to_numpy() ** -1.5 * 0.03
        offset = np.average(y - slope * t, weights=u**-2)
        chi_square += float(np.sum(((y - slope * t - offset) / u) ** 2))
        n += len(y) - 1
    assert chi_square / n == pytest.approx(1, abs=3 * np.sqrt(2 / n))  # 3 standard deviations of χ²/n: 0.3


def test_what_was_done_stands_in_run_json(usual):
    record = json.loads((usual.folder / "run.json").read_text(encoding="utf-8"))
    assert record["schema"] == "levilab-run/1"
    assert record["synthetic"] is True
    assert "no real top" in record["synthetic_how"]
    assert (record["seed"], record["note"]) == (1, "first try")
    assert record["instruments"]["counter"]["identity"].startswith("Keysight Technologies,53230A")
    assert record["instruments"]["generator"]["settings_end"]["output"] is False
    assert record["instruments"]["counter"]["settings_end"]["gate_s"] == 1.0
    assert [channel["unit"] for channel in record["channels"]] == ["s", "Hz", "Hz"]
    assert record["software"]["levilab"]


def test_the_same_seed_gives_the_same_readings_and_another_one_others(usual, tmp_path):
    runs = [usual, *(acquire(mock(tmp_path, seed), Silent()) for seed in (1, 6))]
    first, again, other = ((run.folder / "readings.csv").read_bytes() for run in runs)
    assert first == again != other


def test_the_wire_log_holds_every_byte(usual):
    log = (usual.folder / "wire.log").read_text(encoding="utf-8")
    assert log.count("> b'READ?\\n'") == len(usual.readings().frame) + BEFORE + 2  # and two at the fall
    assert "> b'OUTP1 OFF\\n'" in log


def test_a_top_that_is_not_there_is_an_error_that_says_what_to_look_at(tmp_path, outputs):
    with pytest.raises(ExperimentFailed, match="trigger level"):
        acquire(of_scene(tmp_path, SpinScene(start_hz=5.0)), Silent())
    (run,) = [Run.load(path) for path in tmp_path.iterdir()]
    assert run.status == "failed"
    assert not outputs or outputs[-1] is False


def test_a_top_that_does_not_follow_the_drive_is_an_error(tmp_path, outputs):
    weak = SpinSettings(drive_amplitude_vpp=0.5)
    with pytest.raises(ExperimentFailed, match=r"did not follow .*: ramp slower \(.* or drive harder"):
        acquire(of_scene(tmp_path, SpinScene(), weak), Silent())
    (run,) = [Run.load(path) for path in tmp_path.iterdir()]
    # once more and once more, until the top has fallen meanwhile
    assert [event["kind"] for event in run.events()][:5] == [*2 * ["drive on", "not held"], "drive on"]
    assert True in outputs
    assert outputs[-1] is False


@pytest.mark.parametrize("frequency", [5.0, 100.0])
def test_a_drive_beyond_the_window_is_answered_with_the_window(tmp_path, frequency):
    """No ramp and no amplitude brings a top to where it does not float."""
    given = SpinSettings(drive_frequency_hz=frequency, ramp_hz_per_s=0.5)
    with pytest.raises(ExperimentFailed, match=r"floats only between 21\.65 and 80\.60 Hz: ask for") as failed:
        acquire(of_scene(tmp_path, SpinScene(), given), Silent())
    assert "ramp slower" not in str(failed.value)


def test_a_top_that_keeps_its_spin_is_noticed_once_while_it_is_read(tmp_path, usual):
    """After a minute, in which air takes a sixth of the spin; a top that spins down is not noticed."""
    scene = SpinScene(fall_hz=1.0, constants=(1e-6,))
    run = acquire(of_scene(tmp_path, scene, SpinSettings(longest_s=150.0)), Silent())
    assert (run.status, run.count()) == ("finished", 16)
    (seen,) = events(run, "does not fall")
    assert seen["time_s"] == pytest.approx(66.0, abs=6.0)  # at the first reading after
    assert seen["text"].startswith("the spin does not fall: 4")
    assert seen["text"].endswith("is the drive still on, or does something else drive the top?")
    assert "does not fall" not in {event["kind"] for event in usual.events()}


def test_a_scene_without_drag_is_named_as_the_reason(tmp_path):
    settings = ("hold_s=0", "drive_frequency_hz=31", "longest_s=80")
    run = acquire(asked("spin", out=tmp_path, seed=1, scene="driven", settings=settings), Silent())
    (seen,) = events(run, "does not fall")
    assert "the scene has no drag (drag.law); take one with drag" in seen["text"]


@pytest.mark.parametrize(("number", "by"), [(signal.SIGINT, "Ctrl-C"), (signal.SIGTERM, "SIGTERM")])
def test_a_signal_ends_the_run_with_outputs_off_and_all_readings(tmp_path, outputs, number, by):
    show = Impatient(5, number)
    run = acquire(mock(tmp_path), show)
    assert run.status == "interrupted"
    assert len(run.readings().frame) == 5
    assert outputs[-1] is False
    assert run.events()[-1]["text"] == f"interrupted by {by}, outputs are off"
    assert show.after_close == [run.events()[-1]["text"]], "not above a bench whose drive was on"


def test_ctrl_c_twice_breaks_through_an_exchange_and_outputs_go_off(tmp_path, outputs, monkeypatch):
    count = itertools.count()

    def hangs(self):
        if next(count) == 4:
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
            pytest.fail("the second signal did not break through")
        return read(self)

    read = Keysight53230A.frequency
    monkeypatch.setattr(Keysight53230A, "frequency", hangs)
    run = acquire(mock(tmp_path), Silent())
    assert run.status == "interrupted"
    assert outputs[-1] is False


@pytest.mark.parametrize("when", [0, 1, 2, 20, 28, 29, BEFORE - 1, BEFORE, BEFORE + 1, BEFORE + 12])
def test_an_exception_at_any_moment_leaves_outputs_off_and_the_readings_so_far(tmp_path, outputs, monkeypatch, when):
    count = itertools.count()

    def fails(self):
        if next(count) == when:
            raise ExperimentFailed("no more of `it`")
        return read(self)

    read = Keysight53230A.frequency
    monkeypatch.setattr(Keysight53230A, "frequency", fails)
    with pytest.raises(ExperimentFailed):
        acquire(mock(tmp_path), Silent())
    (run,) = [Run.load(path) for path in tmp_path.iterdir()]
    assert run.status == "failed"
    assert len(run.readings().frame) == max(0, when - BEFORE)
    assert not outputs or outputs[-1] is False
    assert "no more of it" in run.events()[-1]["text"]


def counting(monkeypatch, wrong):
    """Let the counter miscount: `wrong` gets the number of the count, the first reading is BEFORE, and its value."""
    count = itertools.count()
    read = Keysight53230A.frequency
    monkeypatch.setattr(Keysight53230A, "frequency", lambda self: wrong(next(count), read(self)))


def test_a_fallen_top_that_rattles_is_not_taken_for_a_spinning_one(tmp_path, monkeypatch):
    rattle = itertools.cycle([180.0, 3.0, 95.0])
    counting(monkeypatch, lambda _, spin: spin or next(rattle))
    run = acquire(mock(tmp_path), Silent())
    assert run.readings().frame["spin_frequency_hz"].between(20, 41).all()
    assert run.events()[-1]["kind"] == "fell"
    assert "3 times in a row" in run.events()[-1]["text"]
    assert {180.0, 3.0, 95.0} <= {event.get("spin_frequency_hz") for event in run.events()}


@pytest.mark.parametrize(("reading", "factor"), [(1, 2.0), (5, 2.0), (5, 0.45), (5, 1.3), (12, 1.1)])
def test_a_miscount_that_cannot_be_is_asked_again_and_not_kept(usual, tmp_path, monkeypatch, reading, factor):
    whole = usual.readings().frame
    counting(monkeypatch, lambda k, spin: spin * factor if spin and k == BEFORE + reading else spin)
    run = acquire(mock(tmp_path), Silent())
    frame = run.readings().frame
    assert run.status == "finished"
    asked_again = events(run, "asked again")
    assert len(asked_again) == 2  # at the miscount, and at the fall
    assert asked_again[0]["spin_frequency_hz"] == pytest.approx(
        factor * whole["spin_frequency_hz"].iloc[reading], rel=1e-12
    )
    assert len(frame) == len(whole)
    # a second later than it would have been, 0.1 Hz lower
    assert np.allclose(frame["spin_frequency_hz"], whole["spin_frequency_hz"], rtol=0, atol=0.3)


@pytest.mark.parametrize(
    ("gap_s", "share", "plausible"),
    [(1.0, 1.048, True), (1.0, 1.05, False), (600.0, 0.58, False), (10.0, 0.467, True), (10.0, 0.466, False)],
)
def test_a_free_top_keeps_its_spin_within_what_air_takes(gap_s, share, plausible):
    """At most 5 % more, less 0.1 %/s (1.049 after 1 s, 0.576 after 600 s); at least 0.4665 after 10 s."""
    last = {"time_s": 50.0, "spin_frequency_hz": 30.0}
    reading = {"time_s": 50.0 + gap_s, "spin_frequency_hz": 30.0 * share}
    assert is_plausible(last, reading) is plausible


@pytest.mark.parametrize("moment", range(3))
def test_a_signal_while_connecting_never_lets_the_drive_on(tmp_path, outputs, monkeypatch, moment):
    asked = itertools.count()
    driver = Keysight53230A if moment % 2 else Keysight33500B
    identity = driver.identity

    def interrupted(self):
        if next(asked) == moment // 2:
            signal.raise_signal(signal.SIGINT)
        return identity(self)

    def and_again(self, status):  # an impatient person's do not tear what is kept
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        finish(self, status)

    finish = RunWriter.finish
    monkeypatch.setattr(RunWriter, "finish", and_again)
    monkeypatch.setattr(driver, "identity", interrupted)
    run = acquire(mock(tmp_path), Silent())
    assert run.status == "interrupted"
    assert True not in outputs


def test_the_time_of_a_reading_is_the_middle_of_its_gate(ten_runs):
    """At 0.1 Hz/s a time stamp that is half a gate off would be 0.05 Hz off, which the mean of ten runs shows."""
    off = []
    for world, frame in ten_runs:
        released = [stretch for stretch in world._stretches if stretch.phase is Phase.COASTING][-1].start
        spin, _ = world.motion(released + frame["time_s"].to_numpy()[:8])
        off += list(frame["spin_frequency_hz"].to_numpy()[:8] - spin / (2 * np.pi))
    # 80 readings of 0.03 Hz: 0.0034 Hz; 5 ms between the drive's end and time zero: 0.0005 Hz; the reciprocal
    # counter's own bias near whole numbers of periods: a few mHz
    assert abs(np.mean(off)) < 0.012


def test_errors_that_an_earlier_program_left_are_not_ours(tmp_path, monkeypatch):
    init = Virtual33500B.__init__

    def soiled(self, *args, **named):
        init(self, *args, **named)
        self.execute("NONSENSE")

    monkeypatch.setattr(Virtual33500B, "__init__", soiled)
    assert acquire(mock(tmp_path), Silent()).status == "finished"


def test_a_full_disk_in_the_middle_leaves_outputs_off_and_the_shown_readings(tmp_path, outputs, monkeypatch):
    def full(_):
        raise OSError(28, "No space left on device")

    show = Meanwhile(7, lambda: monkeypatch.setattr("levilab.runs.writer.os.fsync", full))
    with pytest.raises(CannotWrite, match=r"write the reading .*No space left"):
        acquire(mock(tmp_path), show)
    (run,) = [Run.load(path) for path in tmp_path.iterdir()]
    assert run.status == "interrupted"
    assert outputs[-1] is False
    shown = [float(text.split()[0]) for text in show.readings]
    assert [round(t, 2) for t in run.readings().frame["time_s"]][:7] == shown


def test_an_interrupted_run_is_resumed_where_it_was_left(usual, tmp_path):
    half = acquire(mock(tmp_path), Impatient(8))
    run = acquire(mock(tmp_path, None, resume=half.folder, note="second half"), Silent())
    whole, frame = usual.readings().frame, run.readings().frame
    assert run.folder == half.folder
    assert run.status == "finished"
    assert len(frame) == len(whole)
    # gates open a little earlier or later, at 0.1 Hz/s, and each sees noise of its own
    assert np.allclose(frame["spin_frequency_hz"], whole["spin_frequency_hz"], atol=0.2)


def readings_of(law, constants, times, noise=0.0):
    """Readings of a top that slows down from 40 Hz."""
    spin = DECAYS[law].after(80 * np.pi, times, *constants) / (2 * np.pi) + noise
    return [{"time_s": time, "spin_frequency_hz": hz} for time, hz in zip(times.tolist(), spin.tolist(), strict=True)]


@pytest.mark.parametrize("law", LAWS)
def test_a_top_falls_within_the_time_left_under_every_law_of_drag(law):
    """Constants differ by 20 %, readings scatter by 0.03 Hz; the range is of about two standard uncertainties."""
    held = []
    for seed in range(20):
        random = np.random.default_rng(seed)
        constants = tuple(c * random.uniform(0.8, 1.2) for c in LAWS[law].usual)
        fell = float(DECAYS[law].elapsed(80 * np.pi, 2 * np.pi * random.uniform(21.4, 24.9), *constants))
        times = np.arange(0.5, fell, 10.0)
        rows = readings_of(law, constants, times, 0.03 * random.standard_normal(times.size))
        for part in (0.25, 0.5, 0.75):
            k = int(part * times.size)
            least, most = time_left(rows[0], rows[k // 2], rows[k], 1800.0)
            held.append(times[k] + least <= fell <= times[k] + most)
            assert most - least < (0.9 if part == 0.25 else 0.55) * fell
    assert np.mean(held) > 0.95


@pytest.mark.parametrize(("law", "off"), [("stokes", 0.003), ("disc", 0.003), ("newton", 0.003), ("mixed", 0.02)])
def test_the_time_left_of_exact_readings_is_that_of_their_law(law, off):
    """From 40 to about 32 Hz: the power is interpolated, and that of the mixed law falls with the spin."""
    constants = LAWS[law].usual
    first, middle, last = (
        {**row, "spin_frequency_u_hz": 1e-6} for row in readings_of(law, constants, np.array([0.0, 30.0, 60.0]))
    )
    spin = 2 * np.pi * last["spin_frequency_hz"]
    expected = [DECAYS[law].elapsed(spin, 2 * np.pi * hz, *constants) for hz in FALLS_BETWEEN_HZ]
    assert time_left(first, middle, last, 1800.0) == pytest.approx(expected, rel=off)
    assert time_left(first, middle, last, 80.0) == (20.0, 20.0)


@pytest.mark.parametrize("u", [1e-9, 0.5, 1e6])
def test_any_uncertainty_of_readings_leaves_a_time_left(u):
    rows = [{**row, "spin_frequency_u_hz": u} for row in readings_of("disc", (2.34e-4,), np.arange(0.0, 150.0, 10.0))]
    for k, row in enumerate(rows):
        least, most = time_left(rows[0], rows[k // 2], row, 1800.0)
        assert 0.0 <= least <= most <= 1800.0
    backwards = rows[5] | {"time_s": rows[0]["time_s"]}
    assert time_left(rows[0], rows[2], backwards, 1800.0)[1] > 0.0  # a clock that went back is an error of its own


def test_the_practice_benchs_top_falls_within_the_time_left_that_is_shown(tmp_path):
    """A tilted moment brings it down at 23.3 Hz, long before the published tops' 21.86 Hz."""

    class Watching(Silent):
        def reading(self, text, elapsed, remaining):
            super().reading(text, elapsed, remaining)
            between.append((elapsed + remaining[0], elapsed + remaining[1]))

    between = []
    settings = ("spin.hold_s=0", "spin.drive_frequency_hz=32")
    run = acquire(asked("spin", out=tmp_path, seed=3, scene="practice", settings=settings), Watching())
    (fell,) = [event["time_s"] for event in events(run, "fell")]
    for earliest, latest in between[len(between) // 2 :]:
        assert earliest < fell < latest
        assert latest - earliest > 30.0


def test_what_a_resumed_virtual_run_goes_through_again_is_not_shown(tmp_path):
    class Bar(Silent):
        def preparing(self, text, fraction):
            self.messages.append(text)

    half, first = acquire(mock(tmp_path, 3), show := Bar()), Bar()
    assert any("drive at" in text for text in show.messages)
    acquire(mock(tmp_path, None, resume=cut(half, tmp_path / "half", half.count())), first)
    assert not any("drive" in text for text in first.messages)


def test_a_wire_log_that_cannot_be_written_does_not_keep_the_output_on(tmp_path, outputs, monkeypatch):
    append = RunWriter._append

    def full(self, name, line, *, sync=True):
        if name == "wire.log" and "OUTP1 ON" in line:
            raise OSError(28, "No space left on device")
        append(self, name, line, sync=sync)

    monkeypatch.setattr(RunWriter, "_append", full)
    run = acquire(mock(tmp_path, wire_log=True), Silent())
    assert run.status == "finished"
    assert outputs[-1] is False
    assert (run.record.model_extra or {})["wire_log_ended"] == "No space left on device"


def test_a_real_run_is_gone_on_with_by_the_time_on_the_wall(tmp_path):
    """As without a world: instruments from the configuration, and a top that has gone on since its time zero."""
    clock = VirtualClock()
    library = library_for(virtual_bus(SpinWorld(SpinScene(), clock)))
    config = Configuration(**VIRTUAL)
    request = AcquisitionRequest(
        "spin", config, lambda: Wiring(config.instruments(), config.limits, library, clock), out=tmp_path
    )
    half = acquire(request, Impatient(4))
    assert half.record.synthetic  # the instruments say so themselves
    zero = datetime(2026, 7, 1, 12, tzinfo=UTC)

    class Later(Computer):
        def utc(self):
            return zero + timedelta(seconds=72.5)

    left = dataclasses.replace(half, record=half.record.model_copy(update={"time_zero_utc": zero.isoformat()}))
    with at_another_computer(Later()):
        run = acquire(dataclasses.replace(request, resume=left), Silent())
    times = run.readings().frame["time_s"].to_numpy()
    assert len(times) > 6
    assert 80 <= times[4] < 81  # the next whole ten seconds, and half a gate
    assert (np.diff(times) > 0).all()


# --- a top in full motion ---


def test_a_spin_down_in_full_motion_has_the_drag_of_its_scene(tmp_path):
    run = acquire(mock(tmp_path, 5, scene="spindown"), Silent())
    assert [event["kind"] for event in run.events()][-4:] == ["locked", "drive off", "asked again", "fell"]
    spins = run.readings().frame["spin_frequency_hz"]
    assert spins.iloc[0] == pytest.approx(40, abs=0.6)  # it swings about the drive
    assert 22.5 < spins.iloc[-1] < 26
    assert run.record.configuration["scene"] == preset("spindown").as_table()
    assert "full motion" in str(run.record.synthetic_how)
    found = SPINDOWN.analyze([run.folder]).runs[0]
    release = found.model.release
    assert release.spin_hz == pytest.approx(30, abs=1)
    assert 200 < release.driven_s < 300  # 10 Hz at 0.05 Hz/s, 20 s of holding, and as long to take hold
    disc = found.fit("disc").parameters["c32"]
    # 0.3 % of its own uncertainty, and what nutation from the drive leaves (docs/decisions/0011)
    assert disc.value == pytest.approx(2.34e-4, rel=0.009)


def test_a_run_in_full_motion_is_repeated_by_its_seed_and_resumed_in_its_scene(tmp_path):
    settings = ("spin.hold_s=0", "spin.drive_frequency_hz=31", "spin.interval_s=2")
    first = acquire(asked("spin", out=tmp_path, seed=5, scene="spindown", settings=settings), Impatient(6))
    run = acquire(mock(tmp_path, None, resume=cut(first, tmp_path / "half", 3)), Impatient(3))
    spins = run.readings().frame["spin_frequency_hz"]
    assert len(spins) == 6
    assert np.allclose(spins, first.readings().frame["spin_frequency_hz"], rtol=0, atol=0.02)
    assert run.record.configuration["scene"]["name"] == "spindown"


@pytest.mark.parametrize("error", [OutputMayBeOn("COM1", OSError("gone")), ConnectionError("gone")])
def test_a_drive_that_may_be_on_is_said_once(monkeypatch, error):
    """Either by the error, or by a message where the error is another one."""
    said = [str(error)]
    monkeypatch.setattr("levilab.acquisition.loop._acquire", Mock(side_effect=error))
    monkeypatch.setattr(Silent, "message", lambda _, text: said.append(str(text)), raising=False)
    request = dataclasses.replace(asked("spin"), synthetic_how=None)
    with pytest.raises(type(error)):
        acquire(request, Silent())
    assert " ".join(said).count("MAY STILL BE ON") == 1

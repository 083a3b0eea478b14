"""The limits on the virtual bench: against the falls that its world draws, and every way out."""

import json
import math

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.generator.keysight_33500b import Keysight33500B
from instruments.errors import NoAnswer
from instruments.virtual.generator.channel import Output, Triggered
from levilab.acquisition.counting import FreeTop
from levilab.acquisition.driving import held_spin
from levilab.acquisition.experiments.limit import LimitSettings, _limit_of_loss, _rises
from levilab.acquisition.loop import AcquisitionRequest, acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.acquisition.session import DidNotFollow, ExperimentFailed, NotHeld
from levilab.acquisition.table import Configuration, settings_of, with_settings
from levilab.acquisition.triggering import CYCLE
from levilab.bench.config import ConfigError
from levilab.errors import UsageError
from levilab.pipelines.limit.document import LIMIT
from levilab.pipelines.spindown.document import SPINDOWN
from levilab.simulator.scene import preset
from levilab.world.bursts import mean_pull
from levilab.world.motion_world import MotionWorld
from levilab.world.spin_world import SpinScene, SpinWorld, random_scene
from support.acquisitions import Impatient, Meanwhile, Silent, asked, events, in_world, kinds, texts

#: From 30 Hz down to where a top falls within a minute, not held for long.
QUICK = ("limit.drive_frequency_hz=24", "limit.ramp_hz_per_s=0.3", "limit.hold_s=1")
#: A drive of 0.2 mT.
WEAK = ("limit.which=upper", "limit.drive_amplitude_vpp=5", "limit.hold_s=1", "limit.creep_hz_per_s=0.05")


def mock(out, *settings, seed=1, **changes):
    return asked("limit", out=out, seed=seed, settings=settings, **changes)


def causes(run):
    return [event["cause"] for event in run.events() if "cause" in event]


@pytest.mark.parametrize(("counter", "seed"), [(None, 1), ("34461A", 4)])  # a multimeter begins to count a second late
def test_the_lower_limits_are_those_of_the_world_within_their_uncertainty(tmp_path, counter, seed):
    run = acquire(mock(tmp_path, *QUICK, "limit.repetitions=5", counter=counter, seed=seed), Silent())
    frame, scene = run.readings().frame, random_scene(seed)
    truth = np.array([scene.fall_of(number) for number in range(5)])
    pulls = (frame["spin_frequency_hz"] - truth) / frame["spin_frequency_u_hz"]
    assert abs(pulls.mean()) < 1.34  # 3 standard errors of five
    assert pulls.std() == pytest.approx(1, abs=0.95)  # 3 of a standard deviation
    assert np.corrcoef(frame["spin_frequency_hz"], truth)[0, 1] > 0.85
    assert frame["spin_frequency_u_hz"].between(0.02, 0.1).all()
    assert (frame["spin_seen_hz"] > frame["spin_frequency_hz"] - 0.3).all()
    assert [kinds(run).count(one) for one in ("asked the person", "fell")] == [4, 5]  # the first one floats already
    said = [text.endswith("Hz, below the line by its scatter") for text in texts(run, "fell")]
    assert said == (frame["spin_seen_hz"] < frame["spin_frequency_hz"]).tolist()  # no contradiction
    assert run.record.instruments["generator"]["settings_end"]["output"] is False


def test_the_upper_limit_is_where_drag_takes_all_that_the_drive_can_give(tmp_path):
    """In the idealised world the drive gives α, the disc takes C ω^1.5, the creep the rest."""
    run = acquire(mock(tmp_path, *WEAK, "limit.repetitions=1"), Silent())
    (limit,) = run.readings().frame["spin_frequency_hz"]
    most, c = 0.03 * 0.714 / 2 / 1.731314e-6 * 2e-4, random_scene(1).constants[0]
    ends = [((most - left) / c) ** (2 / 3) / 2 / math.pi for left in (2 * math.pi * 0.05, 0.0)]
    # lost is a top that is 1 Hz beside: at 0.05 Hz/s, of which most is made up for, that takes less than 2 Hz of creep
    assert ends[0] - 0.5 < limit < ends[1]
    held, lost = [*run.events()][-2:]
    assert (held["kind"], lost["kind"]) == ("held", "lock lost")
    assert held["time_s"] < lost["time_s"] - 5.0 / 0.05  # from 5 Hz below the limit, on a creep of 0.05 Hz/s
    assert (causes(run), "warning" in kinds(run)) == (["left behind by the drive"], False)


class Slipping(SpinWorld):
    """The drive loses the top when it is set above 36 Hz."""

    def _plan_future(self, now):
        if self._drive_spin > 2 * math.pi * 36:
            self._hold = 0.0
        super()._plan_future(now)


#: An upper limit, soon: from 34 Hz at 0.1 Hz/s.
SLIPS = ("limit.which=upper", "limit.drive_frequency_hz=34", "limit.hold_s=0", "limit.repetitions=1")


def test_a_top_that_slips_before_it_is_missed_has_its_limit_within_u(tmp_path):
    """It is 1 Hz behind only some seconds after it was lost, while the drive goes on creeping."""
    run = acquire(in_world(mock(tmp_path, *SLIPS), Slipping(SpinScene(), VirtualClock())), Silent())
    (limit,), (u,) = (run.readings().frame[name] for name in ("spin_frequency_hz", "spin_frequency_u_hz"))
    assert "lock lost" in kinds(run)
    assert abs(limit - 36) < 2 * u  # an even distribution ends at 1.7 u
    assert u < 0.5


@pytest.mark.parametrize(("slips_hz", "most_u_hz"), [(0.0, 0.025), (0.9, 0.35)])
def test_counts_that_scatter_move_no_upper_limit(slips_hz, most_u_hz):
    """A count over half a second scatters by 0.08 Hz, where a step of the drive is 0.05 Hz."""
    random, off, u = np.random.default_rng(5), [], []
    for _ in range(1000):
        held = 36.0
        edge = held + random.uniform(-slips_hz, 0.05)  # one that slips is lost up to so much earlier
        steps = held - 0.05 * np.arange(100)[::-1]
        counts = steps + 0.08 * random.standard_normal(100)
        counts[-1] -= slips_hz
        limit = _limit_of_loss(
            LimitSettings(), (held, held + 0.05), [(0.0, *one) for one in zip(counts, steps, strict=True)]
        )
        off.append(limit["spin_frequency_hz"] - edge)
        u.append(limit["spin_frequency_u_hz"])
    # four standard errors; of a top that slips, what its count is taken to be higher than it is, halved, too
    assert abs(np.mean(off)) < 4 * np.std(off) / 1000**0.5 + 0.5 * 2 * 0.08 * (slips_hz > 0)
    assert np.mean(u) < most_u_hz


def test_counts_that_scatter_are_not_taken_to_rise():
    times, noise = 2.0 * np.arange(3), np.random.default_rng(5).standard_normal((1000, 3))
    assert not any(_rises(times, 22 - 0.06 * times + 0.1 * one, 0.1) for one in noise)
    assert _rises(times, 78 + 0.06 * times, 0.03)  # an image of a spin


def test_a_top_that_is_lost_as_the_creep_begins_has_no_limit(tmp_path, monkeypatch):
    """No count shows how fast it still was under the drive: a u of 0 Hz would be wrong."""
    lost = iter([NotHeld(None, 34.0)])

    def held_at_second(session, drive):
        for first in lost:
            raise first
        return held_spin(session, drive)

    monkeypatch.setattr("levilab.acquisition.experiments.limit.held_spin", held_at_second)
    world = Slipping(SpinScene(), VirtualClock())
    run = acquire(in_world(mock(tmp_path, *SLIPS, "limit.interval_s=0.6"), world), Silent())
    (once_more,) = texts(run, "once more")
    assert "as the creep began" in once_more
    (limit,), (u,) = (run.readings().frame[name] for name in ("spin_frequency_hz", "spin_frequency_u_hz"))
    assert abs(limit - 36) < 2 * u


def test_the_mean_of_tops_that_are_all_alike_is_no_better_than_a_step(tmp_path):
    """Four tops that are lost at exactly 36 Hz: their limits hardly scatter, and all are wrong by the same."""
    run = acquire(
        in_world(mock(tmp_path, *SLIPS[:-1], "limit.repetitions=4"), Slipping(SpinScene(), VirtualClock())), Silent()
    )
    (found,) = (one.statistics for one in LIMIT.analyze([run.folder]).runs)
    assert (found.n, found.mean.value) == (4, pytest.approx(36, abs=2 * found.mean.u))
    assert found.mean.u > found.scatter.value / 2  # of four
    assert found.step > 0.03  # a look each 0.2 Hz, a quarter of it


def test_a_limit_is_kept_though_the_generator_fails_as_it_is_switched_off(tmp_path, monkeypatch):
    """Twice: the bench itself tries once more over a new link.  The top is not driven up again for it."""
    off = Keysight33500B.off
    faults = []

    def switched_off(self):
        if faults:
            faults.pop()
            raise NoAnswer(self.transport.address, "OUTP1?", 1.0)
        off(self)

    monkeypatch.setattr(Keysight33500B, "off", switched_off)
    request = in_world(mock(tmp_path, *SLIPS), Slipping(SpinScene(), VirtualClock()))
    run = acquire(request, Meanwhile(1, lambda: faults.extend([1, 2])))
    assert (run.status, run.count()) == ("finished", 1)
    assert "found again" in kinds(run)
    assert kinds(run).count("drive on") == 1
    assert run.record.instruments["generator"]["settings_end"]["output"] is False


def test_a_drive_does_not_jump_after_a_counter_was_away(tmp_path, monkeypatch):
    """In 12 s the drive would have gone on by 1.2 Hz, which no top follows at once."""
    away = iter([12.0])

    def look(session, drive):
        session.wait(next(away, 0.0) if drive > 34.5 else 0.0)
        return held_spin(session, drive)

    monkeypatch.setattr("levilab.acquisition.experiments.limit.held_spin", look)
    run = acquire(in_world(mock(tmp_path, *SLIPS), Slipping(SpinScene(), VirtualClock())), Silent())
    assert run.readings().frame["spin_frequency_hz"].tolist() == pytest.approx([36], abs=0.3)


def test_a_top_that_falls_while_the_counter_is_away_may_have_fallen_all_that_time(tmp_path):
    """The moment of its fall is known as well as when it was seen last, and first seen down."""

    lost = []
    counted = FreeTop._count

    def count(top):
        row = counted(top)
        if row and row["spin_frequency_hz"] < 22.3 and not lost:
            lost.append(row["time_s"])
            top.session.wait(25.0)
            raise NoAnswer(top.session.bench.address("counter"), "READ?", 25.0)
        return row

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(FreeTop, "_count", count)
        request = mock(tmp_path, *QUICK, "limit.repetitions=1")
        run = acquire(in_world(request, SpinWorld(SpinScene(), VirtualClock())), Silent())
    (limit,), (u,) = (run.readings().frame[name] for name in ("spin_frequency_hz", "spin_frequency_u_hz"))
    assert "instrument lost" in kinds(run)
    assert u > max(0.3, abs(limit - SpinScene.fall_hz) / 2)  # 25 s at 0.06 Hz/s, an even distribution


def test_a_top_that_never_follows_does_not_keep_a_series_beyond_its_time(tmp_path, monkeypatch):
    def never(session):
        session.wait(60.0)
        raise DidNotFollow("the top did not follow")

    monkeypatch.setattr("levilab.acquisition.experiments.limit.drive_up_and_let_go", never)
    world = SpinWorld(SpinScene(fall_hz=1.0), VirtualClock())  # it stays up
    run = acquire(in_world(mock(tmp_path, "limit.longest_s=200"), world), Silent())
    assert kinds(run)[-1] == "longest"
    assert kinds(run).count("once more") == 4


def test_a_top_that_falls_under_the_drive_is_said_to_have_fallen(tmp_path):
    class Falling(SpinWorld):
        """The top falls as soon as the drive is above 36 Hz."""

        def light(self, start, step, n):
            dark = np.full(n, self.scene.tape.dark)
            return dark if self._drive_spin > 2 * math.pi * 36 else super().light(start, step, n)

        def crossings(self, start, stop, triggers):
            return np.empty(0) if self._drive_spin > 2 * math.pi * 36 else super().crossings(start, stop, triggers)

    settings = ("limit.which=upper", "limit.creep_hz_per_s=0.2", "limit.hold_s=0", "limit.repetitions=1")
    run = acquire(in_world(mock(tmp_path, *settings), Falling(SpinScene(), VirtualClock())), Silent())
    (limit,) = run.readings().frame["spin_frequency_hz"]
    assert limit == pytest.approx(36, abs=0.5)  # looked at each 2 s, 0.4 Hz
    assert "top lost" in kinds(run)
    assert "lock lost" not in kinds(run)
    assert causes(run) == ["out of the window"]


@pytest.mark.parametrize(
    ("drag", "begins", "cause"), [(3.6e-4, 54.0, "left behind by the drive"), (5e-5, 79.0, "out of the window")]
)
def test_the_cause_of_a_loss_in_full_motion_is_the_only_possible_one(tmp_path, drag, begins, cause):
    """Much drag takes all that 0.4 mT give near 58 Hz, far below the window's edge at 80; little drag never does."""
    scene = preset("spindown").changed({"drag.coefficient": drag, "start.spin_hz": begins})
    settings = ("limit.which=upper", f"limit.drive_frequency_hz={begins}", "limit.creep_hz_per_s=0.1", "limit.hold_s=0")
    request = mock(tmp_path, *settings, "limit.drive_waveform=SQU", "limit.repetitions=1")
    run = acquire(in_world(request, MotionWorld(scene, VirtualClock(), seed=1)), Silent())
    (group,) = LIMIT.analyze([run.folder]).groups
    assert causes(run) == [cause]
    assert group.causes == {cause: 1}
    assert f"The phase before each loss tells why: {cause}." in group.text
    (lag,) = (event["lag_turns"] for event in run.events() if "cause" in event)
    assert lag > 1.0 or lag < 0.5  # the boundary is 0.75


def test_a_top_that_the_drive_does_not_take_up_is_floated_again(tmp_path):
    class Unwilling(SpinWorld):
        """The first top cannot be held."""

        def float_top(self, number):
            self.scene = SpinScene()
            super().float_top(number)

    world = Unwilling(SpinScene(lock_torque=1.0), VirtualClock())
    quick = ("limit.ramp_hz_per_s=0.3", "limit.hold_s=1", "limit.repetitions=1")
    run = acquire(in_world(mock(tmp_path, *quick), world), Silent())
    assert kinds(run).count("once more") >= 1
    assert (kinds(run).count("asked the person"), run.count()) == (1, 1)
    world = SpinWorld(SpinScene(lock_torque=1.0), VirtualClock())
    never = in_world(mock(tmp_path, *quick), world)
    with pytest.raises(ExperimentFailed, match="did not follow the drive to 30 Hz"):
        acquire(never, Silent())


def test_an_interrupted_series_goes_on_with_the_next_top(tmp_path):
    half = acquire(mock(tmp_path, *QUICK, "limit.repetitions=4"), Impatient(2))
    assert half.status == "interrupted"
    assert half.record.instruments["generator"]["settings_end"]["output"] is False
    before = half.readings().frame["spin_frequency_hz"].tolist()
    run = acquire(mock(tmp_path, seed=None, resume=half.folder), Silent())
    limits = run.readings().frame["spin_frequency_hz"].tolist()
    assert limits[:2] == before
    assert limits == pytest.approx([random_scene(1).fall_of(number) for number in range(4)], abs=0.25)  # 4 u


def test_a_series_that_is_resumed_after_its_time_has_it_anew(tmp_path):
    half = acquire(mock(tmp_path, *QUICK, "limit.repetitions=2"), Impatient(1))
    file = half.folder / "readings.csv"
    header, row, *_ = file.read_text(encoding="utf-8").splitlines()
    file.write_text(f"{header}\n{','.join(['90000.0', *row.split(',')[1:]])}\n", encoding="utf-8")
    assert acquire(mock(tmp_path, seed=None, resume=half.folder), show := Silent()).count() == 2
    assert show.left == [0.0]


def test_a_top_that_is_not_floated_ends_the_series_in_a_line(tmp_path):
    settings = LimitSettings(float_s=5.0)
    config = with_settings(Configuration(), "limit", settings)
    request = AcquisitionRequest("limit", config, wiring=NotImplemented, out=tmp_path, synthetic_how="a test")

    class Unfloatable(SpinWorld):
        def float_top(self, number): ...

    with pytest.raises(ExperimentFailed, match=r"no light pulses .* \(limit\.trigger_level_v in the bench file\)"):
        acquire(in_world(request, Unfloatable(SpinScene(start_hz=5.0), VirtualClock())), Silent())


def test_a_series_ends_when_its_time_is_over(tmp_path):
    run = acquire(mock(tmp_path, *QUICK, "limit.longest_s=60"), Silent())
    assert (kinds(run)[-1], run.status) == ("longest", "finished")


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ("limit.which=middle", "lower or upper is expected; levilab acquire limit --settings lists all"),
        ("limit.repetitions=0", "a whole number above 0 is expected"),
        ("limit.drive_frequency_hz=fast", "a number above 0 up to 100 [Hz] is expected"),
        ("limit.gate_s=0,5", "a number above 0 [s] is expected; write a decimal point, not a comma"),
        ("limit.wich=upper", "there is no such setting, did you mean limit.which? levilab acquire limit --settings"),
        ("limit.gate_s=3", "gate_s = 3 must be shorter than interval_s = 2"),
        ("gate_s=fast", "limit.gate_s=fast: a number above 0 [s] is expected; levilab acquire limit --settings"),
        ("gate_s=0,5", "limit.gate_s=0,5: a number above 0 [s] is expected; write a decimal point, not a comma"),
        ("drive_frequency_hz=500", "limit.drive_frequency_hz = 500 is more than this bench allows"),
        ("drive_frequency_hz=20rpm", "0.333333 Hz: no top floats there; a Levitron of the usual kind does between"),
        ("wich=upper", "limit.wich: there is no such setting, did you mean limit.which?"),
        ("which", "limit.KEY=VALUE is expected"),
        ("=3", "the key is missing: limit.KEY=VALUE is expected"),
        ("limit=3", "the key is missing: limit.KEY=VALUE is expected"),
        ("what=upper", "there is no such setting; levilab acquire limit --settings lists all"),
        ("spin.hold_s=1", "is a setting of levilab acquire spin, this is levilab acquire limit"),
        ("__init__.x=1", "limit.KEY=VALUE is expected"),
        ("which=upper highest_hz=120", "limit.highest_hz = 120 is more than this bench allows"),
        ("which=upper highest_hz=25", "limit.highest_hz = 25: more than limit.drive_frequency_hz = 30"),
    ],
)
def test_settings_on_the_command_line_that_cannot_be_are_refused(tmp_path, settings, says):
    with pytest.raises(UsageError) as caught:
        mock(tmp_path, *settings.split())
    assert caught.value.name == "settings"
    assert says in str(caught.value)


def test_a_key_without_its_experiment_is_of_the_one_that_is_carried_out(tmp_path):
    bare, full = (mock(tmp_path, f"{table}which=upper", f"{table}hold_s=7").config for table in ("", "limit."))
    assert settings_of(bare, "limit") == settings_of(full, "limit")


def test_a_setting_that_the_bench_files_do_not_allow_is_wrong_usage(tmp_path):
    """The bench's limit is lower than the default highest_hz, which counts once the upper limit is asked for."""
    bench = tmp_path / "bench.toml"
    bench.write_text("[limits]\ndrive_frequency_hz = 60.0\n", encoding="utf-8")
    with pytest.raises(UsageError, match=r"limit\.highest_hz = 100 is more than this bench allows"):
        mock(tmp_path, "limit.which=upper", bench=bench)


def test_a_bench_file_that_is_wrong_without_the_given_settings_is_named(tmp_path):
    bench = tmp_path / "bench.toml"
    bench.write_text("[limits]\ndrive_frequency_hz = 20.0\n[limit]\ndrive_frequency_hz = 30\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"limit\.drive_frequency_hz = 30 is more than this bench allows"):
        mock(tmp_path, "limit.repetitions=5", bench=bench)


def test_settings_on_the_command_line_go_before_the_bench_files(tmp_path):
    bench = tmp_path / "bench.toml"
    bench.write_text("[limit]\nrepetitions = 3\nhold_s = 7.0\n", encoding="utf-8")
    request = mock(tmp_path, "limit.repetitions=5", bench=bench)
    chosen = settings_of(request.config, "limit")
    assert (chosen.repetitions, chosen.hold_s) == (5, 7.0)
    half = acquire(mock(tmp_path, *QUICK, "limit.repetitions=2"), Impatient(1)).folder
    with pytest.raises(UsageError, match="a resumed run keeps its settings"):
        mock(tmp_path, "limit.repetitions=5", seed=None, resume=half)


def test_loose_washers_are_warned_of_in_the_run_and_in_its_result(tmp_path):
    """In full motion; the slip is that of the washers' drag against their coupling, I₃ C ω^1.5/k."""
    given = ("spin.drive_frequency_hz=30.2", "spin.interval_s=2", "spin.longest_s=5", "spin.hold_s=12")
    options = AcquisitionOptions(mock=True, out=tmp_path, seed=1, scene="loose-washers", settings=given)
    show = Silent()
    run = acquire(request_for("spin", options), show)
    (held,) = events(run, "held")
    slip = 1.731314e-6 * 2.34e-4 * (2 * math.pi * 30.2) ** 1.5 / 1e-6 / (2 * math.pi)
    assert held["drive_frequency_hz"] - held["spin_frequency_hz"] == pytest.approx(slip, abs=0.02)
    (warning,) = texts(run, "warning")
    assert "LOOSE WASHERS, the tape slips by 0.1" in warning
    assert warning in show.messages
    assert warning in json.loads(json.dumps(SPINDOWN.analyze([run.folder]).all_warnings))


# --- a drive that the top triggers ---

TRIGGERED = ("limit.which=upper", "limit.drive=triggered", "limit.hold_s=1", "limit.drive_amplitude_vpp=6")


def test_a_top_that_levels_off_shows_where_pull_and_drag_are_equal(tmp_path):
    run = acquire(mock(tmp_path, *TRIGGERED, "limit.repetitions=2"), Silent())
    assert causes(run) == ["the drive pulls no further"] * 2
    frame, scene = run.readings().frame, random_scene(1)
    place = scene.moment_turns + scene.tape.offset(scene.trigger.thresholds(rising=True), 50.0)
    bursts = Triggered(2.4e-4, 1, rising=True, delay=0.0, jitter=0.0)
    phases = [event["phase_deg"] for event in events(run, "phase found")]
    sines = [Output("SIN", CYCLE * 50.0, 0.0, 0.0, phase=phase, triggered=bursts) for phase in phases]
    pull = np.array([scene.lock_torque * mean_pull(sine, 50.0, place, jitter=scene.jitter) for sine in sines])
    balance = (pull / scene.constants[0]) ** (2 / 3) / 2 / math.pi
    pulls = (frame["spin_frequency_hz"] - balance) / frame["spin_frequency_u_hz"]
    assert abs(pulls).max() < 3
    assert frame["spin_frequency_u_hz"].max() < 0.02 * balance.min()
    (found,) = LIMIT.analyze([run.folder]).groups
    assert found.conditions.triggered
    assert found.conditions.levels_off
    assert found.statistics.step == 0
    assert not found.comparisons
    way = frame["spin_frequency_hz"] - frame["spin_seen_hz"]
    assert found.statistics.common == pytest.approx(way.mean() / 2)
    assert found.statistics.mean.u > found.statistics.common  # by √n less without it
    assert "this is no limit of the top" in found.text


def test_a_top_that_leaves_the_window_has_its_limit_where_it_fell(tmp_path):
    """Two at 37 Hz; one that only levels off is no limit, and enters no mean."""
    world = SpinWorld(SpinScene(edges_hz=(37.0, 37.0, 99.0), put_back_after_s=60.0), VirtualClock())
    settings = [*TRIGGERED[:-1], "limit.drive_amplitude_vpp=4.2", "limit.repetitions=3"]
    run = acquire(in_world(mock(tmp_path, *settings), world), Silent())
    assert causes(run) == ["out of the window"] * 2 + ["the drive pulls no further"]
    lost = run.readings().frame[:2]
    pulls = (lost["spin_frequency_hz"] - 37) / lost["spin_frequency_u_hz"]
    assert abs(pulls).max() < 3
    assert lost["spin_frequency_u_hz"].max() < 0.05
    analysis = LIMIT.analyze([run.folder])
    (found,) = analysis.groups
    assert found.statistics.n == 2
    assert not found.conditions.levels_off
    assert "The top fell under the drive twice, got no faster under the drive once." in found.text
    assert "1 of 3 tops got no faster than" in str(analysis.sources[0].warnings)


def test_the_counts_of_a_phone_are_of_the_middle_of_their_samples(tmp_path):
    """They cover 3 s, in which this top gains 0.6 Hz; taken for the last 0.5 s they gave limits 2.5 u off."""
    world = SpinWorld(SpinScene(edges_hz=(35.0,), put_back_after_s=60.0, seed=2), VirtualClock())
    request = mock(tmp_path, *TRIGGERED[:-1], "limit.repetitions=3", counter="phyphox")
    lost = acquire(in_world(request, world), Silent()).readings().frame
    pulls = (lost["spin_frequency_hz"] - 35) / lost["spin_frequency_u_hz"]
    assert abs(pulls.mean()) < 1.5


def test_a_top_that_gets_slower_under_its_drive_is_no_limit(tmp_path):
    """Its trigger's cable is off after the start phase was found."""

    class Cut(SpinWorld):
        is_cut = False

        def _triggered_acceleration(self, spin):
            self.is_cut |= spin > 2 * math.pi * 33
            return -0.7 if self.is_cut else super()._triggered_acceleration(spin)

    settings = [*TRIGGERED, "limit.repetitions=1", "limit.longest_s=300"]
    run = acquire(in_world(mock(tmp_path, *settings), Cut(SpinScene(), VirtualClock())), Silent())
    assert causes(run) == []
    (once_more, *_) = texts(run, "once more")
    assert "the top gets slower under the drive" in once_more
    assert "does the cable lead from the phototransistor" in once_more

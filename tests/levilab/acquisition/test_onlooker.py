"""What views see of an acquisition while it goes on, and that it costs nothing where none listens."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest

from instruments.drivers.oscilloscope import Trace
from levilab.acquisition import onlooker
from levilab.acquisition.loop import acquire
from levilab.acquisition.onlooker import Onlooker, Sent, publishing, record_of
from levilab.telemetry.address import FILE, read_address
from levilab.telemetry.messages import Poses, Record, State
from levilab.telemetry.publisher import LEAST_PAUSE_S, Publisher
from levilab.telemetry.subscriber import Subscriber
from support.acquisitions import Silent, asked

SHORT = ("spin.drive_frequency_hz=30.5", "spin.hold_s=0", "spin.interval_s=2", "spin.longest_s=30")


def request(out, experiment="spin", *settings, **options):
    return asked(experiment, out=out, seed=3, settings=settings, **options)


def watched(out, experiment="spin", *settings):
    """Messages of a run to a view that asks each time, on a wall clock that goes on with each look."""
    seen = []

    @contextlib.contextmanager
    def watch(session, wiring):
        wall = [0.0]
        with Publisher(lambda: wall[0]) as publisher:
            look = Onlooker(session, publisher, wiring.poses, wiring.signals)
            look()
            found = read_address(session.writer.folder)
            assert found == publisher.address is not None
            with Subscriber(found, lambda: wall[0]) as view:

                def step():
                    wall[0] += LEAST_PAUSE_S
                    seen.extend(view.receive())
                    look()

                yield step
                seen.extend(view.receive())

    return seen, acquire(request(out, experiment, *settings), Silent(), watch)


@pytest.fixture(scope="module")
def spin_run(tmp_path_factory):
    return watched(tmp_path_factory.mktemp("runs"), "spin", *SHORT)


def test_a_view_sees_the_drive_the_count_and_the_readings(spin_run):
    messages, run = spin_run
    states = [message for message in messages if isinstance(message, State)]
    driven = [state for state in states if state.drive and state.drive.output]
    assert driven[-1].drive.frequency_hz == 30.5
    assert driven[-1].drive.amplitude_vpp == 10.0
    assert any(state.text.startswith("drive at") and state.share for state in states)
    assert not states[-1].drive.output
    assert states[-1].counting.gate_s == 1.0
    assert states[-1].readings == run.count()
    last = run.readings().frame.iloc[-1]
    assert states[-1].last["spin_frequency_hz"] == pytest.approx(last["spin_frequency_hz"], abs=0.5)
    assert states[-1].folder == str(run.folder)
    assert all(state.virtual and state.speed is None for state in states)
    left = [state.time_left_s for state in states if state.time_left_s is not None]
    assert min(left) >= 0


def test_the_poses_of_one_message_go_on_where_the_last_ended(spin_run):
    messages, _ = spin_run
    chunks = [message for message in messages if isinstance(message, Poses)]
    ends = [chunk.start_s + chunk.step_s * len(chunk.up) for chunk in chunks]
    begins = [chunk.start_s for chunk in chunks]
    gaps = np.subtract(begins[1:], ends[:-1])
    assert (gaps > -1e-9).all()  # and a bench that jumped shows its last second
    assert max(len(chunk.up) for chunk in chunks) <= 400
    assert any(abs(gap) < 1e-9 for gap in gaps)


def test_watching_changes_no_reading(spin_run, tmp_path):
    _, run = spin_run
    other = acquire(request(tmp_path, "spin", *SHORT), Silent())
    assert (run.folder / "readings.csv").read_bytes() == (other.folder / "readings.csv").read_bytes()
    assert not (run.folder / FILE).exists()
    assert not (other.folder / FILE).exists()


def test_where_no_view_listens_nothing_is_computed(tmp_path, monkeypatch):
    calls = []
    looks = []
    monkeypatch.setattr(onlooker, "state_of", lambda *_, **__: calls.append("state"))
    monkeypatch.setattr(Sent, "send_poses", lambda *_: calls.append("poses"))

    @contextlib.contextmanager
    def counting(session, wiring):
        with publishing(session, wiring) as look:
            yield lambda: (looks.append(1), look())[1]

    acquire(request(tmp_path, "spin", *SHORT), Silent(), counting)
    assert len(looks) > 100
    assert calls == []


def test_a_terminal_that_wants_it_sees_the_state(tmp_path):
    class Screen(Silent):
        states: tuple[State, ...] = ()

        def is_due(self):
            return True

        def state(self, state):
            self.states += (state,)

    acquire(request(tmp_path, "field", "field.highest_m=0.065"), screen := Screen())
    assert screen.states[-1].last["flux_density_t"]
    assert screen.states[-1].drive is None


def test_records_reach_the_view_by_their_lows_and_highs(tmp_path):
    messages, run = watched(tmp_path, "trace", "trace.records=2", "trace.interval_s=2")
    records = [message for message in messages if isinstance(message, Record)]
    assert {(record.number, record.channel) for record in records if not record.drawn} >= {(1, "tape")}
    first = next(k for k, record in enumerate(records) if not record.drawn)
    assert not any(record.drawn for record in records[first:])  # what the run reads is shown, and nothing else
    assert all(len(record.low) <= 1000 for record in records)
    assert run.count() == 2


def test_a_virtual_bench_draws_the_signals_that_a_run_does_not_read(spin_run):
    records = [message for message in spin_run[0] if isinstance(message, Record)]
    assert {record.channel for record in records if record.drawn} == {"tape", "drive", "laser"}
    assert all(record.drawn for record in records)
    drive = [record for record in records if record.channel == "drive"]
    swing = [float(np.ptp(record.low)) for record in drive]
    assert max(swing) == pytest.approx(10.0, rel=0.01)  # [V], peak to peak: some record has both peaks of the sine
    assert swing[-1] == 0.0  # the drive went off for the spin-down


# --- a record in steps ---

CODES = np.array([10, 12, 200, 11, 10, 9, 10, 250], dtype=np.uint8)


@pytest.mark.parametrize("scale", [0.01, -0.01])
def test_a_long_record_keeps_its_extremes(scale):
    codes = np.full(1_000_003, 100, dtype=np.uint8)
    codes[500_000], codes[777_777] = 3, 250
    record = record_of(1, "light", 5.0, Trace(codes, 1e-6, -0.5, scale, 1.0, 1))
    assert len(record.low) == len(record.high) <= 1000
    assert float(record.low.min()) == pytest.approx(1.0 + min(3 * scale, 250 * scale))
    assert float(record.high.max()) == pytest.approx(1.0 + max(3 * scale, 250 * scale))
    assert record.step_s * len(record.low) >= 1.0
    assert (record.low <= record.high).all()


def test_samples_that_are_none_are_left_out():
    codes = np.tile(CODES, 300)
    codes[:4] = 0
    trace = Trace(codes, 1e-3, 0.0, 0.1, 0.0, 1)
    with_none, without = record_of(1, "x", 0.0, replace(trace, none=0)), record_of(1, "x", 0.0, trace)
    assert np.isnan(with_none.low[0])
    assert float(np.nanmin(with_none.low)) == pytest.approx(0.9)
    assert float(without.low.min()) == 0.0
    assert record_of(1, "x", 0.0, replace(trace, codes=codes[:0])).low.size == 0


def test_a_record_is_sent_again_for_views_that_come_later():
    sent = []

    class Noting(Publisher):
        def send(self, message):
            sent.append(message)

    wall = [0.0]
    with Noting(lambda: wall[0]) as publisher:
        note, records = Sent(), {"light": (1, 0.0, Trace(CODES, 1e-3, 0.0, 0.1, 0.0, 1))}
        for now in (0.0, 0.05, 0.9, 1.1):
            wall[0] = now
            note.send_new_records(publisher, records)
        assert len(sent) == 2
        assert sent[0] is sent[1]


def test_the_clock_has_nothing_to_do_meanwhile_after_the_run(tmp_path):
    asked = request(tmp_path, "field", "field.highest_m=0.065")
    wiring = asked.wiring()
    acquire(replace(asked, wiring=lambda: wiring), Silent())
    assert wiring.clock.meanwhile is None

"""A bench publishes, views listen; a bench that no view listens to computes nothing."""

import os
import socket
import stat

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from levilab.telemetry.address import FILE, LOOPBACK, Address, read_address, remove_address, write_address
from levilab.telemetry.datagrams import PART_BYTES, Joiner, is_wish, split, wish
from levilab.telemetry.messages import Poses, Record, State
from levilab.telemetry.publisher import FORGOTTEN_AFTER_S, LEAST_PAUSE_S, Publisher
from levilab.telemetry.subscriber import Subscriber

TOKEN = bytes(range(16))


class Wall:
    """A wall clock that a test moves."""

    def __init__(self):
        self.time = 100.0

    def __call__(self):
        return self.time


@pytest.fixture
def wall():
    return Wall()


@pytest.fixture
def bench(wall):
    with Publisher(wall) as publisher:
        yield publisher


def due(bench, wall):
    """Whether a round is due once the pause is over.  On loopback a datagram is there when `sendto` returns."""
    wall.time += LEAST_PAUSE_S
    return bench.is_due()


def address_of(bench):
    assert bench.address
    return bench.address


def test_a_view_that_asks_gets_messages(bench, wall):
    n = 3000  # in more than one datagram
    state = State(1.0, text="<b>ü", last={"spin_frequency_hz": 25.0})
    with Subscriber(address_of(bench), wall) as view:
        assert view.receive() == []
        assert due(bench, wall)
        bench.send(state)
        bench.send(Record(1, "light", 1.0, 0.0, 1e-3, np.zeros(n, np.float32), np.ones(n, np.float32)))
        bench.send(
            Poses(1.0, 0.0025, np.ones((2, 3), np.float32), np.ones((2, 4), np.float32), np.array([True, False]))
        )
        first, second, third = view.receive()
    assert first == state
    assert isinstance(second, Record)
    assert second.high.sum() == n
    assert isinstance(third, Poses)
    assert third.up.tolist() == [True, False]


def test_views_are_served_at_most_twenty_times_a_second(bench, wall):
    with Subscriber(address_of(bench), wall) as view:
        view.receive()
        assert sum(bench.is_due() for _ in range(1000) if not setattr(wall, "time", wall.time + 0.001)) == 20


def test_a_view_that_asks_no_more_is_forgotten(bench, wall):
    with Subscriber(address_of(bench), wall) as view:
        view.receive()
        assert due(bench, wall)
    wall.time += FORGOTTEN_AFTER_S
    assert not due(bench, wall)


def test_two_views_get_the_same(bench, wall):
    with Subscriber(address_of(bench), wall) as one, Subscriber(address_of(bench), wall) as other:
        for view in (one, other):
            view.receive()
        assert due(bench, wall)
        bench.send(State(2.0))
        assert one.receive() == other.receive() == [State(2.0)]


def test_only_a_view_with_the_token_is_served(bench, wall):
    port = address_of(bench).port
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        for said in (b"", wish(TOKEN), wish(b""), wish(address_of(bench).token) + b"x", b"x" * 20_000):
            stranger.sendto(said, (LOOPBACK, port))
        assert not due(bench, wall)
    assert socket.getaddrinfo(LOOPBACK, port)  # and from other machines nothing comes: it is bound to the loopback
    assert bench._socket.getsockname() == (LOOPBACK, port)


def test_a_view_takes_nothing_from_a_stranger(bench, wall):
    address = address_of(bench)
    with Subscriber(address, wall) as view, Publisher(wall) as stranger:
        view.receive()
        assert due(bench, wall)
        (seen,) = bench._views
        stranger.address, stranger._views = address, {seen: wall.time}  # it knows the token, and sends from elsewhere
        stranger.send(State(666.0))
        assert view.receive() == []


def test_a_bench_that_is_gone_hurts_no_view_and_a_view_no_bench(bench, wall):
    view = Subscriber(address_of(bench), wall)
    view.receive()
    assert due(bench, wall)
    view.close()
    for _ in range(3):  # Windows says in recvfrom that the view is gone
        bench.send(State(1.0))
        due(bench, wall)
    with Subscriber(address_of(bench), wall) as other:
        bench.close()
        for _ in range(3):
            wall.time += 2
            assert other.receive() == []
    bench.send(State(1.0))
    assert not bench.is_due()


def test_windows_says_that_a_far_end_is_gone_and_the_rest_is_read(bench, wall):
    class Resetting:
        """What recvfrom does on Windows after a datagram to a port that is closed."""

        said: tuple[type[OSError] | bytes, ...] = (ConnectionResetError, wish(address_of(bench).token))

        def recvfrom(self, count):
            if not self.said:
                raise BlockingIOError
            (said, *rest) = self.said
            self.said = tuple(rest)
            if isinstance(said, bytes):
                return said, (LOOPBACK, 9)
            raise said

    bench._read_wishes(Resetting(), wall.time)
    assert bench.is_watched


# --- datagrams ---


@given(st.binary(max_size=5 * PART_BYTES), st.integers(0, 2**33), st.randoms())
def test_parts_are_joined_in_any_order(message, number, random):
    parts = list(split(message, number, TOKEN))
    assert all(len(part) <= 9000 for part in parts)
    random.shuffle(parts)
    joiner = Joiner(TOKEN)
    joined = [joiner.join(part) for part in parts]
    assert joined[-1] == message
    assert joined[:-1] == [None] * (len(parts) - 1)


@given(st.binary(max_size=100), st.booleans())
def test_what_is_no_part_is_dropped(data, begins_well):
    assert Joiner(TOKEN).join((b"LVT1" + bytes(16) if begins_well else b"") + data) is None
    assert not is_wish(data, TOKEN)


def test_a_part_that_is_lost_loses_its_message_and_nothing_else():
    joiner, joined = Joiner(TOKEN), []
    for number in range(50):
        first, *rest = split(bytes([number]) * (2 * PART_BYTES), number, TOKEN)
        joined += [joiner.join(part) for part in ([] if number % 10 == 3 else [first]) + rest]
    assert len([whole for whole in joined if whole]) == 45
    assert len(joiner._open) <= 5


def test_a_message_that_is_too_long_is_not_sent():
    assert list(split(bytes(256 * PART_BYTES), 1, TOKEN)) == []


# --- the address ---


def test_the_address_is_in_the_run_folder_while_the_bench_publishes(tmp_path, bench):
    other = tmp_path / "rescued"
    other.mkdir()
    bench.announce(tmp_path)
    assert read_address(tmp_path) == bench.address
    if os.name == "posix":
        assert stat.S_IMODE((tmp_path / FILE).stat().st_mode) == 0o600
    bench.announce(other)
    assert (read_address(tmp_path), read_address(other)) == (None, bench.address)
    bench.close()
    assert [path.name for path in tmp_path.rglob("*")] == ["rescued"]


@pytest.mark.parametrize(
    "said",
    ["", "{", "[]", '{"port": 1}', '{"port": 0, "token": "00"}', '{"port": 70000, "token": "%s"}' % ("00" * 16),
     '{"port": true, "token": "%s"}' % ("00" * 16), '{"port": 1, "token": 3}', "x" * 10_000],
)  # fmt: skip
def test_a_file_that_says_something_else_is_no_address(tmp_path, said):
    (tmp_path / FILE).write_text(said)
    assert read_address(tmp_path) is None


def test_the_address_of_another_bench_stays(tmp_path):
    mine, its = Address.at(1234), Address.at(1235)
    assert mine.token != its.token
    write_address(tmp_path, mine)
    write_address(tmp_path, its)
    remove_address(tmp_path, mine)
    assert read_address(tmp_path) == its
    assert [path.name for path in tmp_path.iterdir()] == [FILE]


def test_a_folder_that_cannot_be_written_ends_no_measurement(tmp_path, bench):
    bench.announce(tmp_path / "nowhere")
    assert bench.address

"""When the running fit is computed: on a clock that the test moves."""

import asyncio
import math
import time
from contextlib import nullcontext
from types import MappingProxyType, SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from starlette.websockets import WebSocketDisconnect

from levilab.live.desk import Desk
from levilab.live.doors import Doors
from levilab.live.running import Curve, Running
from levilab.live.server import FRAMES_PER_S, OWN_BENCH, Hall, Pages
from levilab.live.watch import Watch
from levilab.simulator.scene import preset
from levilab.telemetry.address import Address, write_address
from levilab.telemetry.codec import unpack
from levilab.telemetry.messages import State
from support.live_pages import GrowingRun, publish, spin_down
from support.waiting import HANG_GUARD_S

LINE = Running("a law so far", curve=Curve(np.arange(2.0), np.arange(2.0)))


def looking(watch):
    watch.step()
    while watch.followed and watch.followed.behind:
        watch.step()
    return watch


@pytest.mark.parametrize("practice", [False, True])
def test_the_first_fit_does_not_count_for_the_pause_to_the_next(tmp_path, practice):
    run, now = GrowingRun(tmp_path), 0.0
    watch = Watch(None, lambda: None, lambda: now) if practice else Watch(run.folder, clock=lambda: now)
    if practice:  # as the bench begins to record
        publish(watch, State(0.0, folder=str(run.folder)))
    with run.running():
        run.readings(spin_down(3))
        for k, found in enumerate((Running("no fit yet"), LINE)):  # the second one imports what it needs
            assert looking(watch).fit_task()
            watch.take_fit(run.folder, found, 0.4)
            run.readings(spin_down(1, first=3 + k))
            now += 1.6
        assert looking(watch).fit_task()
        watch.take_fit(run.folder, LINE, 0.4)
        run.readings(spin_down(1, first=5))
        now += 7.9
        assert not looking(watch).fit_task()
        now += 0.2
        assert watch.fit_task()  # after 20 times the processor time


def test_the_last_fit_of_a_run_waits_for_nothing(tmp_path):
    run = GrowingRun(tmp_path)
    watch = Watch(run.folder, clock=lambda: 0.0)
    with run.running():
        run.readings(spin_down(3))
        assert looking(watch).fit_task()
        watch.take_fit(run.folder, None, 0.1)
        run.readings(spin_down(1, first=3))
        assert not looking(watch).fit_task()
    run.say(status="finished")
    assert looking(watch).fit_task()
    watch.take_fit(run.folder, None, 0.1)
    assert not looking(watch).fit_task()


def test_a_fit_under_way_is_dropped_when_the_next_run_begins(tmp_path):
    one, two = (GrowingRun(tmp_path, name) for name in ("one", "two"))
    watch = Watch(one.folder, lambda: None, lambda: 0.0)
    one.readings(spin_down(3))
    assert looking(watch).fit_task()
    with two.running():
        publish(watch, State(0.0, folder=str(two.folder)))
        two.readings(spin_down(3))
        watch.take_fit(one.folder, LINE, 0.4)
        assert watch.fit is None
        assert looking(watch).fit_task()  # at once


def test_a_run_that_another_program_records_is_shown_with_its_own_bench(tmp_path):
    run, practice, own = GrowingRun(tmp_path, "one"), Address.at(1), Address.at(2)
    hall = Hall(tmp_path, "", Doors(1), Desk(SimpleNamespace(address=practice)))
    write_address(run.folder, own)
    for context, expected in ((run.running(), own), (nullcontext(), practice)):  # one that was killed leaves its file
        with context, hall.watching("one") as watch:
            for _ in range(2):  # the first one looks at the record
                watch.step()
            assert watch._subscriber.address == expected
            assert watch.has_own_bench == (expected == own)
    write_address(run.folder, practice)  # as the bench for practice does for its own runs
    with run.running(), hall.watching("one") as watch:
        watch.step()
        watch.step()
        assert not watch.has_own_bench


def test_a_page_that_chose_no_run_turns_to_that_of_another_program(tmp_path):
    own, other = (GrowingRun(tmp_path, name) for name in ("1-own", "2-other"))
    desk = SimpleNamespace(address=lambda: None, folder=own.folder, folders=[own.folder], is_recording=False)
    hall = Hall(tmp_path, "", Doors(1), desk)

    def shown():
        asyncio.run(hall.turn_to_another())
        assert chosen.followed.folder == own.folder  # a run that was chosen by hand stays
        followed = looking(watch).followed
        return followed.folder.name if followed else ""

    with hall.watching("") as watch, hall.watching("1-own") as chosen:
        assert shown() == "1-own"
        with other.running():
            desk.is_recording = True
            assert shown() == "1-own"
            desk.is_recording = False
            assert shown() == "2-other"
            assert shown() == "2-other"
            desk.is_recording = True
            assert shown() == "1-own"


def test_a_page_that_went_back_to_its_own_bench_stays_there(tmp_path):
    own, other = (GrowingRun(tmp_path, name) for name in ("1-own", "2-other"))
    desk = SimpleNamespace(address=lambda: Address.at(1), folder=None, folders=[], is_recording=False)
    hall = Hall(tmp_path, "", Doors(1), desk)
    with other.running(), hall.watching("") as watch, hall.watching(OWN_BENCH) as kept:
        asyncio.run(hall.turn_to_another())
        assert watch.followed.folder == other.folder
        assert kept.followed is None
        publish(kept, State(0.0, folder=str(own.folder)))  # what the bench itself records is followed
        assert kept.followed.folder == own.folder


def test_the_top_of_another_program_is_drawn_also_where_no_page_chose_its_run(tmp_path):
    scene = preset("practice").as_table()
    other = GrowingRun(tmp_path, "2-other", configuration={"scene": scene | {"base": {"outer_radius_m": 0.07}}})
    write_address(other.folder, Address.at(2))
    desk = SimpleNamespace(address=lambda: Address.at(1), folder=None, folders=[], is_recording=False, scene=scene)
    hall = Hall(tmp_path, "", Doors(1), desk)
    with other.running(), hall.watching("") as watch, hall.watching(OWN_BENCH) as kept:
        asyncio.run(hall.turn_to_another())
        looking(watch).step()
        kept.step()
        assert [one.has_own_bench for one in (watch, kept)] == [True, False]
        assert hall.scene("2-other") == other.record["configuration"]["scene"]
        assert hall.scene("") == scene  # what a page sees that keeps to the bench for practice
    assert hall.scene("2-other") == scene  # the run is over, or no page sees it: its bench is not listened to


def test_a_page_that_waits_is_sent_a_fit_when_it_is_there(tmp_path, monkeypatch):
    monkeypatch.setattr("levilab.live.server.PATIENCE_S", math.inf)  # a page that is not called would wait for ever
    hall, folder = Hall(tmp_path, "", Doors(1)), tmp_path / "one"  # which is not there, so that nothing else is new

    async def wait_for_fit():
        reading = asyncio.create_task(hall.read_on())
        with hall.watching("one") as watch:
            watch.step()
            page = asyncio.create_task(hall.wait_for_news(watch, watch.tick))
            for _ in range(5):  # both wait now
                await asyncio.sleep(0)
            watch.take_fit(folder, LINE, 0.1)
            await asyncio.wait_for(page, HANG_GUARD_S)
        reading.cancel()

    asyncio.run(wait_for_fit())


def test_a_watch_that_fails_fails_alone_and_names_the_error(tmp_path, monkeypatch):
    GrowingRun(tmp_path, "1-broken")
    sound = GrowingRun(tmp_path, "2-sound")
    hall = Hall(tmp_path, "", Doors(1))

    async def read():
        with hall.watching("1-broken") as one, hall.watching("2-sound") as two:
            one.step()
            assert one.followed
            assert two.followed
            monkeypatch.setattr(one.followed, "look", Mock(side_effect=MemoryError("1 TiB")))
            sound.readings(spin_down(3))
            reading = asyncio.create_task(hall.read_on())
            while not two.followed.readings.count and not reading.done():
                await asyncio.sleep(0.001)
            reading.cancel()
            return unpack(one.frame({}))["about"], two.followed.readings.count

    about, readings = asyncio.run(read())
    assert "MemoryError: 1 TiB" in about["problem"]
    assert about["experiment"] == "spin"  # as far as it was read
    assert readings == 3


class Flood:
    """A socket with a question at any time.  It is closed after 1000 answers."""

    query_params, headers, cookies = MappingProxyType({"run": "one"}), MappingProxyType({}), MappingProxyType({})

    def __init__(self):
        self.answers = 0

    async def accept(self):
        pass

    async def receive(self):
        return {"type": "websocket.receive", "text": "{}"}

    async def receive_text(self):
        return "{}"

    async def send_bytes(self, _):
        self.answers += 1
        if self.answers == 1000:
            raise WebSocketDisconnect


def test_a_flood_of_questions_leaves_time_to_others(tmp_path):
    GrowingRun(tmp_path, "one")
    flood = Flood()

    async def serve():
        hall = Hall(tmp_path, "", Doors(1))
        pages = Pages(hall, hall.doors)
        begin = time.monotonic()
        flooded = asyncio.create_task(pages.frames(flood))
        for _ in range(20):  # what another page takes
            await asyncio.sleep(0.01)
        flooded.cancel()
        return time.monotonic() - begin

    took = asyncio.run(serve())
    assert 1 <= flood.answers <= 1 + took * FRAMES_PER_S

"""What the server keeps of what the bench for practice says."""

from types import SimpleNamespace

from levilab.live.desk import Desk
from levilab.live.practice.commands import PracticeEvent


def test_what_is_said_of_a_run_is_marked_since_it_stands_among_its_events():
    kinds = ("message", "recording", "message", "refused", "recorded", "message")
    said = [PracticeEvent(kind, "x", folder="runs/one") for kind in kinds]
    desk = Desk(SimpleNamespace(events=lambda: said))
    desk.step()
    assert desk.about["runs"] == ["one"]
    assert [one["of_run"] for one in desk.events_after(0)] == [False, False, True, False, False, False]

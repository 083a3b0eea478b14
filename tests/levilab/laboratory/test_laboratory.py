"""The simulated laboratory: the same for the same seed, nothing is wrong in it, and it notices what would be."""

import re
import signal
from dataclasses import replace

import pytest

from instruments.drivers.counter.reciprocal import ReciprocalCounter
from instruments.drivers.magnetometer.lakeshore import LakeShoreGaussmeter
from levilab.acquisition import driving
from levilab.acquisition.experiments import field
from levilab.acquisition.session import Session
from levilab.bench.bench import Bench
from levilab.cli.exit_codes import exit_status
from levilab.interruption import interruption_blocked
from levilab.laboratory import explore
from levilab.laboratory import visit as visiting
from levilab.laboratory.disk import SimulatedComputer
from levilab.laboratory.fate import Event
from levilab.laboratory.plan import draw
from levilab.laboratory.shrink import shrink
from levilab.laboratory.visit import visit
from levilab.runs.run import Run
from levilab.runs.writer import RunWriter
from levilab.workers.ways import this_process


def a_plan(experiment, *settings, model="", events=()):
    """A laboratory with these events and no others; model: of the counter or the oscilloscope."""
    kind = "oscilloscope" if experiment == "trace" else "counter"
    return replace(
        draw(0),
        experiment=experiment,
        settings=tuple(f"{experiment}.{setting}" for setting in settings),
        mock=False,
        models={kind: model} if model else {},
        typed={},
        events=tuple(events),
    )


def spin_down(*events):
    """A spin-down of a top that was spun by hand."""
    return a_plan("spin", "drive_waveform=NONE", "interval_s=5", events=events)


def a_scan(*events):
    """A Hall scan of five heights."""
    return a_plan("field", "step_m=0.02", "readings=2", events=events)


def left_on_before(*events):
    """A process that is killed while it drives, and another one."""
    return a_plan("spin", "drive_frequency_hz=35", events=[Event("kill", 0, 300), *events])


#: Each of these once failed.
FAILED_ONCE = {
    "a loss of power took events": a_plan("spin", "hold_s=0", "drive_frequency_hz=35", events=[Event("power", 0, 121)]),
    "a record without a frequency was no row": a_plan("trace", "records=3", "points=1000", model="DSOX1000"),
    "the computer stood still during a count": spin_down(Event("slow disk", 0, 154)),
    "no disk after a kill, and the drive on": left_on_before(Event("disk error", 1, 1)),
    "no generator after a kill, and the drive on": left_on_before(*(Event("link", 1, 1, 0.05) for _ in range(3))),
    "Ctrl-C after a kill, and the drive on": left_on_before(Event("ctrl-c", 1, 1)),
    "a probe was zeroed outside of its chamber": a_scan(Event("mistypes", 0, 1)),
    "a finished run could not be described": draw(400442),
    "the folder went when the run was finished": draw(400597),
    "a top was taken before it was filmed": draw(411516),
    "a held spin was resumed half a reading early": draw(400407),
    "a mock's multimeter counted over 0.1 s": draw(610728),
    "a multimeter hid what the bursts do": draw(611873),
    "the lid was closed while a top fell": draw(761304),
    "a phone showed the image of a spin": draw(771759),
    "a top fell within the window of a phone": draw(762582),
    "the lid was closed while a phone counted": replace(draw(820013), models={"counter": "phyphox"}),
    "a folder was removed from a full disk": draw(840092),
    "a folder was removed before the power went": a_plan(
        "spin", "hold_s=0", "drive_frequency_hz=35", events=[Event("folder", 0, 187), Event("power", 0, 478)]
    ),
}


@pytest.mark.parametrize("name", FAILED_ONCE)
def test_a_laboratory_that_once_failed_does_not(name):
    told = visit(FAILED_ONCE[name], exit_status)
    assert told.findings == (), "\n".join(told.story)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.usefixtures("drawn_figures")
def test_nothing_is_wrong_in_a_laboratory(seed):
    told = visit(draw(seed), exit_status)
    assert told.findings == (), "\n".join(told.story)


def test_a_seed_gives_the_same_trace_in_another_process(levilab_process):
    """Python orders sets differently there."""
    told = visit(draw(7), exit_status)
    assert len(told.trace) > 100
    assert levilab_process("fuzz", "--seed", "7").stdout.splitlines()[-1] == f"trace {told.digest}"


# --- what it would notice ---


WITHOUT_SYNC = (SimulatedComputer, "sync", lambda *_: None)
READING, READINGS_EVERY, RECONNECT = RunWriter.reading, Session.readings_every, Session.reconnect
FLUX_DENSITY = LakeShoreGaussmeter.flux_density


def off_by_a_turn(writer, row):
    row["spin_frequency_hz"] += 0.5
    READING(writer, row)


#: What is wrong in the program, by whom that is noticed, and in which laboratory.
MISTAKES = {
    "without sync": (WITHOUT_SYNC, "lost", spin_down(Event("power", 0, 150))),
    "shown before it is written": ((RunWriter, "reading", lambda *_: None), "lost", spin_down()),
    "written twice": ((RunWriter, "reading", lambda *row: [READING(*row), READING(*row)]), "doubled", spin_down()),
    "a defect": ((Bench, "changed_settings", lambda *_: {}["of no such name"]), "traceback", spin_down()),
    "off by a turn": ((RunWriter, "reading", off_by_a_turn), "wrong reading", spin_down()),
    "another height than typed": (
        *((field, "parse_height", lambda _: 0.05), "wrong reading"),
        a_scan(Event("types a height", 0, 3)),
    ),
    "in gauss": (
        *((LakeShoreGaussmeter, "flux_density", lambda meter: 1e4 * FLUX_DENSITY(meter)), "wrong reading", a_scan()),
    ),
    "readings that catch up": (
        (Session, "readings_every", lambda session, interval, most: READINGS_EVERY(session, interval / 3, most)),
        *("crowded", spin_down()),
    ),
    "not set up again": (
        (Session, "reconnect", lambda session, kind, error, _: RECONNECT(session, kind, error, lambda: None)),
        *("false fall", spin_down(Event("plug", 0, 150, 0.03))),
    ),
    "drives on": (
        (driving, "drive_off", lambda _: None),
        "output",
        a_plan("spin", "hold_s=0", "drive_frequency_hz=35"),
    ),
    "fails without a reason": (
        (ReciprocalCounter, "_reading", lambda driver, *asked: driver.reject(*asked, "another number")),
        *("gave up", spin_down()),
    ),
    "None in a report": ((visiting, "page_of", lambda _: "<p>None</p><svg>NaN</svg>"), "report", spin_down()),
    "raises what the disk says": (
        (Run, "events", lambda run: [(run.folder / "run.json").read_bytes() for _ in range(9)] and []),
        *("traceback", replace(spin_down(), seed=31)),
    ),
    "left on": (
        *((Bench, "outputs_off", lambda _: None), "output"),
        a_plan("spin", "drive_frequency_hz=35", events=[Event("ctrl-c", 0, 300)]),
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
@pytest.mark.usefixtures("undrawn_figures")
def test_a_mistake_in_the_program_is_noticed(name, monkeypatch):
    mistake, oracle, plan = MISTAKES[name]
    monkeypatch.setattr(*mistake)
    assert oracle in {finding.oracle for finding in visit(plan, exit_status).findings}


def test_ctrl_c_is_pressed_in_a_worker_too_which_blocks_its_own():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with interruption_blocked():
            told = visit(spin_down(Event("ctrl-c", 0, 154)), exit_status)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
    assert "interrupted, status 130" in " ".join(told.story)


@pytest.mark.usefixtures("undrawn_figures")
def test_a_failure_is_shrunk_to_what_it_needs(monkeypatch):
    monkeypatch.setattr(*WITHOUT_SYNC)
    events = [Event("slow disk", 0, 20, 0.01), Event("power", 0, 150)]
    plan = replace(spin_down(*events), typed={"group": "Group 7"}, models={"counter": "CNT-91"})
    small = shrink(visit(plan, exit_status), exit_status)
    assert [event.what for event in small.plan.events] == ["power"]
    assert not small.plan.typed
    assert not small.plan.models
    story = "\n".join(small.story)
    assert re.search(r"step 150: the computer loses its power\nprocess 1: [1-9]\d* readings shown; killed", story)


def test_many_laboratories_are_carried_out(levilab, monkeypatch):
    monkeypatch.setattr(explore, "processes", lambda _: this_process())
    told = levilab("fuzz", "--number", "2").stdout
    assert re.fullmatch(r"2 laboratories, \d+ a minute: 0 failed\n", told)

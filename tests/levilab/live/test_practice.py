"""The whole experiment in the browser, as a student without an instrument does it, at the bench's fastest speed."""

import json
import threading
import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from levilab.live.desk import Desk
from levilab.live.practice.bench import PracticeBench
from levilab.live.practice.what_if import WHAT_IF
from levilab.live.watch import SILENT_AFTER_S
from levilab.pipelines.tune.advice import advise
from levilab.pipelines.tune.owner import Owner
from levilab.simulator import preset
from levilab.telemetry.address import Address, write_address
from levilab.telemetry.messages import Count, Drive, Poses, State
from support.browser import PHONE
from support.live_pages import PATIENCE_S, GrowingRun, address, carry_out_here, publish, serving, spin_down, until

OLDER = "20251122T100000Z-spin-0000"


@pytest.fixture(scope="module")
def older(tmp_path_factory):
    run = GrowingRun(tmp_path_factory.mktemp("runs"), OLDER)
    run.readings(spin_down(19))
    return run


@pytest.fixture(scope="module")
def served(older):
    out = older.folder.parent
    with PracticeBench(out) as bench, serving(out, desk=Desk(bench)) as hall:
        yield hall


#: A run that is up soon: a student's is at 34 Hz, a minute of the bench later.
QUICK = ("spin.drive_frequency_hz=31", "spin.drive_waveform=SQU", "spin.ramp_hz_per_s=0.1", "spin.hold_s=2",
         "spin.interval_s=2")  # fmt: skip
#: A top that another program's bench publishes.
POSE = Poses(7.0, 1 / 400, np.full((1, 3), 0.1), np.array([[0.0, 0.0, 0.0, 1.0]]), np.ones(1, dtype=bool))
#: The control that the page marks as the next one to use, buttons that are drawn as it, and whether Analyze is one.
NEEDED = "document.querySelector('.needed')?.id"
SOLID = "[...document.querySelectorAll('#controls .main')].map((one) => one.id).join()"
CAN_BE_ANALYZED = "!document.getElementById('analyze').disabled"
#: The steps of the guide that are ticked.
DONE = "[...document.querySelectorAll('#guide .done')].map((one) => one.dataset.step).join()"


def see_another_program_record(page, served, older):
    """The bench of that program is shown, and the controls, which are of the one for practice, are off meanwhile."""
    scene = preset("practice").as_table()
    scene["base"] |= {"outer_radius_m": 0.07}
    older.say(configuration={"scene": scene})
    outer = page.evaluate("levilab.space.parts.base.outer")
    with older.running():
        write_address(older.folder, Address.at(1))
        until(page, "levilab.data.about.status === 'running' && levilab.seen.source === 1")  # it listens to that bench
        publish(served.watches[OLDER], State(7.0, folder=str(older.folder)), POSE)
        until(page, "document.getElementById('controls').disabled && levilab.data.bench.time_s === 7")
        assert page.inner_text("#said").startswith("Another program records this run")
        assert page.evaluate(DONE) == "drive"  # as before: the guide is of the bench for practice
        until(page, "levilab.space.parts.base.outer === 0.07")  # the top and the base of that program
        page.get_by_role("button", name="To the practice bench").press("Enter")
        until(page, "levilab.seen.run === '' && !document.getElementById('controls').disabled")
        until(page, f"levilab.space.parts.base.outer === {outer} && document.getElementById('own').hidden")
        assert page.evaluate("document.activeElement.id") == "practice"
        assert page.inner_text("#run option:checked") == "no run of this bench yet"
        page.select_option("#run", OLDER)
        until(page, f"levilab.seen.run === '{OLDER}' && levilab.seen.source === 1")
        publish(served.watches[OLDER], State(8.0, folder=str(older.folder)), POSE)
        until(page, "document.getElementById('controls').disabled")
    older.say(status="finished")
    until(page, "!document.getElementById('controls').disabled && document.getElementById('said').textContent === ''")
    until(page, f"levilab.space.parts.base.outer === {outer}")  # and those of the bench for practice


def record_some_readings(page):
    """Meanwhile the oscilloscope, which the run does not read, shows the simulated signals."""
    own = page.get_by_role("button", name="To the practice bench")
    assert own.is_visible()  # an older run is shown
    listings = []
    page.route("**/runs", lambda route: listings.append(route))  # noqa: PLW0108 - Playwright takes no method of a list
    page.click("#back")  # it may be down by now
    page.click("#record")
    until(page, f"levilab.seen.run && levilab.seen.run !== '{OLDER}'")
    assert not own.is_visible()  # also while the run that has begun is not listed
    for listing in listings:
        listing.continue_()
    page.unroute("**/runs")
    until(page, f"levilab.data.bench?.busy && levilab.seen.run !== '{OLDER}' && levilab.data.count >= 3")
    until(page, "levilab.data.fit")
    until(page, "!document.getElementById('recording').hidden && document.getElementById('to-record').hidden")
    assert listings
    until(page, "[...levilab.data.records.values()].some((one) => one.drawn)")
    still = "this run does not use it; the signals are simulated"
    until(page, f"document.getElementById('scope-key').textContent.endsWith('{still}')")
    assert still in (page.get_attribute("#trace", "aria-label") or "")
    assert "ago" not in (page.get_attribute("#trace", "aria-label") or "")
    page.click("#record")


def type_into_the_fields(page):
    """Numbers with a comma and with a point are taken; what is no number, or none that is allowed, is refused."""
    for field, typed, said in (
        ("frequency", "333", "from 1 to 100 Hz, not 333"),
        ("frequency", "3o,5", "a number from 1 to 100 Hz, not 3o,5"),
        ("seed", "1.5", "a whole number from 0 to 999999999, not 1.5"),
    ):
        page.fill(f"#{field}", typed)
        page.keyboard.press("Enter")
        until(page, f"document.getElementById('{field}-wrong').textContent === '{said}'")
        page.evaluate("document.activeElement.blur()")
        frames = page.evaluate("levilab.frames")
        until(page, f"levilab.frames > {frames} + 2")
        assert page.get_attribute(f"#{field}", "aria-invalid") == "true"
        assert page.input_value(f"#{field}") == typed  # and not what the bench has
    page.fill("#seed", "0")  # else a task would wait
    page.fill("#frequency", "30")
    for typed, vpp in (("9,5", 9.5), ("9.75", 9.75)):
        page.fill("#amplitude", typed)
        page.keyboard.press("Enter")
        until(page, f"levilab.data.bench.drive.amplitude_vpp === {vpp}")
    page.keyboard.press("ArrowUp")
    until(page, "levilab.data.bench.drive.amplitude_vpp === 10")
    page.keyboard.press("Tab")


def change_what_if(page):
    """A slider has its effect at once; the task under way stands in the place of the guide."""
    slider = "document.querySelector('#quantities input')"
    assert page.locator("#quantities input").count() == len(WHAT_IF)
    page.evaluate(f"{slider}.value = 0.22, {slider}.dispatchEvent(new Event('input'))")
    until(page, "levilab.data.bench.what_if.washers_g === 0.22")
    tab = "getComputedStyle(document.querySelector('[aria-controls=what-if]'), '::after').content"
    assert page.evaluate(tab) == '" •"'  # seen from the other tabs, too
    ask_which_washers(page)
    page.click("#usual")
    until(page, f"levilab.data.bench.what_if.washers_g === 0.2 && {slider}.value === '0.2'")
    assert page.evaluate(tab) == "none"
    page.get_by_role("tab", name="Measure").press("ArrowLeft")  # the last one
    page.get_by_role("button", name="Count the stem").click()
    until(page, "document.getElementById('guide').hidden && !levilab.data.bench.drive.output")  # each begins without it
    assert page.input_value("#experiment") == "precession", "what the task asks for"
    until(page, "document.getElementById('speed').value === '1'")
    page.select_option("#speed", "10")
    page.select_option("#experiment", "spin")
    page.click("#leave-task")
    until(page, "!document.getElementById('guide').hidden && document.getElementById('task').hidden")
    page.get_by_role("tab", name="Measure").click()


def ask_which_washers(page):
    """The questions of levilab tune, with its advice: the washers are put on at the bench."""
    page.get_by_role("tab", name="What if").click()
    page.click("#washers summary")
    page.fill("#tune-top", "24.1 stones")
    page.click("#tune-ask")
    until(page, "document.getElementById('tune-text').textContent.includes('a mass such as')")
    page.fill("#tune-top", "24.1")
    page.click("#tune-ask")
    until(page, "document.getElementById('tune-text').textContent.startsWith('Put on ')")
    assert page.evaluate("document.getElementById('tune-why').getBoundingClientRect().bottom <= innerHeight")
    page.click("#tune-did [value=sinks]")  # the next one is lighter, by the rules of the command
    until(page, "document.querySelectorAll('#tune-trials li').length === 1")
    assert "sank" in page.inner_text("#tune-why")
    page.click("#tune-on")
    owner = Owner(24.1e-3).with_washers((2e-5, 4e-5, 1e-4, 2e-4, 4e-4)).with_trial(page.inner_text("#tune-trials li"))
    best = 1e3 * sum(advise(owner, 20.0).best.washers_kg)
    until(page, f"Math.abs(levilab.data.bench.what_if.washers_g - {best}) < 1e-6")
    page.hover("#field-value")  # the lowest of the readings: nothing lies over it


#: Another top is drawn while the motion stands still, as with reduced motion, and its poses, a tenth of a millimetre
#: apart, have begun again.
ANOTHER_TOP = """() => {
  const space = levilab.space, parts = space.parts, upright = [0, 0, 0, 1, 0, 0, 0, 1];
  space.add(0, 0.0025, new Float32Array([0, 0, 0.07, 0, 0, 0.0701]), new Float32Array(upright), [1, 1]);
  space.setParts({...parts, another: true});
  const place = space.state.place;
  space.setParts(parts);
  return place;
}"""


def record_quickly(route):
    """Give a run that a page asks for the settings of a test."""
    wanted = json.loads(route.request.post_data or "{}")
    more = {"settings": QUICK} if wanted["do"] == "record a run" else {}
    route.continue_(post_data=json.dumps(wanted | more))


def load_again(page, name):
    """As for another language: the run, and the experiment that was chosen, are there; one button is the next step."""
    page.select_option("#experiment", "hold")
    page.reload()
    until(page, f"levilab.seen.run === '{name}' && levilab.data.count >= 3 && {CAN_BE_ANALYZED}")
    assert page.input_value("#experiment") == "hold"
    until(page, f"{SOLID} === 'analyze'")


def read_the_report_and_come_back(page, name):
    """As from an opened file: all steps of the guide are still done."""
    page.evaluate("document.getElementById('report').click()")
    until(page, "document.getElementById('guide').hidden")
    page.goto("about:blank")
    page.go_back()
    until(page, f"window.levilab?.seen.run === '{name}' && {CAN_BE_ANALYZED}")
    until(page, "document.getElementById('guide').hidden && document.getElementById('fit-head').offsetParent")


def test_a_student_drives_records_and_analyzes(served, older, watched, monkeypatch):
    page = watched(device_scale_factor=0.5)  # fewer pixels to draw for a minute
    page.route("**/do?*", record_quickly)
    page.goto(address(served, token=True))
    until(page, "levilab.data.bench?.last.spin_frequency_hz && levilab.space?.frames && levilab.space.state")
    assert page.evaluate(ANOTHER_TOP) == pytest.approx([0, 0, 0.07], abs=2e-4)
    page.click("#match")
    page.keyboard.press("d")
    until(page, "levilab.data.bench.drive.output")
    until(page, "document.getElementById('drive').getAttribute('aria-pressed') === 'true'")
    ticked_early = "document.querySelectorAll('#guide .done').length && !levilab.data.bench.took_hold"
    assert not page.evaluate(ticked_early)  # a slow machine may come here when the drive has taken hold
    page.select_option("#speed", "10")
    page.select_option("#experiment", "hold")
    assert page.inner_text("#asks").endswith("The amplitude says it. About 3:00 min of the bench, 18 s at 10 ×.")
    page.select_option("#experiment", "spin")
    until(page, "document.getElementById('event-list').textContent.includes('the top follows the drive')")
    until(page, "document.querySelectorAll('#guide .done').length === 1")
    page.evaluate("levilab.data.before = levilab.data.bench.drive.frequency_hz")
    page.keyboard.press(".")  # from a spin that was counted, which lies between the steps of the field
    until(page, "Math.abs(levilab.data.bench.drive.frequency_hz - levilab.data.before - 0.05) < 0.006")
    type_into_the_fields(page)
    change_what_if(page)
    assert page.evaluate("[levilab.seen.run, document.getElementById('run').value, levilab.data.count]") == ["", ".", 0]
    page.select_option("#run", OLDER)  # of another bench, and it is there like one of this
    until(page, f"levilab.data.count === 19 && levilab.data.bench && {CAN_BE_ANALYZED}")
    with monkeypatch.context() as quick:
        quick.setattr(served.analyses, "carry_out", lambda _: (0, ""))
        page.click("#analyze")
        until(page, "document.getElementById('result').open && !document.getElementById('verdict').innerText")
    page.keyboard.press("Escape")
    page.evaluate("document.getElementById('report').click()")
    frames = page.evaluate("levilab.frames")
    until(page, f"levilab.frames > {frames}")
    assert page.evaluate(DONE) == "drive"  # this bench has recorded nothing
    see_another_program_record(page, served, older)
    record_some_readings(page)
    until(page, "document.body.dataset.state === 'interrupted'")
    assert page.input_value("#speed") == "10"  # as it was chosen
    name = page.input_value("#run")
    load_again(page, name)
    page.click("#hold")
    until(page, "levilab.data.bench.paused")
    monkeypatch.setattr(served.analyses, "carry_out", carry_out_here)
    page.click("#analyze")
    until(page, "document.querySelectorAll('#figures img').length && document.getElementById('verdict').innerText")
    until(page, f"{DONE} === 'drive,tune,record,analyze'")  # the run tuned the drive up
    assert page.text_content("#fit-lines").startswith(page.text_content("#verdict p >> nth=0"))
    read_the_report_and_come_back(page, name)
    assert sorted(path.name for path in served.root.iterdir()) == [OLDER, name]
    assert (served.root / name / "result.json").exists()


@pytest.fixture
def starting(tmp_path):
    not_ready = SimpleNamespace(address=None, may_record=False, events=list)
    with serving(tmp_path, desk=Desk(not_ready)) as hall:
        yield hall


def test_nothing_can_be_pressed_before_the_bench_is_there(starting, watched):
    page = watched(viewport=PHONE)
    page.goto(address(starting, token=True))
    until(page, "document.body.dataset.state === 'setup' && levilab.frames > 0")
    publish(starting.watches[""], State(1.0))  # it answers, and has measured nothing
    until(page, "levilab.data.bench")
    assert page.inner_text("body").count("being set up, for ") == 1
    assert page.locator("#waits").is_visible()
    assert page.is_disabled("#drive")
    measured = State(2.0, last={"spin_frequency_hz": 30.0}, drive=Drive("SQU", 30.0, 10.0, output=True))
    publish(starting.watches[""], measured)
    until(page, "document.body.dataset.state === 'idle' && !document.getElementById('controls').disabled")
    assert not any(text in page.inner_text("body") for text in ("being set up", "wait for the bench"))
    counted = replace(measured, time_s=3.0, count=Count(30.0, 2.75, 0.5))
    publish(starting.watches[""], counted)
    until(page, "document.getElementById('lock').textContent.startsWith('takes hold')")
    publish(starting.watches[""], replace(counted, took_hold=True))
    until(page, f"document.getElementById('lock').textContent.startsWith('follows') && {DONE} === 'drive'")
    held = replace(counted, time_s=4.0, drive=Drive("SQU", 33.3, 10.0, output=True, triggered=True))
    publish(starting.watches[""], held)  # 33.3 Hz is that of a cycle, and no drive is 3.3 Hz beside the top
    until(page, "document.getElementById('lock').textContent === 'triggers its drive'")
    until(page, "Number.isNaN(levilab.history.drives.at(-1)[1])")
    page.locator("#group").press_sequentially("d?")
    assert page.input_value("#group") == "d?"
    assert not page.locator("#keys").is_visible()
    assert page.evaluate("document.querySelector('header').offsetHeight") < 90  # two lines of 30 pixels, and room
    counter, practice = (
        page.evaluate(f"document.getElementById('{one}').offsetTop") for one in ("counter", "practice")
    )
    assert counter < practice
    starting.watches[""].clock = lambda: time.monotonic() + 2 * SILENT_AFTER_S
    until(page, "document.body.dataset.state === 'slow'")  # and not silent: it has not ended


def test_a_task_opens_the_control_that_it_needs_and_leads_to_the_next(starting, page):
    page.goto(address(starting, token=True))
    until(page, "levilab.frames > 0")
    here = State(2.0, last={"spin_frequency_hz": 30.0}, drive=Drive("SQU", 30.0, 10.0), count=Count(30.0, 1.8, 0.5))
    publish(starting.watches[""], here)
    until(page, f"{NEEDED} === 'match'")
    assert page.locator("#experiment").is_visible()
    page.evaluate("levilab.data.up = false")
    until(page, f"{NEEDED} === 'back' && document.getElementById('guide').hidden")  # no step goes with a top that lies
    assert page.inner_text("#to-back") == "Put the top back: it floats again."
    page.evaluate("levilab.data.up = true")
    until(page, f"{NEEDED} === 'match' && document.getElementById('to-back').hidden")
    page.evaluate("levilab.data.up = false")
    publish(starting.watches[""], replace(here, time_s=2.5, task="hold"))
    until(page, f"{NEEDED} === 'back' && !document.getElementById('to-back').hidden")
    publish(starting.watches[""], replace(here, time_s=3.0, task="mass"))
    until(page, f"{NEEDED} === 'washers_g'")
    page.evaluate("levilab.data.up = true")
    assert page.locator("#washers_g").is_visible()
    assert not page.locator("#guide").is_visible()
    page.get_by_role("tab", name="Tasks").click()  # a person may go elsewhere
    assert page.inner_text("#goal") == page.inner_text("#task-does")
    publish(starting.watches[""], replace(here, time_s=4.0, tasks_done=("catch", "mass")))
    until(page, "!document.getElementById('offer').hidden")
    assert page.inner_text("#offer-text").startswith("✓ Find the mass that floats: of 25 g only some tenths are free")
    assert page.inner_text("#next-task") == "Hold it for three minutes"
    assert page.locator("#guide").is_visible()  # its steps are not done
    assert page.inner_text("#tasks-done") == "2/6"


def test_a_run_and_a_task_wait_until_no_field_is_wrong(starting, page):
    asked, wrong = [], "First correct this: Seed, a whole number from 0 to 999999999, not x"

    def take(route):
        asked.append(route.request.post_data_json)
        route.fulfill(json={"number": 1})

    show_a_top(starting, page)
    page.route("**/do?*", take)
    page.fill("#seed", "x")
    for tab, button in (("Measure", "#record"), ("Tasks", "#task-list button >> nth=0")):
        page.evaluate("document.getElementById('said').textContent = ''")
        page.get_by_role("tab", name=tab).click()
        page.click(button)
        until(page, f"document.getElementById('said').textContent === '{wrong}'")
    assert asked == []
    page.get_by_role("tab", name="Measure").click()
    page.fill("#seed", "7")
    with page.expect_request(lambda one: "record a run" in (one.post_data or "")):
        page.click("#record")
    assert page.inner_text("#said") == ""
    page.select_option("#speed", "10")
    page.get_by_role("tab", name="Tasks").click()
    with page.expect_request(lambda one: "begin a task" in (one.post_data or "")):
        page.click("#task-list button >> nth=0")
    assert {"do": "set the speed", "speed": 1} in asked  # at 10 × it would be down before the task is read
    publish(
        starting.watches[""], State(3.0, last={"spin_frequency_hz": 30.0}, drive=Drive("SQU", 30.0, 10.0), task="catch")
    )
    until(page, "document.getElementById('task-does').textContent.endsWith(' Time goes at 1 × again.')")


def test_after_a_run_the_last_minutes_show_what_a_person_does(starting, page, tmp_path):
    run = GrowingRun(tmp_path, OLDER)
    run.readings(spin_down(19))
    page.goto(address(starting, token=True))
    until(page, "levilab.frames > 0")
    page.select_option("#run", OLDER)
    until(page, "levilab.data.count === 19")
    watch = starting.watches[OLDER]
    off = State(2.0, last={"spin_frequency_hz": 30.0}, drive=Drive("SQU", 30.0, 10.0))
    publish(watch, off)
    until(page, "document.body.dataset.state === 'finished' && levilab.data.bench")
    assert page.inner_text("#readings-title") == "Readings"
    assert page.text_content("#run-label") == "Run"
    publish(watch, replace(off, time_s=2.1, task="guess"))  # n is asked for
    until(page, "document.getElementById('fit-head').textContent.startsWith('The fit is shown once')")
    publish(watch, replace(off, time_s=2.2, task="stem"))  # of a precession
    until(page, "!document.getElementById('fit-head').textContent.startsWith('The fit is shown once')")
    is_of_minutes = "document.getElementById('readings-title').textContent === 'The last minutes'"
    is_over = "document.getElementById('run-label').textContent === 'Last run'"  # the bench is ready, and shown
    publish(watch, replace(off, time_s=3.0, drive=Drive("SQU", 30.0, 10.0, output=True)))
    until(page, f"{is_of_minutes} && {is_over} && document.body.dataset.state === 'idle'")
    page.select_option("#drawn", "all")  # the run is still there
    until(page, f"!({is_of_minutes}) && document.body.dataset.state === 'finished'")
    page.set_viewport_size({"width": 1366, "height": 650})  # a laptop: the plot is as high as its two parts need
    assert page.evaluate("document.getElementById('plot').clientHeight") >= 190
    assert page.evaluate("document.documentElement.scrollHeight") == 650
    page.route("**/do?*", lambda route: route.fulfill(json={"number": 1}))
    for button in ("back", "usual"):
        page.evaluate(f"document.getElementById('{button}').click()")
        until(page, f"{is_of_minutes} && document.body.dataset.state === 'idle'")
        page.select_option("#drawn", "all")


def test_a_result_that_was_closed_early_is_opened_again(starting, page, tmp_path, monkeypatch):
    run, closed, asked = GrowingRun(tmp_path, OLDER), threading.Event(), []
    run.readings(spin_down(19))

    def answer(words):
        asked.append(words[0])
        if words[0] == "analyze":
            (run.folder / "result.json").write_text('{"sentences": ["The disc law."]}', encoding="utf-8")
        else:
            assert closed.wait(PATIENCE_S)
            (run.folder / "report.html").write_text("<p>", encoding="utf-8")
        return 0, ""

    monkeypatch.setattr(starting.analyses, "carry_out", answer)
    page.goto(address(starting, token=True))
    until(page, "levilab.frames > 0")
    page.select_option("#run", OLDER)
    until(page, "levilab.data.count === 19")
    publish(starting.watches[OLDER], State(2.0, last={"spin_frequency_hz": 30.0}, drive=Drive("SQU", 30.0, 10.0)))
    page.click("#analyze")
    until(page, "document.getElementById('writing').textContent.startsWith('The report is being written')")
    page.keyboard.press("Escape")
    closed.set()
    until(page, "!document.getElementById('report').hidden")  # the page has gone on to look
    page.click("#analyze")
    assert page.locator("#report").is_visible()
    assert page.inner_text("#verdict") == "The disc law."
    assert asked == ["analyze", "report"]  # each once


#: Whether the panel of each tab is seen whole, without a scroll of the page or of its part.
SEEN_WHOLE = """() => [...document.querySelectorAll('[role=tab]')].map((tab) => {
  tab.click();
  const panel = document.getElementById(tab.getAttribute('aria-controls')).getBoundingClientRect();
  const part = document.getElementById('practice');
  return panel.height > 60 && panel.bottom <= innerHeight && panel.right <= innerWidth
    && part.scrollHeight <= part.clientHeight;
})"""
#: Whether the counter's number and the picture of the top are in view, once the last control is.
STAYS_IN_VIEW = """() => {
  document.getElementById('task-list').lastElementChild.scrollIntoView({block: 'end'});
  return ['spin-value', 'space'].map((id) => {
    const {top, bottom, left, right} = document.getElementById(id).getBoundingClientRect();
    const over = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
    return top >= 0 && bottom <= innerHeight && over.closest('#counter, #top') !== null;
  });
}"""


def show_a_top(starting, page):
    """A top that stands still, on a bench that takes commands."""
    page.goto(address(starting, token=True))
    until(page, "levilab.frames > 0")
    up = Poses(2.0, 1 / 400, np.full((1, 3), 0.07), np.array([[0.0, 0.0, 0.0, 1.0]]), np.ones(1, dtype=bool))
    publish(starting.watches[""], State(2.0, last={"spin_frequency_hz": 30.0}, drive=Drive("SQU", 30.0, 10.0)), up)
    until(page, "!document.getElementById('controls').disabled && levilab.space?.state && levilab.space.frames")


@pytest.mark.parametrize(
    ("width", "height", "whole"),
    [(1280, 800, True), (1024, 768, True), (1366, 625, True), (390, 844, True), (640, 400, False)],
)
def test_controls_and_top_are_seen_together(starting, watched, width, height, whole):
    """A trace on a desk has 36 px, 18 for its label; 640 × 400 is 1280 × 800 at a zoom of 200 %, where they scroll."""
    page = watched(viewport={"width": width, "height": height})
    show_a_top(starting, page)
    assert page.evaluate(SEEN_WHOLE) == 3 * [whole]
    assert page.evaluate(STAYS_IN_VIEW) == [True, True]
    assert page.evaluate("document.documentElement.scrollWidth") == width
    seen = page.evaluate("[document.documentElement.scrollHeight, document.getElementById('trace').clientHeight]")
    assert width < 1000 or (seen[0] == height and seen[1] >= 108)


#: The control that has the focus, and whether it is marked, in the window, and covered by nothing.
FOCUSED = """() => {
  const one = document.activeElement, style = getComputedStyle(one);
  const {top, bottom, left, right} = one.getBoundingClientRect();
  const over = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
  const free = one.contains(over) || over?.contains(one) || [...one.labels || []].some((label) => label.contains(over));
  const inside = top >= 0 && bottom <= innerHeight + 1 && left >= 0 && right <= innerWidth + 1;
  return [one.id || one.textContent, style.outlineStyle !== 'none' && inside && free];
}"""


@pytest.mark.parametrize(("width", "height"), [(390, 844), (640, 400)])
def test_the_keyboard_comes_to_each_control_in_order_and_sees_it(starting, watched, width, height):
    """Nothing that stays in view covers what has the focus."""
    page = watched(viewport={"width": width, "height": height})
    show_a_top(starting, page)
    page.focus("#space")
    seen = [("space", True)]
    while seen[-1][0] != "record":
        page.keyboard.press("Tab")
        seen.append(tuple(page.evaluate(FOCUSED)))
        assert len(seen) < 40
    assert [name for name, is_seen in seen if not is_seen] == []
    order = ["space", "show-path", "motion", "drive", "frequency", "speed", "Measure", "experiment", "record"]
    assert [name for name, _ in seen if name in order] == order
    page.keyboard.press("?")
    assert page.locator("#keys").is_visible()
    page.keyboard.press("Escape")
    assert not page.locator("#keys").is_visible()


def test_fingers_turn_the_top_come_nearer_and_scroll(starting, watched):
    """A phone: one finger from side to side, two apart, and one upwards."""
    page = watched(viewport=PHONE, has_touch=True)
    show_a_top(starting, page)
    cdp, box = page.context.new_cdp_session(page), page.locator("#space").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def draw(*paths):
        """Move a finger for each path, and return the picture then."""
        frames = page.evaluate("levilab.space.frames")
        for k in range(9):
            points = [{"x": x + k * dx, "y": y + k * dy, "id": n} for n, (dx, dy) in enumerate(paths)]
            cdp.send("Input.dispatchTouchEvent", {"type": "touchMove" if k else "touchStart", "touchPoints": points})
        cdp.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        if any(dx for dx, _ in paths):
            until(page, f"levilab.space.frames > {frames}")
        return page.locator("#space").screenshot()

    pictures = [page.locator("#space").screenshot(), draw((10.0, 0.0)), draw((-6.0, 0.0), (6.0, 0.0))]
    assert len(set(pictures)) == 3
    draw((0.0, -20.0))
    until(page, "scrollY > 40")


def test_an_axis_has_two_numbers_at_least(starting, page):
    page.goto(address(starting))
    for low, high in ((29.1, 31.5), (29.6, 30.4), (20.0, 35.0), (0.0, 1e-3)):
        found = page.evaluate(f"import('/page/plot.js').then(({{ticks}}) => ticks({low}, {high}, 2))")
        assert 2 <= len(found) <= 6
        assert low - 1e-9 < found[0] < found[-1] < high + 1e-9  # rounding


def test_a_page_without_the_token_may_only_look(served, page):
    page.goto(address(served))
    until(page, "document.getElementById('controls').disabled")
    assert "only look" in page.inner_text("#said")
    page.evaluate("location.hash = 'readings'")  # the link to a part of the page is no token
    with page.expect_event("load"):
        page.goto(address(served, token=True))  # in the same tab, where only what follows # is new
    until(page, "!document.getElementById('controls')?.disabled && window.levilab?.data.bench")
    page.click("#pause")
    page.click("#drive")
    until(page, "document.getElementById('said').textContent.startsWith('The view is paused')")
    page.click("#pause")
    until(page, "document.getElementById('said').textContent === ''")

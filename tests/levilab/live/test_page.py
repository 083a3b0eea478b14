"""The live view in a browser: it loads, updates, survives, and takes what a run contains for text."""

import io
import shutil
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from PIL import Image

from levilab.formats.table import read_table
from levilab.formats.understanding import SPIN
from levilab.telemetry.messages import Count, Counting, Drive, Poses, Record, State
from support.browser import DESK, PHONE, watch
from support.live_pages import GrowingRun, address, publish, serving, spin_down, until

HOSTILE = '<img src=x onerror="window.hacked=1"><script>window.hacked=1</script>&lt;b&gt;'
NAME = "20261122T090000Z-spin-0bad"
#: What is said of the oscilloscope's screen to those who do not see it.
SAID = "document.getElementById('trace').getAttribute('aria-label')"


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    root = tmp_path_factory.mktemp("runs")
    hostile = GrowingRun(
        root, NAME, note=HOSTILE, instruments={"counter": {"identity": f"Maker,{HOSTILE},1,2", "driver": HOSTILE}}
    )
    hostile.readings(spin_down(19))
    hostile.event(HOSTILE, kind=HOSTILE)
    hostile.event("the top follows the drive", time_s=130.0, utc="2026-11-22T09:03:00.5Z")
    hostile.event("a command before the run", utc="2026-11-22T08:00:00.1Z")
    return root


@pytest.fixture(scope="module")
def hall(runs):
    with serving(runs) as hall:
        yield hall


@pytest.fixture(scope="module")
def shown(browser, hall):
    """A page that shows a finished run whose texts are hostile."""
    with watch(browser, timezone_id="Asia/Kolkata") as page:
        page.goto(address(hall, NAME))
        until(page, "levilab.drawn > 0 && levilab.data.fit")
        yield page


def test_a_finished_run_stands_there_with_its_fit(shown):
    assert shown.inner_text("#state-word") == "finished"
    assert shown.inner_text("#count") == "19"
    assert shown.inner_text("#fit-head").startswith("disc law   ω̇")  # no "so far", and nothing dashed beyond the last
    assert shown.evaluate("levilab.data.fit.x.at(-1) - levilab.data.readings.x.at(-1)") == 0
    assert shown.inner_text("#fit-lines").split(" · ")[0].count("(") == 2  # one constant: its u, and its unit
    assert shown.inner_text("#spin-value") == f"{spin_down(19)[-1][1]:.4f}"


def test_nothing_that_a_run_contains_becomes_markup(shown):
    made = "[window.hacked, document.images.length, document.querySelectorAll('main script').length]"
    assert shown.evaluate(made) == [None, 0, 0]
    assert HOSTILE in shown.inner_text("#event-list")
    assert HOSTILE in shown.inner_text("#facts")
    assert HOSTILE in shown.text_content("#counter-model")


def test_events_have_the_time_of_the_clock_on_the_wall_and_that_of_the_run(shown):
    times = shown.evaluate("[...document.querySelectorAll('#event-list time')].map((one) => one.textContent)")
    assert times == ["14:33:00 (2:10)", "14:30:05", "13:30:00"]  # the latest first, also where it came before
    assert shown.inner_text("#events-key") == "in brackets: time of the run"


def test_on_a_desk_nothing_scrolls(shown):
    root = "document.documentElement"
    assert shown.evaluate(f"[{root}.scrollWidth, {root}.scrollHeight]") == [DESK["width"], DESK["height"]]
    cut_off = """[document.getElementById("state-text")].map((one) => {
        one.textContent = "a long text on the state of a run, ".repeat(6);
        const [right, bottom] = [one.getBoundingClientRect().right, one.getBoundingClientRect().bottom];
        const found = one.scrollWidth > one.clientWidth || right > innerWidth - 300
            || bottom > document.querySelector("main").getBoundingClientRect().top;
        one.textContent = "";
        return found; })[0]"""
    assert not shown.evaluate(cut_off)


def test_every_control_has_a_name_and_every_part_a_heading(shown):
    nameless = """[...document.querySelectorAll("button, select, input, a[href], canvas, [tabindex='0'], output")]
        .filter((one) => !(one.getAttribute("aria-label") || one.textContent.trim()
                           || one.labels?.[0]?.textContent.trim()))
        .map((one) => one.id || one.outerHTML)"""
    assert shown.evaluate(nameless) == []
    headed = """[...document.querySelectorAll("section")]
        .every((one) => document.getElementById(one.getAttribute("aria-labelledby")))"""
    assert shown.evaluate(headed)
    assert [shown.locator(name).count() for name in ("main", "header", "h1")] == [1, 1, 1]
    ids = shown.evaluate("[...document.querySelectorAll('[id]')].map((one) => one.id)")
    assert len(ids) == len(set(ids))


def test_texts_stand_out_from_their_ground_by_day_and_by_night(shown):
    contrasts = """() => {
        const parts = (colour) => colour.match(/[\\d.]+/g).slice(0, 3).map((v) => v / 255)
            .map((v) => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
        const light = (colour) => { const [r, g, b] = parts(colour); return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
        const ground = (one) => { for (; one; one = one.parentElement) {
            const colour = getComputedStyle(one).backgroundColor; if (!/, 0\\)$/.test(colour)) return colour; }
            return getComputedStyle(document.body).backgroundColor; };
        return [...document.querySelectorAll("p, dt, dd, h2, small, li span, time, b, output, em, label")]
            .filter((one) => one.offsetParent
                && [...one.childNodes].some((n) => n.nodeType === 3 && n.data.trim()))
            .map((one) => {
                const [a, b] = [light(getComputedStyle(one).color), light(ground(one))].sort((x, y) => y - x);
                return [(a + 0.05) / (b + 0.05), one.id || one.textContent.slice(0, 30)]; })
            .filter(([contrast]) => contrast < 4.5); }"""
    for scheme in ("dark", "light"):
        shown.emulate_media(color_scheme=scheme)
        assert shown.evaluate(contrasts) == []


def test_the_keys_go_from_reading_to_reading_and_pause(shown):
    shown.focus("#plot")
    shown.keyboard.press("End")
    until(shown, "document.getElementById('pointer').textContent.includes('180 s')")
    shown.keyboard.press("ArrowLeft")
    said = until(shown, "document.getElementById('pointer').textContent.includes('170 s') && pointer.textContent")
    assert "± 0.03 Hz" in said
    assert "from the fit" in said
    assert shown.evaluate("document.getElementById('news').textContent") == said
    for pressed in ("true", "false"):
        shown.keyboard.press("Space")
        assert shown.get_attribute("#pause", "aria-pressed") == pressed
    for part in ("#plot", "#run"):  # also in a list, whose letters choose an option
        shown.focus(part)
        shown.keyboard.press("?")
        assert shown.locator("#keys").is_visible()
        shown.keyboard.press("Escape")


def test_a_phone_scrolls_down_and_not_sideways(watched, hall):
    page = watched(viewport=PHONE, color_scheme="dark")
    page.goto(address(hall, NAME))
    until(page, "levilab.drawn > 0")
    assert page.evaluate("[document.documentElement.scrollWidth, innerWidth]") == [PHONE["width"], PHONE["width"]]


@pytest.fixture
def served(tmp_path):
    """A server of its own.  Before `page` among a test's fixtures, so that the page is closed first."""
    with serving(tmp_path) as hall:
        yield hall


def test_a_run_grows_is_torn_reloaded_and_ends(served, page, tmp_path):
    page.goto(address(served))
    until(page, "document.body.dataset.state === 'none'")
    run = GrowingRun(tmp_path, group="Group 7")
    with run.running():
        run.readings(spin_down(3))
        run.add("30.0,37.")
        until(page, "levilab.data.count === 3")
        assert page.inner_text("#state-word") == "running"
        publish(served.watches[run.folder.name], State(20.0))  # a bench that does not know how long it takes
        until(page, "levilab.data.bench")
        assert page.inner_text("#left") == ""
        run.add("1,0.03\n")
        until(page, "levilab.data.count === 4")
        page.reload()
        until(page, "levilab.data.count === 4")
        run.event("the lamp was moved", "warning", 31.0)
        until(page, "document.querySelector('#event-list .warning')")
        run.readings(spin_down(9, first=4))  # to 120 s; 25 Hz come at 143 s, 21.36 Hz at 199 s
        until(page, "document.getElementById('left').textContent === 'about 25 to 80 s left'")
        # the line ends where the head says
        assert page.evaluate("Math.abs(levilab.data.fit.x.at(-1) - levilab.data.end[1])") < 0.001
        for limits, said in (("-3, 21", "at most 25 s"), ("-9, -1", ""), ("80, 140", "about 80 s to 2:20 min")):
            assert page.evaluate(f"import('/page/words.js').then(({{between}}) => between({limits}))") == said
    chosen = "document.querySelector('#run option:checked').textContent"
    until(page, f"/^Group 7, spin-down, [-0-9/.,:APM ]+$/.test({chosen})")
    page.evaluate("void (window.fetch = () => new Promise(() => {}))")  # the list needs no second answer of the server
    run.say(status="finished")
    until(page, f"/^Group 7, spin-down, [-0-9/.,:APM ]+$/.test({chosen}) && document.body.dataset.state === 'finished'")


def test_two_views_of_a_run_one_closed_and_opened_again_and_the_folder_deleted(served, watched, tmp_path):
    run = GrowingRun(tmp_path)
    one, two = watched(), watched()
    with run.running():
        run.readings(spin_down(3))
        for page in (one, two):
            page.goto(address(served, run.folder.name))
            until(page, "levilab.data.count === 3")
        one.goto("about:blank")
        run.readings(spin_down(2, first=3))
        until(two, "levilab.data.count === 5")
        one.goto(address(served, run.folder.name))
        until(one, "levilab.data.count === 5 && document.body.dataset.state === 'running'")
        assert len(served.watches) == 1
    shutil.rmtree(run.folder)
    for page in (one, two):
        until(page, "document.body.dataset.state === 'missing'")
        assert page.evaluate("levilab.data.count") == 5  # what was read stays


def test_while_the_server_is_gone_the_list_of_runs_stays(served, page, tmp_path):
    """And no promise is rejected without a handler: Firefox reports one of a page that is left, too."""
    GrowingRun(tmp_path)
    page.goto(address(served))
    until(page, "levilab.frames > 0 && document.querySelectorAll('#run option').length === 1")
    page.evaluate("void (window.fetch = async () => { document.body.dataset.asked = '1'; throw TypeError('gone'); })")
    page.evaluate("document.getElementById('run').dispatchEvent(new Event('focus'))")
    until(page, "document.body.dataset.asked")
    assert page.locator("#run option").count() == 1


def test_what_the_bench_publishes_is_drawn(served, page, tmp_path):
    run = GrowingRun(tmp_path)
    page.goto(address(served, run.folder.name))
    until(page, "levilab.frames > 0")
    n, wave = 400, np.sin(np.linspace(0, 20, 1000)).astype("f4")
    turn = np.arange(n) * 2 * np.pi * 30 / 400
    quaternion = np.stack([0 * turn, 0 * turn, np.sin(turn / 2), np.cos(turn / 2)], axis=1)
    position = np.tile([0.0, 0.0, 0.075], (n, 1))
    drive = Drive("SIN", 31.25, 10.0, 0.0, output=True)
    publish(served.watches[run.folder.name], State(0.5, drive=drive))
    until(page, "levilab.history.drives.length === 1")
    publish(
        served.watches[run.folder.name],
        State(1.0, drive=drive, counting=Counting(0.5, 0.6),
              count=Count(31.25, 0.9, 0.5), last={"spin_frequency_hz": 31.25, "flux_density_t": 0.0191},
              virtual=True, speed=1.0),
        Record(1, "tape", 1.0, -0.1, 2e-4, wave, wave),
        Poses(0.0, 1 / 400, position, quaternion, np.ones(n, dtype=bool)),
    )  # fmt: skip
    until(page, "levilab.space?.frames > 1")
    assert page.inner_text("#drive-value") == "31.2500"
    assert page.inner_text("#lock").startswith("follows")
    assert page.inner_text("#field-value") == "19.100"
    assert until(page, "document.getElementById('top-text').textContent") == "floats at 75.0 mm"
    assert "tape from -1 to 1 volts" in page.get_attribute("#trace", "aria-label").replace("−", "-")
    assert page.inner_text("#scope-key") == ""
    later = State(13.0, last={"height_m": 0.11, "flux_density_t": 0.00896}, virtual=True, speed=1.0, probe_m=0.072)
    publish(served.watches[run.folder.name], later)
    assert "volts, 12 s ago, over" in until(page, f"{SAID}.includes('ago') && {SAID}")
    assert [page.inner_text(f"#{name}") for name in ("field-value", "probe")] == ["8.960", "11 cm above the base"]
    # the laser is not among the channels of this run, and the top falls before the next record of the tape
    up = np.arange(n) < n / 2
    publish(
        served.watches[run.folder.name],
        Record(1, "laser", 13.0, -0.1, 2e-4, wave, wave),
        Poses(13.0, 1 / 400, position, quaternion, up),
    )
    assert until(page, "document.getElementById('scope-key').textContent") == "the top is down"
    assert until(page, f"{SAID}.match(/fall/g)?.length") == 2
    publish(served.watches[run.folder.name], Record(2, "tape", 13.9, -0.1, 2e-4, 0 * wave, 0 * wave))
    assert until(page, f"{SAID}.includes('tape from 0 to 0 volts, laser from') && {SAID}").count("before the fall") == 1


def test_the_sway_of_a_top_is_drawn_while_it_is_filmed(served, page, tmp_path):
    run = GrowingRun(tmp_path, experiment="sway")
    time = np.arange(800) / 400  # two pieces of a second
    position = np.stack([5e-4 * np.cos(9 * time), 0 * time, 0.075 + 0 * time], axis=1)
    with run.running():
        run.readings(spin_down(3))
        page.goto(address(served, run.folder.name))
        until(page, "levilab.data.about?.status === 'running' && levilab.data.count === 3")
        assert page.evaluate("document.getElementById('drawn').lastElementChild.hidden")  # a real top is not seen
        for k in (0, 400):
            pose = np.tile([0.0, 0.0, 0.0, 1.0], (400, 1))
            piece = Poses(7.0 + k / 400, 1 / 400, position[k : k + 400], pose, np.ones(400, dtype=bool))
            publish(served.watches[run.folder.name], State(9.0, virtual=True, speed=1.0), piece)
        until(page, "levilab.data.readings.yAxis[0] === 'x' && levilab.data.readings.x.length === 100")
        x, y = (page.evaluate(f"[...levilab.data.readings.{one}]") for one in ("x", "low"))
        np.testing.assert_allclose(y, 5e-4 * np.cos(9 * np.array(x)), atol=1e-9)
        page.select_option("#drawn", "all")
        until(page, "levilab.data.readings.yAxis[0] === 'spin'")


def test_a_wide_view_shows_the_top_from_near_too(served, page, tmp_path):
    """It is seen half as large again and more, also where it has left the other picture."""
    run = GrowingRun(tmp_path)
    page.goto(address(served, run.folder.name))
    until(page, "levilab.frames > 0")
    space = page.locator("#space")

    def widths(height, time):
        """The widths of the blue body on the left and on the right of the picture [pixels]."""
        pose = Poses(time, 1 / 400, np.array([[0.0, 0.0, height]]), np.array([[0.0, 0.0, 0.0, 1.0]]), np.ones(1, bool))
        publish(served.watches[run.folder.name], pose)
        until(page, f"levilab.space?.state && Math.abs(levilab.space.state.place[2] - {height}) < 1e-6")
        red, _, blue = np.moveaxis(np.asarray(Image.open(io.BytesIO(space.screenshot())).convert("RGB"), int), -1, 0)
        columns = np.flatnonzero(((blue - red > 60) & (blue > 100)).sum(axis=0) > 8)
        return [int(np.ptp(part)) if part.size else 0 for part in np.split(columns, [np.searchsorted(columns, 400)])]

    floats, close = widths(0.075, 1.0)
    assert close > 1.5 * floats > 30
    gone, followed = widths(0.2, 2.0)
    assert gone == 0
    assert followed == pytest.approx(close, abs=3)
    page.uncheck("#close")
    assert widths(0.075, 3.0)[0] == pytest.approx(floats, abs=3)


#: Parts of a page that are written while it shows a number of frames.
WRITTEN = """(frames) => new Promise((done) => {
  const written = new Set(), end = levilab.frames + frames;
  const watch = new MutationObserver((all) => all.forEach(({target}) => written.add(target.id || target.nodeName)));
  watch.observe(document, {subtree: true, childList: true, attributes: true, characterData: true});
  const look = () => levilab.frames < end ? setTimeout(look, 20) : done([...written]);
  look();
})"""


def test_who_hears_the_page_hears_events_and_not_each_number(served, page, tmp_path):
    run = GrowingRun(tmp_path)
    watch = served.watches
    with run.running():
        page.goto(address(served, run.folder.name))
        until(page, "levilab.frames > 0")
        now = [datetime.now(UTC) - timedelta(seconds=late) for late in (60, 0)]
        for text, when in zip(("it was set up", "the top follows the drive"), now, strict=True):
            run.event(text, utc=when.isoformat())
        until(page, "document.getElementById('news').textContent === 'the top follows the drive'")  # the old is no news
        state = State(1.0, last={"spin_frequency_hz": 31.0}, virtual=True, speed=1.0)
        publish(watch[run.folder.name], state)
        until(page, "document.getElementById('spin-value').textContent === '31.0000'")
        until(page, "document.getElementById('plot').getAttribute('aria-label')?.endsWith(': no top is counted')")
        page.evaluate(f"void ({WRITTEN})(3).then((written) => {{ window.written = written; }})")
        for k in range(1, 100):
            publish(watch[run.folder.name], replace(state, time_s=1.0 + 0.001 * k))
            if page.evaluate("window.written"):
                break
            page.wait_for_timeout(60)
        assert page.evaluate("window.written") == []
    assert page.evaluate("[...document.querySelectorAll('output')].every((one) => one.ariaLive === 'off')")


def test_the_last_minutes_of_the_bench_are_drawn_before_the_first_reading(served, page, tmp_path):
    """Without a drive, with one, without light pulses; then only where a person wants them."""
    run = GrowingRun(tmp_path)
    watch = served.watches
    with run.running():
        page.goto(address(served, run.folder.name))
        until(page, "levilab.frames > 0")
        for time, spin, drive in ((1.0, 31.0, False), (2.0, 30.9, False), (3.0, 30.8, True), (200.0, None, True)):
            count = None if spin is None else Count(spin, time, 0.5)
            publish(watch[run.folder.name], State(time, count=count, drive=Drive("SIN", 30.75, 10.0, output=drive)))
            until(page, f"levilab.history.drives.at(-1)?.[0] === {time}")
            if spin:
                said = f"top at {spin:.2f} hertz" + ", drive at 30.75 hertz" * drive
                until(page, f"document.getElementById('plot').getAttribute('aria-label').endsWith(': {said}')")
        # of the last three minutes
        assert page.evaluate("[levilab.history.drives.length, levilab.history.counts.length]") == [1, 0]
        assert page.inner_text("#readings-title") == "The last minutes"
        assert not page.locator("#empty").is_visible()
        run.readings(spin_down(3))
        until(page, "levilab.data.count === 3 && document.getElementById('readings-title').textContent === 'Readings'")
        page.select_option("#drawn", "minutes")
        until(page, "document.getElementById('readings-title').textContent === 'The last minutes'")
        until(page, "document.getElementById('plot').getAttribute('aria-label').startsWith('the last ')")


def test_a_count_that_is_old_is_marked_as_old(served, page, tmp_path):
    """As on the ramp of a run, where nothing is counted: the drive goes on, and the top is not said to lag behind."""
    run = GrowingRun(tmp_path)
    with run.running():
        page.goto(address(served, run.folder.name))
        until(page, "levilab.frames > 0")
        for time, old, said in ((3.0, 0, "–"), (43.0, 1, "counted 40 s ago")):
            drive = Drive("SIN", 30.8 + time / 20, 10.0, output=True)
            last = {"spin_frequency_hz": 30.8}
            publish(served.watches[run.folder.name], State(time, last=last, count=Count(30.8, 3.0, 0.5), drive=drive))
            until(
                page, f"document.querySelectorAll('#counter .stale').length === {old} && levilab.history.drives.length"
            )
            until(page, f"document.getElementById('trend').textContent === '{said}'")
        assert page.inner_text("#lock") == "not counted now"


#: Keep the texts that canvases get.
KEEP_TEXTS = """() => {
  const draw = CanvasRenderingContext2D.prototype.fillText;
  window.written = [];
  CanvasRenderingContext2D.prototype.fillText = function (text, ...where) {
    window.written.push(text);
    draw.call(this, text, ...where);
  };
}"""


def save_what_is_drawn(page, run, folder):
    """What is synthetic says so in a table, which is read like any other, and in a picture."""
    with page.expect_download() as saved:
        page.click("#csv")
    assert saved.value.suggested_filename == f"{run.folder.name}.csv"
    saved.value.save_as(folder / "saved.csv")
    assert (folder / "saved.csv").read_text().startswith("# SYNTHETIC\ntime [s],spin [Hz],u spin [Hz]\n")
    read = read_table(folder / "saved.csv", quantities=SPIN).columns
    table = np.column_stack([read[name] for name in SPIN])
    np.testing.assert_allclose(table, spin_down(3), rtol=1e-6)  # single precision on the way to the page
    page.evaluate(KEEP_TEXTS)
    with page.expect_download() as saved:
        page.click("#png")
    picture = saved.value.path().read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert int.from_bytes(picture[20:24]) >= page.evaluate("document.getElementById('plot').height") + 3 * 18
    written = page.evaluate("window.written")
    assert f"{run.folder.name} (SYNTHETIC)" in written
    assert any(text.startswith("○ Readings     ") for text in written)  # and the fit, or that there is none


def test_a_fall_is_replayed_and_what_is_drawn_is_saved(served, watched, tmp_path):
    """Where less motion is wanted the page shows a picture a second, a replay too."""
    run = GrowingRun(tmp_path)
    page = watched()
    page.goto(address(served, run.folder.name))
    until(page, "levilab.frames > 0")
    assert page.input_value("#motion") == "0"
    n = 1200  # 3 s; it falls after 1.5 s, by 1 mm a pose
    up = np.arange(n) < n / 2
    position = np.zeros((n, 3))
    position[:, 2] = 0.075 - 1e-3 * np.clip(np.arange(n) - n / 2, 0, 55)
    upright = np.tile([0.0, 0.0, 0.0, 1.0], (n, 1))
    watch = served.watches[run.folder.name]
    publish(watch, State(1.0, count=Count(22.6, 1.0, 0.5), virtual=True, speed=1.0))
    until(page, "levilab.history.counts.length")
    publish(watch, *(Poses(k / 400, 1 / 400, position[k : k + 300], upright[k : k + 300], up[k : k + 300])
                     for k in range(0, n, 300)))  # fmt: skip
    until(page, "levilab.space?.state && !levilab.space.state.up && document.getElementById('replay').offsetParent")
    assert page.inner_text("#top-text") == "lies where it fell"
    assert page.evaluate("levilab.history.marks.map(([, text]) => text)") == ["fell"]
    page.click("#replay")
    at = "levilab.space.state.time"  # 4 s of the replay before the fall, and not 3 s, the newest
    until(page, f"levilab.space.state.up && {at} > 1.29 && {at} < 1.5")
    publish(watch, State(2.0, count=Count(22.6, 1.0, 0.5), virtual=True, speed=1.0))
    until(page, "document.getElementById('top-text').textContent === 'falls, 20 times slower'")
    page.fill("#played", "0.1")  # of 1.4 s, which begin at 0.5 s
    until(page, f"Math.abs({at} - 0.65) < 0.03 && levilab.space.played < 0.13")
    with page.expect_download() as saved:
        page.click("#csv")
    rows = saved.value.path().read_text().splitlines()
    assert rows[:2] == ["# SYNTHETIC", "bench_time_s,spin_frequency_hz,drive_frequency_hz"]
    assert rows[2:] == ["0.75,22.6,", "1,,", "2,,"]  # the count at the middle of its gate, and when it was looked
    run.readings(spin_down(3))
    until(page, "levilab.data.count === 3 && levilab.data.shown.head")
    save_what_is_drawn(page, run, tmp_path)
    assert page.evaluate("levilab.space.replays")
    page.reload()  # as for another language
    until(page, "levilab.frames > 0")
    watch = served.watches[run.folder.name]
    publish(watch, Poses(3.0, 1 / 400, position[900:], upright[900:], up[900:]))  # the top lies there
    until(page, "levilab.space?.state && document.getElementById('replay').offsetParent")
    page.click("#replay")
    until(page, "levilab.space.replays")
    later = GrowingRun(tmp_path, "20261122T110000Z-spin-0000")
    watch.turn_to(later.folder)
    until(page, f"levilab.seen.run === '{later.folder.name}'")
    assert not page.evaluate("levilab.space.replays")
    page.click("#replay")
    assert page.evaluate("levilab.space.replays")
    publish(watch, Poses(4.0, 1 / 400, position[:300], upright[:300], up[:300]))  # another top floats
    until(page, "levilab.data.up")
    assert not page.evaluate("levilab.space.replays")


#: When the lamp flashed last before some times, of a drive that goes on at 1 s with 30 Hz, and to 40 Hz at 2.01 s.
FLASHES = """async () => {
  const {openHistory} = await import("/page/history.js");
  const history = openHistory();
  const drives = [[0, null], [1, 30], [2.01, 40], [3, null]];
  for (const [time_s, hz] of drives) history.add({time_s, last: {}, drive: {output: hz !== null, frequency_hz: hz}});
  return [0.5, 1.001, 1.999, 2.02, 2.5, 3.2].map((time) => history.flash(time));
}"""


def test_the_strobe_lamp_flashes_once_in_each_period_of_the_drive(shown):
    found = shown.evaluate(FLASHES)
    # 30.3 turns by 2.01 s: turn 31 comes 0.7/40 s later, and turn 50 at 2.5025 s
    ramp = [2.01 - 0.3 / 40, 2.01 + (49 - 30.3) / 40]
    assert found == pytest.approx([0.5, 1.0, 1.0 + 29 / 30, *ramp, 3.2], abs=1e-9)


#: A free top of a bench at 10x on a busy computer, whose states come every 4 s; it falls after 20 s.
FALL = """async () => {
  const {openHistory} = await import("/page/history.js");
  const history = openHistory(), found = [];
  for (let time_s = 0; time_s <= 400; time_s += 4) {
    const end_s = Math.min(time_s, 20), count = {frequency_hz: 30 - end_s / 9, end_s, gate_s: 0.5};
    const changed = history.add({time_s, count, drive: {output: false}}, time_s > 20);
    if (time_s === 84 || time_s === 400) found.push([changed, history.rests, history.drives.at(-1)[0]]);
  }
  return [history.counts.map((row) => row[1]), found];
}"""


def test_the_curve_of_a_top_that_fell_is_whole_and_stays(shown):
    counts, found = shown.evaluate(FALL)
    assert counts == pytest.approx([30 - end / 9 for end in range(0, 21, 4)])
    assert found == [[True, True, 80], [False, True, 80]]  # drawn once more, with the reason, and then no more


#: What is kept of a top that follows a ramp of 0.1 Hz/s, counted at first, then not, at states of a bench at 10x; then
#: a top that was put back, without a drive, and one more after a fall.
RAMP = """async () => {
  const {openHistory} = await import("/page/history.js");
  const history = openHistory(), here = [];
  const add = (time_s, spin, end_s, output = true) => {
    const count = {frequency_hz: spin, end_s, gate_s: 1}, drive = {output, frequency_hz: 30 + time_s / 10};
    history.add({time_s, count, drive});
    here.push(history.latest?.[0] ?? null);
  };
  for (let time = 0; time <= 20; time += 0.5) {
    const end = Math.min(Math.floor(time), 10);
    add(time, 30 + (end - 0.5) / 10, end);
  }
  add(21, 28.3, 21, false);
  add(22, 29.95, 22, false);
  history.mark(22.2, "fell");
  add(23, 29.9, 23, false);
  return [history.counts, here];
}"""


def test_a_count_is_compared_with_the_drive_of_its_own_time(shown):
    """On a ramp a count that is kept would fall behind a drive that the top follows."""
    counts, latest = shown.evaluate(RAMP)
    *of_ramp, gap, low, jump, high, fall, back = counts  # 28.3 to 29.9 Hz are three tops, and no line joins them
    ramp = np.array([row for row in of_ramp if np.isfinite(row[2])])
    assert len(ramp) >= 10
    np.testing.assert_allclose(ramp[:, 1], ramp[:, 2], atol=1e-9)
    assert [latest[20], latest[26], latest[27]] == [9.5, 9.5, None]  # 3 s after the gate of 1 s: a gate, and 2 s
    assert all(np.isnan([gap[1], jump[1], fall[1]]))
    assert [low[:2], high[:2], back[:2]] == [[20.5, 28.3], [21.5, 29.95], [22.5, 29.9]]


#: What stands on the chart of the last minutes: of a top that spins by 3.5 Hz less than its drive.
STRIP = """async () => {
  const {drawHistory} = await import("/page/history.js"), {fixed} = await import("/page/words.js"), said = [];
  const draw = (name) => (text) => { if (name === "fillText") said.push(text); return {width: 40}; };
  const context = new Proxy({}, {get: (_, name) => draw(name), set: () => true});
  const counts = [0, 1, 2].map((time) => [time, 30, 33.5, time]), drives = counts.map(([time]) => [time, 33.5]);
  drawHistory({context, fit: () => [600, 300]}, {drives, counts, marks: [], latest: counts[2], rests: false});
  return [said, fixed(-0.0001, 3), fixed(-0.01, 3)];
}"""


def test_a_difference_beyond_its_strip_is_a_number_and_a_zero_has_no_sign(shown):
    said, *numbers = shown.evaluate(STRIP)
    assert "top − drive [Hz]: −3.50" in said
    assert numbers == ["0.000", "−0.010"]


#: When a pulse that passes half of its height at t triggers the page, from records that began at other times.
TRIGGERED = """async (source) => {
  const {triggerOf, drawRecords, sheet} = await import("/page/plot.js");
  const paper = sheet(document.getElementById("trace")), found = [];
  for (const begin of [0, 3e-4, 0.011]) {
    const make = (channel, signal) => {
      const low = Float32Array.from({length: 600}, (_, k) => signal((begin + 4e-4 * k) * 30));
      return {channel, low, high: low, start_s: begin, step_s: 4e-4, drawn: true};
    };
    const tape = make("tape", (turns) => Math.exp(-(((turns % 1) - 0.5) ** 2) / 2e-3));
    const drive = make("drive", (turns) => source === "drive" ? 5 * Math.sin(2 * Math.PI * turns) : 0);
    found.push([triggerOf(tape), triggerOf(drive), drawRecords(paper, [tape, drive], "drive").split(", ").at(-1)]);
  }
  return found;
}"""


#: How far a pulse of light rises above the lowest point on a screen of a height, and how far it stays below the edge.
RISE = """async (height) => {
  const {drawRecords} = await import("/page/plot.js"), drawn = [];
  const context = new Proxy({}, {get: (_, name) => (x, y) => name === "lineTo" && drawn.push(y), set: () => true});
  const low = Float32Array.from({length: 9}, (_, k) => k === 4 ? 1.2 : 0.1);
  const records = ["drive", "laser", "tape"].map((channel) => ({channel, low, high: low, start_s: 0, step_s: 0.01}));
  drawRecords({context, fit: () => [240, height]}, records, "tape");
  return [(drawn.at(-1) - drawn.at(-5)) / height, drawn.at(-5) - height * 2 / 3];
}"""


def test_the_page_triggers_what_a_virtual_bench_draws(shown):
    """A wave stands still wherever its record begins; a drive that is off leaves the trigger to the tape."""
    for tape, drive, said in shown.evaluate(TRIGGERED, "drive"):
        rise = (0.5 - (2e-3 * np.log(2)) ** 0.5) / 30
        assert min(abs(tape - rise - k / 30) for k in range(3)) < 5e-5  # an eighth of a step
        assert min(abs(drive - k / 30) for k in range(3)) < 5e-6
        assert said == "triggered by the drive"
    assert [said for *_, said in shown.evaluate(TRIGGERED, "off")] == 3 * ["triggered by the tape"]
    assert all(shown.evaluate(RISE, height)[0] > 0.6 / 3 for height in (60, 90, 400))  # of the lane, the last of three
    assert all(shown.evaluate(RISE, height)[1] >= 18 for height in (108, 132, 400))  # a line of 12 px, below 6 px


def test_a_million_readings_are_drawn_from_a_few_thousand_numbers(served, page, tmp_path):
    run = GrowingRun(tmp_path)
    n = 1_000_000
    rows = np.stack([np.arange(n) * 0.04, 30 + np.sin(np.arange(n) / 1e5), np.full(n, 0.03)], axis=1)
    page.goto(address(served, run.folder.name))
    until(page, "levilab.frames > 0")
    followed = served.watches[run.folder.name].followed
    followed.readings.add(rows)
    run.readings([(1e5, 30.0, 0.03)])
    until(page, f"levilab.data.count === {n + 1}")
    assert page.evaluate("[levilab.data.readings.x.length < 2000, levilab.data.readings.single]") == [True, False]
    assert len(followed.readings.groups()) <= 8192

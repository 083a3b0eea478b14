"""The report in a browser: readings answer, nothing overflows, nothing that a run contains is markup or script."""

import json
import shutil

import pytest

from levilab.report.page import write_report
from levilab.report.worksheets.document import write_worksheets
from support.acquisitions import RAISED_QUICKLY, acquired
from support.browser import PHONE, watch
from support.figures import with_drawing
from support.paths import SAMPLE_DATA

EVIL = (
    """</script><script>window.pwned = 1</script><img src=x onerror="window.pwned = 2">${1+1}{{7*7}}"' &amp; --> ]]>"""
)
LONG = "x" * 3000


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """Of a run in which each text is hostile, or long and without a blank."""
    folder = tmp_path_factory.mktemp("report")
    run = folder / "run <b>bold<script>window.pwned = 3<"
    shutil.copytree(SAMPLE_DATA / "spin-down-1", run)
    record = json.loads((run / "run.json").read_text(encoding="utf-8"))
    settings = {EVIL: EVIL, "gate_s": 1.0, "slope": LONG}
    about = {"identity": EVIL, "address": LONG, "settings_start": {**settings, EVIL: LONG}, "settings_end": settings}
    record |= {
        "note": EVIL + LONG,
        "synthetic_how": EVIL,
        "command_line": ["levilab", EVIL, LONG],
        "started_utc": EVIL,
        "software": {EVIL: EVIL},
        "configuration": {"spin": {EVIL: EVIL, "drive_waveform": LONG}, "limits": {EVIL: EVIL}},
        "channels": [{"name": "spin_frequency_u_hz", "source": EVIL}],
        "instruments": {EVIL: about, LONG: about},
    }
    (run / "run.json").write_text(json.dumps(record), encoding="utf-8")
    events = [{"time_s": float(k), "kind": EVIL, "text": EVIL if k % 2 else LONG} for k in range(20)]
    (run / "events.jsonl").write_text("".join(json.dumps(event) + "\n" for event in events), encoding="utf-8")
    with with_drawing():
        return write_report([run], folder / "report.html", {"tilt": "none"})


@pytest.fixture(scope="module")
def desk(browser, report):
    with watch(browser) as page:
        page.goto(report.as_uri())
        yield page


def test_what_a_run_contains_is_text_and_runs_nowhere(desk):
    assert desk.evaluate("window.pwned") is None
    assert EVIL in desk.locator("main").inner_text()
    assert desk.locator("main b, main img, main script").count() == 0


def test_a_reading_answers_to_the_pointer_with_value_uncertainty_and_residual(desk):
    mark = desk.locator('[id="spindown-readings-0"] use').nth(2)
    mark.scroll_into_view_if_needed()
    box = mark.bounding_box()
    desk.mouse.move(box["x"] + box["width"] / 2 + 4, box["y"] + box["height"] / 2)
    tip = desk.get_by_role("tooltip")
    assert tip.is_visible()
    assert tip.inner_text().split("\n") == ["t = 20 s", "ν = 37.090(30) Hz", "ν − disc law = −0.014 Hz"]
    desk.mouse.move(2, 2)
    assert not tip.is_visible()


def test_a_reading_answers_to_the_keyboard_too(desk):
    marks = desk.locator('[id="spindown-readings-0"] use')
    marks.first.focus()
    tip = desk.get_by_role("tooltip")
    assert tip.inner_text().startswith("t = 0 s\n")
    desk.keyboard.press("ArrowRight")
    assert tip.inner_text().startswith("t = 10 s\n")
    desk.keyboard.press("End")
    assert tip.inner_text().startswith("t = 190 s\n")
    label = marks.last.get_attribute("aria-label")
    assert label.startswith("t = 190 s, ν = ")
    desk.keyboard.press("Escape")
    assert not tip.is_visible()


def test_a_figure_is_enlarged_and_whole_again(desk):
    def width():
        return float(desk.locator("figure svg").first.evaluate("svg => svg.viewBox.baseVal.width"))

    whole = width()
    desk.get_by_role("button", name="Enlarge the figure").click()
    assert width() == pytest.approx(whole / 2)
    desk.get_by_role("button", name="The whole figure").click()
    assert width() == pytest.approx(whole)


def test_what_is_folded_is_opened_for_the_printer_and_folded_again(desk):
    folded = desk.locator("details:not([open], .on-paper-out, .on-paper-summary)")
    count = folded.count()
    assert count > 0
    desk.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert folded.count() == 0
    desk.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert folded.count() == count


def test_on_paper_a_figure_stays_on_one_page(desk):
    figures = desk.locator("figure")
    desk.emulate_media(media="print")
    heights = [box["height"] for figure in figures.all() if (box := figure.bounding_box())]
    breaks = {figure.evaluate("one => getComputedStyle(one).breakInside") for figure in figures.all()}
    desk.emulate_media(media="screen")
    assert breaks == {"avoid"}
    assert max(heights) > 600, "one of them is tall"
    assert max(heights) < 265 * 96 / 25.4, "a page of A4 without its margins holds the tallest"


@pytest.mark.parametrize("script", [True, False])
def test_on_a_telephone_the_page_is_not_moved_sideways(browser, report, script):
    with watch(browser, viewport=PHONE, color_scheme="dark", java_script_enabled=script) as page:
        page.goto(report.as_uri())
        for details in page.locator("summary").all():
            details.click()
        right = page.evaluate("document.documentElement.scrollWidth") if script else _right_edge(page)
        assert right <= PHONE["width"]
        background = page.locator("body").evaluate("body => getComputedStyle(body).backgroundColor")
        assert background == "rgb(20, 24, 28)"
        card = page.locator(".card").first.evaluate("card => getComputedStyle(card).backgroundColor")
        assert card == "rgb(255, 255, 255)"  # figures are drawn in black
        joined = page.locator("sup").first.evaluate("sup => getComputedStyle(sup, '::before').content")
        assert joined == '"\u2060"', "no line ends between a unit and its power"
        covers = page.locator(".scroll").first.evaluate("table => getComputedStyle(table).backgroundAttachment")
        assert covers.startswith("local, local, scroll, scroll")  # the shades of what goes on beyond an edge


def test_on_a_telephone_a_figure_is_as_wide_as_it_can_be_read_and_moved_sideways(browser, report):
    with watch(browser, viewport=PHONE) as page:
        page.goto(report.as_uri())
        card = page.locator(".card").first
        assert card.evaluate("card => card.scrollWidth") >= 576  # 7 pt of 7 inches are 8 px there
        assert card.evaluate("card => { card.scrollLeft = 100; return card.scrollLeft; }") == 100


def _right_edge(page):
    box = page.locator("main").bounding_box()
    return box["x"] + box["width"]


def test_paper_is_light_and_holds_what_is_folded(browser, report):
    with watch(browser, color_scheme="dark") as page:
        page.goto(report.as_uri())
        drawn = "card => getComputedStyle(card).filter.startsWith('invert')"
        assert page.locator(".card:has(svg)").first.evaluate(drawn)
        page.emulate_media(media="print")
        assert not page.locator(".card:has(svg)").first.evaluate(drawn)
        assert page.locator("body").evaluate("body => getComputedStyle(body).backgroundColor") == "rgb(255, 255, 255)"
        assert not page.locator(".zoom").first.is_visible()
        # neither a heading with its lead nor the titles of a table stand alone at the foot of a page
        for above in ("section > h3", "section > .lead"):
            assert page.locator(above).first.evaluate("one => getComputedStyle(one).breakAfter") == "avoid"
        first = page.locator("tbody tr:first-child").first
        assert first.evaluate("row => getComputedStyle(row).breakBefore") == "avoid"


@pytest.mark.parametrize(("sample", "short", "pages"), [("spin-down-1", True, 1), ("lower-limits", False, 3)])
def test_on_paper_the_figure_shares_a_page_with_the_result(browser, tmp_path, sample, short, pages):
    with with_drawing(), watch(browser) as page:
        page.goto(write_report([SAMPLE_DATA / sample], tmp_path / "report.html", short=short).as_uri())
        margin = dict.fromkeys(("top", "right", "bottom", "left"), "10mm")
        assert page.pdf(format="A4", margin=margin).count(b"/Type /Page\n") == pages


def test_a_short_report_and_a_worksheet_are_a_page_with_the_margins_of_a_printer(browser, tmp_path):
    (tmp_path / "run").mkdir()
    run = acquired("spin", seed=1, group="Group 1", out=tmp_path / "run", settings=RAISED_QUICKLY).folder
    with with_drawing(), watch(browser) as page:
        for file in (
            write_report([run], tmp_path / "short.html", short=True),
            *write_worksheets([], tmp_path, {f"Gruppe {k}": k for k in range(12)}, language="de", keys=False),
        ):
            page.goto(file.as_uri())
            assert page.pdf(prefer_css_page_size=True).count(b"/Type /Page\n") == 1, file.name


@pytest.mark.parametrize("sample", ["spin-down-1", "sway/track.csv", "lower-limits", "hold/45-hz", "precession-sweep"])
def test_the_figure_of_a_short_report_has_the_room_that_the_rest_leaves_of_its_page(browser, tmp_path, sample):
    with with_drawing(), watch(browser, viewport={"width": 680, "height": 1020}) as page:  # A4 at 96 dpi less margins
        page.goto(write_report([SAMPLE_DATA / sample], tmp_path / "report.html", short=True).as_uri())
        page.emulate_media(media="print")
        figure, whole = page.locator(".short").bounding_box(), page.locator(".short svg").bounding_box()
        assert figure == whole
        width, height = page.locator(".short svg").evaluate(
            "svg => [svg.viewBox.baseVal.width, svg.viewBox.baseVal.height]"
        )
        end = page.locator("main > :last-child").bounding_box()
        left = 1020 - end["y"] - end["height"]
        assert left < 40 or figure["height"] > 0.98 * figure["width"] * height / width  # it is as wide as the page
        assert page.pdf(prefer_css_page_size=True).count(b"/Type /Page\n") == 1


def test_on_paper_a_section_of_nothing_but_what_is_left_out_there_has_no_title(browser, report):
    with watch(browser) as page:
        page.goto(report.as_uri())
        page.emulate_media(media="print")
        assert page.locator("section:has(> details.on-paper-out)").count()
        assert not page.locator("#runs").is_visible()
        assert page.locator("#result").is_visible()

"""The page of an animation in a browser: it draws, plays, obeys keys, and stays whole whatever a scene is called."""

import base64
import hashlib
import html
import io
import math
import re
from importlib.util import find_spec

import numpy as np
import pytest
from PIL import Image

from levilab.animation.page import LARGEST, as_page, columns_of, most_poses
from levilab.animation.poses import poses_of
from levilab.animation.three import three_js
from levilab.motion.summary import summarise
from levilab.simulator.scene import preset
from levilab.simulator.single import simulate
from support.browser import PHONE, watch

if find_spec("nicegui") is None:  # which takes a second to import
    pytest.skip("three.js comes out of it: pip install 'levilab[live]'", allow_module_level=True)

HOSTILE = "</script><img src=x onerror=alert(1)>{{ 7 * 7 }}<!--"
#: Small, since a processor draws it.
WINDOW = {"width": 640, "height": 700}


@pytest.fixture(scope="module")
def page_of_top():
    scene = preset("loose-washers").changed({"name": HOSTILE, "description": f"{HOSTILE} \u2028 '\""})
    motion = simulate(scene, 1.0, rate=480.0)
    return poses_of(motion, 0.0, 1.0, 480), summarise(motion, 1.0, 100.0, 0.1), 0.1


@pytest.fixture(scope="module")
def path(page_of_top, tmp_path_factory):
    place = tmp_path_factory.mktemp("page") / "top.html"
    place.write_bytes(as_page(*page_of_top))
    return place


@pytest.fixture(scope="module")
def opened(browser, path):
    """One page for the tests that change nothing for good; it does not start by itself."""
    with watch(browser, viewport=WINDOW) as page:
        page.goto(path.as_uri())
        page.wait_for_selector("#stage[data-drawn]")
        yield page


def canvas(page):
    """The pixels of the picture."""
    pixels = page.locator("#stage > canvas").screenshot()
    return np.asarray(Image.open(io.BytesIO(pixels)).convert("RGB"), dtype=int)


def seek(page, share):
    drawn = page.locator("#stage").get_attribute("data-drawn")
    page.locator("#scrub").evaluate(
        "(s, share) => { s.value = share * s.max; s.dispatchEvent(new Event('input')) }", share
    )
    page.wait_for_function("before => document.getElementById('stage').dataset.drawn > Number(before)", arg=drawn)
    shows(page, share)  # not a picture that was under way


def press_and_see(page, key):
    drawn = page.locator("#stage").get_attribute("data-drawn")
    page.keyboard.press(key)
    page.wait_for_function("before => document.getElementById('stage').dataset.drawn > Number(before)", arg=drawn)


def shows(page, time):
    """Wait until the page shows a time [s], which has three decimals."""
    page.wait_for_function(
        "t => Math.abs(Number(document.getElementById('read-time').textContent) - t) < 1.5e-3", arg=time
    )


def read(page, name):
    return float(page.locator(f"#read-{name}").inner_text().replace("−", "-"))


def test_it_is_small_and_has_the_same_bytes_each_time(page_of_top, path):
    content = path.read_bytes()
    assert content == as_page(*page_of_top)
    assert len(content) < LARGEST
    assert "MIT" in (text := content.decode())
    assert "Three.js Authors" in text
    # what is not the poses leaves the room for them that is counted with
    poses = len(page_of_top[0].times) * len(columns_of(page_of_top[0])) * 16 / 3
    assert len(content) - poses < LARGEST - most_poses(10) * 10 * 16 / 3


def test_only_what_has_its_hash_may_run(path):
    text = path.read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)
    allowed = html.unescape(policy[1])
    assert allowed.startswith("default-src 'none'; script-src 'sha256-")
    assert "unsafe" not in allowed
    for tag in ("style", "script"):
        (inside,) = re.findall(rf"<{tag}>(.*?)</{tag}>", text, re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(inside.encode()).digest()).decode()
        assert f"'sha256-{digest}'" in allowed
    assert HOSTILE not in text
    assert len(re.findall(r"</script", text)) == 5  # data, poses, three, top and the player


def test_it_draws_and_the_picture_changes_with_the_time(opened):
    seek(opened, 0.1)
    first = canvas(opened)
    assert first.std() > 20  # not blank
    seek(opened, 0.505)
    assert (np.abs(canvas(opened) - first).sum(axis=2) > 60).sum() > 200


def test_it_reads_what_the_poses_are(opened, page_of_top):
    poses, *_ = page_of_top
    seek(opened, 0.5)
    k = 240
    assert read(opened, "time") == pytest.approx(poses.times[k], abs=6e-4)
    assert read(opened, "height") == pytest.approx(100 * poses.positions[k, 2], abs=6e-3)
    assert read(opened, "tilt") == pytest.approx(np.degrees(poses.tilts[k]), abs=0.06)
    assert read(opened, "spin") == pytest.approx(poses.spins[k], abs=6e-3)
    assert read(opened, "slip") == pytest.approx(poses.slips[k] / 2 / np.pi, abs=6e-3)
    assert read(opened, "drive") == pytest.approx(0.4 * poses.drive[k], abs=6e-3)


def test_a_scenes_name_is_text(opened):
    assert opened.locator("h1").inner_text() == f"Levitron: {HOSTILE}"
    assert opened.locator("img").count() == 0
    assert "simulation" in opened.locator(".badge").inner_text()
    assert HOSTILE in opened.locator("table").inner_text()


def test_it_stands_still_where_less_motion_is_wanted_until_it_is_played(opened):
    seek(opened, 0.2)
    play = opened.get_by_role("button", name="Play")
    assert play.is_visible()
    play.click()
    start = read(opened, "time")
    opened.wait_for_function(
        "start => Number(document.getElementById('read-time').textContent) > start + 0.01", arg=start
    )
    opened.get_by_role("button", name="Pause").click()
    assert play.is_visible()


def test_keys_play_step_change_the_speed_and_turn_the_view(opened):
    opened.locator("body").evaluate("() => document.activeElement.blur()")
    seek(opened, 0.4)
    step = 1 / 480
    before = read(opened, "time")
    for key, after in ((".", before + step), (",", before), ("Home", 0.0), ("End", 1.0)):
        opened.keyboard.press(key)
        shows(opened, after)
    opened.keyboard.press("[")
    assert opened.locator("#speed").input_value() == "0.05"
    opened.keyboard.press("]")
    assert opened.locator("#speed").input_value() == "0.1"
    opened.keyboard.press("p")
    assert not opened.get_by_label("Path").is_checked()
    opened.keyboard.press("p")
    seek(opened, 0.3)
    seen = canvas(opened)
    opened.locator("#stage > canvas").focus()
    press_and_see(opened, "ArrowUp")
    press_and_see(opened, "ArrowUp")
    turned = canvas(opened)
    press_and_see(opened, "r")
    inner = (slice(8, -8), slice(8, -8))  # without the line around what has the focus
    assert (np.abs(turned - seen)[inner].sum(axis=2) > 60).sum() > 1000
    assert (np.abs(canvas(opened) - seen)[inner].sum(axis=2) > 60).sum() < 100


#: How far the drawn axis stands from upright [degrees], for leans by these angles, as it is and five times as far.
LEANS = """async (three) => {
  const link = (text) => URL.createObjectURL(new Blob([text], {type: "text/javascript"}));
  const {buildScene} = await import(link(document.getElementById("top").textContent));
  const {THREE} = await import(link(three));
  const data = JSON.parse(document.getElementById("data").textContent), view = buildScene(THREE, data.parts);
  const found = [1, 5].map((factor) => [0, 1, 10, 60, 90].map((degrees) => {
    view.setLean(factor);
    const half = degrees / 360 * Math.PI;
    view.setPose([0, 0, 0.07], [Math.sin(half), 0, 0, Math.cos(half)]);
    const end = view.axisEnd([0, 0, 0], [Math.sin(half), 0, 0, Math.cos(half)]);
    const drawn = new THREE.Vector3(0, 0, 1).applyQuaternion(view.top.quaternion);
    return [Math.atan2(-end[1], end[2]), Math.atan2(-drawn.y, drawn.z)].map((angle) => angle / Math.PI * 180);
  }));
  view.dispose();
  return found;
}"""


def test_a_lean_is_exaggerated_and_goes_no_further_than_a_limit(opened):
    drawn = opened.evaluate(LEANS, three_js("").read_text(encoding="utf-8"))
    most = math.degrees(1.2)  # LEAN_MOST
    for (end, top), wanted in zip(drawn[0] + drawn[1], [0, 1, 10, 60, 90, 0, 5, 50, most, 90], strict=True):
        assert end == pytest.approx(wanted, abs=0.01)
        assert top == pytest.approx(wanted, abs=0.01)


def test_on_a_telephone_in_the_dark_nothing_is_wider_than_the_screen(watched, path):
    page = watched(viewport=PHONE, color_scheme="dark", has_touch=True, reduced_motion="no-preference")
    page.goto(path.as_uri())
    page.wait_for_selector("#stage[data-drawn]")
    # it begins by itself
    page.wait_for_function("() => Number(document.getElementById('read-time').textContent) > 0")
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    assert canvas(page)[-20:, :20].mean() < 60
    texts = page.locator("#scale, #readout dd, td, .lead, .legend li").all_inner_texts()
    assert [text for text in texts if re.search(r"\d (mm|cm|s|Hz|mT|g|A)\b", text)] == []


def test_without_script_there_are_a_picture_and_the_numbers(watched, path):
    page = watched(viewport=WINDOW, java_script_enabled=False)
    page.goto(path.as_uri())
    assert page.locator("#still img").is_visible()
    assert page.locator("#still img").evaluate("image => image.naturalWidth") == 800
    assert not page.locator("#controls").is_visible()
    assert page.locator("noscript p").is_visible()  # get_by_text leaves it out
    assert page.get_by_role("row", name="height").is_visible()

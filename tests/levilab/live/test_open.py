"""A data file in the browser: dropped, corrected, kept, analyzed; and what the server takes and refuses."""

import asyncio
import json
import math
import shutil
import socket
from pathlib import Path
from threading import Event

import numpy as np
import pytest

from levilab.errors import UsageError
from levilab.live.opened import LONGEST_NAME, MOST_FILES, Opened, OpenedFile, plain_name
from levilab.pipelines.inputs.correction import read_correction
from levilab.pipelines.look import look_at
from levilab.texts.text import Text, as_tables
from support.browser import PHONE
from support.live_pages import PATIENCE_S, address, carry_out_here, request, serving, until, wait_for

TIME = 10.0 * np.arange(19)
#: A spin-down by the disc law, from 38 Hz.
SPIN = 38 * (1 + 2.34e-4 * np.sqrt(2 * np.pi * 38) * TIME / 2) ** -2
FIGURE = Path(__file__).parents[3] / "docs" / "pictures" / "spindown.png"
SAMPLES = Path(__file__).parents[3] / "sample_data"
#: Angular velocities under a title that says nothing, over times in ms.
OMEGA = "Zeit;Wert\n" + "".join(
    f"{1000 * t:.0f};{2 * math.pi * f:.3f}\n".replace(".", ",") for t, f in zip(TIME, SPIN, strict=True)
)
DROP = """([name, text]) => {
    const carried = new DataTransfer();
    carried.items.add(new File([text], name));
    for (const kind of ["dragenter", "dragover", "drop"]) {
        document.body.dispatchEvent(new DragEvent(kind, {dataTransfer: carried, bubbles: true, cancelable: true}));
    }
}"""


@pytest.fixture(scope="module")
def hall(tmp_path_factory):
    with serving(tmp_path_factory.mktemp("lab") / "runs") as hall:
        yield hall


@pytest.mark.slow
def test_a_file_is_dropped_corrected_kept_and_analyzed(hall, watched, monkeypatch):
    page, apart = watched(), hall.analyses.carry_out
    carry_out = {"analyze": apart, "report": carry_out_here}
    monkeypatch.setattr(hall.analyses, "carry_out", lambda words: carry_out[words[0]](words))
    page.goto(address(hall, token=True))
    until(page, "!document.getElementById('open').hidden")
    page.evaluate(DROP, ["Müller's omega.csv", OMEGA])  # anywhere in the live view
    page.wait_for_url("**/open?file=*")
    until(page, "window.levilab?.look")
    file = hall.root.parent / "opened" / "Müller's omega.csv"
    assert file.read_text("utf-8") == OMEGA
    assert page.get_by_role("button", name="Analyze").is_disabled()
    assert page.inner_text("#why") == "Answer the question above first."
    assert page.is_hidden("#command")  # it would be refused, too
    assert "no unit" in page.get_by_role("group").first.inner_text()
    page.get_by_role("button", name="rad/s (38").press("Enter")
    until(page, "levilab.look.options.columns?.f")
    page.get_by_role("button", name="ms (3 min)").press("Enter")
    until(page, "levilab.look.plots['0']")
    assert page.evaluate("levilab.look.plots['0'][0].y[0]") == pytest.approx(38, abs=0.01)
    assert page.get_by_label("unit of Wert").input_value() == "rad/s"
    assert '--columns "t=1 [ms],f=2 [rad/s]"' in page.inner_text("#command")
    page.get_by_role("button", name="Keep for the next time").press("Enter")
    until(page, "document.getElementById('news').textContent.startsWith('kept in')")
    assert read_correction(file)["columns"] == {"t": "1 [ms]", "f": "2 [rad/s]"}
    page.get_by_role("button", name="Analyze").press("Enter")
    until(page, "!document.getElementById('report').hidden")
    assert "disc law" in page.inner_text("#verdict")
    until(page, "document.querySelector('#figures img')?.naturalWidth > 100")
    with page.context.expect_page() as opened:
        page.click("#report")
    assert "spin-down" in opened.value.inner_text("body").lower()
    found = json.loads((file.parent / f"{file.name}.result.json").read_text("utf-8"))
    assert found["settings"]["columns"] == {"t": "1 [ms]", "f": "2 [rad/s]"}


@pytest.mark.parametrize(("name", "file", "same"), [
    ("a phone's spin-down", "phone.csv", "student-files/phyphox-semicolon-point.csv"),
    ("a spreadsheet", "spreadsheet.xlsx", "student-files/excel.xlsx"),
    ("a sound", "sound.wav", "scope-files/recording.wav"),
])  # fmt: skip
def test_who_has_no_file_tries_one(hall, watched, name, file, same):
    page = watched()
    page.goto(f"{address(hall)}open#{hall.doors.token}")
    until(page, "document.getElementById('kept-in').textContent")
    clip = page.evaluate("getComputedStyle(document.getElementById('chosen')).clipPath")
    assert clip == "inset(50%)"  # the link is the one way to choose a file
    page.get_by_role("button", name=name).click()
    until(page, f"levilab.look?.name === '{file}' && !document.getElementById('analyze').disabled")
    assert Path(page.evaluate("levilab.look.path")).read_bytes() == (SAMPLES / same).read_bytes()


#: Of an answer, in order: doubts, sentences, figures, the other sentences, notes, whether there is a link; is it so?
ANSWER = """(() => {
  const ids = ['doubts', 'verdict', 'figures', 'verdict-more', 'results-notes', 'report'];
  const parts = ids.map((id) => document.getElementById(id));
  const inOrder = parts.slice(1).every((part, k) => parts[k].compareDocumentPosition(part) & 4);
  return [...parts.slice(0, 5).map((part) => part.children.length), !parts[5].hidden, inOrder];
})()"""


def test_an_answer_is_shown_in_one_order_and_nothing_before_it_is_whole(hall, watched, monkeypatch):
    page, file, go_on = watched(), hall.root.parent / "steps.csv", {"analyze": Event(), "report": Event()}
    file.write_text("t [s],f [Hz]\n" + "".join(f"{t},{f}\n" for t, f in zip(TIME, SPIN, strict=True)))

    def carry_out(words):
        """Write first, and end later: what is there is not all yet."""
        if words[0] == "analyze":
            value = Text("C = {value:n}.", value="2.34(1)")
            answer = {"sentences": as_tables(["The disc law fits.", value, "Not Stokes.", "Wobble."])}
            answer |= {"doubts": ["LOOSE WASHERS"], "notes": ["one run"]}
            file.with_name("steps.csv.result.json").write_text(json.dumps(answer))
            shutil.copy(FIGURE, file.with_name("steps.csv.spindown.png"))
        else:
            file.with_name("steps.csv.report.html").write_text("report")
        return (0, "") if go_on[words[0]].wait(PATIENCE_S) else (1, "")

    monkeypatch.setattr(hall.analyses, "carry_out", carry_out)
    page.goto(f"{address(hall)}open?file={hall.opened.add(file)}#{hall.doors.token}")
    until(page, "window.levilab?.look")
    page.click("#analyze")
    wait_for(file.with_name("steps.csv.spindown.png").exists)
    until(page, "/^Analyzing: .*\\.\\s+\\d+ s/.test(document.querySelector('.foot').innerText)")
    with page.expect_response("**/analysis?*"), page.expect_response("**/analysis?*"):
        pass
    assert page.evaluate(ANSWER) == [0, 0, 0, 0, 0, False, True]
    go_on["analyze"].set()
    until(page, "document.getElementById('writing').textContent.startsWith('The report is being')")
    until(page, f"JSON.stringify({ANSWER}) === '[1,3,1,1,1,false,true]'")
    sizes = "['clientWidth', 'scrollWidth'].map((name) => document.getElementById('figures')[name])"
    assert len({*page.evaluate(sizes)}) == 1  # nothing is cut
    assert page.inner_text("#verdict") == "The disc law fits.\n\nC = 2.34(1).\n\nNot Stokes."
    assert not page.locator("#verdict-more").is_visible()  # in a fold
    assert page.locator("#progress").is_visible()
    go_on["report"].set()
    until(page, "!document.getElementById('report').hidden")
    assert page.evaluate(ANSWER) == [1, 3, 1, 1, 1, True, True]
    assert not page.locator("#progress").is_visible()


def test_where_an_analysis_fails_the_page_offers_no_command_that_does_so_too(hall, watched, monkeypatch):
    page, file = watched(), hall.root.parent / "steps.csv"
    file.write_text("t [s],f [Hz]\n" + "".join(f"{t},{f}\n" for t, f in zip(TIME, SPIN, strict=True)))
    monkeypatch.setattr(hall.analyses, "carry_out", lambda _: (1, "levilab: say it with --columns"))
    page.goto(f"{address(hall)}open?file={hall.opened.add(file)}#{hall.doors.token}")
    until(page, "window.levilab?.look")
    assert page.is_visible("#command")
    page.click("#analyze")
    until(page, "document.getElementById('verdict').innerText === 'say it with columns'")
    until(page, "document.getElementById('command').parentElement.hidden")


def test_a_choice_in_the_table_changes_how_it_is_read(hall, watched):
    page = watched(viewport=PHONE, color_scheme="dark")
    file = hall.root.parent / "three.csv"
    rows = (f"{t},{60 * f:.3f},{k}\n" for k, (t, f) in enumerate(zip(TIME, SPIN, strict=True)))
    file.write_text("A,B,C\n" + "".join(rows).replace("\n30.0,", "\n30.0,2l34,2\n30.0,"))
    key = hall.opened.add(file)
    page.goto(f"{address(hall)}open?file={key}#{hall.doors.token}")
    until(page, "window.levilab?.look")
    page.get_by_label("what A is").select_option("time")
    until(page, "levilab.look.options.columns?.t === '1'")
    page.get_by_label("what B is").select_option("spin frequency")
    until(page, "levilab.look.options.columns?.f === '2'")
    page.get_by_label("unit of B").select_option("rpm")
    until(page, "document.querySelector('.doubt')?.textContent.startsWith('three.csv, line 5: ')")
    assert page.get_by_role("button", name="Analyze").is_disabled()
    page.get_by_role("button", name="Leave such rows out").click()
    until(page, "levilab.look.plots['0']?.[0].y[0] < 40")
    assert page.inner_text("#command").endswith(" --skip-doubtful")
    assert page.evaluate("levilab.look.plots['0'][0].y[0]") == pytest.approx(38, abs=0.01)
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
    page.get_by_role("button", name="Undo corrections").click()
    until(page, "levilab.look.problem")
    assert page.inner_text("#why")
    assert page.get_by_role("button", name="Analyze").is_disabled()
    nameless = """[...document.querySelectorAll("button, select, input, a[href], canvas, [tabindex='0']")]
        .filter((one) => !(one.getAttribute("aria-label") || one.textContent.trim() || one.labels?.[0]))
        .map((one) => one.outerHTML)"""
    assert page.evaluate(nameless) == []


def test_the_name_of_a_channel_is_not_translated(hall, watched):
    page, file = watched(), hall.root.parent / "scope.csv"
    drawn = "CanvasRenderingContext2D.prototype.fillText = (text) => (window.drawn ||= []).push(text)"
    page.add_init_script(drawn)
    rows = "".join(f"{n},{n % 7}\n" for n in range(60))
    file.write_text(f"X,time,Start,Increment,\nSequence,Volt,0.0,1e-3\n{rows}")
    page.goto(f"{address(hall)}open?file={hall.opened.add(file)}&language=de#{hall.doors.token}")
    until(page, "window.drawn?.length")
    assert {"Zeit [s]", "time [V]"} <= {*page.evaluate("window.drawn")}
    assert page.get_by_role("img", name="60 Punkte: time über Zeit").count() == 1


def test_nothing_that_a_file_contains_becomes_markup(hall, watched):
    page, hostile, file = watched(), '<img src=x onerror="window.hacked=1">', hall.root.parent / "hostile.csv"
    rows = (f"{1.7e9 + t + 0.123:.9f};{f:.14f};{hostile}\n" for t, f in zip(TIME, SPIN, strict=True))
    file.write_text(f"t;f [Hz];{hostile}\n{''.join(rows)}")
    page.goto(f"{address(hall)}open?file={hall.opened.add(file)}#{hall.doors.token}")
    until(page, "window.levilab?.look")
    as_in_the_file = (hostile, f"{1.7e9 + TIME[1] + 0.123:.9f}", f"{SPIN[1]:.14f}")
    assert all(text in page.inner_text("#runs") for text in as_in_the_file)
    assert page.evaluate("[window.hacked, document.images.length]") == [None, 0]


def test_a_page_without_the_token_opens_nothing(hall, watched):
    page = watched()
    page.goto(f"{address(hall)}open")
    until(page, "document.getElementById('said').textContent.startsWith('This page may only look')")


# --- the server ---


def post(hall, path, body, **headers):
    """Status and answer to a page that has the token."""
    status, text = request(address(hall), path, body, headers={"X-Levilab-Token": hall.doors.token, **headers})
    return status, json.loads(text)


def test_a_file_needs_the_token_and_a_page_of_this_server(hall):
    before, name = dict(hall.opened.files), {"X-Levilab-Name": "a.csv"}
    for wrong in ({"X-Levilab-Token": "guess"}, {"X-Levilab-Token": "", "Origin": "http://evil.example"}):
        assert post(hall, "/file", b"t,f\n", **name, **wrong)[0] == 403
    with pytest.raises(json.JSONDecodeError):  # DNS rebinding: turned away before anything reads it
        post(hall, "/file", b"t,f\n", **name, Host="evil.example")
    assert hall.opened.files == before


def test_a_file_that_breaks_off_on_its_way_leaves_nothing(hall):
    head = f"POST /file HTTP/1.1\r\nHost: 127.0.0.1:{hall.doors.port}\r\nX-Levilab-Token: {hall.doors.token}\r\n"
    with socket.create_connection(("127.0.0.1", hall.doors.port)) as raw:
        raw.sendall(f"{head}X-Levilab-Name: torn.csv\r\nContent-Length: 9999\r\n\r\nt,f\n".encode())
        wait_for(lambda: [*hall.opened.folder.glob(".incoming*")])
    wait_for(lambda: not [*hall.opened.folder.glob(".incoming*")])
    assert not (hall.opened.folder / "torn.csv").exists()


def test_a_file_replaces_a_link_and_is_not_written_through_it(hall, tmp_path):
    hall.opened.folder.mkdir(parents=True, exist_ok=True)
    (hall.opened.folder / "link.csv").symlink_to(tmp_path / "elsewhere.csv")
    assert post(hall, "/file", b"t,f\n", **{"X-Levilab-Name": "link.csv"})[0] == 200
    assert not (tmp_path / "elsewhere.csv").exists()


def test_a_file_that_is_too_large_leaves_nothing(hall, monkeypatch):
    monkeypatch.setattr("levilab.live.opened.MOST_BYTES", 1000)
    status, answer = post(hall, "/file", 1001 * b"x", **{"X-Levilab-Name": "large.csv"})
    assert (status, "large.csv: is larger than" in answer["error"]) == (400, True)
    assert [path.name for path in hall.opened.folder.glob("*large*")] == []
    assert [path.name for path in hall.opened.folder.glob(".incoming*")] == []


@pytest.mark.parametrize("wanted", [
    {"do": "look at a file", "file": "none"}, {"do": "keep"}, {"do": "analyze a file", "file": ["x"]},
    {"do": "look at a file", "file": "KEY", "options": {"device": "/etc/passwd"}},
    {"do": "look at a file", "file": "KEY", "options": {"columns": {"colour": "1"}}},
    {"do": "look at a file", "file": "KEY", "options": {"rate": "1; rm"}},
    {"do": "keep", "file": "KEY"},
])  # fmt: skip
def test_what_is_no_command_for_a_file_is_refused_in_words(hall, tmp_path, wanted):
    key = hall.opened.add(tmp_path / "my.csv")
    given = {name: key if value == "KEY" else value for name, value in wanted.items()}
    status, answer = post(hall, "/do", json.dumps(given).encode())
    assert (status, bool(answer["error"])) == (400, True)


async def _pieces(*pieces):
    for piece in pieces:
        yield piece


async def _keep(opened, name, content):
    return opened.files[await opened.receive(name, _pieces(content))].path.name


def test_a_dropped_file_replaces_no_other(tmp_path):
    opened = Opened(tmp_path)

    async def drop():
        return [await _keep(opened, "my.csv", content) for content in (b"one", b"two", b"one", b"two")]

    assert asyncio.run(drop()) == ["my.csv", "my (2).csv", "my.csv", "my (2).csv"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["my (2).csv", "my.csv"]
    assert len(opened.files) == 2


@pytest.mark.parametrize("name", [
    "../x.csv", "/etc/passwd", "..", "", "a\x00b.csv", "con", 500 * "ü" + ".csv", 200 * "Ж", 99 * "😀" + ".txt",
])  # fmt: skip
def test_a_dropped_file_stays_in_its_folder(tmp_path, name):
    plain = plain_name(name)
    assert (tmp_path / plain).resolve().parent == tmp_path.resolve()
    assert 0 < len(plain.encode()) <= LONGEST_NAME
    assert plain_name(plain) == plain


def test_the_oldest_file_is_closed_when_many_are_open(tmp_path):
    opened = Opened(tmp_path)
    keys = [opened.add(tmp_path / f"{k}.csv") for k in range(MOST_FILES + 3)]
    assert list(opened.files) == keys[3:]


@pytest.mark.slow
def test_a_film_is_followed_in_its_pictures_once_its_scale_is_known(hall, watched, monkeypatch):
    asked = []
    monkeypatch.setattr(hall.analyses, "carry_out", lambda words: asked.append(words) or (0, ""))
    film = shutil.copy(SAMPLES / "video" / "top.mp4", hall.root.parent / "top.mp4")
    key = hall.opened.add(film)
    page = watched()
    page.goto(address(hall, token=True).replace("/#", f"/open?file={key}#"))
    until(page, "window.levilab?.look?.film")
    assert "diameter of the top's rim" in page.inner_text("#problem")
    assert page.get_by_role("button", name="Analyze").is_disabled()
    page.get_by_label("Rim of the top").fill("300")
    page.get_by_label("Rim of the top").press("Enter")
    assert "from 1 to 200" in page.inner_text("#rim-wrong")
    page.get_by_label("Rim of the top").fill("30")
    page.get_by_label("Rim of the top").press("Enter")
    until(page, "levilab.look.options.rim_mm === 30")
    assert page.inner_text("#command").endswith("top.mp4 --rim 30")
    assert not page.inner_text("#problem")
    page.get_by_role("button", name="Analyze").press("Enter")
    wait_for(lambda: len(asked) == 2)
    assert asked[0] == ["analyze", str(film), "--language", "en", "--rim", "30"]
    assert asked[1][:2] == ["report", str(film)]
    with pytest.raises(UsageError, match="a diameter in mm"):
        hall.opened.look(key, {"rim_mm": "wide"})


def test_a_dropped_file_is_typed_from_the_folder_of_the_command(tmp_path, monkeypatch):
    opened = Opened(tmp_path / "lab" / "opened")
    key = asyncio.run(opened.receive("my.csv", _pieces(b"t [s],f [Hz]\n0,38\n9,37\n")))
    for here, typed in (("lab", "opened/my.csv"), ("lab/opened", "my.csv"), ("", "lab/opened/my.csv")):
        monkeypatch.chdir(tmp_path / here)
        assert opened.look(key)["typed"] == typed


def test_a_field_is_drawn_in_its_own_unit_each_component(tmp_path):
    rows = "".join(f"{n / 100},{30 + n},{40 + n},-20\n" for n in range(50))
    (tmp_path / "my.csv").write_text(f"t (s),Bx (µT),By (µT),Bz (µT)\n{rows}", "utf-8")
    drawn = look_at(tmp_path / "my.csv", {}).plots[0]
    assert {plot.y_axis[1] for plot in drawn} == {"µT"}
    assert [plot.y[0] for plot in drawn] == pytest.approx([30, 40, -20])


def test_the_words_of_a_file_are_options_of_the_command_line(tmp_path):
    one = OpenedFile(tmp_path, {"columns": {"t": "1", "f": "2 [rpm]"}, "skip_doubtful": True, "rate": 100.0})
    assert one.words == ["--columns", "t=1,f=2 [rpm]", "--rate", "100.0", "--skip-doubtful"]

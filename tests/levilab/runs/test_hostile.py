"""Whatever stands in a file that a person can write: one line about it, never a traceback, and no other run suffers."""

import contextlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from levilab.acquisition.loop import acquire
from levilab.errors import DataError
from levilab.files import CannotWrite, parse_json, parse_toml, replace_atomically
from levilab.formats.columns import CANONICAL
from levilab.runs.find import find_run
from levilab.runs.listing import list_runs
from levilab.runs.run import Run
from levilab.runs.writer import RunWriter
from support.acquisitions import QUICKLY, Impatient, mock
from support.commands import command
from support.paths import SAMPLE_DATA

SAMPLE = SAMPLE_DATA / "spin-down-1"
RECORD = json.loads((SAMPLE / "run.json").read_text(encoding="utf-8"))
posix_only = pytest.mark.skipif(os.name != "posix", reason="Windows has no such files, or asks for a privilege")

#: Values that programs stumble over, as JSON and mostly TOML write them.
ODD = {
    "nested deeply": "[" * 100_000,
    "nested deeply, and closed": "[" * 400 + "]" * 400,
    "a number of 5000 digits": "9" * 5000,
    "a number beyond all floats": "9" * 400,
}
ODD_JSON = ODD | {
    "objects nested deeply": '{"a":' * 100_000,
    "not a number": "NaN",
    "infinity": "1e999",
    "half a surrogate pair": r'"\ud800"',
}


def run_with(folder, **texts):
    """A copy of a run in which keys of run.json have the values that the texts say."""
    shutil.copytree(SAMPLE, folder)
    entries = {key: json.dumps(value) for key, value in RECORD.items()} | texts
    text = "{" + ", ".join(f'"{key}": {value}' for key, value in entries.items()) + "}"
    (folder / "run.json").write_text(text, encoding="utf-8")
    return folder


@pytest.mark.parametrize("name", ODD_JSON)
def test_an_odd_record_costs_one_line_and_no_other_run(tmp_path, name):
    runs = tmp_path / "runs"
    run_with(runs / "odd", configuration=ODD_JSON[name])
    shutil.copytree(SAMPLE, runs / "sound")
    assert [(Path(run.path).name, run.status) for run in list_runs(runs)] == [
        ("odd", "unreadable"),
        ("sound", "finished"),
    ]
    listed = command("runs", runs, cwd=tmp_path)
    assert listed.status == 0
    assert "is cut off or not JSON" in listed.out
    assert command("runs", runs, "--json", cwd=tmp_path).status == 0
    refused = command("acquire", "spin", "--mock", "--resume", runs / "odd", cwd=tmp_path)
    assert refused.status == 1
    assert len(refused.err.splitlines()) == 1


@pytest.mark.parametrize(("record", "said"), [
    ("{", "ist abgeschnitten oder kein JSON (von Zeile 1, Spalte 2 an); die Messwerte lassen sich noch auswerten"),
    ('{"schema": 3}', "das Schema ist '3', erwartet wird 'levilab-run/1' dieser Version; die Messwerte lassen sich"),
])  # fmt: skip
def test_a_broken_record_is_named_in_the_language_of_the_person(tmp_path, record, said):
    shutil.copytree(SAMPLE, tmp_path / "run")
    (tmp_path / "run" / "run.json").write_text(record, encoding="utf-8")
    listed = command("runs", ".", "--language", "de", cwd=tmp_path).out
    assert f"Hinweis: run/run.json: {said}" in " ".join(listed.split())


@pytest.mark.parametrize("name", ODD_JSON)
def test_an_odd_event_is_left_out(tmp_path, name):
    folder = run_with(tmp_path / "run")
    lines = ['{"text": "before"}', f'{{"text": "odd", "time_s": {ODD_JSON[name]}}}', '{"text": "after"}', ""]
    (folder / "events.jsonl").write_text("\n".join(lines), encoding="utf-8")
    assert [event["text"] for event in Run.load(folder).events()] == ["before", "after"]


@pytest.mark.parametrize("name", ODD)
@pytest.mark.parametrize(
    "words", [["bench", "check", "--bench", "odd.toml"], ["simulate", "odd.toml"], ["stability", "odd.toml"]]
)
def test_an_odd_bench_or_scene_is_reported_in_one_line(tmp_path, words, name):
    (tmp_path / "odd.toml").write_text(f"x = {ODD[name]}", encoding="utf-8")
    ended = command(*words, cwd=tmp_path)
    assert ended.status == 1
    (line,) = ended.err.splitlines()
    assert "odd.toml: not readable as TOML: " in line


@pytest.mark.parametrize("name", [name for name, text in ODD.items() if len(text) < 10_000])  # as a word may be
def test_an_odd_value_of_a_key_is_wrong_usage(tmp_path, name):
    ended = command("simulate", "undriven", "--set", f"top.mass_kg={ODD[name]}", cwd=tmp_path)
    assert ended.status == 2
    assert len(ended.err.splitlines()) == 1


@pytest.mark.parametrize("name", ["a**b", "**", "*", "[a", "?", "a*b", "sp*n", ".", "a" * 5000, "\udcff"])
def test_a_name_is_compared_and_never_a_pattern(tmp_path, name):
    shutil.copytree(SAMPLE, tmp_path / "runs" / "20261120T101500Z-spin-7f3a")
    (tmp_path / "data").mkdir()
    for words in (["analyze", "spindown", name, "--no-save"], ["acquire", "spin", "--mock", "--resume", name]):
        ended = command(*words, cwd=tmp_path / "data")
        assert ended.status == 1
        assert len(ended.err.splitlines()) == 1
    if len(name) < 100:
        assert find_run(Path(name), tmp_path / "runs") == Path(name)


def test_a_name_with_brackets_is_found_as_it_is(tmp_path):
    shutil.copytree(SAMPLE, tmp_path / "20261120T101500Z-[a]")
    assert find_run(Path("[a]"), tmp_path) == tmp_path / "20261120T101500Z-[a]"


def test_markup_and_escapes_in_a_record_are_printed_as_text(tmp_path):
    odd = json.dumps("[/] [red]x \x1b[31m\n\u202e")
    run_with(tmp_path / "runs" / "odd", note=odd, experiment=odd, started_utc=odd)
    ended = command("runs", "runs", cwd=tmp_path)
    assert ended.status == 0
    assert "[red]x" in ended.out
    assert "\x1b" not in ended.out
    assert "\u202e" not in ended.out


#: A title of the window, a colour, the same as one byte, and what turns the direction of writing.
STEERING = "\x1b]0;title\x07\x1b[31mred\x9b32m\u202e"
posix_names = pytest.mark.skipif(os.name != "posix", reason="Windows has no such names")


@posix_names
def test_names_and_notes_do_not_steer_the_terminal_of_an_analysis(tmp_path):
    folder = tmp_path / f"run{STEERING}"
    shutil.copytree(SAMPLE_DATA / "loose-washers", folder)
    with (folder / "events.jsonl").open("a", encoding="utf-8") as events:
        events.write(json.dumps({"time_s": 1.0, "kind": "warning", "text": f"odd {STEERING}"}) + "\n")
    ended = command("analyze", folder, "--no-save", cwd=tmp_path)
    assert ended.status == 0
    assert not set(ended.out + ended.err) & set("\x1b\x07\x9b\u202e")
    assert "]0;title" in ended.out


@pytest.mark.parametrize("key", ["address", "model"])
def test_an_address_and_a_model_do_not_steer_the_terminal(tmp_path, key):
    entries = {"model": "53230A", "address": "no resource name"} | {key: f"x::{STEERING}"}
    lines = ["[counter]", *(f"{name} = {json.dumps(text)}" for name, text in entries.items())]
    (tmp_path / "bench.toml").write_text("\n".join(lines), encoding="utf-8")
    ended = command("bench", "check", cwd=tmp_path)
    assert ended.status in {1, 3}
    assert not set(ended.out + ended.err) & set("\x1b\x07\x9b\u202e")
    assert "]0;title" in ended.out + ended.err


# --- resuming ---


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("channels", '[{"unit": "s"}]'),
        ("channels", "[]"),
        ("time_zero_utc", '"noon"'),
        ("time_zero_utc", '"2026-11-20"'),
        ("time_zero_utc", '"9999-12-31T23:59:59"'),
        ("configuration", '{"spin": 3}'),
        ("configuration", '{"scene": {"top": []}}'),
        ("seed", "-1"),
        ("experiment", '"../x"'),
    ],
)
def test_an_odd_run_is_not_resumed_or_is_resumed(tmp_path, key, value):
    entries = {"status": '"interrupted"', "time_zero_utc": '"2026-11-20T10:15:00Z"'} | {key: value}
    folder = run_with(tmp_path / "run", **entries)
    for bench in (["--mock"], []):
        ended = command("acquire", "spin", *bench, "--resume", folder, cwd=tmp_path)
        assert ended.status in {0, 1, 2}
        assert "Traceback" not in ended.err


@pytest.fixture(scope="module")
def half(tmp_path_factory):
    """A virtual run that was interrupted after some readings."""
    return acquire(mock(tmp_path_factory.mktemp("half")), Impatient(8)).folder


def refusal(half, place):
    """The line with which a run is not resumed, and is left as it was."""
    before = {path.name: path.read_bytes() for path in half.iterdir()}
    ended = command("acquire", "spin", "--mock", "--resume", half, cwd=place)
    assert ended.status == 1
    (line,) = ended.err.splitlines()
    assert {path.name: path.read_bytes() for path in half.iterdir()} == before
    return line


TIME, SPIN, U = ({"name": name, "unit": "", "source": ""} for name in CANONICAL[:3])


@pytest.mark.parametrize(
    ("way", "value", "says"),
    [
        (["seed"], -1, "seed = '-1'"),
        (["configuration", "scene"], "x", "configuration.scene"),
        (["configuration", "scene"], [], "configuration.scene"),
        (["configuration", "spin", "ramp_hz_per_s"], 5e-324, "spin.ramp_hz_per_s"),
        (["configuration", "spin", "ramp_hz_per_s"], 1e-4, "spin.ramp_hz_per_s"),
        (["configuration", "limits", "drive_frequency_hz"], 1e308, "spin.drive_frequency_hz"),
        (["configuration", "spin", "longest_s"], 50.0, "spin.longest_s"),
        (["channels"], [TIME, U], "channels"),
        (["channels"], [SPIN, U], "channels"),
        (["channels"], [TIME, SPIN, SPIN], "channels"),
        (["channels"], [TIME, SPIN, U, {"name": "x"}], "channels"),
    ],
)
def test_a_run_with_an_odd_record_is_not_resumed(tmp_path, half, way, value, says):
    folder = Path(shutil.copytree(half, tmp_path / "run"))
    record = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    *tables, key = way
    table = record
    for name in tables:
        table = table[name]
    table[key] = value
    if way[-1] == "drive_frequency_hz":  # what the bench allows, too
        record["configuration"]["spin"][key] = value
    (folder / "run.json").write_text(json.dumps(record), encoding="utf-8")
    assert says in refusal(folder, tmp_path)


@pytest.mark.parametrize(
    ("row", "says"),
    [("80,0,0.03", "spin_frequency_hz"), ("80,-1,0.03", "spin_frequency_hz"), ("1e9,30,0.03", "spin.longest_s")],
)
def test_a_run_with_odd_readings_is_not_resumed(tmp_path, half, row, says):
    folder = Path(shutil.copytree(half, tmp_path / "run"))
    with (folder / "readings.csv").open("a", encoding="utf-8") as file:
        file.write(row + "\n")
    assert says in refusal(folder, tmp_path)


def test_readings_without_a_declared_column_are_not_resumed(tmp_path, half):
    folder = Path(shutil.copytree(half, tmp_path / "run"))
    (folder / "readings.csv").write_text("time_s\n0\n10\n20\n", encoding="utf-8")
    assert "readings.csv" in refusal(folder, tmp_path)


@pytest.mark.parametrize("row", ["80,nan,0.03", "80,inf,0.03", "nan,30,0.03", "80,,", "80,30,"])
def test_a_missed_reading_does_not_keep_a_run_from_going_on(tmp_path, half, row):
    folder = Path(shutil.copytree(half, tmp_path / "run"))
    with (folder / "readings.csv").open("a", encoding="utf-8") as file:
        file.write(row + "\n")
    assert command("acquire", "spin", "--mock", "--resume", folder, cwd=tmp_path).status == 0


def test_a_ramp_of_days_is_refused(tmp_path):
    (tmp_path / "slow.toml").write_text("[spin]\nramp_hz_per_s = 1e-6\n", encoding="utf-8")
    ended = command("acquire", "spin", "--mock", "--bench", "slow.toml", cwd=tmp_path)
    assert ended.status == 1
    (line,) = ended.err.splitlines()
    assert "spin.ramp_hz_per_s = 1e-06" in line


@pytest.mark.parametrize(("text", "says"), [("noon", "time_zero_utc"), ("9999-12-31T23:59:59", "set back")])
def test_a_time_zero_that_makes_no_sense_is_reported(tmp_path, text, says):
    with pytest.raises(DataError, match=says):
        Run.load(run_with(tmp_path / "run", time_zero_utc=json.dumps(text))).elapsed()


def interrupted(out):
    return run_with(out, status='"interrupted"')


@posix_only
@pytest.mark.parametrize("name", ["readings.csv", "events.jsonl"])
def test_a_link_is_not_written_through(tmp_path, name):
    folder = interrupted(tmp_path / "run")
    other = tmp_path / "precious"
    (folder / name).rename(other) if (folder / name).exists() else other.write_text("mine\n", encoding="utf-8")
    before = other.read_bytes()
    (folder / name).symlink_to(other)
    with pytest.raises(CannotWrite, match=f"{name} is a symbolic link"):
        RunWriter.reopen(Run.load(folder))
    assert other.read_bytes() == before


@posix_only
def test_a_link_in_the_place_of_the_new_file_is_not_written_through(tmp_path):
    (tmp_path / "precious").write_text("mine", encoding="utf-8")
    (tmp_path / f".run.json.{os.getpid()}.part").symlink_to(tmp_path / "precious")
    replace_atomically(tmp_path / "run.json", "new")
    assert (tmp_path / "precious").read_text(encoding="utf-8") == "mine"
    assert (tmp_path / "run.json").read_text(encoding="utf-8") == "new"


@posix_only
@pytest.mark.parametrize("name", ["run.json", "readings.csv", "events.jsonl"])
def test_a_pipe_in_a_run_is_waited_for_by_no_command(tmp_path, name):
    folder = interrupted(tmp_path / "runs" / "run")
    (folder / name).unlink(missing_ok=True)
    os.mkfifo(folder / name)
    assert command("runs", "runs", cwd=tmp_path).status == 0
    assert command("acquire", "spin", "--mock", "--resume", folder, cwd=tmp_path).status == 1
    if name != "run.json":
        with pytest.raises(CannotWrite, match=f"{name} is no regular file"):
            RunWriter.reopen(Run.load(folder))


def test_a_run_that_was_finished_meanwhile_is_not_reopened(tmp_path):
    run = Run.load(interrupted(tmp_path / "run"))
    with RunWriter.reopen(run) as writer:
        writer.finish("finished")
    with pytest.raises(CannotWrite, match="is finished"):
        RunWriter.reopen(run)


def test_a_text_that_utf_8_cannot_hold_is_written_with_a_question_mark(tmp_path):
    replace_atomically(tmp_path / "page.html", "runs/\udcff")
    assert (tmp_path / "page.html").read_bytes() == b"runs/?"


# --- what may stand in a file ---

LEAVES = (
    st.none()
    | st.booleans()
    | st.integers(-(10**20), 10**20)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(exclude_categories=["Cs"]))
)
TREES = st.recursive(LEAVES, lambda inner: st.lists(inner) | st.dictionaries(st.text(max_size=5), inner), max_leaves=8)
KEYS = sorted({*RECORD, "simulation", "instruments", "channels", "time_zero_utc", "seed"} - {"schema"})


@given(st.dictionaries(st.sampled_from(KEYS), TREES, max_size=2), st.lists(TREES, max_size=3))
def test_whatever_a_record_says_the_list_of_runs_goes_on(changes, events):
    with tempfile.TemporaryDirectory() as place:
        folder = run_with(Path(place) / "run", **{key: json.dumps(value) for key, value in changes.items()})
        lines = [json.dumps({"text": "x", "time_s": event}) for event in events]
        (folder / "events.jsonl").write_text("\n".join(lines), encoding="utf-8")
        for words in (["runs", "."], ["runs", ".", "--json"]):
            ended = command(*words, cwd=Path(place))
            assert ended.status == 0, ended
        with contextlib.suppress(DataError):
            assert len(Run.load(folder).events()) == len(events)


@given(st.text() | st.binary(max_size=60).map(lambda data: data.decode("latin-1")))
def test_whatever_a_text_says_it_is_read_or_refused(text):
    for parse in (parse_json, parse_toml):
        with contextlib.suppress(ValueError):
            parse(text)


def test_python_refuses_numbers_as_long_as_those_that_are_tested():
    assert 0 < sys.get_int_max_str_digits() < 5000


FEW_FILES = """
import resource, sys
resource.setrlimit(resource.RLIMIT_NOFILE, ({files}, {files}))
sys.argv = ["levilab", *{words!r}]
from levilab.cli.main import main
main()
"""


@posix_only
@pytest.mark.parametrize("files", [5, 8])
def test_too_few_open_files_from_the_start_cost_one_line(tmp_path, files):
    """A process of its own: with 5 it cannot import all that it needs, with 8 it writes a run."""
    program = [sys.executable, "-c", FEW_FILES.format(files=files, words=["acquire", "spin", "--mock", *QUICKLY])]
    done = subprocess.run(program, cwd=tmp_path, capture_output=True, text=True, encoding="utf-8", check=False)
    costs_one_line(done.returncode, done.stderr)


@posix_only
@pytest.mark.parametrize(
    "words",
    [["acquire", "spin", "--mock", *QUICKLY], ["report", str(SAMPLE), "--no-crosscheck"], ["runs", str(SAMPLE)]],
)
def test_too_few_open_files_cost_one_line(tmp_path, words):
    """In this process, which has imported all by then; it may open ever more files than it has, until it succeeds.

    Figures are drawn the first time alone: that opens the fonts, and later ones open no file.
    """
    import resource

    import levilab.present.style  # noqa: F401 - for figures, which none of these draws the first time

    assert command(*words, cwd=tmp_path).status == 0
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    for more in range(4):
        with contextlib.ExitStack() as stack:
            gaps = [stack.enter_context(Path(os.devnull).open("rb")) for _ in range(more + 1)]
            stack.callback(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
            resource.setrlimit(resource.RLIMIT_NOFILE, (gaps[-1].fileno(), hard))
            for gap in gaps:
                gap.close()
            ended = command(*words, cwd=tmp_path)
        costs_one_line(ended.status, ended.err)
        assert more or ended.status == 1 or words[0] == "runs"  # which lists what can be read
        if ended.status == 0:
            break


def costs_one_line(status, err):
    assert "Traceback" not in err
    assert status == 0 or "Too many open files" in err.splitlines()[-1]


@posix_only
def test_a_closed_standard_output_costs_no_command(tmp_path):
    words = " ".join([sys.executable, "-m", "levilab", "runs", str(SAMPLE)])
    done = subprocess.run(["sh", "-c", f"{words} >&-"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")

"""How each command ends on each mistake: 2 for wrong usage, 1 for a known failure, 3 for an instrument, in one line."""

import ast
import errno
import inspect
import re
from unittest.mock import Mock

import pytest

from levilab.cli import exit_codes
from levilab.cli.main import main
from levilab.cli.quantities import in_options, option_names
from levilab.errors import LevilabError, UsageError
from support.commands import command
from support.paths import ROOT, SAMPLE_DATA
from support.spin_downs import spin_down_csv

SAMPLE = str(SAMPLE_DATA / "spin-down-1")
LIMITS = str(SAMPLE_DATA / "lower-limits")
SCOPE = str(SAMPLE_DATA / "scope-files" / "rigol-ds1000z.csv")

#: The command → what its line says. What stands in "file" is a file, in "bench.toml" a bench that is not there.
WRONG_USAGE = {
    "acquire spin --seed 1": "--mock",
    "acquire spin --realtime": "--mock",
    "acquire spin --scene spindown": "--mock",
    "acquire trace --mock --set trace.duration=1": "did you mean trace.duration_s",
    "acquire trace --mock --set trace.points=1.5": "--set trace.points=1.5: a whole number above 0 is expected",
    "acquire trace --mock --set trace.volts_per_division=50": "a number from 0.001 to 10 is expected",
    "acquire trace --mock --set trace.trigger_level_v=5": "beyond what the oscilloscope records, -0.35 to 1.65 V",
    "acquire trace --mock --set records=two": "--set trace.records=two: a whole number above 0 is expected",
    f"analyze spindown {SAMPLE} --reading-u 0": "--reading-u 0: ",
    f"analyze spindown {SAMPLE} --reading-u -0.1": "--reading-u -0.1: ",
    f"analyze spindown {SAMPLE} --reading-u nan": "--reading-u nan: ",
    **{
        f"{words} -o out.png": "--out out.png: a folder is expected"
        for words in (
            f"analyze spindown {SAMPLE}",
            "acquire spin --mock",
            "simulate undriven",
            "worksheet spin",
            "live",
            "sweep undriven --sweep start.spin_hz=20:22:2",
            "stability undriven --map",
            "crosscheck spin",
        )
    },
    **{
        f"{words} -o out.png": "--out out.png: a name that ends in"
        for words in (
            f"report {SAMPLE}",
            f"export {SAMPLE}",
            f"open {SAMPLE}",
            f"class {SAMPLE}",
            "reproduce",
            "bench init",
        )
    },
    "worksheet": "EXPERIMENT: name some of spin, limit",
    "simulate undriven --set top.mass_kg=25lb": "--set: top.mass_kg = '25lb': a number in kg, g or mg is expected",
    "acquire spin --mock --set gate_s=3x": "--set: spin.gate_s = '3x': a number in s, ms",
    f"analyze spindown {SAMPLE} --columns t": "--columns 't': ",
    f"analyze spindown {SAMPLE} --columns colour=f": "--columns: 'colour' is no quantity",
    f"analyze spin {SCOPE} --rate -1": "--rate -1: ",
    f"analyze spin {SCOPE} --channel CH7": "--channel 'CH7': ",
    f"report {SAMPLE} --reading-u inf": "--reading-u inf: ",
    f"report {SAMPLE} --columns t=": "--columns 't=': ",
    f"report {SAMPLE} -o x.docx": "--out x.docx: ",
    "simulate undriven --set nonsense=1": "--set: nonsense = 1: there is no key nonsense",
    "simulate undriven --set top.mass_kg": "--set: 'top.mass_kg': KEY=VALUE is expected",
    "simulate undriven --set top.mass_kg=-1": "--set: top.mass_kg",
    "simulate undriven --duration -1": "--duration -1: a number above 0",
    "simulate undriven --duration nan": "--duration nan: ",
    "simulate undriven --duration inf": "--duration inf: ",
    "simulate undriven --tolerance 0": "--tolerance 0: ",
    "simulate undriven --rate -5": "--rate -5: ",
    "simulate undriven --rate 1e9": "--duration 30: with --rate 1e+09 these are 3e+10 states",
    "stability undriven --set nonsense=1": "--set: nonsense = 1",
    "stability undriven --spins 20:30:1": "--spins: it is of a map: give --map, too",
    "stability undriven --masses 0.02:0.03:0.001": "--masses: it is of a map: give --map, too",
    "stability undriven --duration 5": "--duration: it is of a map: give --map, too",
    "stability undriven --out x": "--out: it is of a map: give --map, too",
    "stability undriven --map --spins 20": "--spins 20: LOW:HIGH:STEP is expected",
    "stability undriven --map --spins 30:20:1": "--spins 30:20:1: LOW:HIGH:STEP is expected",
    "stability undriven --map --masses 0:1:1e-9": "--masses 0:1:1e-9: at most",
    "stability undriven --map --masses -1:1:1": "--masses from -1 kg: masses above 0",
    "stability undriven --map --duration -1": "--duration -1: a number of seconds above 0",
    "bench check --mock --bench bench.toml": "--bench: does not go with --mock",
    "bench serve --model nonsense": "--model",
    "analyze field file --height -7": "--height -7: a number above 0 [mm] is expected",
    "bench serve --model counter=nonsense": "--model",
    "bench serve --speed 0": "--speed",
    "bench serve --scene spindown --speed 1e6": "--speed",
    "bench serve --port-base 65535": "--port-base",
    "bench serve --host ::1": "--host ::1: ",
    "acquire spin --mock --scene spindwon": "did you mean spindown?",
    **dict.fromkeys(("simulate", "stability", "sweep"), "SCENE: is missing: name one of undriven, friction, "),
    "simulate nowhere": "there is no scene 'nowhere'",
    "stability nowhere": "there is no scene 'nowhere'",
    "bench serve --scene nowhere": "there is no scene 'nowhere'",
}
#: What the command line itself does not understand is shown with the usage, over several lines.
NOT_UNDERSTOOD = (
    "fly", "acquire", "acquire fly", "acquire spin --mok", "acquire spin --mock --seed -1",
    "acquire spin --mock --seed many", "acquire --mock", "analyze spindown x --uncertainty perhaps",
    "analyze spindown x --reading-u much", "simulate undriven --duration long", "bench clock --mock --duration 0.5s",
    "bench", "bench serve --port-base 0", "bench serve --port-base 65536", "benchmark", "benchmark fly",
)  # fmt: skip
FAILURES = {
    **dict.fromkeys(("analyze", "analyze spindown", "report", "report -o r.html"), "there is no folder runs here"),
    "simulate undriven --duration 1e6 --animate file/a.html": "choose another place with --animate",
    "crosscheck spindown --out file": "choose another place with --out",
    "reproduce -o file/r.html": "choose another place with --out",
    "live nowhere": "nowhere: there is no such run or folder",
    "live file": "file: is a file: levilab open file shows it",
    "open nowhere": "nowhere: there is no such file or folder",
    "crosscheck --like nowhere": "nowhere: there is no such file or folder",
    "analyze field file --device other.toml": "other.toml: there is no such file or folder",
    "acquire spin --bench other.toml": "other.toml: there is no such file",
    "acquire spin --mock --resume spin-567a": "no run spin-567a, there is no folder runs here",
    "acquire spin --mock --resume elsewhere/spin-567a": "elsewhere/spin-567a: there is no such run; levilab runs lists",
    f"acquire spin --mock --resume {SAMPLE}": "is finished",
    "acquire spin --mock --out file": "choose another place with --out",
    f"analyze spindown {LIMITS}": f"spindown needs a spin run; levilab analyze limit {LIMITS} reads it",
    f"analyze limit {SCOPE}": f"levilab analyze spin {SCOPE} reads it",
    "analyze spindown file --columns t=1 f=2": 'in quotation marks: --columns "t=1,f=2"',
    "analyze spindown nowhere": "nowhere: there is no such file or folder in ",
    "analyze spindown nowhere.toml": "its .toml files are bench.toml",
    "analyze spindown nowhere.csv": ": check the name",
    "analyze spindown --columns f=2 [rpm]": 'in quotation marks: --columns "f=2 [rpm]"',
    "analyze spindown bench.tml": "did you mean bench.toml?",
    f"report {SAMPLE} -o file/page.html": "file: is a file, a folder is expected",
    "analyze spindown .": "an empty file (file: record again)",
    "analyze spindown file": "file: is empty",
    "report nowhere": "nowhere: there is no such file or folder",
    "runs nowhere": "nowhere: there is no such folder",
    "runs file": "file: is a file",
    "simulate nowhere.toml": "nowhere.toml: there is no such file",
    "simulate undriven --duration 0.01 --out file": "choose another place with --out",
    "stability undriven --map --out file": "choose another place with --out",
    "bench check --bench other.toml": "other.toml: there is no such file",
    "bench init --library @levilab --out nowhere/bench.toml": "nowhere is no folder",
    "bench init --library @levilab": "bench.toml is there already",
}
INSTRUMENTS = {
    "acquire spin": "TCPIP0::127.0.0.1::9::SOCKET: ",
    "bench check": "",
    "bench init --library @nonsense --out new.toml": "nonsense",
}
TABLE = [
    (words, status, says)
    for status, mistakes in (
        (exit_codes.WRONG_USAGE, WRONG_USAGE),
        (exit_codes.FAILED, FAILURES),
        (exit_codes.INSTRUMENT, INSTRUMENTS),
    )
    for words, says in mistakes.items()
]


@pytest.fixture
def place(tmp_path):
    """A folder with a file, and a bench at a port where nothing listens."""
    (tmp_path / "file").write_text("", encoding="utf-8")
    (tmp_path / "bench.toml").write_text(
        '[counter]\nmodel = "53230A"\naddress = "TCPIP0::127.0.0.1::9::SOCKET"\n'
        '[generator]\nmodel = "33500B"\naddress = "TCPIP0::127.0.0.1::9::SOCKET"\n',
        encoding="utf-8",
    )
    return tmp_path


@pytest.mark.parametrize(("words", "status", "says"), TABLE, ids=[words for words, _, _ in TABLE])
def test_each_mistake_has_its_exit_status_and_one_line(place, words, status, says):
    ended = command(*words.split(), cwd=place)
    assert ended.status == status, ended
    if words != "bench check":  # which tells of every instrument
        line = ended.err.splitlines()[-1]
        assert line.startswith("levilab: ")
        assert says in line
        assert "`" not in line
    assert {path.name for path in place.iterdir()} <= {"file", "bench.toml", "runs"}


def test_a_film_is_no_acquisition_at_a_bench_whether_that_is_described_or_not(tmp_path):
    assert "a bench has no camera: film the top from above" in command("acquire", "sway", cwd=tmp_path).err


def test_only_titles_of_the_analysis_that_was_asked_for_are_named(tmp_path):
    (tmp_path / "odd.csv").write_text("p,q\n1,2\n2,3\n3,4\n", encoding="utf-8")
    spins = command("analyze", "spindown", "odd.csv", cwd=tmp_path).err
    assert "(time_s, spin_frequency_hz, t, f [Hz], rpm …) among 'p', 'q'" in spins
    assert "(height_m, flux_density_t, z [mm], B [mT] …)" in command("analyze", "field", "odd.csv", cwd=tmp_path).err


def test_an_option_of_other_programs_is_answered_with_ours(place):
    assert "No such option: --format. The ending of a file" in command("report", "--format", "pdf", cwd=place).err


def test_what_has_the_name_of_an_analysis_is_no_path_without_its_folder(tmp_path):
    (tmp_path / "limit").touch()
    assert "levilab analyze ./limit reads" in command("analyze", "limit", "--json", cwd=tmp_path).err


def test_the_virtual_bench_is_no_advice_to_those_who_use_it(place):
    advice = ", or try --mock"
    assert advice in command("acquire", "spin", "--bench", "other.toml", cwd=place).err
    assert advice not in command("acquire", "spin", "--mock", "--bench", "other.toml", cwd=place).err


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (f"analyze spindown {SAMPLE} --reading-u 0,03", "'0,03': a number is expected; write a decimal point"),
        ("simulate undriven --duration 5kg", "'5kg': a number in s, ms, μs, ns, min, h or d is expected"),
        ("acquire spin --mock --seed abc", "'abc': a whole number is expected"),
        ("bench serve --speed fast", "'--speed': 'fast': a number is expected"),
    ],
)
def test_a_number_written_otherwise_is_shown_with_how_to_write_it(place, words, says):
    ended = command(*words.split(), cwd=place)
    assert ended.status == exit_codes.WRONG_USAGE
    assert says in " ".join(ended.err.replace("│", " ").split())


@pytest.mark.parametrize("words", NOT_UNDERSTOOD)
def test_what_is_not_understood_is_wrong_usage(place, words):
    assert command(*words.split(), cwd=place).status == exit_codes.WRONG_USAGE


@pytest.mark.parametrize("words", ["runs", "analyze", "analyze spindown"])
def test_what_may_not_be_read_is_said_in_one_line(monkeypatch, tmp_path, words):
    """Typer would refuse it as wrong usage of `levilab analyze each`, with no advice."""
    command("analyze", spin_down_csv(tmp_path / "open.csv"), cwd=tmp_path)  # modules read tables as they are imported
    monkeypatch.setattr("os.access", lambda *_, **__: False)
    file = spin_down_csv(tmp_path / "closed.csv")

    def refuse(*_, **__):
        raise PermissionError(errno.EACCES, "Permission denied", str(file))

    monkeypatch.setattr("pathlib.Path.open", refuse)
    closed = tmp_path if words == "runs" else file
    ended = command(*words.split(), closed, cwd=tmp_path)
    assert ended.status == exit_codes.FAILED
    assert re.fullmatch(
        rf"levilab: {re.escape(str(closed))}: may not be (read|searched) by you; change .*\n", ended.err
    )


def test_an_interrupted_analysis_says_in_one_line_what_is_lost(monkeypatch, tmp_path, sample_data):
    monkeypatch.setattr("levilab.pipelines.spindown.analysis.fit_spin_down", Mock(side_effect=KeyboardInterrupt))
    run = sample_data / "spin-down-1"
    for words, says in (("analyze spindown", "is lost, nothing is written"), ("report", "no report is written")):
        ended = command(*words.split(), str(run), cwd=tmp_path)
        assert (ended.status, ended.out) == (exit_codes.INTERRUPTED, "")
        *progress, last = ended.err.splitlines()
        assert says in last
        assert len(progress) == (words == "report")


def test_the_exit_statuses_know_only_the_trees_of_errors():
    """A class of another room needs no row of its own: it says what it is by its base."""
    tree = ast.parse(inspect.getsource(exit_codes))
    imported = {str(node.module) for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    assert imported <= {"__future__", "analysis.errors", "instruments.errors", "levilab.errors"}


def test_a_defect_of_the_program_stays_loud(monkeypatch, tmp_path):
    monkeypatch.setattr("levilab.runs.listing.list_runs", Mock(side_effect=ZeroDivisionError))
    monkeypatch.setattr("sys.argv", ["levilab", "runs", str(tmp_path)])
    with pytest.raises(ZeroDivisionError):
        main()


# --- the names of options ---


def test_a_quantity_in_a_message_becomes_its_option():
    texts = {
        "choose another place with `out`": "choose another place with --out",
        "take `rate` = 500 or less": "take --rate 500 or less",
        "or print only with `save` = False": "or print only with --no-save",
        "goes with `mock` = True": "goes with --mock",
        "change a key with `settings`": "change a key with --set",
        "the `nonsense` stays": "the `nonsense` stays",
    }
    for text, shown in texts.items():
        assert in_options(LevilabError(text)) == shown
    assert in_options(UsageError("reading_u", "above 0", value=-1.0)) == "--reading-u -1: above 0"
    assert in_options(UsageError("survival", "is a map")) == "--map: is a map"


def test_one_quantity_has_one_option_in_all_commands():
    names = option_names()
    assert names["settings"] == ("--set", "")
    assert names["save"] == ("--save", "--no-save")
    assert names["out"] == ("--out", "")
    assert len({on for on, _ in names.values()}) == len(names)


#: The rooms whose messages are about quantities.
ROOMS = ("runs", "formats", "motion", "stability")


@pytest.mark.parametrize("room", ROOMS)
def test_messages_below_the_command_line_name_quantities_not_options(room):
    names = option_names()
    for path in (ROOT / "levilab" / room).glob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert not re.findall(r'"[^"\n]*--[a-z]+[^"\n]*"', text), path
        for name in re.findall(r'UsageError\(\s*"(\w+)"', text):
            assert name in names, path

"""The commands as a user runs them: what they print, what they refuse, and with which exit status."""

import html
import json
import re
import shutil
import subprocess
import sys
from importlib.metadata import version
from typing import get_type_hints

import pytest

from levilab.acquisition.table import EXPERIMENTS
from levilab.cli.acquire import EXPERIMENT_HELP
from levilab.cli.analyze import COMMANDS
from levilab.cli.checks import reproduce
from levilab.cli.options import SCENES
from levilab.cli.sweep import sweep
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.options import KINDS
from levilab.reproduce.chapters import CHAPTERS
from levilab.simulator.scene import presets
from levilab.sweeps.quantities import NAMES
from support.acquisitions import QUICKLY
from support.commands import command
from support.spin_downs import spin_down_csv
from support.waiting import HANG_GUARD_S

HELP = ["", "acquire", "acquire spin", "analyze", "analyze spindown", "analyze spin", "report", "simulate", "runs"]


@pytest.mark.parametrize("command", HELP)
def test_every_command_has_help_and_the_ones_that_do_something_an_example(levilab, command):
    text = levilab(*command.split(), "--help").stdout
    assert "Usage:" in text
    if command not in {"", "acquire", "analyze"}:
        assert f"Example: levilab {command}" in text


def test_the_example_of_sway_names_the_folder_that_a_search_leaves_out(levilab):
    assert "Example: levilab analyze sway sample_data/sway/" in levilab("analyze", "sway", "--help").stdout


def test_each_experiment_and_each_analysis_has_its_command():
    assert EXPERIMENT_HELP.keys() == EXPERIMENTS.keys() == {one.name for one in EXPERIMENTS.values()}
    assert COMMANDS.keys() - {"each"} == ANALYSES.keys()


def test_each_analysis_has_its_options():
    assert {name: type(analysis.options_from({})) for name, analysis in ANALYSES.items()} == KINDS


def test_the_version_is_printed(levilab):
    assert levilab("--version").stdout == f"levilab {version('levilab')}\n"


@pytest.mark.usefixtures("undrawn_figures")
def test_acquire_analyze_report_and_list_from_an_empty_folder(levilab, levilab_process, tmp_path):
    for decoy in ("analysis.py", "instruments.py", "pyvisa_levilab.py"):
        (tmp_path / decoy).write_text("raise SystemExit('the decoy was imported')", encoding="utf-8")
    acquired = levilab_process("acquire", "spin", "--mock", *QUICKLY, "--note", "one")
    assert acquired.stdout.startswith("finished: ")
    assert "of bench time left" in acquired.stderr
    analyzed = levilab("analyze", "spindown", "runs")
    assert "What the data say" in analyzed.stdout
    (run,) = (tmp_path / "runs").iterdir()
    assert {"result.json", "spindown.png"} <= {path.name for path in run.iterdir()}
    assert "report.html" in levilab("report", "runs").stdout
    assert (tmp_path / "report.html").stat().st_size > 10_000
    listed = levilab("runs").stdout
    assert "finished" in listed
    assert "one" in listed


@pytest.mark.usefixtures("undrawn_figures")
def test_json_is_one_document_and_nothing_else(levilab):
    acquired = json.loads(levilab("acquire", "spin", "--mock", *QUICKLY, "--seed", "2", "--json").stdout)
    assert acquired["status"] == "finished"
    result = json.loads(levilab("analyze", "spindown", acquired["run"], "--json").stdout)
    assert result["best_model"] == "disc"
    (listed,) = json.loads(levilab("runs", "--json").stdout)
    assert listed["readings"] == acquired["readings"]


@pytest.mark.usefixtures("undrawn_figures")
def test_no_save_writes_nothing_and_out_writes_there(levilab, tmp_path):
    path = spin_down_csv(tmp_path / "my.csv")
    levilab("analyze", "spindown", path, "--no-save")
    assert list(tmp_path.iterdir()) == [path]
    levilab("analyze", "spindown", path, "--out", "there")
    assert sorted(p.name for p in (tmp_path / "there").iterdir()) == ["my.csv.result.json", "my.csv.spindown.png"]


@pytest.mark.usefixtures("undrawn_figures")
def test_an_analysis_need_not_be_named(levilab, sample_data):
    run = sample_data / "spin-down-1"
    named = levilab("analyze", "spindown", run, "--no-save")
    assert levilab("analyze", run, "--no-save").stdout == named.stdout
    names = ("hold", "precession-sweep", "loose-washers", "lower-limits", "field-scan", "trace-tape", "spin-down-1")
    each = json.loads(levilab("analyze", *(sample_data / name for name in names), "--no-save", "--json").stdout)
    assert [(one["analysis"], len(one["runs"])) for one in each] == [
        *(("spindown", 1), ("spin", 1), ("field", 1), ("limit", 2), ("precession", 1), ("hold", 4)),
    ]
    assert "Did you mean 'spindown'" in levilab("analyze", "spindwon", check=2).stderr


@pytest.mark.usefixtures("undrawn_figures")
def test_options_may_stand_before_the_name_of_an_analysis(levilab, sample_data):
    run = sample_data / "spin-down-1"
    named = levilab("analyze", "spindown", run, "--no-save").stdout
    for first in (["--out", "spindown"], ["--out=there"], ["--no-save"], ["--tilt", "auto"]):
        assert levilab("analyze", *first, "spindown", run, "--no-save").stdout == named
    assert "Did you mean 'spindown'" in levilab("analyze", "--out", "there", "spindwon", check=2).stderr
    assert "spindown: there is no such file" in levilab("analyze", "--no-save", "--", "spindown", check=1).stderr


@pytest.mark.usefixtures("drawn_figures")
def test_the_spin_of_a_record_is_printed_and_written_beside_it(levilab, sample_data, tmp_path):
    path = shutil.copy(sample_data / "scope-files" / "rigol-ds1000z.csv", tmp_path)
    done = levilab("analyze", "spin", path)
    assert re.search(r"The spin is 30\.00\d\d\(\d+\) Hz", done.stdout)
    assert "--channel chooses another" in " ".join(done.stdout.split())
    for name in ("rigol-ds1000z.csv.result.spin.json", "rigol-ds1000z.csv.spin.png"):
        assert (tmp_path / name).stat().st_size > 1000
    said = levilab("report", path, "-o", "new/page.html", "--no-crosscheck").stdout
    assert said.endswith("page.html, in a new folder\n")
    said = levilab("class", path, "-o", "new/page.html").stdout
    assert said.endswith("page.html, in place of an earlier file\n")
    levilab("report", path, "-o", "new/page.html", "--no-crosscheck")
    page = (tmp_path / "new" / "page.html").read_text(encoding="utf-8")
    assert "as levilab analyze found it" in page
    assert re.search(r"30\.00\d\d\(\d+\)", page)


@pytest.mark.usefixtures("undrawn_figures")
def test_notes_name_options_on_the_terminal_and_quantities_where_stored(levilab, tmp_path, sample_data):
    runs = tmp_path / "runs"
    for name in ("sound", "torn"):
        shutil.copytree(sample_data / "spin-down-1", runs / name)
    (runs / "torn" / "readings.csv").write_text("time_s,x\n0,1\n10,2\n20,3\n", encoding="utf-8")
    shown = " ".join(levilab("analyze", "spindown", runs).stdout.split())
    assert "say --columns f=NAME" in shown
    (result,) = runs.rglob("result.json")
    levilab("report", runs, "--no-crosscheck")
    page = html.unescape((tmp_path / "report.html").read_text(encoding="utf-8"))
    for text in ("\n".join(json.loads(result.read_text(encoding="utf-8"))["warnings"]), page):
        assert "say columns = f=NAME" in text
        assert text.count("skipped") == 1


@pytest.mark.usefixtures("undrawn_figures")
def test_an_input_that_a_report_skips_is_one_line_on_standard_error(levilab, tmp_path):
    (tmp_path / "data").mkdir()
    spin_down_csv(tmp_path / "data" / "good.csv")
    (tmp_path / "data" / "bad.csv").write_text("t in s,f in Hz\n0,40\n10,abc\n", encoding="utf-8")
    for paths in (["data/good.csv", "data/bad.csv"], ["data"]):
        done = levilab("report", *paths, "--no-crosscheck")
        (skipped,) = [line for line in done.stderr.splitlines() if "bad.csv" in line]
        assert re.match(r"skipped data/bad.csv, line 1: holds 1 reading", skipped)


@pytest.mark.usefixtures("undrawn_figures")
def test_what_does_not_belong_to_the_analysis_is_a_message_and_no_warning(levilab, sample_data):
    done = levilab("analyze", "spindown", sample_data, "--no-save")
    assert "skipped" not in done.stdout
    (skipped,) = [line for line in done.stderr.splitlines() if "skipped" in line]  # each file by kind and number
    assert "4 hold runs, 3 limit runs, 1 precession run" in skipped
    assert "2 Markdown pages" in skipped
    assert "lasts [s]" in done.stdout


@pytest.mark.usefixtures("undrawn_figures")
def test_columns_of_another_name_are_mapped(levilab, tmp_path):
    path = spin_down_csv(tmp_path / "my.csv", u=False)
    path.write_text(path.read_text().replace("time_s,spin_frequency_hz", "Uhr,Kanal 2").replace(",", ";"), "utf-8")
    refused = levilab("analyze", "spindown", path, check=1)
    assert "Kanal 2" in refused.stderr
    assert "--columns" in refused.stderr
    mapped = levilab("analyze", "spindown", path, "--json", "--columns", "t=Uhr,f=Kanal 2", "--tilt", "none")
    assert json.loads(mapped.stdout)["best_model"] == "disc"


def table(spins):
    return "t,f\n" + "".join(f"{10 * k},{spin}\n" for k, spin in enumerate(spins))


@pytest.mark.parametrize(("text", "says"), [
    ("", "empty"), ("a,b\n1,2\n2,3\n3,4\n", "--columns"), ("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "CSV"),
    (table([40, 39]), "3 readings"), (table([40] * 8), "fall"), (table(range(30, 38)), "fall"),
])  # fmt: skip
def test_bad_data_get_one_clear_line_and_status_1(levilab, tmp_path, text, says):
    path = tmp_path / "my.csv"
    path.write_bytes(text.encode("latin-1"))
    refused = levilab("analyze", "spindown", path, check=1)
    assert refused.stdout == ""
    (line,) = refused.stderr.splitlines()
    assert line.startswith("levilab: ")
    assert "my.csv" in line
    assert says in line
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.usefixtures("undrawn_figures")
def test_a_run_is_meant_by_its_short_name_and_not_resumed_once_finished(levilab):
    run = json.loads(levilab("acquire", "spin", "--mock", *QUICKLY, "--json").stdout)["run"]
    short = run.split("Z-")[1]
    assert short in levilab("runs").stdout
    assert json.loads(levilab("analyze", "spindown", short, "--json").stdout)["inputs"]
    for name in (short, run):
        assert "is finished" in levilab("acquire", "spin", "--resume", name, check=1).stderr


def test_a_reader_that_goes_away_costs_neither_the_run_nor_the_result(tmp_path, sample_data):
    """As in `levilab … | head -1`: the first line is read, then the pipe is closed."""
    analyze = ["analyze", "field", sample_data / "field-scan", "--out", "found"]
    for words in (["acquire", "spin", "--mock", *QUICKLY], analyze):
        process = subprocess.Popen(
            [sys.executable, "-m", "levilab", *words], cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        process.stdout.readline()
        process.stdout.close()
        process.wait(timeout=HANG_GUARD_S)
    (run,) = (tmp_path / "runs").iterdir()
    assert '"finished"' in (run / "run.json").read_text(encoding="utf-8")
    assert (tmp_path / "found" / "result.json").exists()


def test_the_bench_file_sets_the_experiment_of_the_virtual_bench_too(levilab, tmp_path):
    (tmp_path / "mine.toml").write_text("[spin]\ninterval_s = 20.0\n", encoding="utf-8")
    words = ("acquire", "spin", "--mock", *QUICKLY, "--bench", "mine.toml", "--json")
    assert 8 <= json.loads(levilab(*words).stdout)["readings"] <= 11


@pytest.mark.usefixtures("undrawn_figures")
def test_a_result_that_cannot_be_written_is_shown(levilab, tmp_path):
    path = spin_down_csv(tmp_path / "my.csv")
    done = levilab("analyze", "spindown", path, "--out", path / "below", check=1)
    assert "What the data say" in done.stdout
    assert "--no-save" in done.stderr.splitlines()[-1]


@pytest.mark.parametrize(("typed", "says"), [
    ("spindown my.csv", "No such command 'spindown': take levilab analyze spindown my.csv"),
    ("fit my.csv", "No such command 'fit': take levilab analyze my.csv"),
    ("trace --mock", "take levilab acquire trace --mock"),
    ("analyze my.csv --unit rpm", '--columns "t=1,f=2 [rpm]"'), ("open my.csv --sheet 2", "my.xlsx/Sheet2"),
])  # fmt: skip
def test_what_other_programs_call_a_command_or_an_option_is_told_ours(typed, says, tmp_path):
    done = command(*typed.split(), cwd=tmp_path)
    assert done.status == 2
    assert says in " ".join(line.strip("│ ") for line in done.err.splitlines())


@pytest.mark.parametrize(("typed", "says"), [
    ("anlyze", "Den Befehl 'anlyze' gibt es nicht. Meintest du 'analyze'?"),
    ("analyze spindwn", "Den Befehl 'spindwn' gibt es nicht. Meintest du 'spindown', 'spin'?"),
    ("fit my.csv", "Den Befehl 'fit' gibt es nicht: Nimm levilab analyze my.csv"),
    ("my.csv", "my.csv ist eine Datei oder ein Ordner und kein Befehl: Nimm levilab analyze my.csv"),
    ("runs --nonsense", "Die Option --nonsense gibt es nicht"), ("runs", "runs: diesen Ordner gibt es nicht"),
    ("--nonsense", "Aufruf: levilab [OPTIONS] COMMAND [ARGS]... Hilfe: 'levilab -h' ╭─ Fehler"),
    ("report --title", "Die Option '--title' braucht einen Wert."),
    ("analyze spin my.csv --method matchd", "Falscher Wert für '--method': 'matchd' ist keins von 'auto'"),
    ("simulate", "SCENE: fehlt: eine von undriven"), ("worksheet", "EXPERIMENT: einige von spin"),
    ("report", "hier gibt es keinen Ordner runs, und kein anderer Pfad ist angegeben"),
    ("analyze spindown my.csv", "rpm …), es gibt 'Foo', 'Bar': --columns \"t=NAME,f=NAME\" angeben"),
    ("analyze spindown half.csv", "es gibt 't [s]', 'x': --columns f=NAME angeben"),
    ("open my.csv --no-browser", "my.csv: wird erst gelesen, wenn die Frage mit --columns beantwortet ist"),
])  # fmt: skip
def test_the_commonest_mistakes_are_answered_in_german(typed, says, tmp_path, monkeypatch):
    monkeypatch.setenv("LEVILAB_LANGUAGE", "de")
    for name, titles in (("my.csv", "Foo,Bar"), ("half.csv", "t [s],x")):
        (tmp_path / name).write_text(f"{titles}\n0,38\n10,37\n20,36\n", encoding="utf-8")
    done = command(*typed.split(), cwd=tmp_path)
    assert done.status in {1, 2}
    assert says in " ".join(line.strip("│ ") for line in done.err.splitlines())
    if typed.startswith("open"):
        assert "welche Spalte enthält die Zeit und welche die Drehfrequenz?" in done.out
        assert "mit ihren Nummern: levilab open" in done.out


@pytest.mark.parametrize("encoding", ["cp1252", "ascii"])
def test_an_old_code_page_costs_no_number_its_exponent(tmp_path, encoding):
    """As PYTHONIOENCODING and an old Windows have it: such streams refuse what they cannot carry."""
    path = spin_down_csv(tmp_path / "my.csv")
    done = command("analyze", "spindown", path, "--no-save", cwd=tmp_path, encoding=encoding)
    assert done.status == 0, done.err
    assert "?" not in done.out
    assert re.search(r"C3/2 = 2\.\d+\(\d+\)e-4 \(rad/s\)\^-(1/2|½)/s", done.out)
    assert "chi2/dof" in done.out


#: What takes long to import, and has no business where it is not used.
HEAVY = {
    "numpy", "scipy", "pandas", "matplotlib", "lmfit", "pyvisa", "jinja2", "numba", "rich.progress",
    "instruments.catalogue", "levilab.acquisition.loop", "levilab.formats.table", "analysis.pulses", "zarr",
}  # fmt: skip


#: Commands that follow each other in one process, and what they may import that those before did not.
IMPORTS = {
    """--help, acquire spin --help, simulate --help, simulate nowhere, --version""": "",
    # a refusal of what is not there waits for nothing, nor does one of a name or a value that is none
    """analyze nowhere, analyze, analyze field x --device nowhere, report nowhere, open nowhere, runs nowhere,
    live nowhere, crosscheck --like nowhere, acquire spin, acquire spin --resume nowhere, bench check, simulate no.toml,
    tune --scan nowhere, top nowhere, crosscheck nothing, reproduce --only nothing, worksheet nothing,
    export . -o x.xyz, acquire spin --mock --scene nowhere, tune --top light --no-ask, tune --no-ask,
    sweep undriven --sweep start.spinhz=18:30:3, sweep undriven --sweep start.spin_hz=18:30:3 --observe lifetime,
    sweep undriven --sweep start.spin_hz=18:30:3 --set top.mas_kg=25g, simulate undriven --set top.mas_kg=25g""": "",
    # settings of an experiment stand in its module, which needs numpy
    """acquire spin --mock --set spin.gat_s=3, acquire spin --mock --set spin.gate_s=abc,
    acquire spin --mock --set limit.witch=upper, acquire limit --mock --set limit.which=uper""": "numpy",
    "runs .": "levilab.formats.table",
    " ".join(
        ["acquire spin --mock", *QUICKLY]
    ): "pyvisa instruments.catalogue levilab.acquisition.loop analysis.pulses",
}


def test_nothing_heavy_is_imported_where_it_is_not_used(tmp_path):
    commands = [(words.split(), more.split()) for typed, more in IMPORTS.items() for words in typed.split(",")]
    program = (
        "import sys\nfrom levilab.cli.main import main\n"
        f"for words in {[words for words, _ in commands]!r}:\n    sys.argv = ['levilab', *words]\n"
        "    try:\n        main()\n    except SystemExit:\n        pass\n"
        f"    print('HEAVY', *sorted({HEAVY!r} & set(sys.modules)))"
    )
    options = {"capture_output": True, "text": True, "encoding": "utf-8", "timeout": HANG_GUARD_S}
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, check=True, **options)
    heavy, allowed = [set(line.split()[1:]) for line in done.stdout.splitlines() if line.startswith("HEAVY")], set()
    for (words, more), seen in zip(commands, heavy, strict=True):
        allowed |= {*more}
        assert seen <= allowed, words


def test_help_lists_the_scenes_that_come_with_levilab():
    assert sorted(SCENES.split(", ")) == presets()


@pytest.mark.parametrize(
    ("command", "option", "names"),
    [(sweep, "observe", NAMES), (reproduce, "only", CHAPTERS)],
    ids=["sweep", "reproduce"],
)
def test_help_lists_all_observables_and_chapters(command, option, names):
    (given,) = get_type_hints(command, include_extras=True)[option].__metadata__
    assert given.help.partition(": ")[2].rstrip(".").split(", ") == list(names)


def test_experiments_and_values_are_understood_as_people_write_them(levilab):
    """The name behind the options, numbers with their units, the former name of --out, help and version as words."""
    listed = levilab("acquire", "--mock", "spin", "--set", "gate_s=2000ms", "--settings", "--json").stdout
    (gate,) = [one for one in json.loads(listed)["settings"] if one["name"] == "gate_s"]
    assert gate["value"] == 2.0
    done = levilab("simulate", "undriven", "--duration", "200ms", "--set", "top.mass_kg=25.26g", "--json").stdout
    assert json.loads(done)["duration_s"] == 0.2
    assert levilab("version").stdout == levilab("-v").stdout == levilab("--version").stdout
    assert levilab("help", "runs").stdout == levilab("runs", "--help").stdout


@pytest.mark.parametrize(("words", "said"), [
    ("acquire --mock", "as levilab acquire spin --mock: spin, trace"),
    ("acquire spin --duration 60", "levilab acquire spin --settings lists"),
    ("acquire spin --mok", "(Possible options: --mock)"),
    ("here", "here is a file or a folder, and no command: take levilab analyze here"),
    ("export", "PATH: is missing: name a run, a data file or a sweep, as in levilab export runs/NAME"),
    ("simulate undriven --spin 30", "--set changes the scene: --set start.spin_hz=…"),
])  # fmt: skip
def test_what_is_not_understood_is_answered_with_what_was_meant(levilab, tmp_path, words, said):
    (tmp_path / "here").mkdir()
    refused = " ".join(levilab(*words.split(), check=2).stderr.replace("│", " ").split())
    assert said in refused
    assert ("Possible" in refused) == ("Possible" in said)


@pytest.mark.usefixtures("undrawn_figures")
def test_runs_are_where_acquire_writes_them_unless_another_place_is_named(levilab, sample_data, tmp_path):
    shutil.copytree(sample_data / "spin-down-1", tmp_path / "runs" / "one")
    assert "What the data say" in levilab("analyze", "--no-save").stdout
    assert levilab("analyze", "spindown", "--no-save").stdout == levilab("analyze", "runs", "--no-save").stdout
    for name in ("--out", "--output", "-o"):
        levilab("report", "--no-crosscheck", name, f"page{name}.html")
        assert (tmp_path / f"page{name}.html").exists()
    assert levilab("runs", "--out", "runs").stdout == levilab("runs").stdout


def test_a_table_without_times_is_not_sent_to_another_analysis(levilab, tmp_path):
    (tmp_path / "d.csv").write_text("tick,f [Hz]\nfast,40\n20,39\n30,38\n40,37\n", encoding="utf-8")
    refused = levilab("analyze", "spindown", "d.csv", check=1).stderr
    assert "say --columns t=NAME" in refused
    assert "reads it" not in refused

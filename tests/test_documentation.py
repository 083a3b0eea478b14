"""What the pages show runs as they show it."""

import contextlib
import io
import re
import shlex
import shutil

import pytest

from levilab.acquisition.table import Configuration, settings_of
from levilab.bench.config import read_bench
from support.commands import command
from support.less_work import with_less_work
from support.paths import ROOT

PAGES = [
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
    *sorted((ROOT / "docs").rglob("*.md")),
    ROOT / "sample_data/README.md",
]


@pytest.fixture(autouse=True, scope="module")
def less_work():
    """No test looks at a figure here: those of each analysis are drawn by the tests of its room."""
    with with_less_work():
        yield


def blocks(language):
    """(page, block) of every fenced block of a language."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        found += [(page.name, block) for block in re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)]
    return found


def copy_samples(text, place):
    """Copy the sample data to where a text that names them is tried."""
    if "sample_data" in text:
        shutil.copytree(ROOT / "sample_data", place / "sample_data")


@pytest.mark.pages
@pytest.mark.parametrize(("page", "code"), blocks("python"))
def test_python_in_the_pages_prints_what_it_says(page, code, tmp_path):
    copy_samples(code, tmp_path)
    shown = io.StringIO()
    with contextlib.chdir(tmp_path), contextlib.redirect_stdout(shown):
        exec(compile(code, page, "exec"), {"__name__": "__main__"})
    assert shown.getvalue().splitlines() == re.findall(r"print\(.*\)  # (.*)", code)


def steps():
    """Page → command → what the page shows of its output; in order, each command once.

    In a block of ``console`` a command stands after ``$``, above its output.  What is of the reader's own table, and
    shows nothing, is not carried out; nor is a block of ``shell-session``.
    """
    found = {}
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for block in re.findall(r"```console\n(.*?)```", text, re.DOTALL):
            for line, shown in re.findall(r"^\$ (levilab .*)\n((?:(?!\$ ).*\n)*)", block, re.MULTILINE):
                words = line.split("  #")[0].strip()
                if shown or ".csv" not in words:
                    outputs = found.setdefault(page.relative_to(ROOT).as_posix(), {}).setdefault(words, [])
                    outputs += [shown] if shown else []
    return found


def test_each_command_stands_after_a_dollar():
    """So that a reader tells what is typed from what is printed; tables of settings and programs have other blocks."""
    for page in (*PAGES, ROOT / "CONTRIBUTING.md"):
        text = page.read_text(encoding="utf-8")
        assert not re.findall(r"```(sh|bash|shell|text|)\n(levilab|pip|make|python|uv) ", text), page
        for block in re.findall(r"```(?:console|shell-session)\n(.*?)```", text, re.DOTALL):
            assert block.startswith("$ "), (page, block)


def as_pattern(shown):
    """What a page shows of an output; ``…`` stands for any text in a line, alone on a line for any lines."""
    lines = [
        r"(?:.*\n)*" if line == "…" else re.escape(line).replace("…", ".*") + r" *\n" for line in shown.splitlines()
    ]
    return "".join(lines) + r"\Z"


@pytest.mark.pages
@pytest.mark.parametrize("steps", steps().values(), ids=steps())
def test_the_commands_of_a_page_work_one_after_another(tmp_path, steps):
    copy_samples(" ".join(steps), tmp_path)
    for line, outputs in steps.items():
        ended = command(*shlex.split(line)[1:], cwd=tmp_path)
        assert ended.status == 0, (line, ended.err)
        written = ended.err + ended.out  # progress comes before results
        for shown in outputs:
            assert re.match(as_pattern(shown), written), (line, shown, written)


def test_the_readme_and_the_tutorial_show_commands():
    assert len(steps()["README.md"]) >= 5
    assert len(steps()["docs/tutorial.md"]) >= 8
    german = [re.sub(" --language de| --note .*", "", line) for line in steps()["docs/tutorial-de.md"]]
    assert german == [re.sub(" --note .*", "", line) for line in steps()["docs/tutorial.md"]]


@pytest.mark.parametrize(("shown", "matches"), [
    ("a\nc\n", False), ("a\nb\nc\n", True), ("…\nc\n", True), ("a\n…\n", True), ("a…\nb\nc\n", True), ("…\nb\n", False),
])  # fmt: skip
def test_an_output_is_compared_with_what_a_page_shows_of_it(shown, matches):
    assert bool(re.match(as_pattern(shown), "a\nb\nc\n")) is matches


#: What a shell takes for more than itself, outside of quotes: zsh looks for files, PowerShell splits at commas.
SPECIAL = re.compile(r"\S[\[,](?!…)\S|\*|(?<=\s)\[\S")


def unquoted(line):
    """A command without what stands in quotes and without its comment."""
    return re.sub(r"\"[^\"]*\"|'[^']*'", "", line.split("  #", maxsplit=1)[0])


def commands_to_type(text):
    """The commands of a page, in blocks and within a line, and those of a program's help."""
    in_blocks = re.findall(r"^(?:\$ )?((?:levilab|pip|python) .*)", text, re.MULTILINE)
    in_lines = re.findall(r"(?<!`)`((?:levilab|pip|python|--[a-z-]+) [^`\n]*)`", text)
    return in_blocks + in_lines + re.findall(r"Example: (levilab .*)['\"]", text)


def test_commands_mean_the_same_in_every_shell():
    sources = [*PAGES, *sorted((ROOT / "levilab/cli").glob("*.py"))]
    found = [(page.name, line) for page in sources for line in commands_to_type(page.read_text(encoding="utf-8"))]
    assert len(found) > 100
    assert not [(page, line) for page, line in found if SPECIAL.search(unquoted(line))]


@pytest.mark.parametrize(("line", "special"), [
    ("levilab simulate undriven --set start.position_m=[0,0,0.073]", True), ("levilab analyze runs/*", True),
    ("levilab reproduce --only limits,errata  # some", True), ('levilab reproduce --only "limits,errata"', False),
    ("levilab runs  # all, of [any] kind", False), ("pip install 'levilab[pdf]'", False),
])  # fmt: skip
def test_what_a_shell_would_change_is_seen(line, special):
    assert bool(SPECIAL.search(unquoted(line))) is special


def test_the_readme_begins_with_the_browser_then_make_demo_and_make_test():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    first = blocks("console")[0][1]
    assert [line.split("#")[0].strip("$ ") for line in first.splitlines()] == ["make demo", "make test"]
    assert readme.index("levilab live --mock") < readme.index("make demo") < 1600


def test_links_between_the_pages_lead_somewhere():
    for page in PAGES:
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), (page, target)


def test_the_bench_of_the_page_is_a_valid_one(tmp_path):
    (text,) = (text for page, text in blocks("toml") if page == "bench.md")
    path = tmp_path / "bench.toml"
    path.write_text(text, encoding="utf-8")
    bench = read_bench(path, Configuration)
    assert bench.counter
    assert settings_of(bench, "spin").reading_u_hz == 0.03

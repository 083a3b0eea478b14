"""What the pages show runs as they show it."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from support.paths import ROOT
from support.waiting import HANG_GUARD_S

if TYPE_CHECKING:
    from pathlib import Path

PAGES = [
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
    *sorted((ROOT / "docs").rglob("*.md")),
    ROOT / "sample_data/README.md",
]


def blocks(language: str) -> list[tuple[str, str]]:
    """(page, block) of every fenced block of a language."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        found += [(page.name, block) for block in re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)]
    return found


@pytest.mark.parametrize(("page", "code"), blocks("python"))
def test_python_in_the_pages_prints_what_it_says(page: str, code: str, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "sample_data", tmp_path / "sample_data")
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=HANG_GUARD_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == re.findall(r"print\(.*\)  # (.*)", code)


def commands() -> list[str]:
    """Every levilab command that the README and the first steps show, in order, once."""
    lines = [line.split("  #")[0].strip() for page, block in blocks("sh") for line in block.splitlines()]
    wanted = [line for line in lines if line.startswith("levilab ") and ".csv" not in line]
    return list(dict.fromkeys(wanted))


def test_the_commands_of_the_pages_work_one_after_another(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "sample_data", tmp_path / "sample_data")
    assert len(commands()) >= 5
    for command in commands():
        done = subprocess.run(
            [sys.executable, "-m", *shlex.split(command)],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            encoding="utf-8",
            timeout=HANG_GUARD_S,
            check=False,
        )
        assert done.returncode == 0, (command, done.stderr)


def test_make_demo_and_make_test_stand_at_the_top_of_the_readme_and_in_the_makefile() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    first = blocks("sh")[0][1]
    assert [line.split("#")[0].strip() for line in first.splitlines()] == ["make demo", "make test"]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert re.search(r"^demo:", makefile, re.MULTILINE)
    assert re.search(r"^test:", makefile, re.MULTILINE)
    assert readme.index("make demo") < 1000


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_between_the_pages_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), target


def test_the_bench_of_the_page_is_a_valid_one(tmp_path: Path) -> None:
    from levilab.acquisition.table import Configuration, settings_of
    from levilab.bench.config import read_bench

    ((_, text),) = blocks("toml")
    path = tmp_path / "bench.toml"
    path.write_text(text, encoding="utf-8")
    bench = read_bench(path, Configuration)
    assert bench.counter
    assert settings_of(bench, "spin").reading_u_hz == 0.03

"""A report in another language: what a person reads of it, and the figure in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from levilab.report.page import write_report
from levilab.texts.text import speak
from support.paths import SAMPLE_DATA

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@pytest.fixture
def german() -> Iterator[None]:
    speak("de")
    yield
    speak("en")


@pytest.mark.usefixtures("german")
def test_a_german_report_has_german_headings_answer_and_figure(tmp_path: Path) -> None:
    run = SAMPLE_DATA / "spin-down-1"
    page = write_report([run], tmp_path / "report.html", short=True).read_text(encoding="utf-8")
    for said in (
        ">Ergebnis<",
        "Am besten passt das Scheibengesetz",
        "Drehfrequenz",
        "--language de",
        'lang="de"',
    ):
        assert said in page
    assert ">Result<" not in page

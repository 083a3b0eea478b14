"""The report: self-contained, complete, and safe against what a user typed."""

from __future__ import annotations

import json
import re
import shutil
from html.parser import HTMLParser
from typing import TYPE_CHECKING

import pytest
from tests_of_levilab import spin_down_csv

from levilab.errors import LevilabError
from levilab.pipeline import Options, analyze_spindowns
from levilab.report.page import render, write_report

if TYPE_CHECKING:
    from pathlib import Path


class Page(HTMLParser):
    """Tags with their attributes, and the text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.fixture(scope="module")
def page() -> Page:
    from pathlib import Path

    return Page(render(analyze_spindowns([Path(__file__).parents[2] / "sample_data"], Options())))


def test_nothing_is_fetched_when_the_report_is_opened(page: Page) -> None:
    addresses = [value for _, attributes in page.tags for name, value in attributes.items() if name in {"src", "href"}]
    assert addresses
    assert all(address and address.startswith("data:") for address in addresses)
    assert not {"script", "link", "iframe", "object"} & {tag for tag, _ in page.tags}


def test_numbers_have_uncertainties_and_the_published_constants_are_there(page: Page) -> None:
    text = " ".join(page.text.split())
    assert "SYNTHETIC" in text
    assert re.search(r"C₁ = 3\.199\(\d+\)×10⁻³ s⁻¹", text)
    assert re.search(r"C₂ = 1\.760\(\d+\)×10⁻⁵ rad⁻¹", text)
    assert re.search(r"C₁ = 3\.182\(\d+\)×10⁻³ s⁻¹", text)  # the mean, 0.00318175
    assert "exclude" in text
    assert "scatters between the runs" in text


def test_what_a_user_typed_is_escaped_wherever_it_stands(tmp_path: Path, sample_data: Path) -> None:
    evil = '<script>alert("x")</script>&<img src=x onerror=alert(1)>'
    run = tmp_path / "run <b>bold"
    shutil.copytree(sample_data / "spin-down-1", run)
    record = (run / "run.json").read_text(encoding="utf-8")
    record = re.sub(r'"note": "[^"]*"', lambda _: '"note": ' + json.dumps(evil), record)
    (run / "run.json").write_text(record, encoding="utf-8")
    (run / "events.jsonl").write_text(json.dumps({"time_s": 1.0, "kind": "x", "text": evil}) + "\n", encoding="utf-8")
    parsed = Page(render(analyze_spindowns([run], Options())))
    assert parsed.text.count(evil) == 2
    assert "run <b>bold" in parsed.text
    assert "script" not in {tag for tag, _ in parsed.tags}
    assert all("onerror" not in attributes for _, attributes in parsed.tags)


def test_a_report_of_a_data_file_knows_no_instrument_and_says_so_by_silence(tmp_path: Path) -> None:
    parsed = Page(render(analyze_spindowns([spin_down_csv(tmp_path / "my.csv")], Options())))
    assert "my.csv" in parsed.text
    assert "SYNTHETIC" not in parsed.text


def test_many_readings_are_cut_in_the_page_and_the_figure_stays_small(tmp_path: Path) -> None:
    import numpy as np

    t = np.arange(20_000) * 0.01
    nu = 40 * (1 + 2.34e-4 * np.sqrt(2 * np.pi * 40) * t / 2) ** -2 + np.random.default_rng(0).normal(0, 0.03, t.size)
    path = tmp_path / "long.csv"
    np.savetxt(path, np.c_[t, nu], delimiter=",", header="time_s,spin_frequency_hz", comments="")
    html = render(analyze_spindowns([path], Options(reading_u=0.03)))
    assert "the first 200 of 20000" in " ".join(Page(html).text.split())
    assert len(html) < 5e6


def test_a_report_that_cannot_be_written_is_told_in_one_line(tmp_path: Path, sample_data: Path) -> None:
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    with pytest.raises(LevilabError, match="--output"):
        write_report([sample_data], tmp_path / "file" / "report.html")

"""Tables on a narrow terminal: no word is cut, no line is wider than the terminal."""

import io
import os
import re
import shutil
import sys
from unittest.mock import Mock

import pytest

from levilab.present import terminal
from levilab.present.progress import BarDisplay
from levilab.present.tables import table
from levilab.telemetry.messages import State

HEADS = ("what is set", "now", "what may stand there", "what it means to the person at the bench")
ROWS = (
    ("drive_amplitude_vpp", "10.0", "a number above 0 [V peak to peak]", ""),
    ("trigger_patience_s", "5.0", "a number above 0 [s]", "longest wait for a trigger"),
)
TABLE = table("Settings of an experiment", HEADS, ROWS, numbers=["now"])
WORDS = {word for text in (*HEADS[1:], *ROWS[0], *ROWS[1]) for word in text.split()}


def drawn(width):
    out = io.StringIO()
    terminal.Terminal(width=width, file=out, highlight=False).print(terminal.draw(TABLE))
    return [line.rstrip() for line in out.getvalue().splitlines()]


@pytest.mark.parametrize("width", [200, 80, 60, 40])
def test_no_line_is_wider_than_the_terminal_and_no_word_is_cut(width):
    lines = drawn(width)
    assert max(map(len, lines)) <= width
    assert {word for line in lines for word in line.split()} >= WORDS


def test_where_the_words_do_not_fit_beside_each_other_a_row_is_a_list():
    lines = drawn(40)
    assert lines[lines.index("drive_amplitude_vpp") + 1].split() == ["now", "10.0"]
    assert not any("───" in line for line in lines)
    assert any("───" in line for line in drawn(80))


class Screen(io.StringIO):
    """A terminal's stream."""

    def isatty(self):
        return True


def test_a_table_is_as_wide_as_the_terminal_and_wider_into_a_file(monkeypatch):
    monkeypatch.setattr(shutil, "get_terminal_size", lambda *_, **__: os.terminal_size((57, 24)))
    monkeypatch.setattr(sys, "stdout", Screen())
    assert terminal.terminal().width == 57
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    assert terminal.terminal().width == 160


def test_at_the_end_the_bench_is_taken_away_and_the_lines_stay(monkeypatch):
    for name, value in {"TERM": "xterm", "COLUMNS": "100", "LINES": "24"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "stderr", screen := Screen())
    display = BarDisplay()
    display.reading("40.123 Hz", 1.0, 3.0)
    assert display.is_due()
    display.state(State(5.0, elapsed_s=1.0, time_left_s=3.0, last={"spin_frequency_hz": 40.123}, readings=1))
    assert not display.is_due()
    display.close()
    shown = screen.getvalue()
    assert "40.123 Hz" in shown
    assert "\x1b[2K" in shown.rpartition("about 3 s left")[2]  # the lines of the bench are erased


@pytest.mark.parametrize(
    ("encoding", "expected"), [("utf-8", "─"), ("cp437", "---"), ("ascii", "---"), ("cp1252", "---")]
)
def test_the_bench_is_drawn_in_the_characters_of_the_stream(encoding, expected):
    stream = io.TextIOWrapper(io.BytesIO(), encoding=encoding)  # it raises for what it cannot carry
    display = BarDisplay(terminal.Terminal(file=stream, force_terminal=True, width=60, color_system=None))
    for k in range(5):
        display.state(State(1.0 * k, elapsed_s=1.0, time_left_s=9.0, last={"spin_frequency_hz": 25.0 - 0.1 * k}))
    stream.flush()
    shown = stream.buffer.getvalue().decode(encoding)
    display.close()
    assert "spin 24.600 Hz" in shown
    assert "0.10 Hz/s" in shown
    assert expected in shown
    assert not re.search("\x1b\\[[0-9;]*m", shown)  # no colour was asked for


def test_a_terminal_that_is_gone_ends_no_measurement(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", screen := Screen())
    display = BarDisplay()
    monkeypatch.setattr(screen, "write", Mock(side_effect=OSError(5, "Input/output error")))
    display.reading("40.123 Hz", 1.0, 3.0)
    display.state(State(5.0, elapsed_s=1.0, time_left_s=3.0, readings=1))
    display.close()

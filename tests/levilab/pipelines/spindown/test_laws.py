"""A law is one row of one table: everything else is made from it."""

import json
import subprocess
import sys

import numpy as np
import pytest

from analysis.spindown.drag import LAWS, spin
from analysis.spindown.tilt import PARAMETERS
from levilab.pipelines.spindown.words import STRAIGHT_LINES, SYMBOLS
from levilab.present.looks import LOOKS
from support.paths import ROOT, SAMPLE_DATA

#: A row more, in a process of its own: what is made from the rows is made when modules are imported.
TURBULENT = """
import sys
from types import MappingProxyType
from analysis.spindown import drag
row = drag.power_law("turbulent", drag.Fraction(9, 5), "the spin to the power 9/5, as of turbulent air")
drag.LAWS = MappingProxyType({**drag.LAWS, row.name: row})
"""
#: Several commands in one process, which shares imports and kernels, and the head of a page while a run goes on; no
#: test looks at the trials of this report.
COMMANDS = """
import json
from pathlib import Path
sys.path.append("tests")
from support.commands import command
from support.less_work import with_less_work
with with_less_work():
    for words in json.loads(sys.argv[1]):
        ended = command(*words, cwd=Path.cwd())
        assert ended.status == 0, ended.err
        print(ended.out)
import numpy as np
from levilab.live.running import spin_down
time = np.linspace(0.0, 60.0, 101)  # ends before the top leans
noise = 0.01 * np.random.default_rng(1).standard_normal(101)
print(spin_down({"time_s": time, "spin_frequency_hz": drag.spin("turbulent", time, 40.0, 4e-5) + noise}, 1).head)
"""


def test_every_constant_has_a_symbol_and_every_law_a_colour():
    assert set(SYMBOLS) == {name for law in LAWS.values() for name in law.parameters} | set(PARAMETERS)
    assert len({LOOKS[name].colour for name in LAWS}) == len(LAWS)


@pytest.mark.parametrize("law", STRAIGHT_LINES)
def test_what_is_said_to_be_straight_is_straight(law):
    exponent = LAWS[law].exponent
    t = np.linspace(0, 200, 9)
    constant = 3.2e-3 * 250 ** (1 - exponent)  # of a top that loses half its 40 Hz in 200 s
    drawn = STRAIGHT_LINES[law].transform(2 * np.pi * spin(law, t, 40.0, constant))
    assert np.diff(drawn, 2) == pytest.approx(0, abs=1e-12)  # rounding of numbers of order one


def test_a_new_law_is_one_row_from_the_fit_to_every_page(tmp_path):
    t = np.linspace(0.0, 200.0, 101)
    noise = np.random.default_rng(1).normal(0, 0.01, len(t))
    frequency = spin("power", t, 40.0, 4e-5, 1.8) + noise
    data = tmp_path / "turbulent.csv"
    rows = [f"{a},{b},0.01" for a, b in zip(t, frequency, strict=True)]
    data.write_text("\n".join(["time_s,spin_frequency_hz,spin_frequency_u_hz", *rows]))
    page, many = tmp_path / "report.html", tmp_path / "many.csv"
    commands = (
        ("analyze", "spindown", "--tilt", "none", data),
        ("report", data, "--tables", "-o", page),
        ("analyze", "spindown", SAMPLE_DATA / "spin-down-1", data, "--table", many, "--cores=1"),
    )
    program = [sys.executable, "-W", "error", "-c", TURBULENT + COMMANDS, json.dumps(commands, default=str)]
    done = subprocess.run(program, capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    shown = done.stdout
    assert "C₉/₅ = " in shown
    assert "(rad/s)^−4/5/s" in shown
    assert "ω^−4/5" in shown
    # the free exponent contains it, so that a tie of the two decides for it
    assert "turbulent law fits best" in " ".join(shown.split())
    assert (tmp_path / "turbulent.csv.spindown.png").exists()
    assert "turbulent" in page.read_text(encoding="utf-8")
    tables = {file.name: file.read_text(encoding="utf-8") for file in (tmp_path / "report.tables").iterdir()}
    assert "turbulent_c95_per_rad_s_4_5_per_s" in tables["spindown-inputs.csv"]
    assert "turbulent" in tables["spindown-laws.tex"]
    assert "turbulent_c95_u_per_rad_s_4_5_per_s" in many.read_text()
    assert "ω̇ = −C₉/₅ω^(9/5)" in shown

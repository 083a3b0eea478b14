"""Tables beside a report: all digits for programs, LaTeX that compiles, nothing that a spreadsheet would execute."""

import csv
import io
import json
import re

import pytest

from levilab.errors import LevilabError
from levilab.pipelines.catalogue import ANALYSES
from levilab.present.document.blocks import Banner, Details, Document, Section, Tabular
from levilab.present.tables import Row, table
from levilab.present.units import UNITS
from levilab.report.tables.latex import as_latex, to_latex, units_in_heads
from levilab.report.tables.values import CONTENTS, Values, as_csv, folder_of, of_analysis, write_tables
from support.paths import SAMPLE_DATA


@pytest.fixture(scope="module")
def values():
    """Name → rows of the tables of two spin-downs, and the result that they are of as `result`."""
    analysis = ANALYSES["spindown"]
    options = analysis.options_from({"tilt": "none"})
    found = analysis.analyze([SAMPLE_DATA / f"spin-down-{k}" for k in (1, 2)], options)
    tables = {
        one.name: [*csv.DictReader(io.StringIO(as_csv(one)))] for one in of_analysis(analysis, found, SAMPLE_DATA)
    }
    return tables | {"result": [{"json": json.dumps(analysis.document(found, SAMPLE_DATA))}]}


def test_each_run_has_a_row_with_units_in_the_names_and_all_digits(values):
    result = json.loads(values["result"][0]["json"])
    first, second = values["spindown-inputs"]
    disc = next(model for model in result["runs"][0]["models"] if model["name"] == "disc")["parameters"]["c32"]
    assert float(first["disc_c32_per_sqrt_rad_s"]) == disc["value"]
    assert float(first["disc_c32_u_per_sqrt_rad_s"]) == disc["u"]
    assert (first["input"], second["input"]) == ("spin-down-1", "spin-down-2")
    assert first["synthetic"] == "true"


def test_each_quantity_has_a_row_with_u_and_unit(values):
    result = json.loads(values["result"][0]["json"])
    rows = {(row["input"], row["model"], row["quantity"]): row for row in values["spindown-quantities"]}
    mean = rows["all together", "", "c32"]
    assert float(mean["value"]) == result["values"]["c32"]["value"]
    assert mean["unit"] == "(rad/s)^-1/2/s"
    assert mean["runs"] == "2"
    assert rows["spin-down-2", "stokes", "c1_linearised"]["unit"] == "1/s"
    assert rows["spin-down-1", "disc", "rms_residual"]["unit"] == "Hz"


@pytest.mark.parametrize("text", ["=1+1", "+1", "-2+3", "@SUM(A1)", "\t=1", "\r=1", " =cmd|'/C calc'!A0"])
def test_no_text_is_a_formula_to_a_spreadsheet(text):
    ((head,), (cell,)) = csv.reader(io.StringIO(as_csv(Values("x", "", (text,), ((text,),)))))
    assert head.startswith("'")
    assert cell.startswith("'")
    assert as_csv(Values("x", "", ("n",), ((-0.5,),))) == "n\n-0.5\n", "a number is none"


#: Characters with a meaning of their own, a row that begins like an option, and letters that LaTeX's fonts lack.
HOSTILE = "\\input{/etc/passwd} \\write18{x} $ & # % _ ^ ~ { } < > | \" ` ' [x] * -- --- ?` !` 中 é ν\x00\u202e"
#: What may stand in the body: a command of LaTeX itself or of booktabs.
KNOWN = {
    "begin", "end", "centering", "caption", "label", "toprule", "midrule", "bottomrule", "textbf", "textsuperscript",
    "textsubscript", "setlength", "tabcolsep", "par", "smallskip", "footnotesize", "textbackslash",
    "textasciicircum", "textasciitilde", "times", "nu", "frac", "ldots", "linewidth", "resizebox", "ifdim", "width",
    "else", "fi",
}  # fmt: skip


def test_what_a_person_typed_is_no_command_of_latex():
    shown = table(HOSTILE, (HOSTILE, "[n]"), [("*", "[1pt]"), (HOSTILE, "10⁻³ (rad/s)^−½")], numbers=["[n]"])
    text = as_latex("hostile", shown, note=HOSTILE, mark="SYNTHETIC.")
    assert text.isascii()
    body = "".join(line for line in text.splitlines(keepends=True) if not line.startswith("%"))
    commands = set(re.findall(r"\\([a-zA-Z]+)", body))
    assert commands <= KNOWN
    assert "\\write18" not in body
    unescaped = re.sub(r"\\[\\{}$&#%_]", "", body)
    assert unescaped.count("{") == unescaped.count("}")
    assert unescaped.count("$") % 2 == 0
    assert "#" not in unescaped
    assert "%" not in unescaped
    rows = [line for line in body.splitlines() if line.endswith(r"\\")]
    assert len(rows) == 3
    assert all(re.sub(r"\\&", "", row).count("&") == 1 for row in rows), "as many columns as heads"
    # behind a row's end LaTeX takes [ for a length, and * for an option
    assert all(not re.match(r"\s*[\[*]", row) for row in rows)


def test_numbers_are_typeset_as_in_the_report():
    assert to_latex("2.34(3)×10⁻⁴") == r"2.34(3)$\times$10\textsuperscript{$-$4}"
    assert to_latex("φ̇ and χ²") == r"$\dot\varphi$ and $\chi$\textsuperscript{2}"


def test_a_unit_stands_in_the_head_and_long_texts_are_paragraphs():
    heads = ("source", "where it comes from", "type", "adds to u", "share of u²")
    remark = "the standard deviation of one top from another, of eight tops and two runs"
    rows = [
        ("setting of the heights", remark, "B", "0.17 mT cm", "2.9 %"),
        ("combined: u", "", "", "1 mT cm", "< 0.1 %"),
    ]
    shown = units_in_heads(table("", heads, rows, numbers=heads[3:]))
    assert shown.heads[3:] == ("adds to u\n[mT cm]", "share of u²\n[%]")
    assert [row.cells[3] for row in shown.rows] == ["0.17", "1"]
    text = as_latex("budget", shown)
    assert r"\begin{tabular}{lp{0.4\linewidth}lrr}" in text
    assert text.count(r"\begin{tabular}[b]{@{}r@{}}") == 2, "heads end in one line"
    assert text.count("{") == text.count("}"), "the box that scales a wide table is closed"


def test_of_trials_each_cell_keeps_what_chance_leaves_to_it():
    rows = [("strength", "125", "+0.26 ± 0.09", "71 ± 4 %"), ("origin", "125", "−0.08 ± 0.09", "74 ± 4 %")]
    shown = table("", ("quantity", "pulls", "mean", "within"), rows, numbers=("pulls", "mean", "within"))
    assert units_in_heads(shown) == shown


def test_only_units_go_to_the_head():
    for behind in ("Hz (u not known)", "s ago", "tops", "of 120", "per"):
        shown = table("", ("x",), [(f"1.2 {behind}",), (f"3 {behind}",)], numbers=["x"])
        assert units_in_heads(shown) == shown
    of_results = {text for unit in UNITS for text in (unit.text, unit.shown.unit, unit.fine.unit)} - {""}
    for unit in of_results | {"(rad/s)^−4/5/s", "mT cm per K", "per Hz"}:
        found = units_in_heads(table("", ("x",), [(f"< −1.2(3)×10⁻³ {unit}",)], numbers=["x"]))
        assert found.heads == (f"x\n[{unit}]",)


def document(*names):
    shown = table("Laws", ("law", "c₁"), [("disc", "1"), Row(("mean", "2"), "together")], numbers=["c₁"])
    tables = tuple(Tabular(name, shown, mark="SYNTHETIC." if name == "quality" else None) for name in names)
    inner = Section("Simulated", (Banner("SYNTHETIC.", ""), Details("more", (Tabular("lines", shown),))))
    return Document("t", "", (Section("Result", tables), inner))


def test_all_tables_are_listed_and_those_of_an_earlier_report_go(tmp_path):
    folder = folder_of(tmp_path / "report.pdf")
    write_tables(document("laws", "laws", "quality"), [Values("v", "values", ("a",), ((1.0,),))], folder)
    assert {file.name for file in folder.iterdir()} == {
        CONTENTS, "laws.tex", "laws-2.tex", "quality.tex", "lines.tex", "v.csv",
    }  # fmt: skip
    assert "SYNTHETIC." in (folder / "quality.tex").read_text(encoding="utf-8")
    (folder / "mine.csv").write_text("1\n", encoding="utf-8")
    files = write_tables(document("laws", "events"), [], folder)
    assert {file.name for file in folder.iterdir()} == {CONTENTS, "laws.tex", "lines.tex", "mine.csv"}
    assert {file.name for file in files} == {CONTENTS, "laws.tex", "lines.tex"}
    assert "SYNTHETIC." not in (folder / "laws.tex").read_text(encoding="utf-8")
    assert "SYNTHETIC." in (folder / "lines.tex").read_text(encoding="utf-8")
    before = {file.name: file.read_bytes() for file in files}
    write_tables(document("laws", "events"), [], folder)
    assert {file.name: file.read_bytes() for file in files} == before


def test_the_list_of_an_earlier_report_takes_nothing_else_away(tmp_path):
    folder = tmp_path / "x.tables"
    folder.mkdir()
    (tmp_path / "precious.csv").write_text("1\n", encoding="utf-8")
    (folder / CONTENTS).write_text("file,what\n../precious.csv,x\n.hidden.csv,x\n/etc/passwd,x\n", encoding="utf-8")
    write_tables(document("laws"), [], folder)
    assert (tmp_path / "precious.csv").exists()


def test_a_folder_that_cannot_be_written_is_reported_in_one_line(tmp_path):
    (tmp_path / "x.tables").write_text("a file\n", encoding="utf-8")
    with pytest.raises(LevilabError, match="the tables could not be written"):
        write_tables(document("laws"), [], tmp_path / "x.tables")

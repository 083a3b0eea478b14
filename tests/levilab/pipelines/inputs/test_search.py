"""What is found at paths: each set of readings once, and a warning only where something is wrong."""

import importlib.util
import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from levilab.cli.analyze import write_and_print
from levilab.errors import DataError, DoesNotSuit
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.inputs.search import collect, sha256_of
from levilab.pipelines.inputs.source import Readings
from levilab.pipelines.inputs.unread import NothingSuits, Skipped, left_out_of, skipped_by_all, texts_of
from levilab.pipelines.options import LimitOptions, SpinDownOptions
from levilab.pipelines.spindown.document import SPINDOWN
from levilab.pipelines.suits import analyze_suiting, save
from levilab.report.page import write_report
from support.spin_downs import spin_down_csv


def with_crlf(text):
    return text.replace("\n", "\r\n")


def with_quotes(text):
    rows = [",".join(f'"{cell}"' for cell in row.split(",")) for row in text.split("\n")]
    return "\n".join(rows[:-1]) + "\n"


def with_decimal_commas(text):
    return text.replace(",", ";").replace(".", ",")


def in_other_units(text):
    t, nu, u = np.loadtxt(text.splitlines()[1:], delimiter=",", unpack=True)
    rows = [f"{1000 * x!r},{60 * y!r},{60 * z!r}" for x, y, z in zip(t.tolist(), nu.tolist(), u.tolist(), strict=True)]
    return "\n".join(["t [ms],f [rpm],u [rpm]", *rows, ""])


def without_uncertainties(text):
    return "\n".join(row.rpartition(",")[0] for row in text.split("\n"))


def rounded(text: str) -> str:
    title, *rows = text.splitlines()
    return "\n".join([title, *(",".join(f"{float(field):.3f}" for field in row.split(",")) for row in rows), ""])


@pytest.mark.parametrize(
    "rewritten", [rounded, with_crlf, with_quotes, with_decimal_commas, in_other_units, without_uncertainties]
)
def test_the_same_readings_in_another_file_format_count_once(tmp_path, rewritten):
    first = spin_down_csv(tmp_path / "first.csv")
    second = tmp_path / "second.csv"
    second.write_bytes(rewritten(first.read_text(encoding="utf-8")).encode())
    analysis = SPINDOWN.analyze([first, second])
    assert [source.name for source in analysis.sources] == ["first.csv"]
    assert analysis.warnings == (f"{second}: holds the same readings as {first}, counted once",)


def test_an_export_beside_the_run_counts_once(tmp_path, sample_data):
    run = shutil.copytree(sample_data / "spin-down-1", tmp_path / "run")
    export = tmp_path / "export.csv"
    export.write_text(with_decimal_commas((run / "readings.csv").read_text(encoding="utf-8")), encoding="utf-8")
    assert len(SPINDOWN.analyze([run, export]).sources) == 1


def test_runs_that_differ_in_one_reading_are_two_runs(tmp_path):
    first = spin_down_csv(tmp_path / "first.csv")
    lines = first.read_text(encoding="utf-8").splitlines()
    time, frequency, u = lines[7].split(",")
    lines[7] = f"{time},{float(frequency) * (1 + 2e-4)!r},{u}"
    (tmp_path / "second.csv").write_text("\n".join([*lines, ""]), encoding="utf-8")
    assert len(SPINDOWN.analyze([first, tmp_path / "second.csv"]).sources) == 2


def test_a_run_that_goes_on_in_another_folder_counts_once(tmp_path, sample_data):
    for name in ("run", "run-rescued"):
        shutil.copytree(sample_data / "spin-down-1", tmp_path / name)
    record = json.loads((tmp_path / "run" / "run.json").read_text(encoding="utf-8"))
    (tmp_path / "run" / "run.json").write_text(json.dumps(record | {"continued_in": "run-rescued"}), encoding="utf-8")
    lines = (tmp_path / "run" / "readings.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    (tmp_path / "run" / "readings.csv").write_text("".join(lines[:-2]), encoding="utf-8")
    analysis = SPINDOWN.analyze([tmp_path])
    assert [source.name for source in analysis.sources] == ["run-rescued"]
    assert analysis.skipped == (Skipped(f"{tmp_path / 'run'}, which was broken off: its run goes on in run-rescued"),)


def test_what_is_no_regular_file_has_no_hash(tmp_path):
    with pytest.raises(DataError, match="a file is expected"):
        sha256_of(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no such pipes in folders")
def test_a_pipe_in_the_place_of_readings_is_refused_at_once(tmp_path, sample_data):
    run = shutil.copytree(sample_data / "spin-down-1", tmp_path / "run")
    (run / "readings.csv").unlink()
    for pipe, paths in ((run / "readings.csv", [run]), (tmp_path / "my.csv", [tmp_path / "my.csv"])):
        os.mkfifo(pipe)
        for find in (ANALYSES["spindown"].analyze, ANALYSES["spindown"].recall):
            with pytest.raises(DataError, match="pipe"):
                find(paths, SpinDownOptions())
        with pytest.raises(DataError, match="a file is expected"):
            sha256_of(pipe)


def test_of_many_runs_few_are_compared_with_each_other(tmp_path, monkeypatch):
    first = spin_down_csv(tmp_path / "0.csv")
    head, *lines = first.read_text(encoding="utf-8").splitlines()
    for k in range(1, 30):
        rows = [f"{time},{float(f) * (1 + k / 1000)!r},{u}" for time, f, u in (line.split(",") for line in lines)]
        (tmp_path / f"{k}.csv").write_text("\n".join([head, *rows, ""]), encoding="utf-8")
    shutil.copy(first, tmp_path / "copy.csv")
    compared = []
    compare = Readings.same_as
    monkeypatch.setattr(Readings, "same_as", lambda *two: compared.append(1) or compare(*two))
    found = collect([tmp_path], SPINDOWN, lambda _: SpinDownOptions())
    assert (len(found.sources), len(found.warnings), len(compared)) == (30, 1, 1)


def test_a_copy_whose_fingerprint_is_rounded_otherwise_is_found(tmp_path, monkeypatch):
    shutil.copy(spin_down_csv(tmp_path / "0.csv"), tmp_path / "copy.csv")
    fingerprints = iter([1.0, 1.0 - 5e-9])  # on both sides of a cell's edge
    monkeypatch.setattr(Readings, "fingerprint", property(lambda _: next(fingerprints)))
    found = collect([tmp_path], SPINDOWN, lambda _: SpinDownOptions())
    assert (len(found.sources), len(found.warnings)) == (1, 1)


def folder_of_a_student(folder, sample_data):
    spin_down_csv(folder / "run.csv")
    shutil.copy(sample_data / "scope-files" / "recording.wav", folder)
    for name, content in {
        "other.csv": b"a,b\n1,2\n3,4\n5,6\n", "notes.txt": b"hello\n", "foto.jpg": b"\xff\xd8\xff\xe0", "a.png": b"",
        "exp.cmbl": b"<xml/>", "README.md": b"x", ".DS_Store": b"x", "~$run.xlsx": b"x", "run.csv.levilab.toml": b"",
    }.items():  # fmt: skip
        (folder / name).write_bytes(content)


@pytest.mark.usefixtures("undrawn_figures")
def test_a_folder_names_every_file_that_it_leaves_out_by_kind_and_number(tmp_path, sample_data):
    folder_of_a_student(tmp_path, sample_data)
    for _ in range(2):  # the second time with results and figures beside the files
        results = analyze_suiting([tmp_path], {})
        said = skipped_by_all([found.skipped for _, found in results])
        assert sorted(Path(one["path"]).name for one in left_out_of(said)) == [
            "README.md", "a.png", "exp.cmbl", "foto.jpg", "notes.txt", "other.csv",
        ]  # fmt: skip
        (text,) = texts_of(said)
        for part in (
            "2 pictures (a.png, foto.jpg: ", "a Logger Pro file (exp.cmbl: in Logger Pro: File, Export As, CSV)",
            "2 tables with other columns (notes.txt, other.csv: name one to see why)",
        ):  # fmt: skip
            assert part in text
        for analysis, found in results:
            save(analysis, found)


@pytest.mark.usefixtures("undrawn_figures")
def test_of_a_pattern_what_levilab_has_written_is_left_out(tmp_path):
    for seed in (1, 2):
        spin_down_csv(tmp_path / f"run{seed}.csv", seed=seed)
    for analysis, found in analyze_suiting([tmp_path], {}):
        save(analysis, found)
    results = sorted(tmp_path.glob("*result.json"))
    found = SPINDOWN.analyze(sorted(tmp_path.iterdir()))
    assert (len(found.sources), len(results)) == (2, 1)
    with pytest.raises(DataError, match="name the folder of the run instead"):
        SPINDOWN.analyze(results)


def test_what_another_analysis_reads_is_left_out_of_one_alone(tmp_path, sample_data):
    folder_of_a_student(tmp_path, sample_data)
    found = SPINDOWN.analyze([tmp_path])
    (sound,) = [one for one in left_out_of(found.skipped) if one["path"].endswith(".wav")]
    assert (sound["kind"], sound["advice"]) == ("WAV recording", "levilab analyze spin reads it")


def test_a_folder_without_anything_to_read_says_of_what_kind_its_files_are(tmp_path):
    (tmp_path / "foto.jpg").write_bytes(b"\xff\xd8\xff\xe0")
    (tmp_path / "other.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    with pytest.raises(DoesNotSuit, match=r"analyze in a picture \(foto\.jpg: .*; a table with other columns \(other"):
        analyze_suiting([tmp_path], {})


@pytest.mark.usefixtures("undrawn_figures")
def test_reports_of_levilab_are_named_as_such_and_need_no_advice(tmp_path):
    spin_down_csv(tmp_path / "run.csv")
    for name in ("report.html", "report.pdf"):
        write_report([tmp_path / "run.csv"], tmp_path / name)
    (text,) = texts_of(skipped_by_all([found.skipped for _, found in analyze_suiting([tmp_path], {})]))
    assert text == "nothing to analyze in 2 reports of levilab (report.html, report.pdf)"


def test_one_analysis_says_why_a_table_with_its_columns_does_not_suit(tmp_path):
    (tmp_path / "a.csv").write_text("spin_frequency_hz\n21.7\n21.4\n21.6\n21.5\n", encoding="utf-8")
    spin_down_csv(tmp_path / "b.csv")
    found = collect([tmp_path], ANALYSES["limit"], lambda _: LimitOptions())
    (text,) = texts_of(skipped_by_all([found.skipped]))
    assert "b.csv: its spins differ by" in text
    assert "nothing to analyze" not in text
    (tmp_path / "a.csv").unlink()
    with pytest.raises(NothingSuits, match=r"found only \S*b.csv: its spins differ"):
        collect([tmp_path], ANALYSES["limit"], lambda _: LimitOptions())
    assert left_out_of(skipped_by_all([found.skipped]))[0]["kind"] == "table that does not suit"
    (text,) = texts_of(skipped_by_all([found.skipped, found.skipped]))
    assert text == "nothing to analyze in a table with other columns (b.csv: name one to see why)"


def test_a_damaged_spreadsheet_is_named_once(tmp_path, capsys):
    spin_down_csv(tmp_path / "run.csv")
    (tmp_path / "damaged.xlsx").write_bytes(b"PK\x03\x04" + bytes(300))
    write_and_print(analyze_suiting([tmp_path], {}), save=False, out=None, as_json=False)
    assert capsys.readouterr().err.count("damaged.xlsx") == 1


def test_sound_without_the_extra_is_counted_with_what_to_install(tmp_path, sample_data, monkeypatch):
    spin_down_csv(tmp_path / "run.csv")
    for name in ("a.m4a", "b.m4a"):
        shutil.copy(sample_data / "scope-files" / "phone.m4a", tmp_path / name)
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    (text,) = texts_of(skipped_by_all([found.skipped for _, found in analyze_suiting([tmp_path], {})]))
    assert text.startswith("nothing to analyze in 2 sound files and films (a.m4a, b.m4a: the extra video")
    assert "names all" not in text
    shutil.copy(tmp_path / "a.m4a", tmp_path / "c.m4a")
    (text,) = texts_of(skipped_by_all([found.skipped for _, found in analyze_suiting([tmp_path], {})]))
    assert "(a.m4a, b.m4a, …" in text
    assert text.endswith("levilab analyze --json names all")

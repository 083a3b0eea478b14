"""Exports hold the numbers that were measured and found, with units, as independent readers see them."""

import hashlib
import io
import json
import shutil
import zipfile

import h5py
import numpy as np
import pandas as pd
import pytest
import xarray

import levilab as door
from levilab.errors import LevilabError
from levilab.report.export.contents import Column, Contents, Table, contents_of, variables_of
from levilab.report.export.write import FORMATS, export
from support.paths import SAMPLE_DATA

RUN, TRACES = SAMPLE_DATA / "spin-down-1", SAMPLE_DATA / "trace-tape"


def written(source, out, **options):
    return export(lambda: contents_of([source]), out, **options)


def test_netcdf_has_readings_and_result_with_units_and_uncertainties(tmp_path):
    written(RUN, tmp_path / "run.nc", creator="Group 7", licence="CC-BY-4.0")
    readings = np.genfromtxt(RUN / "readings.csv", delimiter=",", names=True)
    found = door.analyze(RUN)
    with xarray.open_dataset(tmp_path / "run.nc") as data:
        assert (data.Conventions, data.creator_name, data.license) == ("CF-1.8", "Group 7", "CC-BY-4.0")
        assert (data.synthetic, json.loads(data.run)["experiment"]) == ("true", "spin")
        spin = data["spin_frequency_hz"]
        assert (spin.dims, spin.units, spin.ancillary_variables) == (("time_s",), "Hz", "spin_frequency_u_hz")
        assert np.array_equal(spin, readings["spin_frequency_hz"])
        assert np.array_equal(data["time_s"], readings["time_s"])
        assert np.array_equal(spin.sel(time_s=190.0), readings["spin_frequency_hz"][-1])
        assert data["spindown_residual_hz"].dims == ("time_s",)  # of each reading
        assert np.array_equal(data["spindown_residual_hz"], found.residuals)
        assert "spindown_spin_frequency_hz" not in data  # the readings themselves
        c, u = data["result_spindown_disc_c32"], data["result_spindown_disc_c32_u"]
        assert (float(c), float(u)) == (found["c32"].value, found["c32"].u)
        assert (c.attrs["unit"], "units" in c.attrs) == ("(rad/s)^-1/2/s", False)  # no unit of UDUNITS
        assert data["result_spindown_stokes_c1"].units == "1/s"


def test_traces_are_in_volts_and_seconds(tmp_path):
    head = json.loads((TRACES / "traces.jsonl").read_text(encoding="utf-8").splitlines()[1])
    volts = np.load(TRACES / head["path"]) * head["volts_per_code"] + head["offset_v"]
    written(TRACES, tmp_path / "run.nc")
    with xarray.open_dataset(tmp_path / "run.nc") as data:
        trace = data["tape_v"].sel(trace=2)
        assert (data["tape_v"].dims, trace.units, trace["sample"].units) == (("trace", "sample"), "V", "s")
        assert np.abs(trace - volts).max() < 1e-6  # a code is 8 mV, and a float of 32 bits has 24
        assert np.diff(trace["sample"]) == pytest.approx(head["dt_s"], rel=1e-6)
        assert float(trace["trace_time_s"] + trace["sample"][-1]) == pytest.approx(head["time_s"], abs=2 * head["dt_s"])


def test_a_spreadsheet_has_a_sheet_for_each_table_and_no_formula_of_a_person(tmp_path):
    table = Table("=1+1/x", (Column("note", np.array(["=2+3"]), "1", ""), Column("x_m", np.array([0.25]), "m", "")), "")
    export(lambda: Contents("x", "x", (table,), {}), tmp_path / "x.xlsx")
    assert pd.read_excel(tmp_path / "x.xlsx", sheet_name="=1+1-x", engine="calamine").iloc[0].tolist() == ["=2+3", 0.25]
    written(RUN, tmp_path / "run.xlsx")
    sheets = pd.read_excel(tmp_path / "run.xlsx", sheet_name=None, engine="calamine")
    assert list(sheets) == ["readings", "spindown", "result"]
    assert sheets["readings"]["spin_frequency_hz"].iloc[0] == 39.93


def test_tables_of_names_that_are_no_sheet_s_or_alike_have_a_sheet_each(tmp_path):
    names = ("Readings", "readings", "READINGS", "'quoted'", "''", "x" * 40, "x" * 41, f"{'y' * 30}'z")
    tables = tuple(Table(name, (Column("k", np.array([k]), "1", ""),), "") for k, name in enumerate(names))
    export(lambda: Contents("x", "x", tables, {}), tmp_path / "x.xlsx")
    sheets = pd.read_excel(tmp_path / "x.xlsx", sheet_name=None, engine="calamine")
    assert [int(sheet["k"].iloc[0]) for sheet in sheets.values()] == [*range(len(names))]
    assert [*sheets][:5] == ["Readings", "readings 2", "READINGS 3", "quoted", "table"]


def test_hdf5_has_the_same_variables_over_scales(tmp_path):
    for ending in ("nc", "h5"):
        written(RUN, tmp_path / f"run.{ending}")
    with xarray.open_dataset(tmp_path / "run.nc", mask_and_scale=False) as data, h5py.File(tmp_path / "run.h5") as file:
        assert set(file) == set(data.variables)
        assert all(np.array_equal(file[name][()], one, equal_nan=True) for name, one in data.variables.items())
        assert file["spin_frequency_hz"].dims[0][0] == file["time_s"]
        assert file["spin_frequency_hz"].attrs["units"] == "Hz"


def test_csv_is_a_file_for_each_table(tmp_path):
    files = written(RUN, tmp_path / "run.csv")
    assert [path.name for path in files] == ["run.csv", "run.spindown.csv", "run.result.csv"]
    assert pd.read_csv(files[0]).equals(pd.read_csv(RUN / "readings.csv", dtype=float))
    result = pd.read_csv(files[2]).set_index(["model", "name"])
    assert result.loc["disc", "c32"][["value", "u"]].tolist() == [*door.analyze(RUN)["c32"].__dict__.values()][:2]


def test_a_package_describes_its_files_with_units_and_hashes(tmp_path):
    written(TRACES, tmp_path / "run.zip", creator="Group 7", licence="CC0-1.0")
    with zipfile.ZipFile(tmp_path / "run.zip") as archive:
        package = json.loads(archive.read("datapackage.json"))
        files = {one["path"]: one for one in package["resources"]}
        assert {*files, "datapackage.json"} == {*archive.namelist()}
        assert {"readings.csv", "trace-000001.csv", "result.csv", "result.json", "run.json"} <= files.keys()
        for name, one in files.items():
            assert one["hash"] == f"sha256:{hashlib.sha256(archive.read(name)).hexdigest()}"
        trace = pd.read_csv(io.BytesIO(archive.read("trace-000001.csv")))
    assert (package["contributors"][0]["title"], package["licenses"]) == ("Group 7", [{"name": "CC0-1.0"}])
    fields = files["trace-000001.csv"]["schema"]["fields"]
    assert [(one["name"], one["unit"]) for one in fields] == [("time_s", "s"), ("tape_v", "V")]
    assert list(trace.columns) == ["time_s", "tape_v"]


@pytest.mark.parametrize("source", ["hold/26-hz", "precession-sweep"])
def test_no_two_variables_have_one_name(source):
    """A column and a value, or a value and a parameter of a model, may be called alike."""
    contents = contents_of([SAMPLE_DATA / source])
    names = [one.name for one in variables_of(contents)]
    assert len(set(names)) == len(names)
    assert len(contents.values) == sum(one.startswith("result_") and not one.endswith("_u") for one in names)


def test_a_file_without_a_run_is_exported_with_its_samples(tmp_path):
    written(SAMPLE_DATA / "scope-files" / "recording.wav", tmp_path / "sound.nc")
    with xarray.open_dataset(tmp_path / "sound.nc") as data:
        assert data["result_spin_frequency"].units == "Hz"
        assert float(data["result_spin_frequency"]) == pytest.approx(30.0, abs=0.01)  # sample_data/README.md
        assert data["mono_full_scale"].sizes == {"trace": 1, "sample": 2000}


#: Columns of a dimension of its own → the dimensions of sample runs: heights and drives stand beside the times.
DIMENSIONS = {
    "field-scan": ("height_m", {"time_s": 17}),
    "precession-sweep": ("drive_frequency_hz", {"time_s": 9, "trace": 9, "sample": 6000}),
    "lower-limits": ("limit_top", {"reading": 10}),
}


@pytest.mark.parametrize("source", DIMENSIONS)
def test_what_an_analysis_says_of_each_reading_is_over_the_readings(source, tmp_path):
    written(SAMPLE_DATA / source, tmp_path / "run.nc")
    place, sizes = DIMENSIONS[source]
    with xarray.open_dataset(tmp_path / "run.nc") as data:
        assert dict(data.sizes) == sizes
        assert place in data.coords
        assert {"time_s", "trace", "reading"} & {*data[place].dims}


def table(name, **columns):
    return Table(name, tuple(Column(of, np.array(values), "1", of) for of, values in columns.items()), "a row")


def dataset_of(tables, tmp_path, traces=()):
    export(lambda: Contents("made", "made", tuple(tables), {}, traces=tuple(traces)), tmp_path / "made.nc")
    return xarray.open_dataset(tmp_path / "made.nc")


def test_an_analysis_of_some_readings_leaves_the_others_empty(tmp_path):
    readings = table("readings", time_s=[0.0, 1.0, 2.0], spin_frequency_hz=[30.0, 29.0, 28.0])
    found = table("spin", time_s=[0.0, 2.0], residual_hz=[0.1, 0.2], used=[True, False])
    with dataset_of([readings, found], tmp_path) as data:
        assert dict(data.sizes) == {"time_s": 3}
        assert data["spin_residual_hz"].values == pytest.approx([0.1, np.nan, 0.2], nan_ok=True)
        assert data["spin_used"].values == pytest.approx([1, np.nan, 0], nan_ok=True)


def test_rows_that_are_no_readings_have_a_dimension_of_their_own(tmp_path):
    """Nothing says which reading a row with a value between them belongs to."""
    readings = table("readings", time_s=[0.0, 1.0, 2.0], spin_frequency_hz=[30.0, 29.0, 28.0])
    found = table("sway", time_s=[0.5, 1.5], spin_frequency_hz=[29.5, 28.5])
    with dataset_of([readings, found], tmp_path) as data:
        assert data["sway_spin_frequency_hz"].dims == ("sway_time_s",)


def test_traces_of_unlike_lengths_are_one_behind_the_other_as_cf_has_it(tmp_path):
    short, long = [table(f"trace-{n}", time_s=np.arange(n) * 0.1 + n, tape_v=np.full(n, n)) for n in (2, 3)]
    with dataset_of([], tmp_path, [short, long]) as data:
        assert data["trace_row_size"].values.tolist() == [2, 3]
        assert data["trace_row_size"].sample_dimension == data["tape_v"].dims[0] == "sample"
        assert data["tape_v"].values.tolist() == [2, 2, 3, 3, 3]
        assert data["sample_time_s"].values == pytest.approx([2.0, 2.1, 3.0, 3.1, 3.2])


@pytest.mark.parametrize(
    ("source", "name", "said"),
    [
        ("spin-down-1", "run.docx", "ends in .nc, .h5, .csv, .xlsx or .zip is expected"),
        ("spin-down-1", "there.zip", "is there already: give another name with `out`, or `force` to replace it"),
        ("README.md", "run.zip", "README.md"),
    ],
)
def test_what_cannot_be_exported_says_what_to_do(source, name, said, tmp_path):
    (tmp_path / "there.zip").write_bytes(b"kept")
    with pytest.raises(LevilabError) as refused:
        written(SAMPLE_DATA / source, tmp_path / name)
    assert said in str(refused.value)
    assert [path.name for path in tmp_path.iterdir()] == ["there.zip"]
    assert (tmp_path / "there.zip").read_bytes() == b"kept"


@pytest.mark.parametrize("name", ["four.nc", "four.h5"])
def test_several_inputs_have_a_row_each_and_their_readings_one_behind_the_other(name, tmp_path):
    four = door.analyze([SAMPLE_DATA / f"spin-down-{k}" for k in (1, 2, 3, 4)])
    (file,) = door.export(four, tmp_path / name)
    second = four.by_input["spin-down-2"]["c32"]
    with xarray.open_dataset(file) as data:
        own = data.sel(inputs="spin-down-2")
        assert own.inputs_disc_c32_per_sqrt_rad_s.item() == second.value
        assert own.inputs_disc_c32_u_per_sqrt_rad_s.item() == second.u
        assert data.result_spindown_disc_c32.item() == four["c32"].value  # of all together
        alone = data.residual_hz[data.input == "spin-down-2"]
        assert np.array_equal(alone, door.analyze(SAMPLE_DATA / "spin-down-2").residuals)
        assert four.to_xarray().sizes == data.sizes


def test_of_several_runs_a_package_has_each_record_and_says_what_is_not_in_it(tmp_path):
    for run in (RUN, TRACES):
        shutil.copytree(run, tmp_path / "in" / run.name)
    shutil.copytree(RUN, tmp_path / "in" / "broken")
    (tmp_path / "in" / "broken" / "run.json").write_text("{", encoding="utf-8")
    said: list[str] = []
    export(lambda: contents_of([tmp_path / "in"], said.append), tmp_path / "out.zip")
    assert sum("broken" in text for text in said) == 1
    assert sum("without their traces" in text for text in said) == 1
    with zipfile.ZipFile(tmp_path / "out.zip") as package:
        kept = {package.read(name) for name in package.namelist() if "run-" in name}
    assert kept == {(run / "run.json").read_bytes() for run in (RUN, TRACES)}


def test_no_table_of_a_csv_replaces_a_file(tmp_path):
    (tmp_path / "run.result.csv").write_text("kept", encoding="utf-8")
    with pytest.raises(LevilabError, match=r"run\.result\.csv is there already"):
        written(RUN, tmp_path / "run.csv")
    assert not (tmp_path / "run.csv").exists()


def test_a_missing_library_is_named_with_its_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    with pytest.raises(LevilabError, match=r'pip install "\.\[hdf5\]"'):
        written(RUN, tmp_path / "run.h5")


def test_a_map_is_over_its_axes_in_every_format(tmp_path):
    swept = door.sweep(
        "undriven", spin_hz=[18, 29, 40], mass_kg=["25 g", "25.2 g"], duration=0.3, out=tmp_path / "map.zarr"
    )
    for ending in FORMATS:
        door.export(tmp_path / "map.zarr", tmp_path / f"map{ending}")
    again = door.open_sweep(tmp_path / "map.zarr")
    again.to_xarray().to_netcdf(tmp_path / "own.nc")
    with xarray.open_dataset(tmp_path / "map.nc") as data, xarray.open_dataset(tmp_path / "own.nc") as own:
        lifetime = data["lifetime_s"]
        assert (lifetime.dims, lifetime.units) == (("start_spin_hz", "top_mass_kg"), "s")
        assert np.array_equal(lifetime, swept["lifetime_s"], equal_nan=True)
        assert np.array_equal(data["survived"], swept["survived"])
        assert data["survived"].flag_meanings == "no yes"
        assert data["top_mass_kg"].values.tolist() == [0.025, 0.0252]
        assert data["top_mass_kg"].long_name == own["top.mass_kg"].long_name == "mass"
        assert (own.Conventions, own["lifetime_s"].units) == ("CF-1.8", "s")
        assert np.array_equal(own["lifetime_s"], swept["lifetime_s"], equal_nan=True)
        assert "_FillValue" not in own["top.mass_kg"].encoding
    assert pd.read_csv(tmp_path / "map.csv").equals(swept.to_dataframe())


def test_the_command_names_its_file(levilab, tmp_path):
    done = levilab("export", str(RUN), "--licence", "CC-BY-4.0")
    assert done.stdout == "wrote spin-down-1.zip\n"
    refused = levilab("export", str(RUN), check=1)
    assert "spin-down-1.zip is there already: give another name with --out, or --force to replace it" in refused.stderr


def test_the_command_takes_several_paths_and_the_last_name_for_the_file_without_out(levilab, tmp_path):
    pair = [str(SAMPLE_DATA / f"spin-down-{k}") for k in (1, 2)]
    levilab("export", *pair, "-o", "pair.csv")
    levilab("export", *pair, "same.csv")
    assert (tmp_path / "pair.csv").read_bytes() == (tmp_path / "same.csv").read_bytes()
    assert set(pd.read_csv(tmp_path / "pair.csv")["input"]) == {"spin-down-1", "spin-down-2"}
    refused = levilab("export", pair[0], "pair.csv", "--force", check=2)  # it may be a file of readings
    assert "PATH pair.csv: is there already: name the file to write with --out" in refused.stderr


def test_a_method_writes_the_format_of_its_name_alone(tmp_path):
    with pytest.raises(LevilabError, match=r"a name that ends in \.xlsx is expected"):
        door.load(RUN).to_excel(tmp_path / "run.csv")


def test_hdf5_is_opened_by_xarray_with_what_the_extra_brings(tmp_path):
    written(RUN, tmp_path / "run.h5")
    with xarray.open_dataset(tmp_path / "run.h5", engine="h5netcdf") as data:
        assert data["spin_frequency_hz"].sel(time_s=190.0).item() == 21.75

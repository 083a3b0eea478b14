"""Other people's validators and readers take what levilab writes for other programs."""

import json
import re
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

import levilab
from levilab.present.units import UNITS
from levilab.report.export.contents import contents_of, units_of
from levilab.report.export.write import export
from support.paths import SAMPLE_DATA

pytestmark = [
    pytest.mark.skipif(not find_spec(name), reason=f"{name} is not installed: make peers")
    for name in ("frictionless", "compliance_checker", "netCDF4")
] + [pytest.mark.filterwarnings("ignore")]  # theirs

#: A run of each kind of reading, traces among them, and a file without a run.
SOURCES = ["spin-down-1", "trace-tape", "field-scan", "lower-limits", "precession-sweep", "scope-files/recording.wav"]


@pytest.mark.parametrize("source", SOURCES)
def test_netcdf_keeps_the_cf_conventions(source, tmp_path):
    from compliance_checker.runner import CheckSuite, ComplianceChecker

    file, report = tmp_path / "out.nc", tmp_path / "report.json"
    contents = contents_of([SAMPLE_DATA / source])
    if source == "trace-tape":  # and once as a ragged array
        first, *others = contents.traces
        cut = tuple(replace(one, values=one.values[:100]) for one in first.columns)
        contents = replace(contents, traces=(replace(first, columns=cut), *others))
    export(lambda: contents, file)
    CheckSuite.load_all_available_checkers()
    ComplianceChecker.run_checker(str(file), ["cf:1.8"], 0, "strict", output_filename=str(report), output_format="json")
    found = json.loads(report.read_text(encoding="utf-8"))["cf:1.8"]
    assert found["all_priorities"], "the checker has checked nothing"
    assert [message for one in found["all_priorities"] for message in one["msgs"]] == []


def test_the_library_of_netcdf_reads_the_readings(tmp_path):
    import netCDF4

    export(lambda: contents_of([SAMPLE_DATA / "spin-down-1"]), tmp_path / "out.nc")
    readings = np.genfromtxt(SAMPLE_DATA / "spin-down-1" / "readings.csv", delimiter=",", names=True)
    with netCDF4.Dataset(tmp_path / "out.nc") as file:
        assert np.array_equal(file["spin_frequency_hz"][:], readings["spin_frequency_hz"])
        assert file["spin_frequency_hz"].units == "Hz"


@pytest.mark.parametrize("si", [one.si for one in UNITS])
def test_udunits_knows_each_unit(si):
    from cf_units import Unit

    for text in [units_of(si)["units"]] if "units" in units_of(si) else []:
        assert not Unit(text).is_unknown()
    assert "units" in units_of(si) or re.match(r"\(|dB", si)


@pytest.mark.parametrize("source", SOURCES)
def test_frictionless_validates_an_export(source, tmp_path):
    from frictionless import Package

    export(lambda: contents_of([SAMPLE_DATA / source]), tmp_path / "out.zip", creator="Group 7", licence="CC-BY-4.0")
    package = Package(str(tmp_path / "out.zip"))
    assert package.validate().flatten(["title", "message"]) == []
    assert package.get_resource("result-csv").read_rows()[0]["value"] is not None
    assert (package.contributors[0]["title"], package.licenses[0]["name"]) == ("Group 7", "CC-BY-4.0")


@pytest.mark.parametrize("experiment", ["spin", "trace"])
def test_frictionless_validates_a_run_folder(experiment, tmp_path):
    from frictionless import Package

    run = levilab.acquire(experiment, mock=True, seed=1, out=tmp_path, group="Gruppe 7")
    package = Package(str(run.folder / "datapackage.json"))
    assert package.validate().flatten(["title", "message"]) == []
    assert package.get_resource("readings-csv").schema.fields[0].to_descriptor()["unit"] == "s"

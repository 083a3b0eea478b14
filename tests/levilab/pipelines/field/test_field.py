"""The analysis of scans: results and their recall, users' files, bad input, and what the command prints."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from levilab.errors import DataError, DoesNotSuit
from levilab.formats.device import Device, DeviceError, read_device
from levilab.formats.table import parse_columns
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.field.device import known_of
from levilab.pipelines.field.document import FIELD
from levilab.pipelines.field.figure import field_figure
from levilab.pipelines.field.report import field_part, scans_table
from levilab.pipelines.inputs.search import collect
from levilab.pipelines.options import FieldOptions
from levilab.pipelines.result import save
from levilab.pipelines.top import calculate_top
from levilab.report.page import render
from levilab.runs.find import RECORD
from levilab.texts.note import weight_of
from levilab.world.base import Base
from support.figures import faults

#: The base as it is.
CALLIPER = Device.model_validate(
    {"base": {"inner_radius_m": 0.03, "inner_radius_u_m": 0.0, "outer_radius_m": 0.055, "outer_radius_u_m": 0.0,
              "thickness_m": 0.015, "thickness_u_m": 0.0, "origin_m": 0.0}}
)  # fmt: skip
HEIGHTS_MM = np.arange(30.0, 111.0, 5.0)
BASE = Base(thickness_m=0.015, origin_m=0.0005)
FIELD_MT = np.array([1e3 * BASE.flux_density(z / 1e3) for z in HEIGHTS_MM])


@pytest.fixture
def scan(tmp_path, sample_data):
    return shutil.copytree(sample_data / "field-scan", tmp_path / "scan")


@pytest.fixture
def device(sample_data):
    return sample_data / "device.toml"


def csv(path, header, *columns):
    rows = [",".join(f"{value:.6g}" for value in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([header, *rows, ""]), encoding="utf-8")
    return path


# --- the sample scan ---


def test_the_sample_scan_gives_its_truth_back(sample_data, device):
    """As make.py prints it; 3 u, where the seed was chosen before this was seen."""
    found = FIELD.analyze([sample_data / "field-scan"], FieldOptions(device=read_device(device)))
    for name, truth in (("strength", 1.409299e-3), ("origin", 0.811e-3), ("thickness", 14.79e-3)):
        estimate = found.values[name]
        assert abs(estimate.value - truth) < 3 * estimate.u, name


def test_a_result_holds_what_was_found(scan, device):
    options = FieldOptions(device=read_device(device), height_m=0.0735)
    found = FIELD.analyze([scan], options)
    (file, *_) = save(FIELD.result_of(found, found.place), found.place, b"")
    document = json.loads(file.read_text(encoding="utf-8"))
    assert document["values"]["strength"]["unit"] == "T m"
    assert {"origin", "thickness", "moment", "mass_to_set"} <= set(document["values"])
    assert document["models"][0]["name"] == "ring"
    assert document["synthetic"] is True
    zero = replace(
        found.runs[0].scan, height=np.array([-1e-5, 0.02, 0.05]), flux_density=np.array([-2e-7, 0.045, 0.03])
    )
    (row,) = scans_table(replace(found, runs=(replace(found.runs[0], scan=zero),))).rows
    assert row.cells[2:4] == ("0.00 … 5.00", "0.000 … 45.000"), "ranges, not first and last; zero has no sign"


@pytest.mark.parametrize("said", [-0.01, "much"])
def test_a_gain_that_no_gauss_meter_has_is_taken_for_none(scan, said):
    record = json.loads((scan / "run.json").read_text(encoding="utf-8"))
    record["configuration"]["field"]["gain_u"] = said
    (scan / "run.json").write_text(json.dumps(record), encoding="utf-8")
    (source,) = collect([scan], FIELD, lambda _: FieldOptions()).sources
    assert source.readings.has_own_u
    assert known_of(source, None).gain_u == 0


def test_several_scans_have_means_that_are_no_more_certain_than_the_calliper(tmp_path, scan):
    other = shutil.copytree(scan, tmp_path / "other")
    text = (other / "readings.csv").read_text(encoding="utf-8").replace(",0.035,", ",0.0352,")
    (other / "readings.csv").write_text(text, encoding="utf-8")
    found = FIELD.analyze([tmp_path])
    alone = [run.values["strength"] for run in found.runs]
    mean = found.values["strength"]
    assert mean.value == pytest.approx(np.mean([one.value for one in alone]))
    assert mean.u > 0.99 * alone[0].u
    page = render([(ANALYSES["field"], found)])
    assert "None of these 2 runs came from a real bench" in page
    assert ANALYSES["field"].document(found, tmp_path)["values"]["strength"]["runs"] == 2
    figure = field_figure(found)
    assert len(figure.axes) == 4
    assert faults(figure) == []
    assert len(field_part(found).inputs) == 2


def test_the_windows_of_spin_are_drawn_from_the_lightest_top_to_the_heaviest(sample_data):
    found = FIELD.analyze([sample_data / "field-scan"])
    slow, fast = field_figure(found).axes[3].get_lines()[:2]
    ends = [1e3 * (found.values[name].value or 0.0) for name in ("lightest_mass", "heaviest_mass")]
    for line in (slow, fast):
        masses, spins = (np.asarray(values, dtype=float) for values in (line.get_xdata(), line.get_ydata()))
        drawn = masses[np.isfinite(spins)]
        assert [drawn[0], drawn[-1]] == pytest.approx(ends, abs=1e-3)


def test_of_a_top_that_is_not_described_the_result_says_whose_it_is(scan, sample_data, tmp_path):
    """On a virtual bench the thesis's top floats: nothing is taken for another."""
    virtual = FIELD.analyze([scan])
    assert virtual.text.startswith("Tops float from")
    assert not any("describe yours" in text for text in virtual.all_warnings)
    record = json.loads((scan / RECORD).read_text(encoding="utf-8")) | {"synthetic": False}
    (scan / RECORD).write_text(json.dumps(record), encoding="utf-8")
    real = FIELD.analyze([scan])
    assert real.text.startswith("Tops with the moment of the thesis's float from")
    (said,) = [text for text in real.all_warnings if "describe yours" in text]
    assert said.startswith("the top is not described: masses, heights and spins are of the thesis's")
    save(FIELD.result_of(real, real.place), real.place, b"")
    assert FIELD.recall([scan]).text == real.text
    known = FIELD.analyze([scan], FieldOptions(device=read_device(sample_data / "device.toml")))
    assert known.text.startswith("Tops float from")


def test_of_a_sound_scan_without_u_all_notes_but_one_on_its_top_are_advice(tmp_path):
    """A class takes all other notes for reasons to look at a group."""
    noisy = FIELD_MT + 0.02 * np.random.default_rng(1).standard_normal(HEIGHTS_MM.size)
    file = csv(tmp_path / "own.csv", "z [mm],B [mT]", HEIGHTS_MM, noisy)
    found = FIELD.analyze([file], FieldOptions(device=CALLIPER))
    notes = [text for run in found.runs for text in found.about_run(run) if weight_of(text) != "advice"]
    assert [text[:24] for text in notes] == ["the top is not described"]


def test_no_masses_follow_from_a_field_that_no_ring_has(tmp_path):
    bump = 4 * np.exp(-(((HEIGHTS_MM - 50) / 20) ** 2)) + 1
    file = csv(tmp_path / "bump.csv", "z [mm],B [mT]", HEIGHTS_MM, bump)
    found = FIELD.analyze([file], FieldOptions(device=CALLIPER))
    assert found.text.startswith("This scan does not show the field of a ring magnet")
    assert "mass_to_set" not in found.values
    assert any("no ring magnet has such a field" in text for text in found.all_warnings)
    assert not any("no top of this kind" in text for text in found.all_warnings)
    assert faults(field_figure(found)) == []
    assert "no masses and no spins follow from this scan" in render([(ANALYSES["field"], found)])


# --- users' files ---


@pytest.mark.parametrize(
    ("titles", "z", "b"),
    [
        (("height_m,flux_density_t", ""), HEIGHTS_MM / 1e3, FIELD_MT / 1e3),
        (("z [mm],B [mT]", ""), HEIGHTS_MM, FIELD_MT),
        (("Höhe (cm),Bz / G", ""), HEIGHTS_MM / 10, FIELD_MT * 10),
        (("Abstand,Hallsonde", "z=Abstand [mm],b=Hallsonde [G]"), HEIGHTS_MM, FIELD_MT * 10),
        (("a,b2", "height_m=1,flux_density_t=2"), HEIGHTS_MM / 1e3, FIELD_MT / 1e3),
    ],
)
def test_files_of_users_are_read_in_their_units(tmp_path, titles, z, b):
    path = csv(tmp_path / "hall.csv", titles[0], z, b)
    options = FieldOptions(columns=parse_columns(titles[1]), device=CALLIPER)
    found = FIELD.analyze([path], options)
    strength = found.values["strength"].value
    # the origin is left open to 1 mm, the background to 50 µT
    assert strength == pytest.approx(BASE.strength_t_m, rel=1e-3)
    assert any("no uncertainty of the readings" in text for text in found.all_warnings)


@pytest.mark.parametrize(
    ("z", "b", "says"),
    [
        (HEIGHTS_MM[:2], FIELD_MT[:2], "holds 2 readings, at least 3 readings are needed"),
        (HEIGHTS_MM[:3], FIELD_MT[:3], "heights: 3, from 30 to 40 mm, at least 4 are needed: scan on"),
        (HEIGHTS_MM, np.minimum(FIELD_MT, 20.0), "the probe is saturated, or not moved"),
        (HEIGHTS_MM, np.where(HEIGHTS_MM > 80, -1, 1) * FIELD_MT, "was the probe turned over"),
        (HEIGHTS_MM * 1e3, FIELD_MT, "a height of 30 m cannot be"),
        (HEIGHTS_MM, FIELD_MT * 1e4, "a flux density of"),
    ],
)
def test_bad_scans_are_refused_in_one_line(tmp_path, z, b, says):
    path = csv(tmp_path / "hall.csv", "z [mm],B [mT]", z, b)
    with pytest.raises(DataError) as caught:
        FIELD.analyze([path], FieldOptions(device=CALLIPER))
    assert says in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_file_without_its_base_says_what_is_missing(tmp_path):
    path = csv(tmp_path / "hall.csv", "z [mm],B [mT]", HEIGHTS_MM, FIELD_MT)
    with pytest.raises(DataError, match=r"the radii of the base are not known.*`device`"):
        FIELD.analyze([path])


def test_a_file_of_something_else_does_not_suit(tmp_path, sample_data):
    with pytest.raises(DoesNotSuit, match="needs a field run"):
        FIELD.analyze([sample_data / "spin-down-1"])
    path = csv(tmp_path / "spin.csv", "t,f", HEIGHTS_MM, FIELD_MT)
    with pytest.raises(DoesNotSuit, match=r"no title is known \(height_m, flux_density_t.*z=NAME,b=NAME"):
        FIELD.analyze([path])


def test_a_moment_needs_the_mass(scan):
    with pytest.raises(DataError, match=r"`height_m` tells the moment of a top only if its mass is known"):
        FIELD.analyze([scan], FieldOptions(height_m=0.073))


# --- the device file ---


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[base", "; a TOML file with [base] and [top] is expected, as sample_data/device.toml"),
        ("[base]\ninner_radius = 0.03", "base.inner_radius is no key known here"),
        ("[base]\ninner_radius_m = '3 cm'", "write the number without its unit"),
        ("[top]\ninertia_axial_kg_m2 = 1e-6", "both inertias are expected"),
        ("[top]\nmagnet_radius_m = 0.01", "magnet_radius_m and magnet_height_m"),
        ("[top]\nmass_kg = 0.02\n[[top.parts]]\nname = 'a'\nmass_kg = 0.1\nouter_radius_m = 0.1", "from the parts"),
        ("[[top.parts]]\nname = 'a'\nmass_kg = -0.1\nouter_radius_m = 0.1", "top.parts.0.mass_kg"),
    ],
)
def test_a_device_file_that_is_wrong_is_named_with_its_key(tmp_path, text, says):
    path = tmp_path / "device.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DeviceError) as caught:
        read_device(path)
    assert says in str(caught.value)


def test_a_hole_larger_than_its_part_is_named(tmp_path):
    path = tmp_path / "device.toml"
    path.write_text(
        "[[top.parts]]\nname = 'ring'\nmass_kg = 0.1\nouter_radius_m = 0.01\ninner_radius_m = 0.02", encoding="utf-8"
    )
    with pytest.raises(DataError, match=r"device\.toml: part ring: inner_radius = 0\.02"):
        calculate_top(path)


# --- the commands ---


@pytest.mark.usefixtures("undrawn_figures")
def test_the_commands_print_and_refuse_in_one_line(levilab, tmp_path, scan, device):
    done = levilab("analyze", "field", scan, "--device", device, "--height", "73.5", "--no-save")
    for said in ("strength ρ", "moment of the top", "mass to set", "SYNTHETIC", "1 K warmer"):
        assert said in done.stdout
    shown = json.loads(levilab("analyze", "field", scan, "--json", "--no-save").stdout)
    assert shown["values"]["strength"]["value"] == pytest.approx(1.409e-3, rel=0.02)
    levilab("report", scan, "-o", "page.html", "--no-crosscheck")
    assert "Field of the base on its axis" in (tmp_path / "page.html").read_text(encoding="utf-8")
    top = json.loads(levilab("top", device, "--json").stdout)
    assert top["values"]["mass"]["value"] == pytest.approx(0.02505)
    assert "I₃/I₁" in levilab("top", device).stdout
    for words, status, says in (
        (("analyze", "field", scan, "--height", "1e9"), 2, "--height 1e+09: a number from -1000 to 2000 mm"),
        (("analyze", "field", scan, "--height-u", "1"), 2, "--height-u: goes with --height alone"),
        (("analyze", "field", scan, "--height", "73"), 1, "give it with --device"),
        (("analyze", "field", scan, "--device", "none.toml"), 1, "none.toml: there is no such file"),
        (("top", scan), 1, "is a folder"),
    ):
        refused = levilab(*words, check=status)
        assert says in refused.stderr
        assert len(refused.stderr.splitlines()) == 1

"""Tracks of a swaying top: what they are read from, what they say, and how people see it."""

import csv
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from levilab.errors import DataError, DoesNotSuit
from levilab.formats.device import Device, read_device
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.many.table import Row, Task, analyze_one
from levilab.pipelines.suits import analyze_suiting
from levilab.pipelines.sway.analysis import _doubts, _in_words
from levilab.runs.run import RunRecord
from levilab.runs.writer import RunWriter
from levilab.simulator import preset, simulate
from levilab.texts.text import in_language
from support.commands import command
from support.paths import ROOT

TRACK = ROOT / "sample_data/sway/track.csv"
PHONE = TRACK.with_name("phone.csv")
TRUE_HZ = 0.17490  # (I₃ω₃/m)(B′/2B)² of the thesis's base and inertias, 25.30 g, where it floats, at 30 Hz
SWAY = ANALYSES["sway"]
#: The top of the sample data.
TOP = {"mass_kg": 0.0253, "inertia_transverse_kg_m2": 1.04e-6, "inertia_axial_kg_m2": 1.731314e-6}
DEVICE = Device.model_validate({"base": {"inner_radius_m": 0.030, "outer_radius_m": 0.055}, "top": TOP})


def analyze(path, **options):
    return SWAY.analyze([path], SWAY.options_from(options))


@pytest.fixture(scope="module")
def found():
    return analyze(TRACK, device=DEVICE)


def rows_of(path):
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()[1:]))


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    """The rows of the first window alone, and what is found of them."""
    path = tmp_path_factory.mktemp("window") / "track.csv"
    path.write_text("\n".join(TRACK.read_text(encoding="utf-8").splitlines()[:1202]), encoding="utf-8")
    return rows_of(path), analyze(path, device=DEVICE).runs[0]


def write(path, titles, rows):
    path.write_text("\n".join([",".join(titles), *(",".join(row) for row in rows)]) + "\n", encoding="utf-8")
    return path


def test_the_sample_has_the_geometric_magnetism_of_its_top(found):
    geometry = found.runs[0].geometry
    assert abs(geometry.measured.value - TRUE_HZ) < 3 * geometry.measured.u
    assert geometry.measured.u < 0.03 * TRUE_HZ
    assert geometry.predicted.value == pytest.approx(TRUE_HZ, rel=2e-3)  # it floats lower by its swings
    assert abs(geometry.ratio.value - 1) < 3 * geometry.ratio.u
    assert geometry.of_precession.value == pytest.approx(geometry.of_base.value, rel=2e-3)  # likewise
    assert "excluded" in found.text
    assert found.all_warnings == []
    assert [one.frequency.size for one in found.runs[0].swings[:3]] == [3, 3, 3]
    joint = geometry.joint
    assert abs(joint.ratio.value - 1) < 3 * joint.ratio.u
    # its height is that at which a top floats lower by its swings, as B′/2B of the base is
    assert joint.gradient.value == pytest.approx(geometry.of_base.value, rel=2e-3)
    assert joint.chi_square < joint.freedom + 4 * np.sqrt(2 * joint.freedom)  # 4 standard deviations of χ²


def test_a_view_from_below_gives_the_same_with_a_note(window, tmp_path):
    rows, above = window
    mirrored = [(r["t [s]"], str(-float(r["x [mm]"]) / 10), str(float(r["y [mm]"]) / 10), r["spin [Hz]"]) for r in rows]
    below = analyze(write(tmp_path / "below.csv", ("Zeit [s]", "x (cm)", "y (cm)", "f [Hz]"), mirrored), device=DEVICE)
    assert below.runs[0].geometry.measured.value == pytest.approx(above.geometry.measured.value, rel=1e-6)
    assert "backwards" in " ".join(below.all_warnings)


def test_without_a_spin_nothing_is_said_and_an_option_gives_it(found, tmp_path):
    rows = [(r["t [s]"], r["x [mm]"], r["y [mm]"]) for r in rows_of(TRACK)[:1200]]
    path = write(tmp_path / "short.csv", ("t [s]", "x [mm]", "y [mm]"), rows)
    with pytest.raises(DataError, match="the spin is not known"):
        analyze(path, device=DEVICE)
    geometry = analyze(path, device=DEVICE, spin_hz=38.56).runs[0].geometry
    assert abs(geometry.measured.value - TRUE_HZ) < 3 * geometry.measured.u


def test_a_track_with_spins_does_not_take_that_of_the_option(window, tmp_path):
    rows, own = window
    path = write(tmp_path / "own.csv", tuple(rows[0]), [tuple(row.values()) for row in rows])
    stated = analyze(path, device=DEVICE, spin_hz=30.0)
    assert stated.runs[0].geometry.measured == own.geometry.measured
    assert "`spin` is not used: the tracks have spins of their own" in stated.all_warnings


def test_a_phone_above_the_top_shows_the_split_and_the_spin_of_the_film(found):
    with pytest.raises(DoesNotSuit, match="the option `sensor`"):
        analyze(PHONE, device=DEVICE)
    (ran,) = (whole := analyze(PHONE, device=DEVICE, sensor_m=0.12)).runs
    geometry, film = ran.geometry, found.runs[0]
    assert abs(geometry.measured.value - TRUE_HZ) < 3 * geometry.measured.u
    assert geometry.measured.u < 0.03 * TRUE_HZ
    assert ran.spin[:3] == pytest.approx(film.spin[:3], abs=0.05)  # windows whose middles are 0.3 s apart, of 0.15 Hz/s
    # the place and the moment: 1 %; three times the error of an amplitude in a film, 2.5 µm
    assert ran.swings[1].amplitude == pytest.approx(film.swings[1].amplitude, rel=0.03, abs=8e-6)
    assert ran.swings[1].vertical.u < film.swings[1].vertical.u  # by the third component
    # the folded spin of a record of 100 samples a second is the slower one: a note of the spin-down's
    assert whole.all_warnings == []


def test_unlike_axes_of_a_magnetometer_are_noticed_and_taken_away(tmp_path):
    t, x, y, z = np.loadtxt(PHONE, delimiter=",", skiprows=2, encoding="utf-8").T
    skewed = np.column_stack([t, x, 1.6 * y + 0.1 * x, z])
    path = tmp_path / "skewed.csv"
    titles = "Time (s),Magnetic field x (µT),Magnetic field y (µT),Magnetic field z (µT)"
    np.savetxt(path, skewed, "%.3f", ",", header=titles, comments="", encoding="utf-8")
    skewed = analyze(path, device=DEVICE, sensor_m=0.12)
    measured = skewed.runs[0].geometry.measured
    assert abs(measured.value - TRUE_HZ) < 3 * measured.u
    (note,) = skewed.all_warnings
    assert "23 % off" in note  # (1.6 − 1)/(1.6 + 1)


def test_two_probes_beside_the_top_show_the_split_but_not_the_sense(window, tmp_path):
    rows, film = window
    titles = ("t [s]", "Bx [µT]", "By [µT]", "f [Hz]")
    # 3K/d = 2.14 µT/mm at 10 cm; the second probe is 5 mm nearer; its sense is the other one
    field = [(r["t [s]"], f"{2.14 * float(r['x [mm]']):.4f}", f"{-2.63 * float(r['y [mm]']):.4f}", r["spin [Hz]"])
             for r in rows]  # fmt: skip
    (ran,) = (probes := analyze(write(tmp_path / "probes.csv", titles, field), device=DEVICE, sensor_m=0.1)).runs
    assert abs(ran.geometry.measured.value - TRUE_HZ) < 3 * ran.geometry.measured.u
    assert "sense of the spin" in " ".join(probes.all_warnings)
    assert ran.swings[0].amplitude[:2] == pytest.approx(film.swings[0].amplitude[:2], rel=0.15)


def test_a_mark_on_the_end_of_the_stem_is_noticed(tmp_path):
    rows = rows_of(TRACK)[:1200]
    t = np.array([float(r["t [s]"]) for r in rows])
    leaning = 0.3 * np.exp(2j * np.pi * (5.05 + 0.0257 / 2 * t) * t)  # the tilt of its precession, 2 cm above
    places = [(float(r["x [mm]"]) + p.real, float(r["y [mm]"]) + p.imag) for r, p in zip(rows, leaning, strict=True)]
    moved = [(r["t [s]"], f"{x:.3f}", f"{y:.3f}", r["spin [Hz]"]) for r, (x, y) in zip(rows, places, strict=True)]
    found = analyze(write(tmp_path / "stem.csv", ("t [s]", "x [mm]", "y [mm]", "f [Hz]"), moved), device=DEVICE)
    assert "stem" in " ".join(found.all_warnings)
    assert found.runs[0].geometry.parts["lean"] > 0.1 * found.runs[0].geometry.measured.u


@pytest.mark.slow
def test_a_push_that_was_too_large_leaves_lines_of_the_third_order_which_say_which_is_which(tmp_path):
    """6 s of preset friction: four lines of 0.7 to 1.2 mm, and of 9 µm those at 2b − f and 2f − b."""
    motion, noise = simulate(preset("friction"), 6.0, rate=120.0), np.random.default_rng(1).normal(0, 0.03, (720, 2))
    table = np.column_stack([motion.time[:-1], 1e3 * motion.position[:-1, :2] + noise])
    rows = [tuple(f"{one:.6f}" for one in row) for row in table]
    found = analyze(write(tmp_path / "large.csv", ("t [s]", "x [mm]", "y [mm]"), rows), spin_hz=29.72)
    geometry, measured = found.runs[0].geometry, found.runs[0].geometry.measured
    assert abs(measured.value - 0.1765) < 3 * measured.u < 0.12  # where it floats at rest
    doubtful = replace(geometry, ratio=replace(geometry.ratio, u=0.4))
    assert "too uncertain for a comparison" in str(_in_words(doubtful))
    assert "near the vertical swing, 1.10 Hz" in " ".join(found.all_warnings)


def test_without_a_precession_the_view_is_doubted(tmp_path):
    t = np.arange(1200) / 60
    z = 0.11 * np.exp(-2j * np.pi * 0.617 * t) + 0.45 * np.exp(2j * np.pi * 0.852 * t)
    rows = [(f"{one:.4f}", f"{place.real:.6f}", f"{place.imag:.6f}") for one, place in zip(t, z, strict=True)]
    path = write(tmp_path / "two.csv", ("t [s]", "x [mm]", "y [mm]"), rows)
    assert "no precession is seen" in " ".join(analyze(path, device=DEVICE, spin_hz=38.56).all_warnings)


def test_the_spin_of_a_film_stands_beside_its_track(window, tmp_path):
    rows, film = window
    metres = [(r["t [s]"], *(f"{float(r[axis]) / 1e3:.6f}" for axis in ("x [mm]", "y [mm]"))) for r in rows]
    write(tmp_path / "a.spin.csv", ("time_s", "spin_frequency_hz"), [(r["t [s]"], r["spin [Hz]"]) for r in rows[::60]])
    track = write(tmp_path / "a.tracks.csv", ("time_s", "x_m", "y_m"), metres)
    measured = analyze(track, device=DEVICE).runs[0].geometry.measured
    assert measured.value == pytest.approx(film.geometry.measured.value, rel=1e-4)


def test_a_film_from_beside_gives_the_heights_and_its_spin_the_time(found, tmp_path):
    t, x, spin = (np.array([float(r[name]) for r in rows_of(TRACK)]) for name in ("t [s]", "x [mm]", "spin [Hz]"))
    seen = (t > 8) & (t < 72)
    z = 0.3 * np.sin(2 * np.pi * 1.12 * t) + 0.03 * np.random.default_rng(1).standard_normal(t.size)
    rows = [tuple(f"{one:.6f}" for one in row) for row in zip(t - 7.4, x / 1e3, z / 1e3, spin, strict=True)]
    titles = ("time_s", "x_m", "z_m", "spin_frequency_hz")
    side = write(tmp_path / "side.tracks.csv", titles, [row for row, inside in zip(rows, seen, strict=True) if inside])
    both = analyze(TRACK, device=DEVICE, side=side)
    (note,) = both.all_warnings
    assert re.search(r"side\.tracks\.csv begins at (8\.0\d|7\.9\d) s of track\.csv", note)  # 0.1 Hz/s, and 1 mHz
    swings, alone = both.runs[0].swings, found.runs[0].swings
    assert swings[1].vertical.value == pytest.approx(1.12, abs=1e-3)
    assert swings[1].vertical.u < 0.1 * alone[1].vertical.u
    geometry = both.runs[0].geometry
    assert abs(geometry.measured.value - TRUE_HZ) < 3 * geometry.measured.u
    (either,) = _doubts(swings, replace(geometry, parts={"mistake": 0.01}), view=False)
    assert "the lines at -0.62 or -0.29 Hz and at 0.83 or 0.50 Hz" in either
    other = write(tmp_path / "other.csv", titles, [(*row[:3], "55.0") for row in rows[:200]])
    with pytest.raises(DataError, match="films of the same time are expected"):
        analyze(TRACK, device=DEVICE, side=other)
    places = np.column_stack([t, x / 1e3, [float(r["y [mm]"]) / 1e3 for r in rows_of(TRACK)], spin])
    record = RunRecord(experiment="sway", status="finished", started_utc="2026-11-20T10:15:00Z")
    with RunWriter.create(tmp_path, record) as writer:
        writer.film(["time_s,x_m,y_m,spin_frequency_hz", *(",".join(map(str, row)) for row in places.tolist())])
        writer.finish("finished")
    of_run = analyze(writer.folder, device=DEVICE, side=side)
    assert of_run.runs[0].swings[1].vertical.value == pytest.approx(swings[1].vertical.value, abs=1e-5)
    (note,) = (one for one in of_run.all_warnings if "gives its heights" in one)
    assert in_language(note, "de").startswith("side.tracks.csv beginnt bei ")


def test_a_run_in_which_nothing_was_counted_has_no_spin(tmp_path):
    lines = [f"{float(r['t [s]']):.4f},{r['x [mm]']}e-3,{r['y [mm]']}e-3" for r in rows_of(TRACK)[:1200]]
    columns = [{"name": "time_s", "unit": "s"}, {"name": "spin_frequency_hz", "unit": "Hz"}]
    record = RunRecord(experiment="sway", status="finished", started_utc="2026-11-20T10:15:00Z", channels=columns)
    with RunWriter.create(tmp_path, record) as writer:
        writer.film(["time_s,x_m,y_m", *lines])
        writer.finish("finished")
    with pytest.raises(DataError, match="the spin is not known"):
        analyze(writer.folder, device=DEVICE)


def test_the_base_is_the_calliper_s_or_that_of_a_scan():
    of_file = analyze(TRACK, device=read_device(ROOT / "sample_data/device.toml")).runs[0]
    assert of_file.warnings == ()
    scanned = analyze(TRACK, scan=ROOT / "sample_data/field-scan").runs[0]
    assert scanned.geometry.of_base.value == pytest.approx(9.21, rel=5e-3)
    assert "radii" not in scanned.warnings[0]
    thesis = analyze(TRACK).runs[0]
    # the calliper rules, and the scan adds a little to its radii
    assert 0.8 < scanned.geometry.of_base.u / thesis.geometry.of_base.u < 1
    assert "radii" in thesis.warnings[0]


@pytest.mark.slow
def test_a_simulated_motion_is_compared_with_its_own_scene(tmp_path):
    keys = ("start.spin_hz=35", "drag.law=disc", "start.position_m=[0.0006,0,0.0729]", "top.mass_kg=0.0253")
    made = command(
        "simulate", "undriven", "--duration", "20", *(word for key in keys for word in ("--set", key)), "--out", "out",
        cwd=tmp_path,
    )  # fmt: skip
    assert made.status == 0
    ended = command("analyze", "sway", "out", "--no-save", "--json", cwd=tmp_path)
    assert ended.status == 0, ended.err
    document = json.loads(ended.out)
    assert document["synthetic"]
    # of a single window, whose swings are one part in a thousand
    assert document["values"]["ratio"]["value"] == pytest.approx(1, abs=5 * document["values"]["ratio"]["u"])
    assert document["values"]["windows"]["value"] == 1


def test_a_track_is_for_this_analysis_alone_and_other_tables_are_not():
    assert [row.name for row, _ in analyze_suiting([TRACK], {})] == ["sway"]
    with pytest.raises(DoesNotSuit):
        analyze(ROOT / "sample_data/spin-down-1/readings.csv")


def test_places_in_a_wrong_unit_are_named(tmp_path):
    rows = [(str(k / 60), str(3.0 * (k % 2)), "0", "30") for k in range(200)]
    with pytest.raises(DataError, match=r"x=NAME \[mm\]"):
        analyze(write(tmp_path / "metres.csv", ("t", "x", "y", "f"), rows))


@pytest.mark.usefixtures("drawn_figures")
def test_report_figure_and_table_of_many_show_it(found):
    assert SWAY.part(found).result
    assert "geometric magnetism" in found.text
    assert SWAY.png(found)[:4] == b"\x89PNG"
    row = analyze_one(Task(TRACK, False, True, "sway", SWAY.options_from({"device": DEVICE}), TRACK.parent))
    assert isinstance(row, Row)
    assert not row.problem


def test_a_value_at_a_spin_that_was_not_seen_says_so(found):
    run = found.runs[0]
    assert "The spins seen" not in run.text
    slower = replace(run, spin=run.spin - run.spin.max() + 29)
    assert "to 29.0 Hz: the value at 30 Hz is in proportion to the spin." in slower.text

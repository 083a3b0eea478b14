"""`levilab simulate` as a user runs it: what it prints, what it writes, what it refuses."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from levilab.motion.figure import PIECES, motion_figure
from levilab.motion.lines import rate_for
from levilab.motion.simulation import COLUMNS, SimulationRequest, kept_rows, run_simulation
from levilab.motion.summary import as_document, summarise
from levilab.motion.table import print_motion
from levilab.present.progress import ShareBar
from levilab.runs.run import Run
from levilab.runs.writer import RunWriter
from levilab.simulator.scene import preset
from levilab.simulator.single import simulate
from support.figures import faults

#: As INTERFACE.md has them.
HEADER = "time_s,x_m,y_m,z_m,vx_m_s,vy_m_s,vz_m_s,axis_x,axis_y,axis_z,spin_frequency_hz,energy_j"


def summary(scene, duration, rate=100.0):
    motion = simulate(scene, duration, rate=rate * np.ceil(rate_for(scene) / rate))
    return summarise(motion, duration, rate, 0.01)


# --- the run folder ---


@pytest.mark.usefixtures("drawn_figures")
def test_a_run_folder_holds_the_states_in_full_precision_the_scene_and_a_figure(tmp_path):
    scene = preset("undriven").changed({"start.spin_hz": 31.0})
    done = run_simulation(SimulationRequest(scene, 2.0, out=tmp_path), lambda _: None)
    header, *lines = (done.folder / "states.csv").read_text(encoding="utf-8").splitlines()
    assert header == HEADER == ",".join(column[0] for column in COLUMNS)
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    assert table[:, 0] == pytest.approx(np.arange(201) / 100)
    motion = done.summary.motion
    rows = kept_rows(motion, round((len(motion.time) - 1) / 200))
    assert np.array_equal(table[:, 1:4], motion.position[rows])  # not one bit is lost
    assert np.array_equal(table[:, 11], motion.energies[rows])
    run = Run.load(done.folder)
    assert (run.status, run.record.experiment, run.record.synthetic) == ("finished", "simulate", True)
    assert "undriven" in (run.record.synthetic_how or "")
    assert run.record.configuration["scene"]["start"]["spin_hz"] == 31.0
    assert run.record.configuration["tolerance"] == 1e-7
    assert (run.record.model_extra or {})["simulation"]["states"] == 201
    package = json.loads((done.folder / "datapackage.json").read_text(encoding="utf-8"))
    resource, record = package["resources"]
    assert (resource["path"], record["path"]) == ("states.csv", "run.json")
    assert [field["name"] for field in resource["schema"]["fields"]] == HEADER.split(",")
    assert (done.folder / "motion.png").stat().st_size > 20_000


def test_a_simulation_that_fails_leaves_no_folder(tmp_path):
    def broken(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_simulation(SimulationRequest(preset("undriven"), 5.0, out=tmp_path), lambda _: None, broken)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("undrawn_figures")
def test_runs_lists_a_simulation_with_its_states_and_analyze_says_that_it_is_none_of_its_own(levilab):
    done = levilab("simulate", "friction", "--duration", "2", "--out", "runs")
    assert "stayed up for all of 2 s" in done.stdout
    assert "wrote runs" in done.stderr
    listed = levilab("runs").stdout
    assert "201 states" in listed
    assert "simulate friction, synthetic" in listed
    (run,) = json.loads(levilab("runs", "--json").stdout)
    assert (run["readings"], run["states"], run["length_s"]) == (0, 201, 2.0)
    refused = levilab("analyze", "spindown", "runs", check=1)
    assert "1 simulate run" in refused.stderr


# --- what it prints ---


@pytest.mark.usefixtures("undrawn_figures")
def test_json_has_units_in_its_names_and_the_folder(levilab, tmp_path):
    text = levilab("simulate", "undriven", "--duration", "3", "--json", "--out", "here").stdout
    document = json.loads(text)
    assert document["survived"] is True
    assert document["fell"] is None
    assert document["tolerance_reached"] is True
    assert document["position_error_m"] < 1e-7
    assert 0.07 < document["height_mean_m"] < 0.075
    assert (tmp_path / document["run"] / "states.csv").exists()


def test_a_top_too_slow_to_float_is_said_to_have_fallen_and_when(levilab):
    printed = levilab("simulate", "undriven", "--set", "start.spin_hz=15").stdout
    assert "the top fell after 0.18" in printed
    assert "came down to 0 cm" in printed
    drifted = json.loads(levilab("simulate", "undriven", "--set", "escape.radius_m=0.002", "--json", check=0).stdout)
    assert drifted["fell"]["how"] == "radius"
    assert drifted["fell"]["text"] == "drifted out to 0.2 cm from the axis"
    assert drifted["fell"]["time_s"] == drifted["end_s"] < 30


def test_a_chaotic_motion_is_reported_to_be_one():
    motion = simulate(preset("undriven"), 1.0)
    chaotic = replace(motion, accuracy=replace(motion.accuracy, position=np.inf))
    found = summarise(chaotic, 1.0, 100.0, 0.01)
    assert any("chaotic" in note for note in found.notes)
    assert as_document(found)["position_error_m"] is None
    magnified = replace(motion, accuracy=replace(motion.accuracy, position=5e-7))
    (note,) = summarise(magnified, 1.0, 100.0, 0.01).notes[:1]
    assert "1e-07" in note
    assert "chaotic" not in note
    near = replace(motion, accuracy=replace(motion.accuracy, position=5e-7, nodes=4e-7))
    (note,) = summarise(near, 1.0, 100.0, 0.01).notes[:1]
    assert "nodes it is averaged over leave an error of 4e-07" in note


@pytest.mark.usefixtures("undrawn_figures")
def test_too_low_a_rate_for_the_lines_is_reported_where_states_are_written(levilab, tmp_path):
    words = ("simulate", "undriven", "--duration", "5", "--rate", "50", "--json")
    written = json.loads(levilab(*words, "--out", str(tmp_path)).stdout)
    assert any("take --rate 1" in note for note in written["notes"])  # three times the 42 to 43 Hz of the nutation
    kept = json.loads(Path(written["run"], "run.json").read_text(encoding="utf-8"))["simulation"]["notes"]
    assert any("take rate = 1" in note for note in kept)
    assert not any("take --rate" in note for note in json.loads(levilab(*words).stdout)["notes"])


def test_the_spin_is_reported_with_its_range_where_it_swings_and_as_constant_where_it_is():
    driven, friction, free = (summary(preset(name), 5.0) for name in ("driven", "friction", "undriven"))
    low, high, mean = (f(driven.motion.spin_hz) for f in (np.min, np.max, np.mean))
    assert driven.spin.endswith(f"at the end; {low:.3f} to {high:.3f} Hz, mean {mean:.3f} Hz")
    assert friction.spin == "30.000 Hz at the start, 29.527 Hz at the end"
    assert free.spin == "constant, 30.000 Hz"
    assert "Spin: constant, 30.000 Hz" in texts(free)
    assert as_document(driven)["spin_max_hz"] == high


def test_a_top_that_triggers_its_drive_has_bursts_and_no_lock(capsys):
    found = summary(preset("motor"), 12.0)
    print_motion(found)
    said = capsys.readouterr().out
    assert "bursts, which the tape set off" in said
    assert "locked" not in said
    assert as_document(found)["locked"] is None
    assert "drive" not in {line.name for line in found.lines.lines}


def test_the_table_says_what_its_numbers_are(capsys):
    found = summary(preset("undriven"), 5.0)
    unknown = replace(found.lines, lines=(replace(found.lines.lines[0], name="", frequency=-1e-4),) * 9)
    print_motion(replace(found, lines=unknown, energy_change=0.0))
    shown = capsys.readouterr().out
    for words in ("steps of at most ", "exactly constant", "not identified", "0.4 Hz; 8 of 9 lines", "mrad, 2"):
        assert words in shown
    assert next(line for line in shown.splitlines() if "not identified" in line).split()[0] == "0.00", (
        "zero has no sign"
    )
    print_motion(summary(preset("undriven").changed({"start.spin_hz": 15.0}), 1.0))
    tilt = next(line for line in capsys.readouterr().out.splitlines() if "tilt" in line)
    assert tilt.split() == ["tilt", "up", "to", "101°"]


def test_where_there_are_no_lines_it_is_said_why_and_what_is_enough():
    short = summary(preset("undriven"), 0.5)
    assert any("0.5 s are too short; 2 s are enough" in note for note in short.notes)
    assert summary(preset("undriven"), 2.0).lines.lines
    fell = as_document(summary(preset("undriven").changed({"start.spin_hz": 15.0}), 5.0))
    assert "the top was up for 0.185 s only" in fell["no_lines_because"]
    falling = as_document(summary(preset("undriven").changed({"start.spin_hz": 22.0}), 5.0))
    assert (falling["lines"], falling["no_lines_because"][:19]) == ([], "the top falls, and ")
    few = summarise(simulate(preset("undriven"), 3.0, rate=20.0), 3.0, 20.0, 0.01)
    assert "61 states in 3 s are too few" in as_document(few)["no_lines_because"]
    spin = summary(preset("friction").changed({"observed": "spin"}), 5.0)
    assert "spin alone" in as_document(spin)["no_lines_because"]
    assert not any("no lines" in note for note in spin.notes)
    upright = {"start.place": "equilibrium", "start.tilt_rad": 0.0}
    still = as_document(summary(preset("undriven").changed(upright), 5.0))
    assert still["no_lines_because"] == "the axis stands still"
    assert as_document(summary(preset("undriven"), 2.0))["no_lines_because"] is None


def test_washers_are_in_the_document_where_there_are_some():
    assert "washer_spin_end_hz" not in as_document(summary(preset("driven"), 1.0))
    assert as_document(summary(preset("loose-washers"), 1.0))["washer_spin_end_hz"] > 29


def test_a_mass_that_cannot_float_is_named_in_grams():
    lost = summary(preset("undriven").changed({"top.mass_kg": 0.0265}), 2.0)
    (note,) = (note for note in lost.notes if "does not float" in note)
    assert note.startswith("a top of 26.5 g does not float over this base; the nearest that does has 25.48 g")


# --- the lines ---


def test_the_driven_top_has_a_line_at_the_drive_with_sidebands_and_its_four_modes():
    found = summary(preset("driven"), 60.0).lines
    place = {line.name: line.frequency for line in found.lines}
    assert place["drive"] == pytest.approx(30.0, abs=found.resolution / 100)
    # the roots for small motions are −0.589, 0.772, 7.53 and 42.2 Hz; the tilt of 7° moves them by some percent
    assert place["precession"] == pytest.approx(7.3, abs=0.1)
    assert place["nutation"] == pytest.approx(42.4, abs=0.3)
    assert place["swing sideways"] == pytest.approx(0.77, abs=0.05)
    assert place["swing sideways, backwards"] == pytest.approx(-0.589, abs=0.05)
    sidebands = [line.frequency - 30 for line in found.lines if line.name.startswith("drive ")]
    # the spin swings about the drive's frequency at 0.31 to 0.33 Hz, depending on how far
    assert {round(abs(x), 2) for x in sidebands} >= {0.31}


def test_a_spin_the_other_way_round_mirrors_the_lines():
    mirrored = summary(preset("undriven").changed({"start.spin_hz": -30.0}), 10.0)
    forth, back = summary(preset("undriven"), 10.0).lines.lines, mirrored.lines.lines
    for name in ("precession", "nutation"):
        (one,) = [line for line in forth if line.name == name]
        (other,) = [line for line in back if line.name == name]
        assert other.frequency == pytest.approx(-one.frequency, rel=0.01)
        left, right = motion_figure(mirrored).axes[-1].get_xlim()
        assert left < other.frequency < right


def test_a_falling_spin_gives_the_lines_of_its_first_seconds():
    found = summary(preset("sway"), 60.0)
    assert found.lines.until < 5
    assert any("first" in note for note in found.notes)
    place = {line.name: line.frequency for line in found.lines.lines}
    assert [place["wobble, once a turn"], place["precession"]] == pytest.approx([39.8, 5.15], abs=0.1)  # as at 39.8 Hz


def test_an_unlocked_top_has_the_wobble_once_a_turn_beside_the_drive():
    found = summary(preset("driven").changed({"drive.frequency_hz": 35.0}), 20.0)
    place = {line.name: line.frequency for line in found.lines.lines}
    assert place["drive"] == pytest.approx(35.0, abs=0.01)
    assert place["wobble, once a turn"] == pytest.approx(30.0, abs=0.2)


# --- the figure ---


def texts(found):
    figure = motion_figure(found)
    titles = [panel.get_title(loc="left") for panel in figure.axes]
    return "\n".join([*titles, *(text.get_text() for text in figure.texts)]).replace("\N{NO-BREAK SPACE}", " ")


def test_the_figure_calls_a_change_of_the_energy_an_error_only_where_nothing_changes_it():
    assert "Error of the energy" in texts(summary(preset("undriven"), 2.0))
    dragged = texts(summary(preset("friction"), 2.0))
    assert "Error" not in dragged
    assert "since the start by drag\n" in dragged
    washers = texts(summary(preset("loose-washers"), 2.0))
    assert "by drag, drive and friction of the washers (without the drive's own part)" in washers
    assert "since the start by drive (without" in texts(summary(preset("driven"), 2.0))


def test_the_figure_shows_the_path_to_scale_and_that_it_is_synthetic():
    found = summary(preset("undriven"), 2.0)
    assert motion_figure(found).axes[0].get_aspect() == 1.0
    assert "SYNTHETIC" in texts(found)


def test_a_scene_without_motion_has_the_spin_drawn_alone():
    found = summary(preset("friction").changed({"observed": "spin"}), 5.0)
    assert len(motion_figure(found).axes) == 1
    assert "friction, the spin alone, 5 s" in texts(found)
    assert "stayed up" not in texts(found)


def test_a_motion_too_short_for_a_spectrum_has_a_shorter_figure():
    short, long = (motion_figure(summary(preset("undriven"), s)) for s in (0.5, 2.0))
    assert len(short.axes) == len(long.axes) - 1
    assert short.get_figheight() < long.get_figheight() - 2
    assert min(panel.get_position().y0 for panel in short.axes) * short.get_figheight() == pytest.approx(0.55)


def test_both_views_of_the_path_share_their_x_and_show_all_of_it():
    found = summary(preset("driven"), 5.0)
    side, above = motion_figure(found).axes[:2]
    assert side.get_xlim() == above.get_xlim()
    place = 100 * found.motion.position
    for panel, up in ((side, 2), (above, 1)):
        assert panel.get_xlim()[0] < place[:, 0].min() < place[:, 0].max() < panel.get_xlim()[1]
        assert panel.get_ylim()[0] < place[:, up].min() < place[:, up].max() < panel.get_ylim()[1]


def test_a_name_leaves_room_for_the_next_line():
    found = summary(preset("driven").changed({"drive.frequency_hz": 35.0}), 10.0)
    shown = [text.get_text().partition(" ")[2] for text in motion_figure(found).axes[-1].texts]
    assert {"drive", "wobble, once a turn", "nutation", "precession", "swing sideways"} <= set(shown)


@pytest.mark.parametrize(("name", "spin"), [("driven", 30.03), ("undriven", -30.0), ("undriven", 60.0)])
def test_the_lines_are_named_inside_of_their_panel_and_apart(name, spin):
    figure = motion_figure(summary(preset(name).changed({"start.spin_hz": spin}), 10.0))
    panel = figure.axes[-1]
    frame = panel.get_window_extent()
    boxes = [text.get_window_extent() for text in panel.texts]
    shown = [text.get_text() for text in panel.texts]
    assert any(text.endswith(" precession") for text in shown)
    assert any(text.endswith(" nutation") for text in shown)
    for box in boxes:
        assert frame.x0 <= box.x0 < box.x1 <= frame.x1
        assert frame.y0 <= box.y0 < box.y1 <= frame.y1
    assert faults(figure) == []


def test_of_a_long_tilt_the_envelope_is_drawn_with_its_mean_and_a_second_of_it_beside():
    found = summary(preset("driven"), 30.0, rate=400.0)
    tilt = np.degrees(found.motion.tilt)
    panels = {panel.get_ylabel(): panel for panel in motion_figure(found).axes}
    whole = panels["tilt  [°]"]
    lines = [np.asarray(line.get_ydata()) for line in whole.get_lines()]
    assert [len(line) for line in lines] == [PIECES, PIECES, PIECES // 12]
    assert (lines[0].min(), lines[1].max()) == pytest.approx((tilt.min(), tilt.max()))
    assert lines[2].mean() == pytest.approx(tilt.mean(), rel=0.01)
    (mark,) = [patch.get_x() for patch in whole.patches]
    beside = next(panel for panel in motion_figure(found).axes if panel.get_xlim() == (15.0, 16.0))
    assert mark == 15.0
    assert beside.get_xlim() == (15.0, 16.0)


def test_a_fall_is_drawn_to_its_end():
    found = summary(preset("friction").changed({"start.spin_hz": 22.0}), 60.0)
    assert found.motion.fell
    height = motion_figure(found).axes[3].get_lines()[0]
    assert np.asarray(height.get_ydata())[-1] == pytest.approx(100 * found.motion.position[-1, 2])


# --- what is refused, and what ends it ---


def test_interrupted_it_says_so_in_one_line_and_leaves_nothing(levilab, tmp_path, monkeypatch):
    under_way = []

    def interrupt(share, part):
        under_way.extend(tmp_path.glob("runs/*/run.json"))
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(ShareBar, "__call__", interrupt)
    ended = levilab("simulate", "driven", "--duration", "60", "--out", "runs", check=130)
    assert len(under_way) == 1
    assert ended.stderr.splitlines()[-1] == "levilab: interrupted, nothing was written"
    assert list((tmp_path / "runs").iterdir()) == []


def test_interrupted_while_its_folder_is_made_it_leaves_nothing(tmp_path, monkeypatch):
    made = RunWriter.create

    def interrupted(*arguments):
        writer = made(*arguments)
        signal.raise_signal(signal.SIGINT)
        return writer

    monkeypatch.setattr(RunWriter, "create", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_simulation(SimulationRequest(preset("driven"), out=tmp_path), print)
    assert list(tmp_path.iterdir()) == []


def test_no_bar_is_shown_where_there_is_no_terminal(capsys):
    share = ShareBar("simulating")
    for part in (0.1, 0.9, 0.1):
        share(part)
    share.close()
    assert capsys.readouterr().err == ""


def test_where_nothing_can_be_kept_code_is_compiled_anew_and_not_left_beside_the_source(tmp_path):
    # numba's own other place is beside its source, where it would not notice that another file has changed
    (tmp_path / "file").write_text("no folder", encoding="utf-8")
    nowhere = {name: str(tmp_path / "file" / "cache") for name in ("XDG_CACHE_HOME", "LOCALAPPDATA", "HOME")}
    program = (
        "from levilab.simulator.kernels import compiled, splitting; "
        "print(compiled._folder(), type(splitting.advance._cache).__name__)"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program], env=os.environ | nowhere, capture_output=True, text=True, check=True
    )
    assert ended.stdout.split() == ["None", "NullCache"]

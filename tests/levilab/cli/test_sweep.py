"""levilab sweep, as a user calls it: begin, interrupt, go on, show; and what it refuses."""

import json
import shutil

import pytest

from levilab.sweeps import run as run_module
from support.commands import command
from support.figures import with_drawing

pytestmark = pytest.mark.usefixtures("drawn_figures")  # each command draws the map of its folder again

SPINS, MASSES = "start.spin_hz=18:24:40", "top.mass_kg=0.0250:0.0254:20"
MAP = (
    "sweep", "undriven", "--sweep", SPINS, "--sweep", MASSES, "--observe", "survived", "--duration", "0.3",
    "--out", "map.zarr",
)  # fmt: skip


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """A folder with a map that is complete, and what the command printed."""
    folder = tmp_path_factory.mktemp("sweep")
    with with_drawing():
        ended = command(*MAP, cwd=folder)
    assert ended.status == 0, ended.err
    assert "wrote map.zarr\n" in ended.err
    assert ended.err.splitlines()[-1].startswith("wrote map")  # as the last lines, in one terminal with the table
    return folder, ended.out


def test_a_map_is_summarised_drawn_and_shown_again_without_simulating(shown, monkeypatch):
    folder, printed = shown
    assert "undriven: 40 × 20 points, each up to 0.3 s" in printed
    assert "start.spin_hz from 18 to 24 Hz, 40 values" in printed
    picture = folder / "map.zarr.survived.png"
    before = picture.read_bytes()
    picture.unlink()
    monkeypatch.setattr(run_module, "compute", None)
    again = command("sweep", "map.zarr", cwd=folder)
    assert (again.status, again.out) == (0, printed)
    assert picture.read_bytes() == before
    assert "nothing is left to compute" in command(*MAP, "--resume", cwd=folder).err


def test_json_has_the_plan_and_each_column_in_numbers(shown):
    ended = command("sweep", "map.zarr", "--json", cwd=shown[0])
    found = json.loads(ended.out)
    assert (found["points"], found["computed"], found["plan"]["duration_s"]) == (800, 800, 0.3)
    assert 0 < found["values"]["survived"]["mean"] < 1
    assert found["values"]["survived"]["unit"] == "1"
    assert found["figures"] == ["map.zarr.survived.png"]


def test_after_ctrl_c_the_printed_command_continues_to_the_same_result(shown, tmp_path, monkeypatch):
    calls, compute = [], run_module.compute

    def interrupted(task):
        calls.append(task)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return compute(task)

    with monkeypatch.context() as patched:
        patched.setattr(run_module, "compute", interrupted)
        ended = command(*MAP, cwd=tmp_path)
    assert ended.status == 130
    kept = "levilab: interrupted, 2 of 4 chunks are kept in map.zarr; go on with: levilab sweep map.zarr --resume"
    assert ended.err.splitlines()[-1] == kept
    (tmp_path / "map.zarr").rename(tmp_path / "my map.zarr")
    part = command("sweep", "my map.zarr", cwd=tmp_path)
    assert "400 of them computed" in part.out
    assert 'levilab sweep "my map.zarr" --resume goes on' in part.err
    (tmp_path / "my map.zarr").rename(tmp_path / "map.zarr")
    ended = command("sweep", "map.zarr", "--resume", cwd=tmp_path)
    assert "going on: 2 of 4 chunks are done" in ended.err
    assert ended.out == shown[1]
    assert (tmp_path / "map.zarr.survived.png").read_bytes() == (shown[0] / "map.zarr.survived.png").read_bytes()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("map.zarr", "--duration", "3"), "--duration: map.zarr has its own: leave it out"),
        (("other.zarr",), "other.zarr: there is no such store; levilab sweep SCENE with --out other.zarr makes one"),
        (MAP[1:], "--out map.zarr: it is there already: levilab sweep map.zarr shows it, --resume goes on with it"),
        ((*MAP[1:], "--resume", "--tolerance", "1e-7"), "map.zarr is of another sweep: tolerance is 1e-06 there and"),
        ((*MAP[1:], "--resume", "--adaptive"), "adaptive is False there and True here"),
        (("undriven",), "--sweep: no axis is given"),
        (("undriven", "--sweep", "start.spin=18:40:5"), "did you mean start.spin_hz?"),
        (("undriven", "--sweep", SPINS, "--set", "start.spin_hz=20"), "--set has this key, too"),
        (("undriven", "--sweep", SPINS, "--observe", "survive"), "--observe survive: there is no such observable"),
        (("undriven", "--sweep", SPINS, "--seed", "3"), "--seed: goes with --adaptive alone"),
        (("undriven", "--sweep", SPINS, "--duration", "0"), "--duration 0: a number above 0"),
        (("undriven", "--sweep", SPINS, "--points", "p.csv"), "--points: a table has all axes: leave out --sweep"),
        (("undriven", "--points", "p.csv"), "--points p.csv: cannot be read (No such file or directory)"),
        (
            ("undriven", "--sweep", SPINS, "--cores", "2", "--scheduler", "tcp://127.0.0.1:1"),
            "--cores: a cluster has its own workers: leave it out, or leave out --scheduler",
        ),
    ],
)
def test_a_wrong_option_is_an_error_before_anything_is_computed(words, said, shown, tmp_path):
    shutil.copytree(shown[0] / "map.zarr", tmp_path / "map.zarr")
    ended = command("sweep", *words, cwd=tmp_path)
    assert said in ended.err
    assert ended.status in {1, 2}
    assert [path.name for path in tmp_path.iterdir() if path.suffix == ".zarr"] == ["map.zarr"]


def test_few_points_in_a_row_are_printed_one_by_one(tmp_path):
    (tmp_path / "points.csv").write_text("start.spin_hz,start.tilt_rad\n18,0.01\n30,0.02\n", encoding="utf-8")
    ended = command("sweep", "undriven", "--points", "points.csv", "--duration", "0.5", cwd=tmp_path)
    assert ended.status == 0, ended.err
    rows = [line.split() for line in ended.out.splitlines()]
    assert ["18", "0.01", "no", "0.20798", "—"][:3] in [row[:3] for row in rows]
    assert ["30", "0.02", "yes", "—"] in rows
    assert (tmp_path / "undriven.zarr").is_dir()

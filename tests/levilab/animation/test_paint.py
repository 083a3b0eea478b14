"""Pictures without a browser: what hides what, pixel by pixel; and films of them."""

import io

import numpy as np
import pytest
from PIL import Image

from levilab.animation.film import Film, as_gif, as_mp4, still
from levilab.animation.paint import Painter, Pose
from levilab.animation.parts import parts_of
from levilab.animation.poses import Poses, poses_of
from levilab.simulator.scene import preset
from levilab.simulator.single import simulate

PARTS = parts_of(preset("undriven"))
RADIUS, HALF = 0.0144, 0.00165
#: The camera stands at this azimuth.
NEAR = -1.25


@pytest.fixture(scope="module")
def painter():
    return Painter(PARTS, (480, 480))


@pytest.fixture(scope="module")
def poses():
    return poses_of(simulate(preset("driven"), 0.2, rate=480.0), 0.0, 0.1, 60)


def pose(height=0.073, turn=0.0, *, upside_down=False):
    cosine, sine = np.cos(turn), np.sin(turn)
    matrix = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    return Pose(np.array([0, 0, height]), matrix @ np.diag([1, -1, -1]) if upside_down else matrix, sense=0)


def kind(painter, picture, point):
    """The part whose colour is nearest in hue and brightness to that of a pixel."""
    x, y = painter.where(point)
    seen = np.array(picture.getpixel((round(x), round(y))), dtype=float)
    names = ("background", "base", "magnet", "disc", "washers", "stem", "tape", "mark")
    tones = [(name, share * np.array(painter.colours[name])) for name in names for share in (1.0, 0.8, 0.65)]
    return min(tones, key=lambda tone: float(np.linalg.norm(seen - tone[1])))[0]


def around(radius, height, azimuth=NEAR):
    return [radius * np.cos(azimuth), radius * np.sin(azimuth), height]


def test_upper_parts_hide_lower_ones_from_above(painter):
    picture, z = painter.picture(pose()), 0.073 + HALF
    assert kind(painter, picture, around(0.87 * RADIUS, z + 0.15 * RADIUS)) == "disc"
    assert kind(painter, picture, around(0.40 * RADIUS, z + 0.527 * RADIUS)) == "washers"
    assert kind(painter, picture, around(0.16 * RADIUS, z + 1.15 * RADIUS)) == "stem"
    assert kind(painter, picture, around(RADIUS, 0.073)) == "magnet"


def test_lower_parts_hide_upper_ones_from_below(painter):
    picture = painter.picture(pose(upside_down=True))
    assert kind(painter, picture, [0.0, 0.0, 0.073 + HALF + 0.2 * RADIUS]) == "stem"  # the tip, which is now above
    assert kind(painter, picture, around(0.6 * RADIUS, 0.073 + HALF)) in {"magnet", "base"}  # of one grey
    assert kind(painter, picture, around(0.86 * RADIUS, 0.073 - HALF - 0.15 * RADIUS)) in {"disc", "magnet"}


def test_the_tape_is_seen_on_the_near_side_alone(painter):
    rim = around(RADIUS, 0.073)
    assert kind(painter, painter.picture(pose(turn=NEAR)), rim) in {"tape", "stem", "background"}
    assert kind(painter, painter.picture(pose(turn=NEAR + np.pi)), rim) == "magnet"


def test_the_mark_on_the_disc_turns_with_the_top(painter):
    place = around(0.75 * RADIUS, 0.073 + HALF + 0.30 * RADIUS)
    assert kind(painter, painter.picture(pose(turn=NEAR + np.pi)), place) == "mark"
    assert kind(painter, painter.picture(pose(turn=NEAR)), place) == "disc"


def test_the_near_half_of_the_base_hides_a_top_in_its_hole(painter):
    near_edge = around(0.045, PARTS["base"]["top"])
    low = painter.picture(pose(height=0.001))
    assert kind(painter, low, near_edge) == "base"
    assert kind(painter, low, around(0.16 * RADIUS, 0.001 + HALF + 1.15 * RADIUS)) == "stem"


def test_a_top_that_fell_lies_on_the_ground_and_one_that_floats_stays(painter):
    axes = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    positions = np.array([[0.001, 0.0, 0.073], [0.002, 0.0, -0.05], [0.0, 0.003, -0.05]])
    raised = painter.above_ground(positions, axes)
    ground, tip = PARTS["base"]["bottom"], HALF + 0.34 * RADIUS
    assert raised[:, :2].tolist() == positions[:, :2].tolist()
    assert raised[:, 2] == pytest.approx([0.073, ground + tip, ground + RADIUS], abs=1e-9)


def test_what_floats_is_drawn_before_the_base(painter):
    empty, full = (np.asarray(painter.picture(pose(height=z)), dtype=int) for z in (0.3, 0.055))
    x, y = painter.where([0.0, 0.0, 0.055])
    assert np.abs(full[round(y), round(x)] - empty[round(y), round(x)]).sum() > 50


def test_the_path_and_the_dark_theme_change_the_picture(poses):
    begin, end = (np.asarray(still(Film(poses, 0.05, 20.0, (320, 320)), k), dtype=int) for k in (0, 60))
    assert (np.abs(begin - end).sum(axis=2) > 30).sum() > 500
    dark = np.asarray(still(Film(poses, None, 20.0, (320, 320), theme="dark"), 0))
    assert dark.mean() < 60
    assert begin.mean() > 150


def test_a_path_behind_the_numbers_does_not_cross_them(painter, poses):
    left = np.array([np.sin(NEAR), -np.cos(NEAR), 0.0])
    positions = poses.positions + 0.048 * left  # where the numbers stand
    positions[:, 2] += np.linspace(0.02, -0.03, len(positions))
    fields = {name: getattr(poses, name) for name in Poses.__dataclass_fields__} | {"positions": positions}
    film = Film(Poses(**fields), 0.05, 20.0, (480, 480))
    path = np.array(painter.colours["path"])

    def in_its_colour(*, with_words):
        numbers = np.asarray(still(film, 60, with_words=with_words), dtype=int)[95:185, 15:165]
        return int((np.abs(numbers - path).sum(axis=2) < 150).sum())

    assert in_its_colour(with_words=False) > 30
    assert in_its_colour(with_words=True) == 0


def test_a_gif_has_its_pictures_its_time_and_the_same_bytes_each_time(poses):
    shares = []
    film = Film(poses, 0.05, 20.0, (480, 480), every=3)
    content = as_gif(film, shares.append)
    assert content == as_gif(film, lambda _: None)
    with Image.open(io.BytesIO(content)) as picture:
        assert isinstance(picture.info["duration"], int)
        assert (picture.n_frames, picture.info["duration"], picture.info["loop"]) == (20 + 1, 50, 0)
        assert picture.size == (480, 480)
    assert len(content) < 3e6 / 400 * 21 + 30_000  # 400 pictures are usual, and the first one is the largest
    assert shares[-1] == 1
    assert len(shares) == 21


def test_an_mp4_has_its_pictures_its_time_and_the_same_bytes_each_time(poses, tmp_path_factory):
    encoder = pytest.importorskip("imageio_ffmpeg", reason="pip install 'levilab[video]'")
    film = Film(poses, 0.05, 30.0, (320, 320), every=3)
    content = as_mp4(film, lambda _: None)
    assert content == as_mp4(film, lambda _: None)
    path = tmp_path_factory.mktemp("film") / "film.mp4"
    path.write_bytes(content)
    assert encoder.count_frames_and_secs(path) == pytest.approx((21, 21 / 30), abs=0.02)


def test_a_long_name_and_a_strange_one_are_written(poses):
    scene = poses.scene.changed({"name": "Kreisel №7 " * 9})
    fields = {name: getattr(poses, name) for name in Poses.__dataclass_fields__}
    plain, named = (
        np.asarray(still(Film(Poses(**(fields | {"scene": s})), 0.05, 20.0, (320, 320)), 0))
        for s in (poses.scene, scene)
    )
    assert (plain != named).any()
    assert (plain[:, 250:] == named[:, 250:]).all()  # cut before it reaches the path from above

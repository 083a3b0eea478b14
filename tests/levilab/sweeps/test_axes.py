"""What is no axis is refused before anything is computed, with what to write instead."""

import numpy as np
import pytest

from levilab.errors import UsageError
from levilab.simulator.scene import preset
from levilab.sweeps.axes import check_axes, parse_axis, read_points


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("start.spin_hz", "KEY=FROM:TO:N is expected"),
        ("start.spin_hz=18:40", "KEY=FROM:TO:N is expected"),
        ("start.spin_hz=18:40:2.5", "N, the number of values, is '2.5' here"),
        ("start.spin_hz=18kg:40:3", "write the number without its unit"),
        ("start.spin_hz=18:inf:3", "with finite numbers"),
        ("start.spin_hz=40:18:23", "take start.spin_hz=18:40:23, the map is the same"),
        ("start.tilt_rad=1:0.1:5:log", "take start.tilt_rad=0.1:1:5:log"),
        ("start.spin_hz=18:18:5", "set it by `settings` = start.spin_hz=18"),
        ("start.spin_hz=18:40:1", "set it by `settings` = start.spin_hz=18"),
        ("start.spin_hz=18:40:0", "2 or more"),
        ("start.spin_hz=0:40:5:log", "FROM above 0, not 0; leave log out"),
        ("start.spin_hz=18:40:5:lin", "log or nothing, not 'lin'"),
        ("start.spin_hz=18:40:100000000", "at most 1e+07 values"),
        ("start.spin_hz=18:18.000000000000004:5", "lie so close"),
        ("drive.waveform=sine:square:2", "words are swept by a table of `points`"),
    ],
)
def test_a_text_that_is_no_axis_is_refused_with_what_is_expected(text, said):
    with pytest.raises(UsageError) as refused:
        parse_axis(text)
    assert said in refused.value.text


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        ((), "at least one is needed"),
        (("start.spin=18:40:5",), "did you mean start.spin_hz?"),
        (("start=18:40:5",), "sweep one of its keys, place,"),
        (("start.position_m=1:2:5",), "start.position_m.0, start.position_m.1"),
        (("start.position_m.3=1:2:5",), "start.position_m has 3 numbers: sweep one of them, start.position_m.0"),
        (("top.mass_kg.0=1:2:5",), "no such number"),
        (("drive.waveform=1:2:5",), "it takes words, now off"),
        (("description=1:2:5",), "the same for a whole map"),
        (("drive.frequency_hz=29:31:5",), "it changes nothing, since drive.waveform = off"),
        (("top.mass_kg=-1:1:5",), "top.mass_kg = -1.0 the scene is invalid"),
        (("top.mass_kg=25:26:4",), "Were grams meant?  25 g are 0.025"),
        (("top.moment_a_m2=-1:1:5",), "any number but 0 is expected"),
        (("start.position_m.2=-0.01:0.07:2", "start.spin_hz=20:30:3"), "a height (the third number) above the base"),
        (("start.spin_hz=18:40:5", "start.spin_hz=18:40:5"), "each key is swept once"),
        (("start.velocity_m_s.0=0:1:5",), "`settings` has this key, too"),
        (
            ("start.spin_hz=2:3:5", "start.tilt_rad=0:1:5", "top.mass_kg=0.02:0.03:5", "start.position_m.2=0.05:0.1:5"),
            "a map has at most 3",
        ),
    ],
)
def test_axes_that_the_scene_lacks_or_that_are_invalid_are_named(axes, said):
    with pytest.raises(UsageError) as refused:
        check_axes(preset("undriven"), tuple(map(parse_axis, axes)), {"start.velocity_m_s.0"})
    assert said in refused.value.text


def test_a_start_at_equilibrium_is_refused_where_the_top_floats_nowhere():
    scene = preset("undriven").changed({"start.place": "equilibrium"})
    with pytest.raises(UsageError, match=r"top\.mass_kg = 0\.0265.*does not float"):
        check_axes(scene, [parse_axis("top.mass_kg=0.0250:0.0265:3")])
    with pytest.raises(UsageError, match=r"changes nothing, since start\.place = equilibrium"):
        check_axes(scene, [parse_axis("start.position_m.2=0.07:0.08:3")])


def points(folder, text):
    path = folder / "points.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "text",
    [
        "# made by hand\n\nstart.spin_hz,drive.waveform\n20,sine\n25.5,square\n",
        "\ufeffstart.spin_hz;drive.waveform\n20;sine\n25,5;square",
        "start.spin_hz\tdrive.waveform\r\n2e1\tsine\r\n25.5\tsquare\r\n",
    ],
)
def test_a_table_of_points_may_be_of_commas_semicolons_or_tabs(text, tmp_path):
    spin, waveform = read_points(points(tmp_path, text))
    assert (spin.key, spin.values.tolist(), spin.scale) == ("start.spin_hz", [20.0, 25.5], "table")
    assert waveform.values.tolist() == ["sine", "square"]
    check_axes(preset("driven"), (spin, waveform))


def test_a_key_without_effect_at_some_points_alone_is_an_axis(tmp_path):
    table = read_points(points(tmp_path, "drive.waveform,drive.amplitude_t\nsine,4e-4\noff,0\n"))
    check_axes(preset("driven"), table)
    with pytest.raises(UsageError, match=r"it changes nothing, since drive\.waveform = off"):
        check_axes(
            preset("driven"), read_points(points(tmp_path, "drive.waveform,drive.amplitude_t\noff,0\noff,1e-3\n"))
        )
    check_axes(
        preset("undriven"), [parse_axis("washers.inertia_kg_m2=0:1e-9:3"), parse_axis("washers.drag_share=0:1:3")]
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "it is empty"),
        ("start.spin_hz\n", "no row"),
        ("start.spin_hz,top.mass_kg\n20\n", "line 2: 2 values are expected"),
        ("start.spin_hz,start.spin_hz\n20,20\n", "each once"),
        ("start.spin_hz,top.mass_kg\n20,\n", "line 2: 2 values are expected"),
    ],
)
def test_a_table_without_points_is_refused_with_its_line(text, said, tmp_path):
    with pytest.raises(UsageError, match=said):
        read_points(points(tmp_path, text))


def test_words_in_a_column_of_numbers_are_refused(tmp_path):
    axes = read_points(points(tmp_path, "start.spin_hz\n20\nfast\n"))
    with pytest.raises(UsageError, match="numbers are expected in its column, not 'fast'"):
        check_axes(preset("undriven"), axes)


def test_a_logarithmic_axis_has_a_constant_ratio():
    values = parse_axis("start.tilt_rad=0.001:0.1:5:log").values
    assert values[[0, -1]].tolist() == [0.001, 0.1]
    assert np.allclose(values[1:] / values[:-1], 10**0.5, rtol=1e-14)

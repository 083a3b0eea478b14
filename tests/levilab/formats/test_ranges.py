"""A quantity outside of its range is refused by every door alike, with what was probably meant."""

import pytest

import levilab as door
from levilab.acquisition.experiments.field import FieldSettings
from levilab.errors import LevilabError
from levilab.formats.device import read_device
from levilab.formats.ranges import RANGES, problem_of
from levilab.formats.typed import read_mass, read_temperature
from levilab.pipelines.options import OPTIONS
from support.paths import SAMPLE_DATA

GRAMS = "a number from 1e-06 to 1 kg is expected. Were grams meant? 25 g are 0.025"


@pytest.mark.parametrize(
    "state",
    [
        lambda _: door.simulate("undriven", 1, mass_kg=25),
        lambda _: door.stability("undriven", settings={"top.mass_kg": 25}),
        lambda _: door.sweep("undriven", mass_kg=[25, 25.2]),
        lambda folder: read_device(folder / "device.toml"),
        lambda folder: door.simulate(folder / "scene.toml", 1),
    ],
)
def test_grams_for_kilograms_have_one_answer(state, tmp_path):
    for name in ("device", "scene"):
        (tmp_path / f"{name}.toml").write_text("[top]\nmass_kg = 25.0\n", encoding="utf-8")
    with pytest.raises(LevilabError) as refused:
        state(tmp_path)
    assert GRAMS in " ".join(str(refused.value).split())


def test_the_command_line_gives_the_same_answer(levilab):
    for command in ("simulate", "stability"):
        assert GRAMS in " ".join(levilab(command, "undriven", "--set", "top.mass_kg=25", check=None).stderr.split())
    rim = levilab("analyze", "video", SAMPLE_DATA / "README.md", "--rim", "0.029", check=None).stderr
    assert "from 1 to 200 mm is expected. Were metres meant? 0.029 m are 29" in " ".join(rim.split())


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"rim_m": 29}, "Were millimetres meant? 29 mm are 0.029"),
        ({"near": 2400}, "Were turns per minute meant? 2400 rpm are 40"),
        ({"clock_u": 20}, "Were millionths meant? 20 ppm are 2e-05"),
        ({"distance_m": 50}, "Were centimetres meant? 50 cm are 0.5, 50 mm are 0.05"),
    ],
)
def test_an_option_in_another_unit_is_asked_about(given, said):
    with pytest.raises(LevilabError) as refused:
        door.analyze(SAMPLE_DATA / "spin-down-1", **given)
    assert said in " ".join(str(refused.value).split())


def test_what_was_typed_with_its_unit_is_shown_and_not_asked_about(levilab):
    for option, typed in (("--near", "24000rpm"), ("--scale", "5cm")):
        said = levilab("analyze", "video", SAMPLE_DATA / "README.md", option, typed, check=None).stderr
        assert f"{option} {typed}" in said
        assert "Were" not in said
    assert problem_of("scale_m", 5.0, 1e-6).startswith("a number from 1e-07 to 0.01 m is expected")  # no row of µm


def test_settings_and_what_is_typed_have_the_same_ranges():
    with pytest.raises(ValueError, match="Were milliteslas meant"):
        FieldSettings(range_t=35.0)
    with pytest.raises(ValueError, match="Were kelvins meant"):
        read_temperature("294")
    with pytest.raises(ValueError, match=r"from 0\.001 to 1000 g is expected"):
        read_mass("25 kg")


def test_every_quantity_of_an_option_has_a_range_or_another_bound():
    free = {"reading_u", "rate", "spin_hz", "distance_u_m", "stop_s", "start_s", "height_u_m", "line_time_s"}
    numbers = {name for name, one in OPTIONS.items() if one.kind is float}
    assert numbers - free <= RANGES.keys()

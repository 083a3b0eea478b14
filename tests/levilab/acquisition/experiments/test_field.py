"""The Hall scan on the virtual bench: what it writes, what the person may answer, and what goes wrong."""

import dataclasses

import numpy as np
import pytest
from pydantic import ValidationError

from instruments.clock import VirtualClock
from instruments.virtual.bench.visa_library import library_for
from levilab.acquisition.experiments.field import FieldSettings, _mean, parse_height
from levilab.acquisition.loop import AcquisitionRequest, acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.acquisition.session import ExperimentFailed
from levilab.acquisition.table import Configuration, with_settings
from levilab.bench.config import ConfigError, Limits
from levilab.bench.person import PlaceProbe, ShieldProbe
from levilab.world.base import Base, Stand, random_base
from levilab.world.bench import virtual_bus, virtual_wiring
from levilab.world.spin_world import SpinScene, SpinWorld
from support.acquisitions import Impatient, Meanwhile, Silent, acquired, texts

#: Few heights and readings: what is tested is what happens to them.
SHORT = FieldSettings(lowest_m=0.04, highest_m=0.08, step_m=0.01, readings=3, settle_s=0.1)
BASE = Base(thickness_m=0.015, origin_m=0.0008, background_t=3e-5)


def world_of(base=BASE):
    return SpinWorld(SpinScene(base=base), VirtualClock())


def request_of(out, settings=SHORT, wiring=None, **changes):
    """A scan of a base, its probe put in place exactly."""
    wiring = dataclasses.replace(wiring or virtual_wiring(world_of()), **changes)
    config = with_settings(Configuration(), "field", settings)
    return AcquisitionRequest("field", config, lambda: wiring, out=out, synthetic_how="a test")


def test_the_readings_are_the_base_field_within_their_uncertainty(tmp_path):
    show = Silent()
    run = acquire(request_of(tmp_path), show)
    assert run.status == "finished"
    frame = run.readings().frame
    assert frame["height_m"].tolist() == [0.04, 0.05, 0.06, 0.07, 0.08]
    truth = np.array([BASE.flux_density(height) for height in frame["height_m"]])
    own, whole = frame["flux_density_mean_u_t"].to_numpy(), frame["flux_density_u_t"].to_numpy()
    # three readings of a last digit of 1 µT: 4 u, where a scatter from three is itself known to a factor of two
    assert (np.abs(frame["flux_density_t"] - truth) < np.maximum(4 * own, 2e-6)).all()
    assert whole == pytest.approx(np.hypot(np.hypot(own, 0.0012 * truth), 5e-5), rel=1e-3)
    assert show.left[-1] > 0  # one height is read again
    assert show.left == sorted(show.left, reverse=True)


def test_the_probe_is_zeroed_in_its_chamber_first(tmp_path):
    """The virtual gaussmeter shows 80 µT and more without it; the background is the base's surroundings', and stays."""
    asked = []
    wiring = virtual_wiring(world_of(Base(strength_t_m=1e-9, background_t=4e-5)))

    def person(task):
        asked.append(task)
        return wiring.person(task)

    run = acquire(request_of(tmp_path, wiring=wiring, person=person), Silent())
    field = run.readings().column("flux_density_t")
    assert [type(task) for task in asked] == [ShieldProbe] + [PlaceProbe] * 6
    assert field == pytest.approx(4e-5 * np.ones(5), abs=3e-6)


@pytest.mark.parametrize(("lost", "warned"), [(0.0, False), (0.001, False), (0.02, True)])
def test_a_drift_shows_at_the_height_that_is_read_again(tmp_path, lost, warned):
    """A ferrite loses 0.1 % in half a kelvin, which setting the height may hide, and 2 % in ten."""
    world = world_of()
    wiring = virtual_wiring(world)
    weaker = dataclasses.replace(BASE, strength_t_m=BASE.strength_t_m * (1 - lost))

    def person(task):
        if isinstance(task, PlaceProbe) and "again" in task.text:
            assert task.height_m == 0.05  # where the field is largest
            world.scene = dataclasses.replace(world.scene, base=weaker)
        return wiring.person(task)

    run = acquire(request_of(tmp_path, wiring=wiring, person=person), Silent())
    assert len(run.readings().frame) == 5
    (event,) = (one for one in run.events() if one["kind"] == "height read again")
    true = weaker.flux_density(0.05) - BASE.flux_density(0.05)
    assert event["drift_t"] == pytest.approx(true, abs=3e-6)  # the last digit, twice, and noise
    assert any(one["kind"] == "warning" for one in run.events()) is warned
    assert [text for text in ("-", ", 0.0 u") if text in event["text"]] == []


def test_a_height_that_is_typed_is_the_one_that_is_kept(tmp_path):
    answers = iter(["", "", "", "41,5", "high", "4.9 cm", "", "", "", ""])
    asked = []

    def person(task):
        asked.append(task)
        return next(answers)

    run = acquire(request_of(tmp_path, person=person), Silent())
    assert asked[3].text.startswith("Height 1 of ")
    assert "type the height in mm" in asked[3].prompt
    assert run.readings().column("height_m").tolist() == [0.0415, 0.049, 0.06, 0.07, 0.08]
    texts = [event["text"] for event in run.events()]
    assert "'high' is no height: a number in mm is expected, as 61.5" in texts
    assert "the probe stands at 41.50 mm" in texts


def test_a_probe_that_sees_a_field_is_asked_into_its_chamber_again(tmp_path):
    """On this bench it is left where it was, and all fields are off by the one that is zeroed there."""
    asked = []
    run = acquire(request_of(tmp_path, person=lambda task: asked.append(task.text) or ""), Silent())
    assert [text.partition(",")[0] for text in asked[1:3]] == ["The probe sees 19.4 mT"] * 2
    (warning,) = texts(run, "warning")
    assert warning.startswith("the probe showed 19.4 mT before it was zeroed")


@pytest.mark.parametrize(
    ("typed", "height"),
    [("61.5", 0.0615), ("61,5 mm", 0.0615), ("+6 cm", 0.06), ("0.06 m", 0.06), ("-5", -0.005), ("6e1", None),
     ("9999", None), ("mm", None)],
)  # fmt: skip
def test_heights_as_people_type_them(typed, height):
    assert parse_height(typed) == height


def test_a_field_beyond_the_range_ends_the_scan_in_a_sentence(tmp_path):
    settings = SHORT.model_copy(update={"range_t": 0.003})
    with pytest.raises(ExperimentFailed, match=r"at 40\.0 mm is beyond the range of 3 mT.*field\.range_t"):
        acquire(request_of(tmp_path, settings), Silent())


def test_the_range_may_be_left_to_the_instrument(tmp_path):
    for range_t, automatic in ((0.0, "ON"), (0.035, "OFF")):
        run = acquire(request_of(tmp_path, SHORT.model_copy(update={"range_t": range_t})), Silent())
        assert run.status == "finished"
        assert run.record.instruments["magnetometer"]["settings_end"]["automatic_range"] == automatic


def test_an_interrupted_scan_goes_on_at_the_next_height(tmp_path):
    bench = tmp_path / "bench.toml"
    bench.write_text("[field]\nlowest_m = 0.04\nhighest_m = 0.08\nstep_m = 0.01\nreadings = 3\n", encoding="utf-8")
    run = acquired("field", Impatient(2), bench=bench, out=tmp_path, seed=5)
    assert (run.status, run.count()) == ("interrupted", 2)
    again = acquire(request_for("field", AcquisitionOptions(resume=run.folder)), Silent())
    assert again.status == "finished"
    assert again.readings().column("height_m").tolist() == [0.04, 0.05, 0.06, 0.07, 0.08]
    base, stand = random_base(5), Stand(scatter_m=2e-4, seed=5)
    truth = [stand.at(height).flux_density(base) for height in (0.04, 0.05, 0.06, 0.07, 0.08)]
    assert again.readings().column("flux_density_t") == pytest.approx(truth, abs=3e-6)
    assert f"strength {base.strength_t_m:.6e} T m" in (again.record.synthetic_how or "")


def test_a_magnetometer_that_is_reset_on_the_way_is_set_up_anew(tmp_path):
    """After the second height another program resets it: the third is read once more, in the range of the others."""
    world = world_of()
    bus = virtual_bus(world)
    meter = bus.instruments["ASRLmagnetometer.levilab::INSTR"]
    request = request_of(tmp_path, wiring=virtual_wiring(world), library=library_for(bus))
    run = acquire(request, Meanwhile(2, meter.reset))
    assert run.status == "finished"
    assert run.count() == 5
    assert [event["kind"] for event in run.events()].count("found again") == 1


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"step_m": 5.0}, "make 1 heights, 4 to 1000 are expected"),
        ({"step_m": 1e-6}, "heights, 4 to 1000 are expected"),
        ({"lowest_m": 0.2}, "make 0 heights"),
    ],
)
def test_heights_that_make_no_scan_are_refused(settings, says):
    with pytest.raises(ValidationError) as caught:
        FieldSettings(**settings)
    assert says in str(caught.value)


def test_a_base_that_cannot_be_is_refused():
    with pytest.raises(ConfigError, match=r"field\.base_inner_radius_m = 0\.06 must be less than"):
        FieldSettings(base_inner_radius_m=0.06).check("field", Limits())


def test_readings_that_all_show_the_same_are_uncertain_by_their_last_digit():
    # a rectangular distribution, GUM 4.3.7: its width over 2√3, here that of the last of six digits, 10 nT
    row = _mean(SHORT, [1.2345e-3] * 4)
    assert row["flux_density_mean_u_t"] == pytest.approx(1e-8 / 2 / 3**0.5)

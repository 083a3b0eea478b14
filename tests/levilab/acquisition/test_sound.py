"""The sound card in the place of the oscilloscope and of the counter: --scope sound."""

import math
from dataclasses import replace

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.oscilloscope.sound import SilentInput
from instruments.errors import NotConnected
from levilab.acquisition.loop import acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.errors import UsageError
from levilab.pipelines.catalogue import ANALYSES
from levilab.runs.run import Run
from levilab.world.bench import PickupCoil
from levilab.world.spin_world import SpinScene, SpinWorld
from support.acquisitions import LET_GO_AT_ONCE, RAISED_QUICKLY, Impatient, Silent, acquired, asked, cut
from support.wire import ask

ADDRESS = "sound://oscilloscope.levilab"


def request(experiment, out, *settings, seed=1, **changes):
    return asked(experiment, out=out, seed=seed, scope="sound", settings=settings, **changes)


def with_card(request, act):
    """The same request, with a function that is called with the virtual sound card, and with the generator."""

    def wiring():
        made = request.wiring()
        instruments = made.library.bench.instruments
        act(instruments[ADDRESS], next(one for one in instruments.values() if "33522B" in one.identity))
        return made

    return replace(request, wiring=wiring)


@pytest.fixture(scope="module")
def spin_run(tmp_path_factory):
    return acquire(request("spin", tmp_path_factory.mktemp("spin"), *RAISED_QUICKLY), Silent())


def test_a_spin_down_is_counted_by_the_sound_card_with_a_u_of_each_reading(spin_run):
    assert spin_run.record.instruments["oscilloscope"]["driver"] == "SoundCard"
    assert spin_run.record.configuration["count_with"] == "oscilloscope"
    readings = spin_run.readings()
    assert list(readings.header) == ["time_s", "spin_frequency_hz", "spin_frequency_u_hz"]
    u = readings.column("spin_frequency_u_hz")
    assert 0.005 < np.median(u) < 0.05  # jitter of 0.021 turns, 25 to 35 pulses
    assert np.ptp(u) > 0
    analysis = ANALYSES["spindown"]
    (run,) = analysis.analyze([spin_run.folder]).runs
    statistics = run.fit("disc").statistics
    # u predicts the scatter about the law: within three standard errors of χ² from the readings
    assert abs(statistics.reduced_chi_square - 1) < 3 * math.sqrt(2 / (len(u) - 2))


def test_the_clock_of_the_sound_card_is_a_line_of_the_budget(spin_run, tmp_path):
    run = acquire(request("trace", tmp_path, "trace.records=1", "trace.duration_s=2"), Silent())
    analysis = ANALYSES["spin"]
    (origin,) = analysis.analyze([run.folder]).origins
    rows = {row.name: row for budget in origin.budget for row in budget.components}
    assert rows["time_base"].u == pytest.approx(1e-4 / math.sqrt(3))
    assert not rows["time_base"].included
    assert "levilab bench clock" in rows["time_base"].remedy


def test_a_resumed_run_goes_on_with_the_sound_card(spin_run, tmp_path):
    begun = cut(spin_run, tmp_path / "begun", 3)
    resumed = acquire(request_for("spin", AcquisitionOptions(resume=begun, out=tmp_path)), Impatient(2))
    assert resumed.count() == 5
    assert resumed.record.configuration["named"] == {"oscilloscope": "sound"}
    assert np.isfinite(resumed.readings().column("spin_frequency_u_hz")).all()


def test_an_input_that_is_unplugged_for_a_while_costs_readings_and_no_more(tmp_path):
    def unplug(card, _):
        original, opened = card.open_input, []

        def open_input():
            card.unplugged_at = math.inf if opened else 100.0  # it is plugged in again
            opened.append(True)
            return original()

        card.open_input = open_input

    run = acquire(with_card(request("spin", tmp_path, *RAISED_QUICKLY, "spin.longest_s=80"), unplug), Silent())
    assert run.status == "finished"
    kinds = [event["kind"] for event in run.events()]
    assert "instrument lost" in kinds
    assert "found again" in kinds


@pytest.mark.parametrize(("change", "error"), [({"unplugged_at": 40.0}, NotConnected), ({"muted": True}, SilentInput)])
def test_an_input_that_stays_away_ends_the_run_with_the_drive_off(tmp_path, change, error):
    seen = []

    def act(card, generator):
        vars(card).update(change)
        seen.append(generator)

    with pytest.raises(error):
        acquire(with_card(request("spin", tmp_path, *LET_GO_AT_ONCE), act), Silent())
    assert ask(seen[0], "OUTP?") == "0"
    (folder,) = tmp_path.iterdir()
    assert Run.load(folder).status == "failed"


def test_a_record_with_a_loss_is_kept_cut_and_taken_again(tmp_path):
    def lose(card, _):
        card.loses = [(1.5, 0.01, True)]

    settings = ("trace.records=2", "trace.duration_s=2", "trace.interval_s=5")
    run = acquire(with_card(request("trace", tmp_path, *settings), lose), Silent())
    texts = [event["text"] for event in run.events()]
    assert any("record 1 (tape) was cut short" in text for text in texts)
    assert any("samples were lost" in text for text in texts)
    sizes = [stored.trace.codes.size for stored in run.traces()]
    assert len(sizes) == 3
    assert sizes[0] < sizes[1] == sizes[2] == 96_000
    analysis = ANALYSES["spin"]
    (found,) = analysis.analyze([run.folder]).runs
    assert "jump" not in {one.name for one in found.spin.notes}


def test_left_is_the_light_and_right_a_pickup_coil(tmp_path):
    settings = ("trace.records=1", "trace.duration_s=2", "trace.channels=[1,2]", 'trace.shows=["tape","coil"]')
    run = acquire(request("trace", tmp_path, *settings), Silent())
    analysis = ANALYSES["spin"]
    tape, coil = (
        analysis.analyze([run.folder], analysis.options_from({"channel": name})).runs[0].spin.frequency
        for name in ("tape", "coil")
    )
    assert tape.value == pytest.approx(coil.value, abs=4 * tape.u)
    assert coil.u < tape.u  # it does not see where the tape's pulses scatter to
    (_, stored) = run.traces()
    # 1.26 mV at 30 Hz, 4 cm beside the top, 300 times amplified, of 1.5 V full scale; less by the high-pass
    assert 0.8 < stored.trace.volts.max() / (300 * 1.26e-3 / 1.5) <= 1.02


def test_the_voltage_of_the_pickup_coil_is_that_of_a_turning_dipole():
    world = SpinWorld(SpinScene(), VirtualClock())
    volts = PickupCoil(world, amplifier=1.0)(0.0, 1e-4, 1000)
    # N A ω (μ₀/4π) 2 μ δ / r³
    expected = 1000 * 1e-4 * (2 * math.pi * 30) * 1e-7 * 2 * 0.714 * 0.03 / 0.04**3
    assert volts.max() == pytest.approx(expected, rel=0.01)  # the spin falls by 0.3 %/s


def test_any_oscilloscope_can_count(tmp_path):
    run = acquired("spin", Impatient(2), out=tmp_path, seed=1, scope="DS1000Z", settings=RAISED_QUICKLY)
    assert run.record.instruments["counter"]["driver"] == "SampledCounter"
    frequency, u = (run.readings().column(name) for name in ("spin_frequency_hz", "spin_frequency_u_hz"))
    assert frequency[0] == pytest.approx(35.0, abs=0.3)
    assert (u > 0).all()


@pytest.mark.parametrize("experiment", ["spin", "limit"])
def test_a_top_that_is_spun_by_hand_needs_no_generator(experiment, tmp_path):
    is_limit = experiment == "limit"
    ends = "limit.repetitions=1" if is_limit else "spin.longest_s=80"
    run = acquire(request(experiment, tmp_path, f"{experiment}.drive_waveform=NONE", ends), Silent())
    assert "generator" not in run.record.instruments
    assert run.count() == 1 if is_limit else run.count() > 5
    if is_limit:
        limit, u = (run.readings().column(name)[0] for name in ("spin_frequency_hz", "spin_frequency_u_hz"))
        fell = float(run.record.synthetic_how.rpartition("the first at ")[2].split()[0])
        assert limit == pytest.approx(fell, abs=4 * u)
    analysis = ANALYSES["limit" if is_limit else "spindown"]
    assert analysis.analyze([run.folder]).runs


@pytest.mark.parametrize("settings", [("limit.which=upper",), ()])
def test_what_needs_a_drive_is_refused_without_one(settings, tmp_path):
    experiment = "limit" if settings else "precession"
    with pytest.raises(UsageError, match=r"drive_waveform = NONE: th.* needs a drive"):
        asked(experiment, out=tmp_path, settings=(*settings, f"{experiment}.drive_waveform=NONE"))

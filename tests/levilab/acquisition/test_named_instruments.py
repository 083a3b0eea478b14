"""The options that name an instrument in place of the bench's: --counter and --scope."""

import dataclasses

import pytest

from instruments.catalogue import COUNTERS
from levilab.acquisition.loop import acquire
from levilab.acquisition.request import AcquisitionOptions, request_for
from levilab.bench.config import ConfigError, InstrumentSettings
from levilab.bench.kinds import COUNTER
from levilab.errors import UsageError
from levilab.world.spin_world import random_scene
from support.acquisitions import Impatient, Silent, asked, mock

BENCH = """
[counter]
model = "53230A"
address = "TCPIP0::192.168.1.20::5025::SOCKET"

[generator]
model = "33500B"
address = "USB0::0x0957::0x2807::MY52400001::INSTR"
"""


def counter_of(run):
    return run.record.instruments["counter"]["identity"]


def test_a_mock_has_the_counter_that_is_named_and_a_resumed_run_keeps_it(tmp_path):
    begun = acquire(mock(tmp_path, counter="cnt-91"), Impatient(3))
    assert counter_of(begun).startswith("PENDULUM, CNT-91")
    assert begun.record.configuration["counter"]["model"] == "CNT-91"
    resumed = acquire(mock(tmp_path, seed=None, resume=begun.folder), Silent())
    assert resumed.status == "finished"
    assert counter_of(resumed).startswith("PENDULUM, CNT-91")


def test_an_address_replaces_that_of_the_bench_file(tmp_path):
    bench = tmp_path / "bench.toml"
    bench.write_text(BENCH, encoding="utf-8")
    config = request_for("spin", AcquisitionOptions(bench=bench, counter="GPIB0::3::INSTR")).config
    assert (config.counter.model, config.counter.address) == ("53230A", "GPIB0::3::INSTR")
    assert config.generator.address.startswith("USB0")


def test_the_scheme_of_an_address_gives_the_model_without_a_bench_file():
    phone = dataclasses.replace(COUNTERS[0], name="phone", address="phone://192.168.1.40:8080")
    card = dataclasses.replace(COUNTERS[0], name="card", address="card://")
    kind = dataclasses.replace(COUNTER, models=(*COUNTERS, phone, card))
    assert kind.named("PHONE://10.0.0.7", None) == InstrumentSettings(model="phone", address="PHONE://10.0.0.7")
    assert kind.named("card", None) == InstrumentSettings(model="card", address="card://")
    with pytest.raises(ConfigError, match=r"where the phone is was not said: give its address, such as phone://192"):
        kind.named("Phone", None)


def test_the_named_model_of_the_bench_file_is_the_one_described():
    described = InstrumentSettings(model="CNT-91", address="GPIB0::7::INSTR", timeout_s=9.0)
    assert COUNTER.named("cnt-91", described) == described


def test_a_counter_that_counts_no_laser_is_refused_before_a_top_is_driven_up():
    with pytest.raises(ConfigError, match="phyphox cannot count a laser beam: the precession needs another counter"):
        asked("precession", counter="phyphox")


@pytest.mark.parametrize("scope", ["sound", "DS1000Z"])
def test_the_drive_or_a_pickup_coil_at_an_oscilloscope_is_not_counted_as_the_laser(scope):
    with pytest.raises(ConfigError, match="an oscilloscope cannot count the laser beside the spin: name a `counter`"):
        asked("precession", scope=scope)
    both = AcquisitionOptions(mock=True, scope=scope, counter="53230A", settings=("record_s=6",))
    assert request_for("precession", both).config.count_with == "counter"


@pytest.mark.parametrize("experiment", ["spin", "precession"])
def test_an_oscilloscope_beside_a_counter_that_counts_is_refused(experiment):
    with pytest.raises(UsageError, match="the counter counts; leave out one of the two") as refused:
        asked(experiment, scope="sound", counter="CNT-91")
    assert refused.value.value == "sound"


@pytest.mark.parametrize("counter", ["34461A", "34401A", "53210A"])
def test_a_counter_with_one_input_has_its_cable_changed_by_a_person(counter, tmp_path):
    with pytest.raises(ConfigError, match="virtual bench has no person who could change the counter's cable"):
        asked("precession", counter=counter)
    bench = tmp_path / "bench.toml"
    bench.write_text(BENCH.replace("53230A", counter), encoding="utf-8")
    assert request_for("precession", AcquisitionOptions(bench=bench)).config.precession.laser_input == 1
    with pytest.raises(UsageError, match=f"laser_input = 2: the {counter} has one input; take 1"):
        request_for("precession", AcquisitionOptions(bench=bench, settings=("laser_input=2",)))


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"mock": True, "counter": "DVM"}, "counter = DVM: there is no virtual counter 'DVM': known are 53230A"),
        ({"mock": True, "scope": "GPIB0::3::INSTR"}, "is an address; with `mock` a model is expected"),
        ({"counter": "CNT-91"}, "where the CNT-91 is was not said: describe it in the bench file"),
        ({"counter": "CNT91"}, "'CNT91' is neither a model nor an address: the models are 53230A"),
        ({"counter": "GPIB0::3::INSTR"}, "describes no counter, so the model at GPIB0::3::INSTR is not known"),
    ],
)
def test_an_instrument_that_cannot_be_named_so_is_refused(options, what, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError) as refused:
        request_for("spin", AcquisitionOptions(**options))
    assert what in str(refused.value)


@pytest.mark.parametrize(("gate_s", "taken"), [(0.5, 1.0), (0.25, 0.1), (1.0, 1.0), (1.5, 1.0), (0.1, 0.1), (9.0, 9.0)])
def test_a_multimeter_takes_the_nearest_gate_and_the_run_says_so(gate_s, taken):
    """A u of 0.5 s would be five times too small, and the time of a reading 0.2 s too early."""
    settings = (f"gate_s={gate_s}", "reading_u_hz=0.01")
    request = asked("spin", counter="34461A", settings=settings)
    assert (request.config.spin.gate_s, request.config.spin.reading_u_hz) == (taken, 0.01)
    stated = asked("spin", seed=1, counter="34461A", settings=settings[:1])
    assert stated.config.spin.reading_u_hz == pytest.approx(2**0.5 * random_scene(1).jitter / taken, abs=1e-6)

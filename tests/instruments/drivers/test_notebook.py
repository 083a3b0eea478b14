"""The drivers by hand, as in a notebook: connect, look, misspell, ask for help, close."""

import pydoc
import re

import pytest

from instruments.drivers.counter.keysight_53230a import Keysight53230A
from instruments.drivers.generator.keysight_33500b import Keysight33500B
from instruments.drivers.generator.siglent_sdg1000x import SiglentSDG1000X
from instruments.drivers.magnetometer.lakeshore_425 import LakeShore425
from instruments.drivers.oscilloscope.rigol_ds1000z import RigolDS1000Z
from instruments.errors import NotConnected, OutOfRange, WrongInstrument
from instruments.virtual.bench.visa_library import library_for
from levilab.world.bench import VIRTUAL, practice_world, virtual_bus
from support.models import ROWS


@pytest.fixture
def bench():
    """A bench, and what `connect` needs to reach it."""
    world = practice_world()
    bus = virtual_bus(world)
    return bus, {"library": library_for(bus), "clock": world.clock}


def test_a_counter_is_connected_used_and_closed(bench):
    _, way = bench
    with Keysight53230A.connect(VIRTUAL["counter"].address, **way) as counter:
        assert repr(counter) == f"<Keysight53230A 53230A VIRTUAL at {VIRTUAL['counter'].address}>"
        counter.prepare(gate_s=0.1, trigger_level_v=0.6)
        assert counter.frequency() == pytest.approx(29.5, abs=1.0)  # a top that spins down from 30 Hz
    with pytest.raises(NotConnected, match="closed"):
        counter.identity()


def test_a_serial_line_is_set_as_the_driver_has_it(bench):
    _, way = bench
    with LakeShore425.connect(VIRTUAL["magnetometer"].address, **way) as meter:
        assert repr(meter).startswith("<LakeShore425 MODEL425 VIRTUAL at ASRL")


def test_another_instrument_is_not_connected(bench):
    _, way = bench
    with pytest.raises(WrongInstrument):
        Keysight33500B.connect(VIRTUAL["counter"].address, **way)


def test_the_output_is_off_at_the_end_of_a_with_block(bench):
    bus, way = bench
    with Keysight33500B.connect(VIRTUAL["generator"].address, **way) as generator:
        generator.prepare(waveform="SIN", frequency_hz=30.0, amplitude_vpp=1.0)
        generator.output = True
    assert bus.instruments[VIRTUAL["generator"].address].settings["1:output"] is False


@pytest.mark.parametrize(("name", "meant"), [("tigger_level", "trigger_level"), ("gate_s", "gate"), ("xyzzy", None)])
def test_a_misspelt_setting_raises_and_names_the_one_that_was_meant(bench, name, meant):
    _, way = bench
    hint = f": did you mean '{meant}'?" if meant else ""
    with (
        Keysight53230A.connect(VIRTUAL["counter"].address, **way) as counter,
        pytest.raises(AttributeError, match=re.escape(f"Keysight53230A has no setting '{name}'{hint}") + "$"),
    ):
        setattr(counter, name, 0.3)


def test_an_input_of_a_scope_is_called_by_its_number(bench):
    _, way = bench
    with RigolDS1000Z.connect(VIRTUAL["oscilloscope"].address, **way) as scope:
        assert list(scope.channel) == [1, 2, 3, 4]
        scope.channel[2].scale = 0.5
        assert scope.channel[2].scale == 0.5
        assert scope.channel[1].scale == 1.0
        assert scope.channel[1].identity() == scope.identity()
        assert repr(scope.channel[1]) == f"<input 1 of {scope!r}>"
        with pytest.raises(AttributeError, match="did you mean 'scale'"):
            scope.channel[1].scal = 0.5


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        (Keysight53230A.gate, "SENS:FREQ:GATE:TIME, 0.0001 to 1000 s."),
        (Keysight53230A.impedance, "INP1:IMP, 50 or 1e+06 ohm."),
        (Keysight33500B.output, "OUTP1, True or False."),
        (Keysight33500B.waveform, "FUNC, one of SINusoid, SQUare, TRIangle, RAMP."),
        (SiglentSDG1000X.frequency, "C1:BSWV FRQ, 1e-06 to 6e+07 Hz."),
    ],
)
def test_help_shows_header_unit_and_range(setting, says):
    assert says in pydoc.plain(pydoc.render_doc(setting))


def test_the_only_values_that_an_input_has_are_taken(bench):
    _, way = bench
    with Keysight53230A.connect(VIRTUAL["counter"].address, **way) as counter:
        with pytest.raises(OutOfRange, match="impedance = 75 is refused, allowed is 50 or 1e\\+06 ohm"):
            counter.impedance = 75
        counter.transport.write("INP1:IMP 75;:INP1:RANG 20;:INP1:PROB 3")  # nor by its twin
        counter.forget_errors()
        assert (counter.impedance, counter.input_range, counter.probe_factor) == (1e6, 5.0, 1.0)


@pytest.mark.parametrize("name", ROWS)
def test_every_setting_of_every_driver_has_help(name):
    driver = ROWS[name].driver
    for row in (
        *driver.declared_settings(),
        *(driver.CHANNEL.declared_settings() if hasattr(driver, "CHANNEL") else ()),
    ):
        assert row.header in row.__doc__
        assert row.unit in row.__doc__

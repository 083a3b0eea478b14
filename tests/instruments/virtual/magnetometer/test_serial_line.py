"""The virtual gaussmeters at their serial line."""

import pytest
import pyvisa
from pyvisa.constants import Parity, StatusCode, StopBits

from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.magnetometer.lakeshore_475 import Virtual475
from support.gaussmeters import PORT, meter


def resource(device, **settings):
    line = {"baud_rate": 57600, "data_bits": 7, "parity": Parity.odd, "stop_bits": StopBits.one} | settings
    manager = pyvisa.ResourceManager(library_for(VirtualBench({PORT: device})))
    return manager.open_resource(PORT, read_termination="\r\n", write_termination="\n", **line)


def test_a_program_with_the_right_settings_is_understood():
    line = resource(meter())
    assert line.query("*IDN?") == "LSCI,MODEL425,VIRTUAL,1.0"
    assert line.query_ascii_values("RDGFIELD?") == [pytest.approx(123.0, rel=1e-3)]


def test_settings_may_be_put_right_while_the_port_is_open():
    line = resource(meter(), parity=Parity.none, data_bits=8)
    with pytest.raises(pyvisa.VisaIOError) as silence:
        line.query("*IDN?")
    assert silence.value.error_code == StatusCode.error_timeout
    line.data_bits, line.parity = 7, Parity.odd
    line.flush(pyvisa.constants.BufferOperation.discard_read_buffer)
    assert line.query("*IDN?") == "LSCI,MODEL425,VIRTUAL,1.0"


def test_bytes_take_their_time_on_the_line():
    device = meter(Virtual475, pace=0.0)
    line = resource(device, baud_rate=9600)
    line.query("UNIT?")
    # six characters there, three back, ten bits each
    assert device.clock.now() == pytest.approx(9 * 10 / 9600, abs=1e-9)

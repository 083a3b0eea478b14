"""Whatever is set at a virtual generator, its settings fit each other.

Source: Agilent/Keysight 33500 Series Operating and Service Guide, unless a test names another.
"""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from instruments.clock import VirtualClock
from instruments.virtual.generator.agilent_33220a import Virtual33220A
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from support.wire import ask, cable, send

_HEADERS = """
FREQ FUNC VOLT VOLT:OFFS VOLT:HIGH VOLT:LOW VOLT:UNIT OUTP OUTP:LOAD PHAS APPL:SIN FUNC:PULS:WIDT FUNC:PULS:DCYC
FUNC:PULS:TRAN FUNC:PULS:HOLD FUNC:PULS:PER FUNC:SQU:DCYC BURS:STAT BURS:NCYC BURS:INT:PER BURS:MODE TRIG:SOUR
SWE:STAT *TRG *RST FUNC:ARB:SRAT FUNC:ARB ABOR APPL:DC TRIG:DEL
"""
HEADERS = (*_HEADERS.split(), "DATA:ARB A,", "DATA:ARB:DAC B,#216")
_WORDS = """
SIN SQU PULS RAMP DC NOIS PRBS ARB MIN MAX DEF INF ON OFF DBM VRMS VPP BUS IMM GAT TRIG DCYC WIDT 0 1 -5 1e-9 4.7
1e6 3e7 9.9e37 1e999 A 0,0,0,0,0,0,0,1 RAD abcdefghijklmnop
"""
WORDS = (*_WORDS.split(), "1 MHZ,20,-3", "2 DBM", "-300 DBM")
#: Few random pairs of these say anything: commands that reach the limits of each other.
_COMMANDS = """
FREQ 3e7;FUNC SIN;FUNC SQU;FUNC RAMP;FUNC DC;APPL:DC 1 MHZ,20,-3;VOLT 4.7;VOLT MAX;VOLT:OFFS MIN;VOLT:OFFS MAX;
VOLT:HIGH MAX;VOLT:LOW MIN;OUTP:LOAD INF;OUTP:LOAD 50
"""
COMMANDS = st.one_of(
    st.sampled_from([*map(str.strip, _COMMANDS.split(";"))]),
    st.builds("{} {}".format, st.sampled_from(HEADERS), st.sampled_from(WORDS)),
)


@given(commands=st.lists(COMMANDS, max_size=30))
def test_whatever_is_set_the_settings_fit_each_other(commands):
    for kind in (Virtual33500B, Virtual33220A):
        device = kind(VirtualClock(), listener=lambda *_: None)
        for command in commands:
            send(device, f"{command}\n".encode())
        channel = device.channels[0]
        half = 0.0 if channel["waveform"] == "DC" else channel.number("amplitude_vpp") / 2
        assert abs(channel.number("offset")) + half <= channel.top + 1e-6
        assert all(np.isfinite(value) for value in device.settings.values() if isinstance(value, float))
        slowest, fastest = channel.frequency_limits()
        assert slowest * (1 - 1e-9) <= channel.frequency <= fastest * (1 + 1e-9)
        cable(device).clear()
        assert ask(device, "*CLS;*IDN?") == device.identity

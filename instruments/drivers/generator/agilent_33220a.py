"""The driver of Agilent's 33220A."""

from typing import ClassVar

from instruments.drivers.generator import drive
from instruments.drivers.setting import Setting
from instruments.ieee488 import INFINITY, Form


class Agilent33220A(drive.DriveGenerator):
    """Agilent 33220A: one channel, 20 MHz, an older dialect.

    Source: Agilent 33220A User's Guide, chapter 4; public drivers of the model.  It has no triangle of its own: that
    is a ramp of 50 % symmetry, and so `waveform` answers RAMP for it.
    """

    MODELS: ClassVar[str] = "33220A"
    #: User's Guide, answers of APPLy? and FREQuency?.
    NUMBER: ClassVar[Form] = Form(r"[+-]\d\.\d{13}E[+-]\d{2}", "+1.0000000000000E+03")
    OUTPUT: ClassVar[str] = "OUTP"
    TRIANGLE_IS_RAMP = True

    waveform = Setting("FUNC", str, choices=("SINusoid", "SQUare", "RAMP"), answers=("PULSe", "NOISe", "DC", "USER"))
    symmetry = Setting("FUNC:RAMP:SYMM", float, unit="percent", low=0.0, high=100.0)
    frequency = drive.frequency_setting(20e6, digits=14)
    amplitude = drive.amplitude_setting(20e-3)
    offset = drive.offset_setting(digits=14)
    load = drive.LoadSetting("OUTP:LOAD", float, unit="ohm", low=1.0, high=INFINITY)
    output = drive.OutputSwitch("OUTP", bool)
    burst_cycles = drive.burst_setting("BURS:NCYC", 1.0, 50_000.0)
    trigger_source = drive.burst_word("TRIG:SOUR", "IMMediate", "EXTernal", "BUS")
    trigger_slope = drive.burst_word("TRIG:SLOP", "POSitive", "NEGative")
    trigger_delay = drive.burst_setting("TRIG:DEL", 0.0, 85.0, unit="s")

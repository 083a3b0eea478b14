"""The driver of Keysight's 33500B series."""

from typing import ClassVar

from instruments.drivers.generator import drive
from instruments.drivers.setting import Setting
from instruments.ieee488 import INFINITY, Form


class Keysight33500B(drive.DriveGenerator):
    """Agilent/Keysight 33500B series (they identify as 33509B to 33522B, or 33500-33522A).

    Source: Keysight 33500 Series Operating and Service Guide.  The coil is no 50 Ω load: with the load set
    to INFinity the amplitude on the display is the voltage at the coil's series resistor.
    """

    MODELS: ClassVar[str] = r"335\d\d[AB]"
    #: Operating and Service Guide, "typical response" of its queries.
    NUMBER: ClassVar[Form] = Form(r"[+-]\d\.\d{15}E[+-]\d{2}", "+1.000000000000000E+03")
    OUTPUT: ClassVar[str] = "OUTP1"
    TWO_OUTPUTS: ClassVar[str] = "335(1[02]B|20B|22[AB])"

    waveform = Setting(
        "FUNC",
        str,
        choices=("SINusoid", "SQUare", "TRIangle", "RAMP"),
        answers=("PULSe", "PRBS", "NOISe", "ARBitrary", "DC"),
    )
    frequency = drive.frequency_setting(30e6, digits=16)
    amplitude = drive.amplitude_setting(2e-3)
    offset = drive.offset_setting(digits=16)
    load = drive.LoadSetting("OUTP1:LOAD", float, unit="ohm", low=1.0, high=INFINITY)
    output = drive.OutputSwitch("OUTP1", bool)
    burst_cycles = drive.burst_setting("BURS:NCYC", 1.0, 1e8)
    trigger_source = drive.burst_word("TRIG:SOUR", "IMMediate", "EXTernal", "TIMer", "BUS")
    trigger_slope = drive.burst_word("TRIG:SLOP", "POSitive", "NEGative")
    trigger_delay = drive.burst_setting("TRIG:DEL", 0.0, 1000.0, unit="s")

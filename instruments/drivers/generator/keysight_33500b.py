"""The driver of Keysight's 33500B series."""

from typing import ClassVar

from instruments.drivers.generator.drive import (
    DriveGenerator,
    LoadSetting,
    OutputSwitch,
    amplitude_setting,
    burst_setting,
    burst_word,
    frequency_setting,
    offset_setting,
)
from instruments.drivers.setting import Setting
from instruments.ieee488 import INFINITY, Form


class Keysight33500B(DriveGenerator):
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
    frequency = frequency_setting(30e6, digits=16)
    amplitude = amplitude_setting(2e-3)
    offset = offset_setting(digits=16)
    load = LoadSetting("OUTP1:LOAD", float, unit="ohm", low=1.0, high=INFINITY)
    output = OutputSwitch("OUTP1", bool)
    burst_cycles = burst_setting("BURS:NCYC", 1.0, 1e8)
    gate_polarity = burst_word("BURS:GATE:POL", "NORMal", "INVerted")
    trigger_source = burst_word("TRIG:SOUR", "IMMediate", "EXTernal", "TIMer", "BUS")
    trigger_slope = burst_word("TRIG:SLOP", "POSitive", "NEGative")
    trigger_delay = burst_setting("TRIG:DEL", 0.0, 1000.0, unit="s")

"""The driver of Rigol's DG800 and DG1000Z generators."""

from typing import ClassVar

from instruments.drivers.generator import drive
from instruments.drivers.setting import Setting
from instruments.ieee488 import INFINITY, Form


class RigolDG1000Z(drive.DriveGenerator):
    """Rigol DG800 and DG1000Z: DG811 to DG832, DG1022Z to DG1062Z; the first channel drives the coil.

    Sources: DG800 Programming Guide, pages 2-43 (``:OUTPut``) and 2-72 (numbers with seven digits, ``1.000000E+02``),
    DG1000Z Programming Guide; PyMeasure's DG800.  Headers are those of Agilent's 33220A, a triangle is a ramp of 50 %
    here, too, but the trigger of a burst is set with the burst (page 2-64); a switch is answered with ON or OFF, and a
    model of one channel has no ``OUTP2``.
    """

    MODELS: ClassVar[str] = r"DG8[123][12]|DG10[236]2Z"
    NUMBER: ClassVar[Form] = Form(r"-?\d\.\d{6}E[+-]\d{2}", "1.000000E+02")
    OUTPUT: ClassVar[str] = "OUTP1"
    TWO_OUTPUTS: ClassVar[str] = r"DG8\d2|DG10\d2Z"
    TRIANGLE_IS_RAMP = True

    waveform = Setting(
        *("FUNC", str),
        choices=("SINusoid", "SQUare", "RAMP"),
        answers=("PULSe", "NOISe", "DC", "USER", "ARB", "HARMonic", "SEQ", "PRBS", "DUALtone"),
    )
    symmetry = Setting("FUNC:RAMP:SYMM", float, unit="percent", low=0.0, high=100.0)
    frequency = drive.frequency_setting(60e6, digits=7)
    amplitude = drive.amplitude_setting(2e-3)
    offset = drive.offset_setting(digits=7)
    load = drive.LoadSetting("OUTP1:LOAD", float, unit="ohm", low=1.0, high=INFINITY)
    output = drive.OutputSwitch("OUTP1", bool)
    burst_mode = drive.burst_word("BURS:MODE", "TRIGgered", "INFinity", "GATed")
    burst_phase = drive.burst_setting("BURS:PHAS", 0.0, 360.0, unit="deg")
    #: The guides print an answer of this one in either form.
    burst_cycles = drive.burst_setting("BURS:NCYC", 1.0, 1e6, form=Form(r"\d+|\d\.\d{6}E[+-]\d{2}", "10"))
    trigger_source = drive.burst_word("BURS:TRIG:SOUR", "INTernal", "EXTernal", "MANual")
    trigger_slope = drive.burst_word("BURS:TRIG:SLOP", "POSitive", "NEGative")
    trigger_delay = drive.burst_setting("BURS:TDEL", 0.0, 85.0, unit="s")

    def field_of(self, answer: str, header: str, key: str) -> str:
        """Return the answer, ON and OFF as 1 and 0."""
        return {"ON": "1", "OFF": "0"}.get(answer, answer)

"""A virtual DG1062Z, or another generator of Rigol's DG1000Z and DG800 series: what a drive needs of it.

Sources: see the driver; answers of ``APPLy?`` as in PyMeasure's tests of its DG800; after ``*RST`` a sine of 1 kHz and
5 Vpp at high impedance.  Assumed: a number beyond its limits becomes the limit, with an entry in the error queue, and
``APPLy`` leaves the output as it is; DG800 Programming Guide, pages 2-60 to 2-65 (``:BURSt``).  Modulation, sweeps,
endless bursts and arbitrary waveforms are missing.
"""

import math
from dataclasses import replace
from typing import ClassVar

from instruments.virtual.core.parser import ScpiError, Value
from instruments.virtual.core.rows import Both, Row, Switch, Word
from instruments.virtual.generator.channel import INFINITE, Family, Waveform
from instruments.virtual.generator.generator import VirtualGenerator
from instruments.virtual.generator.rows import CHANNEL, Quantity, burst_cycles, pulses, waveforms


def _family(sine: float, square: float) -> Family:
    """Return a series with these highest frequencies of sine and square [Hz]."""
    return Family(
        waveforms=(
            Waveform("SINusoid", sine, crest=2 * math.sqrt(2)),
            Waveform("SQUare", square),
            Waveform("RAMP", 1e6, crest=2 * math.sqrt(3)),
            Waveform("PULSe", square),
            Waveform("NOISe", sine, crest=6.6),
            Waveform("DC", sine),
        ),
        square=lambda frequency: (max(0.01, 1.6e-6 * frequency), min(99.99, 100 - 1.6e-6 * frequency)),
        least_vpp=1e-3,
        shortest_pulse=16e-9,
        shortest_edge=10e-9,
        longest_burst=500.0,
        burst_rest=1e-6,
    )


DG1062Z, DG832 = _family(60e6, 25e6), _family(35e6, 10e6)

_BURST, _SOURCES = "[SOURce[n]:]BURSt", "INTernal EXTernal MANual"

#: The rows that this language shares with Keysight's; the settings of the others stay as they are after ``*RST``.
_SHARED = (
    *("FREQuency[:CW|:FIXed]", "PHASe[:ADJust]", "SQUare:DCYCle", "RAMP:SYMMetry", "[:AMPLitude]"),
    *("VOLTage:UNIT", "[:IMMediate]:OFFSet", "[:IMMediate]:HIGH", "[:IMMediate]:LOW", "APPLy", "[FUNCtion:]PULSe"),
    *("OUTPut[n][:STATe]", "OUTPut[n]:LOAD", "OUTPut[n]:POLarity", "BURSt:STATe", "BURSt:INTernal:PERiod"),
)


def _as_rigol(row: Row) -> Row:
    """Return a shared row with this maker's answers and defaults."""
    if isinstance(row, Switch):
        return replace(row, words=("OFF", "ON"))
    if isinstance(row, Both) and row.keeps == ("{n}:amplitude_vpp", 0.1):
        return replace(row, keeps=("{n}:amplitude_vpp", 5.0))
    if isinstance(row, Quantity) and row.name == "{n}:load":
        return replace(row, default=INFINITE)
    return row


_OWN = tuple(_as_rigol(row) for row in CHANNEL if row.header.endswith(_SHARED) or "[FUNCtion:]PULSe" in row.header)
_CHANNEL: tuple[Row, ...] = (
    *waveforms(DG1062Z),
    *pulses((40e-9, 1e6), (10e-9, 1.0), 20e-9),
    *_OWN,
    *(
        replace(row, header="OUTPut[n]:IMPedance", alias=True)
        for row in _OWN
        if isinstance(row, Quantity) and row.name == "{n}:load"
    ),
    Switch("OUTPut[n]:SYNC[:STATe]", "{n}:sync", default=True, words=("OFF", "ON")),
    Word(f"{_BURST}:MODE", "{n}:burst_mode", "TRIGgered GATed"),
    Word(f"{_BURST}:GATE:POLarity", "{n}:gate_polarity", "NORMal INVerted"),
    Quantity(f"{_BURST}:PHASe", "{n}:burst_phase", 0.0, (0.0, 360.0), "DEG"),
    burst_cycles(1e6),
    Word(f"{_BURST}:TRIGger:SOURce", "{n}:trigger_source", _SOURCES, default="INT"),
    Word(f"{_BURST}:TRIGger:SLOPe", "{n}:trigger_slope", "POSitive NEGative"),
    Quantity(f"{_BURST}:TDELay", "{n}:trigger_delay", 0.0, (0.0, 85.0), "S"),
)
#: What the language of the other rows is about, off.
_OFF: dict[str, Value] = {
    "{n}:sweep_time": 1.0,
    **{name: value for row in CHANNEL if _as_rigol(row) not in _OWN for name, value in row.defaults().items()},
}


class VirtualDG1000Z(VirtualGenerator):
    """A DG1062Z: two channels, 60 MHz."""

    identity = "Rigol Technologies,DG1062Z,VIRTUAL,03.01.12"
    family = DG1062Z
    no_error = '0,"No error"'
    numbered = (1, 2)
    CHANNEL_ROWS: ClassVar = _CHANNEL
    DEFAULTS: ClassVar = {
        **{name.format(n=n): value for n in (1, 2) for name, value in _OFF.items()},
    }

    def spell(self, value: float) -> str:
        """Return a number with seven digits: 1.000000E+02."""
        return f"{value:.6E}"

    def apply(self, n: int, waveform: str, parameters: list[str]) -> None:
        """See the base; the phase is the fourth number, noise has no frequency and DC a voltage alone."""
        if len(parameters) > (2 if waveform == "NOIS" else 4):
            raise ScpiError(-108)
        given = {"NOIS": ["DEF", *parameters], "DC": ["DEF", "DEF", *parameters[2:3]]}.get(waveform, parameters)
        on = self.channel(n)["output"]
        super().apply(n, waveform, given[:3])
        self.channel(n)["output"] = on
        self.channel(n)["phase"] = self.channel(n).read(given[3], 0.0, 360.0, 0.0) if len(given) > 3 else 0.0
        self.on_change(f"{n}:output")

    def ask_apply(self, n: int) -> str:
        """APPLy?: waveform, frequency, amplitude, offset, phase; DEF where the waveform has none."""
        channel = self.channel(n)
        word = str(channel["waveform"])
        numbers = [self.spell(channel.number(name)) for name in ("frequency", "amplitude_vpp", "offset", "phase")]
        if word == "NOIS":
            numbers = ["DEF", *numbers[1:3], "DEF"]
        elif word == "DC":
            numbers = ["DEF", "DEF", numbers[2]]
        return f'"{",".join([{"PULS": "PULSE", "NOIS": "NOISE"}.get(word, word), *numbers])}"'

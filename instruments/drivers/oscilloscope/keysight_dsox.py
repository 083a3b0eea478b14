"""The driver of Keysight's oscilloscopes."""

from collections.abc import Iterator, Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from instruments.drivers import Value
from instruments.drivers.oscilloscope import Preamble
from instruments.drivers.oscilloscope.scope import TRIGGER_MODES, TRIGGER_SOURCES, Scope
from instruments.drivers.oscilloscope.setup import SLOPES, Channel, Setup
from instruments.drivers.setting import Setting
from instruments.errors import OutOfRange
from instruments.ieee488 import NR1, Form

#: Programmer's Guides, <NR3>: a sign, one to three digits, with or without a point, an exponent of two or three digits.
_NUMBER = Form(r"[+-]\d{1,3}(\.\d{1,12})?E[+-]\d{2,3}", "+1.25000E-01")


class _KeysightChannel(Channel):
    """An input of an InfiniiVision scope."""

    NUMBER: ClassVar[Form] = _NUMBER

    display = Setting("DISP", bool)
    inverted = Setting("INV", bool)
    probe_factor = Setting("PROB", float, low=0.1, high=1e4)
    coupling = Setting("COUP", str, choices=("AC", "DC"))
    #: A probe of less than 1:1 makes it smaller.
    scale = Setting("SCAL", float, unit="V", low=5e-4, high=1e5, span=(1e-5, 1e5))
    offset = Setting("OFFS", float, unit="V", low=-1e5, high=1e5)


class KeysightDSOX(Scope):
    """Keysight (Agilent) InfiniiVision 1000 and 2000 X-Series: DSOX1102G, EDUX1002A, MSO-X 2024A and others.

    Source: Programmer's Guides of the InfiniiVision X-Series; PyMeasure's driver and its suite for a real DSOX1102G.

    - The guide's way for a trigger that may not come: `:SINGle`, then the operation register until its bit 3 (run) is
      gone, `:AER?` telling that the scope was armed at all.  `:DIGitize` would block the link until a device clear.
    - The record is as long as the screen, ten divisions, and has up to a million points (2000 X-Series without
      the memory option: 100 000); `:WAV:POIN` thins it out.
    - ``*RST`` sets the probe to 10:1: without a probe every voltage would read ten times too large.
    - V = (code − yreference)·yincrement + yorigin; code 0 is "no sample", 1 and 255 are clipped.
    """

    MODELS: ClassVar[str] = r"(DSO|MSO|EDU)-?X ?[12]\d{3}[A-Z]*"
    NUMBER: ClassVar[Form] = _NUMBER
    #: Format, type, points, count; distance, first and reference of the times; the same of the voltages.
    PREAMBLE = (NR1, NR1, NR1, NR1, _NUMBER, _NUMBER, NR1, _NUMBER, _NUMBER, NR1)
    CHANNEL = _KeysightChannel
    WHILE_SETTING_UP = ":STOP"
    CODES = (1, 255, 0)
    SLOPES: ClassVar[Mapping[str, str]] = SLOPES | {"either": "EITH"}
    SWEEPS: ClassVar[Mapping[str, str]] = {"normal": "NORM", "single": "NORM", "auto": "AUTO"}

    time_mode = Setting(":TIM:MODE", str, choices=("MAIN", "WINDow", "XY", "ROLL"))
    trigger_mode = Setting(":TRIG:MODE", str, choices=TRIGGER_MODES)
    trigger_source = Setting(":TRIG:EDGE:SOUR", str, choices=TRIGGER_SOURCES)
    trigger_level = Setting(":TRIG:EDGE:LEV", float, unit="V", low=-1e5, high=1e5)
    time_range = Setting(":TIM:RANG", float, unit="s", low=50e-9, high=500.0)
    time_position = Setting(":TIM:POS", float, unit="s", low=-500.0, high=500.0)
    time_reference = Setting(":TIM:REF", str, choices=("LEFT", "CENTer", "RIGHt"))
    acquisition_type = Setting(":ACQ:TYPE", str, choices=("NORMal", "AVERage", "HRESolution", "PEAK"))
    trigger_slope = Setting(":TRIG:EDGE:SLOP", str, choices=("POSitive", "NEGative", "EITHer", "ALTernate"))
    sweep = Setting(":TRIG:SWE", str, choices=("AUTO", "NORMal"))

    _RUNNING = 8
    #: Points that can be asked for.
    _POINTS = (*(m * 10**k for k in range(2, 6) for m in (1, 2, 5)), 1_000_000)
    _points = 1000

    def _times(self, setup: Setup) -> dict[str, Value]:
        """Return the settings of a record that is as long as was asked for."""
        address = self.transport.address
        if not 50e-9 <= setup.duration_s <= 500:
            raise OutOfRange(address, "duration_s", setup.duration_s, "50e-9 to 500 s")
        if not 1 <= setup.points <= self._POINTS[-1]:
            raise OutOfRange(address, "points", setup.points, f"1 to {self._POINTS[-1]}")
        self._points = next(p for p in self._POINTS if p >= setup.points)
        self._duration = setup.duration_s
        return {
            "time_reference": "CENT",
            "time_range": setup.duration_s,
            "time_position": 0.0,
            "acquisition_type": "NORM",
        }

    def _start(self) -> None:
        self._register(":AER?", most=1)  # reading it forgets an earlier arming
        self.command(":SING")
        self._armed = False

    def _complete(self) -> bool:
        self._armed = self._armed or bool(self._register(":AER?", most=1))
        running = self._register(":OPER:COND?", most=0x7FFF) & self._RUNNING
        return self._armed and not running

    def _register(self, question: str, *, most: int) -> int:
        answer = self.transport.query(question)
        if not NR1.matches(answer) or not 0 <= int(answer) <= most:
            self.reject(question, answer, f"a whole number from 0 to {most}")
        return int(answer)

    def _select(self, channel: int) -> None:
        self.command(f":WAV:SOUR CHAN{channel}")
        self.command(":WAV:FORM BYTE")
        self.command(":WAV:UNS 1")
        self.command(":WAV:POIN:MODE RAW")
        self.command(f":WAV:POIN {self._points}")

    def _read_preamble(self, numbers: list[float]) -> Preamble:
        _, _, points, _, dt, t0, _, per_code, origin, reference = numbers
        return Preamble(int(points), dt, t0, per_code, origin - reference * per_code)

    def _pieces(self, preamble: Preamble) -> Iterator[NDArray[np.uint8]]:
        yield self._block(preamble.points)

"""The driver of Rigol's oscilloscopes."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from instruments.drivers import Value
from instruments.drivers.oscilloscope import Preamble
from instruments.drivers.oscilloscope.scope import TRIGGER_MODES, TRIGGER_SOURCES, Scope
from instruments.drivers.oscilloscope.setup import SLOPES, Channel, Setup, time_scales
from instruments.drivers.setting import Setting
from instruments.errors import OutOfRange
from instruments.ieee488 import NR1, Form

#: Programming Guide, "scientific notation": six digits behind the point, two of exponent, a sign where it is negative.
_NUMBER = Form(r"-?\d\.\d{6}[Ee][+-]\d{2}", "2.500000e-01")

#: Points of the memory for one channel; two share it, more have a quarter each.
_DEPTHS = (12_000, 120_000, 1_200_000, 12_000_000, 24_000_000)
_SHARED_DEPTHS = sorted({depth // share for depth in _DEPTHS for share in (1, 2, 4)})


@dataclass(eq=False)
class _Depth(Setting[str]):
    """A depth of the memory, or AUTO.  Some firmware prints the number with an exponent."""

    def _parse(self, answer: str, form: Form) -> bool | float | str:
        return super()._parse(f"{form.number(answer):.0f}" if form.matches(answer) else answer, form)


class _RigolChannel(Channel):
    """An input of a DS1000Z."""

    NUMBER: ClassVar[Form] = _NUMBER

    display = Setting("DISP", bool)
    inverted = Setting("INV", bool)
    #: The guide prints it with six digits; other firmware may print it short, which is not confirmed.
    probe_factor = Setting(
        *("PROB", float),
        low=0.01,
        high=1000.0,
        form=Form(rf"{_NUMBER.pattern}|\+?([125]0{{0,3}}|0\.0?[125])|\+[125]\.0{{1,5}}[Ee][+-]0[0-3]", "10"),
    )
    coupling = Setting("COUP", str, choices=("AC", "DC", "GND"))
    #: A probe of less than 1:1 makes it smaller.
    scale = Setting("SCAL", float, unit="V", low=1e-3, high=1e4, span=(1e-5, 1e4))
    offset = Setting("OFFS", float, unit="V", low=-1e5, high=1e5)


class RigolDS1000Z(Scope):
    """Rigol DS1000Z and MSO1000Z: DS1054Z, DS1104Z Plus, MSO1104Z, DS1202Z-E and others.

    Source: MSO1000Z/DS1000Z Programming Guide as public drivers quote it (ds1054z, PyMeasure's DS1000Z).

    - The screen has twelve divisions; time and volts per division go in steps of 1, 2, 5 (volts: any value).
    - The memory has 12 000 · 10ⁿ or 24 million points for one channel, half for two, a quarter for more, and can be
      read only when the scope has stopped, 250 000 bytes at a time.
    - Code 127 is the middle of the screen, 25 codes are a division; V = (code − yorigin − yreference)·yincrement.
    - ``:CHAN1:OFFS`` is added to the trace: what is in the middle of the screen is its negative.
    - Before a record is complete `:TRIG:STAT?` answers RUN, WAIT, TD or AUTO, then STOP; it may still say STOP when it
      is asked just after `:SINGle`, so STOP counts once another word was heard or a while has gone by.
    """

    MODELS: ClassVar[str] = r"(DS|MSO)1\d{3}Z.*"
    NUMBER: ClassVar[Form] = _NUMBER
    #: Format, type, points, count; distance, first and reference of the times; the same of the voltages.
    PREAMBLE = (NR1, NR1, NR1, NR1, _NUMBER, _NUMBER, NR1, _NUMBER, NR1, NR1)
    CHANNEL = _RigolChannel
    OFFSET_SIGN = -1.0
    COLUMNS = 12
    TIME_SCALES: ClassVar[tuple[float, ...]] = time_scales(5e-9, 50.0)
    FORCE = ":TFOR"
    #: Some firmware takes no memory depth when it has stopped.
    WHILE_SETTING_UP = ":RUN"
    SLOPES: ClassVar[Mapping[str, str]] = SLOPES | {"either": "RFAL"}
    SWEEPS: ClassVar[Mapping[str, str]] = {"normal": "NORM", "single": "SING", "auto": "AUTO"}
    #: `:SINGle` does that.
    CHANGED_BY_ACQUIRE: ClassVar[Mapping[str, str]] = {"sweep": "SING"}

    time_mode = Setting(":TIM:MODE", str, choices=("MAIN", "WINDow", "XY", "ROLL"))
    trigger_mode = Setting(":TRIG:MODE", str, choices=TRIGGER_MODES)
    trigger_source = Setting(":TRIG:EDGE:SOUR", str, choices=TRIGGER_SOURCES)
    trigger_level = Setting(":TRIG:EDGE:LEV", float, unit="V", low=-1e5, high=1e5)
    time_scale = Setting(":TIM:SCAL", float, unit="s", low=5e-9, high=50.0)
    time_offset = Setting(":TIM:OFFS", float, unit="s", low=-300.0, high=5000.0)
    memory_depth = _Depth(":ACQ:MDEP", str, choices=("AUTO", *map(str, _SHARED_DEPTHS)))
    acquisition_type = Setting(":ACQ:TYPE", str, choices=("NORMal", "AVERages", "PEAK", "HRESolution"))
    trigger_slope = Setting(":TRIG:EDGE:SLOP", str, choices=("POSitive", "NEGative", "RFALl"))
    sweep = Setting(":TRIG:SWE", str, choices=("AUTO", "NORMal", "SINGle"))

    #: Points of one block; how long a STOP may be an old one [s].
    _LONGEST_BLOCK = 250_000
    _SETTLED = 0.2

    def _times(self, setup: Setup) -> dict[str, Value]:
        """Choose twelve divisions of 1, 2 or 5 · 10ⁿ s: up to 2.5 times the duration that was asked for."""
        scale = self._time_scale(setup.duration_s)
        depth = self._depth(setup.points, len(setup.shown))
        return {"time_scale": scale, "time_offset": 0.0, "acquisition_type": "NORM", "memory_depth": str(depth)}

    def _depth(self, points: int, shown: int) -> int:
        share = {1: 1, 2: 2}.get(shown, 4)
        found = next((depth // share for depth in _DEPTHS if depth // share >= points), None)
        if found is None or points < 1:
            raise OutOfRange(self.transport.address, "points", points, f"1 to {_DEPTHS[-1] // share}")
        return found

    def _start(self) -> None:
        self.command(":SING")
        self._seen = False

    def _complete(self) -> bool:
        status = self.transport.query(":TRIG:STAT?")
        if status not in {"TD", "WAIT", "RUN", "AUTO", "STOP"}:
            self.reject(":TRIG:STAT?", status, "TD, WAIT, RUN, AUTO or STOP")
        if status == "STOP":
            return self._seen or self.clock.now() - self._started >= self._SETTLED
        self._seen = True
        if status == "WAIT":
            self._force_trigger()
        return False

    def _select(self, channel: int) -> None:
        self.command(f":WAV:SOUR CHAN{channel}")
        self.command(":WAV:MODE RAW")
        self.command(":WAV:FORM BYTE")

    def _read_preamble(self, numbers: list[float]) -> Preamble:
        _, _, points, _, dt, t0, _, per_code, origin, reference = numbers
        return Preamble(int(points), dt, t0, per_code, -(origin + reference) * per_code)

    def _pieces(self, preamble: Preamble) -> Iterator[NDArray[np.uint8]]:
        for first in range(1, preamble.points + 1, self._LONGEST_BLOCK):
            last = min(preamble.points, first + self._LONGEST_BLOCK - 1)
            self.transport.write(f":WAV:STAR {first}")
            self.transport.write(f":WAV:STOP {last}")
            yield self._block(last - first + 1)

"""The driver of Tektronix's teaching oscilloscopes: TDS1000, TDS2000, TBS1000."""

from collections.abc import Iterator, Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from instruments.drivers import Value
from instruments.drivers.oscilloscope import Preamble
from instruments.drivers.oscilloscope.scope import Scope
from instruments.drivers.oscilloscope.setup import Channel, Setup, time_scales
from instruments.drivers.setting import Setting
from instruments.errors import CommandRefused, OutOfRange
from instruments.ieee488 import NR1, Form

#: "1.0E0", "2.5E-3", "-1.25E-8": no zero that need not be, in the exponent neither.
_NUMBER = Form(r"-?\d\.\d{1,9}E-?\d{1,2}", "2.5E-3")
#: Points of every record; codes of a division, and the middle of the screen as a byte from 0 on.
_POINTS, _CODES, _MIDDLE = 2500, 25, 128
#: *ESR?: query, device, execution and command error.
_ERRORS = 0b0011_1100
#: Fields of WFMPre?, by their places: the format that was asked for, then numbers.
_FORMAT = ("1", "8", "BIN", "RI", "MSB", str(_POINTS))
_WFID, _STEP, _START, _PER_CODE, _ZERO, _OFFSET, _FIELDS = 6, 8, 10, 12, 13, 14, 16


def _value(answer: str) -> str:
    """Return the value of an answer, without the header that there may be again after a reset."""
    return answer.partition(" ")[2] if answer.startswith(":") else answer


class _TektronixChannel(Channel):
    """An input of a TDS2000."""

    HEAD: ClassVar[str] = "CH{}:"
    NUMBER: ClassVar[Form] = _NUMBER

    display = Setting("SEL", bool)
    inverted = Setting("INV", bool)
    probe_factor = Setting(
        *("PRO", float),
        values=(1.0, 10.0, 20.0, 50.0, 100.0, 500.0, 1000.0),
        form=Form(rf"{_NUMBER.pattern}|[125]0{{0,3}}", "10"),
    )
    coupling = Setting("COUP", str, choices=("AC", "DC", "GND"))
    scale = Setting("SCA", float, unit="V", low=2e-3, high=5e3)
    #: Of 0 V, upwards from the middle of the screen.
    position = Setting("POS", float, unit="div", low=-1e3, high=1e3, resolution=1 / _CODES)

    def header_in_use(self, header: str) -> str:
        """Return the header with the name of the input; that of the display has it at its end."""
        return f"SEL:CH{self.number}" if header == "SEL" else super().header_in_use(header)

    def field_of(self, answer: str, header: str, key: str) -> str:
        """Return the value; that of a switch, which is ON or OFF, as 1 or 0."""
        value = _value(answer)
        return {"ON": "1", "OFF": "0"}.get(value, "") if header == "INV" else value


class TektronixTDS2000(Scope):
    """Tektronix TDS1000, TDS2000 and TBS1000, with B, C and EDU: TDS2012B, TDS2024C, TBS1052B-EDU and others.

    Sources: TDS200, TDS1000/2000, TDS1000B/2000B, TDS2000C, TPS2000 Programmer Manual (2-69 DATa:ENCdg, 2-178
    TRIGger:STATE, 2-187 WFMPre:PT_Fmt); a preamble that a user read from a TDS2024C; public drivers.

    - A record has 2500 points, whatever number is asked for, on ten divisions of 1, 2.5 or 5 · 10ⁿ s.
    - An answer has a header until ``HEADer OFF``, which the driver sends first.
    - There is no error queue by SCPI's name: ``*ESR?`` says whether there was an error, ``ALLEv?`` which.
    - A single record: ``ACQuire:STOPAfter SEQuence``, ``ACQuire:STATE RUN``, until ``ACQuire:STATE?`` is 0.
    - V = (code − YOFf)·YMUlt + YZEro, code a signed byte, 25 of them a division.  The trace is moved in divisions.
    - Its edge trigger knows rising and falling, and not both.
    """

    MODELS: ClassVar[str] = r"TDS ?[12]0\d\d[BC]?(-EDU|-SC)?|TBS ?1\d{3}B?(-EDU)?"
    NUMBER: ClassVar[Form] = _NUMBER
    CHANNEL = _TektronixChannel
    SOURCE = "CH{}"
    STOP = "ACQ:STATE STOP"
    MAIN: ClassVar[Mapping[str, Value]] = {"time_view": "MAI"}
    EDGE: ClassVar[Mapping[str, Value]] = {"trigger_type": "EDGE"}
    WHILE_SETTING_UP = "ACQ:STATE STOP"
    COLUMNS = 10
    TIME_SCALES: ClassVar[tuple[float, ...]] = time_scales(5e-9, 50.0, (1, 2.5, 5))
    SLOPES: ClassVar[Mapping[str, str]] = {"rising": "RIS", "falling": "FALL"}
    SWEEPS: ClassVar[Mapping[str, str]] = {"normal": "NORM", "single": "NORM", "auto": "AUTO"}

    time_view = Setting("HOR:VIEW", str, choices=("MAIn", "WINDOW", "ZONE"))
    time_scale = Setting("HOR:MAI:SCA", float, unit="s", low=2.5e-9, high=50.0)
    time_offset = Setting("HOR:MAI:POS", float, unit="s", low=-500.0, high=500.0)
    acquisition_type = Setting("ACQ:MOD", str, choices=("SAMple", "PEAKdetect", "AVErage"))
    trigger_type = Setting("TRIG:MAI:TYP", str, choices=("EDGE", "VIDeo", "PULse"))
    trigger_source = Setting(
        "TRIG:MAI:EDGE:SOU", str, choices=("CH1", "CH2", "CH3", "CH4", "EXT", "EXT5", "EXT10", "LINE", "AC LINE")
    )
    trigger_slope = Setting("TRIG:MAI:EDGE:SLO", str, choices=("RISe", "FALL"))
    trigger_level = Setting("TRIG:MAI:LEV", float, unit="V", low=-1e5, high=1e5)
    sweep = Setting("TRIG:MAI:MOD", str, choices=("AUTO", "NORMal"))

    def forget_errors(self) -> None:
        """Ask for answers without headers, and empty the event queue."""
        self.transport.write("HEAD OFF")
        super().forget_errors()

    def raise_errors(self, after: str) -> None:
        """Raise CommandRefused with the texts of the event queue, if the event register has an error."""
        answer = self.transport.query("*ESR?")
        if not NR1.matches(answer) or not 0 <= int(answer) <= 0xFF:
            self.reject("*ESR?", answer, "a whole number from 0 to 255")
        if int(answer) & _ERRORS:
            raise CommandRefused(self.transport.address, after, (self.transport.query("ALLEV?"),))

    def field_of(self, answer: str, header: str, key: str) -> str:
        """See `_value`."""
        return _value(answer)

    # --- preparing ---

    def _times(self, setup: Setup) -> dict[str, Value]:
        """Choose ten divisions of 1, 2.5 or 5 · 10ⁿ s: up to 2.5 times the duration that was asked for."""
        if setup.points < 1:
            raise OutOfRange(self.transport.address, "points", setup.points, f"1 on; there are always {_POINTS}")
        scale = self._time_scale(setup.duration_s)
        return {"time_scale": scale, "time_offset": 0.0, "acquisition_type": "SAM"}

    def _scaling(self, setup: Setup) -> dict[str, Value]:
        wanted = super()._scaling(setup)
        del wanted["offset"]
        return wanted | {"position": 0.0 - setup.offset_v / setup.volts_per_division}

    # --- acquiring ---

    def _start(self) -> None:
        self.command("ACQ:STOPA SEQ")
        self.command("ACQ:STATE RUN")

    def _complete(self) -> bool:
        answer = _value(self.transport.query("ACQ:STATE?"))
        if answer not in {"0", "1"}:
            self.reject("ACQ:STATE?", answer, "0 or 1")
        return answer == "0"

    # --- reading ---

    def preamble(self, channel: int) -> Preamble:
        """Read the preamble of one channel's record; see the base.  Its scales must be those that were set."""
        self._check_readable(channel)
        for command in (f"DAT:SOU CH{channel}", "DAT:ENC RIB", "DAT:WID 1", "DAT:STAR 1", f"DAT:STOP {_POINTS}"):
            self.command(command)
        answer = self.transport.query("WFMP?")
        fields = answer.split(";")
        try:
            step, start, per_code, zero, offset = (
                _NUMBER.number(fields[place]) for place in (_STEP, _START, _PER_CODE, _ZERO, _OFFSET)
            )
            whole = len(fields) == _FIELDS and tuple(fields[: len(_FORMAT)]) == _FORMAT
        except (ValueError, IndexError):
            whole = False
        if not (whole and fields[_WFID].startswith(f'"Ch{channel},') and self._is_as_set(step, per_code)):
            self.reject(
                "WFMP?", answer, f"16 fields of a record of Ch{channel}, 1;8;BIN;RI;MSB;{_POINTS};…, as it was set"
            )
        return Preamble(_POINTS, step, start, per_code, zero - (offset + _MIDDLE) * per_code)

    def _is_as_set(self, step: float, per_code: float) -> bool:
        """Return whether the scales of a record are those that were prepared, to 1 %."""
        wanted = (
            (step, self._duration / _POINTS),
            (per_code, self._setup.volts_per_division / _CODES if self._setup else 0),
        )
        return all(abs(is_ - was) <= 0.01 * was for is_, was in wanted)

    def _pieces(self, preamble: Preamble) -> Iterator[NDArray[np.uint8]]:
        yield np.bitwise_xor(self._block(preamble.points, "CURV?"), np.uint8(_MIDDLE))

"""The driver of Siglent's SDS1000X-E oscilloscopes."""

import struct
from collections.abc import Iterator, Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from instruments.drivers import Value
from instruments.drivers.oscilloscope import Preamble
from instruments.drivers.oscilloscope.scope import Scope
from instruments.drivers.oscilloscope.setup import SLOPES, Channel, Setup, time_scales
from instruments.drivers.scpi import ScpiInstrument
from instruments.drivers.setting import Setting
from instruments.errors import BadAnswer, OutOfRange
from instruments.ieee488 import NR1, BlockForm, Form

#: "1.00E+00V", "-6.00E-01V": as it was measured; other firmware may print more digits.
_VOLTAGE, _TIME = (Form(r"-?\d\.\d{2,6}E[+-]\d{2}", f"5.00E-01{unit}", suffix=unit) for unit in "VS")
#: The factor of a probe: "10", "0.1".
_FACTOR = Form(r"(0|[1-9]\d{0,4})(\.\d{1,3})?", "10")
#: Points of the memory where one channel of a pair (1 and 2, 3 and 4) is on; half where both are.
_DEPTHS = {"14K": 14_000, "140K": 140_000, "1.4M": 1_400_000, "14M": 14_000_000}
_HALVES = {"7K": 7_000, "70K": 70_000, "700K": 700_000, "7M": 7_000_000}
_CODES_PER_DIVISION = 25
#: Code 0 of the wire, a signed byte, is the middle of the screen: here it is 128.
_MIDDLE = 128
#: "C1:WF DAT2,#9…", and two line feeds at the end.
_BLOCK = BlockForm(longest_head=16, ends=2)
#: Bytes of WAVEDESC; in it, as its lower byte first: points that are sent, V per division and offset, s per point.
_DESCRIPTOR, _COUNT, _VOLTS, _STEP = 346, 116, 156, 176


def _after_header(answer: str, header: str) -> str:
    """Return the text behind the header of an answer.  Raises ValueError for another header."""
    head, blank, rest = answer.partition(" ")
    if head.upper() != header.upper() or not blank:
        raise ValueError(answer)
    return rest


class _SiglentChannel(Channel):
    """An input of an SDS1000X-E."""

    HEAD: ClassVar[str] = "C{}:"
    HAS_ERROR_QUEUE = False

    display = Setting("TRA", bool)
    inverted = Setting("INVS", bool)
    probe_factor = Setting("ATTN", float, low=0.1, high=1e4, form=_FACTOR)
    coupling = Setting("CPL", str, choices=("D1M", "A1M", "GND"))
    #: A probe of less than 1:1 makes it smaller.
    scale = Setting("VDIV", float, unit="V", form=_VOLTAGE, low=5e-4, high=1e5, span=(1e-5, 1e5), suffix="V")
    offset = Setting("OFST", float, unit="V", form=_VOLTAGE, low=-1e5, high=1e5, suffix="V")

    def field_of(self, answer: str, header: str, key: str) -> str:
        """Return the text behind the header; a switch as 0 or 1."""
        text = _after_header(answer, self.header_in_use(header))
        return {"ON": "1", "OFF": "0"}.get(text, text)


def _single(value: float) -> float:
    """Return a number that came in single precision, which has seven digits: 0.2 instead of 0.20000000298."""
    return float(f"{value:.7g}")


class SiglentSDS1000XE(Scope):
    """Siglent SDS1000X-E and X-U: SDS1104X-E, SDS1204X-E, SDS1202X-E and others.

    Source: what users of an SDS1204X-E measured on it and wrote down; Siglent's Digital Oscilloscopes Programming
    Guide as that page and public drivers quote it.

    - The dialect is LeCroy's.  Answers have headers (``C1:VDIV 5.00E-01V``), so the answer to another question is
      recognised; the driver sets CHDR SHORT, as it is after a reset.
    - There is no error queue that all firmware has: each setting is asked for after it was sent.
    - The screen has fourteen divisions of 1, 2 or 5 · 10ⁿ s, and the record fills it.
    - The guide's MSIZ sets the points of the memory, while stopped; the measured firmware ignores it without a word.
      The driver sends it, and reads as many points as there are: 14 million over a slow link take their time.
    - A single record: ``TRMD SINGLE``, ``INR?`` to forget the one before, ``ARM``, then ``INR?`` until its bit 0 is
      set.  Not `SAST?`, which the measured firmware did not always answer.
    - V = code · scale / 25 − offset, code a signed byte, 0 in the middle of the screen; scale, offset, points and their
      distance are in WAVEDESC (``WF? DESC``).  What stands in the middle of the screen is the negative offset.
    """

    MODELS: ClassVar[str] = r"SDS1\d{3}X-[EU]"
    HAS_ERROR_QUEUE = False
    CHANNEL = _SiglentChannel
    SOURCE = "C{}"
    STOP = "TRMD STOP"
    MAIN: ClassVar[Mapping[str, Value]] = {}
    EDGE: ClassVar[Mapping[str, Value]] = {}
    OFFSET_SIGN = -1.0
    COLUMNS = 14
    TIME_SCALES: ClassVar[tuple[float, ...]] = time_scales(1e-9, 100.0)
    FORCE = "FRTR"
    WHILE_SETTING_UP = "TRMD STOP"
    #: That WINDOW triggers on both slopes is inferred from the front panel's three choices.
    SLOPES: ClassVar[Mapping[str, str]] = SLOPES | {"either": "WINDOW"}
    #: It acquires in acquire() alone.
    SWEEPS: ClassVar[Mapping[str, str]] = {"normal": "STOP", "single": "STOP", "auto": "STOP"}
    #: While it waits for its trigger; then it is STOP again.
    CHANGED_BY_ACQUIRE: ClassVar[Mapping[str, str]] = {"sweep": "SINGLE"}
    COUPLINGS: ClassVar[Mapping[str, str]] = {"DC": "D1M", "AC": "A1M"}

    sweep = Setting("TRMD", str, choices=("AUTO", "NORM", "SINGLE", "STOP"))
    time_scale = Setting("TDIV", float, unit="s", form=_TIME, low=1e-9, high=100.0, suffix="S")
    time_offset = Setting("TRDL", float, unit="s", form=_TIME, low=-1e4, high=1e4, suffix="S")
    memory_depth = Setting("MSIZ", str, choices=(*_DEPTHS, *_HALVES))
    acquisition_type = Setting("ACQW", str, choices=("SAMPLING", "PEAK_DETECT", "AVERAGE", "HIGH_RES"))
    trigger_source = Setting("TRSE", str, key="EDGE,SR", choices=("C1", "C2", "C3", "C4", "EX", "EX5", "LINE"))
    trigger_slope = Setting("TRSL", str, choices=("POS", "NEG", "WINDOW"))
    trigger_level = Setting("TRLV", float, unit="V", form=_VOLTAGE, low=-1e5, high=1e5, suffix="V")

    def header_in_use(self, header: str) -> str:
        """Return the header; level and slope have that of the trigger's source."""
        if header not in {"TRLV", "TRSL"}:
            return header
        return f"C{self._setup.trigger_source if self._setup else 1}:{header}"

    def field_of(self, answer: str, header: str, key: str) -> str:
        """Return the value behind the header: ``TRSE EDGE,SR,C1,HT,OFF`` says that the source is C1."""
        rest = _after_header(answer, self.header_in_use(header))
        if not key:
            return rest.partition(",")[0]
        if not rest.startswith(f"{key},"):
            raise ValueError(answer)  # a trigger of another kind
        return rest.removeprefix(f"{key},").partition(",")[0]

    def forget_errors(self) -> None:
        """Ask for answers with headers; there is no error queue."""
        self.transport.write("CHDR SHORT")

    # --- preparing ---

    def _times(self, setup: Setup) -> dict[str, Value]:
        """Choose fourteen divisions of 1, 2 or 5 · 10ⁿ s: up to 2.5 times the duration that was asked for."""
        if not 1 <= setup.points <= max(_DEPTHS.values()):
            raise OutOfRange(self.transport.address, "points", setup.points, f"1 to {max(_DEPTHS.values())}")
        scale = self._time_scale(setup.duration_s)
        return {"time_scale": scale, "time_offset": 0.0, "acquisition_type": "SAMPLING"}

    def _scaling(self, setup: Setup) -> dict[str, Value]:
        return super()._scaling(setup) | {"coupling": self.COUPLINGS[setup.coupling]}

    def _apply(self, part: ScpiInstrument, wanted: Mapping[str, Value]) -> None:
        super()._apply(part, wanted)
        if part is self and self._setup:
            shown = set(self._setup.shown)
            depths = _HALVES if {1, 2} <= shown or {3, 4} <= shown else _DEPTHS
            fitting = (word for word, points in depths.items() if points >= self._setup.points)
            # not asked back: there is firmware that keeps its own
            self.transport.write(f"MSIZ {next(fitting, list(depths)[-1])}")
            self.transport.write("WFSU SP,0,NP,0,FP,0")  # every point

    # --- acquiring ---

    def _start(self) -> None:
        self.transport.write("TRMD SINGLE")
        self._has_new_record()  # reading it forgets an earlier one: before it is armed, or it may be this one
        self.transport.write("ARM")

    def _complete(self) -> bool:
        if self._has_new_record():
            return True
        self._force_trigger()
        return False

    def _has_new_record(self) -> bool:
        answer = self.transport.query("INR?")
        try:
            bits = int(NR1.number(_after_header(answer, "INR")))
        except ValueError:
            bits = -1
        if not 0 <= bits <= 0xFFFF:
            self.reject("INR?", answer, "INR and a whole number, as INR 8193")
        return bool(bits & 1)

    # --- reading ---

    def preamble(self, channel: int) -> Preamble:
        """Read the preamble of one channel's record; see the base."""
        self._check_readable(channel)
        self._channel = channel
        question = f"C{channel}:WF? DESC"
        descriptor = self._block(_DESCRIPTOR, question, _BLOCK).tobytes()
        (points,) = struct.unpack_from("<i", descriptor, _COUNT)
        scale, offset = map(_single, struct.unpack_from("<ff", descriptor, _VOLTS))
        step = _single(*struct.unpack_from("<f", descriptor, _STEP))
        per_code = scale / _CODES_PER_DIVISION
        # the delay is 0: the trigger is in the middle
        preamble = Preamble(points, step, -points * step / 2, per_code, -_MIDDLE * per_code - offset)
        if not descriptor.startswith(b"WAVEDESC") or not preamble.plausible or per_code <= 0:
            with self.clearing_on_bad_answer():
                raise BadAnswer(self.transport.address, question, repr(descriptor[:20]), "a WAVEDESC of a record")
        return preamble

    def _pieces(self, preamble: Preamble) -> Iterator[NDArray[np.uint8]]:
        yield np.bitwise_xor(self._block(preamble.points, f"C{self._channel}:WF? DAT2", _BLOCK), np.uint8(0x80))

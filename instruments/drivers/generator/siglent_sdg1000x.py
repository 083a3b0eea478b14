"""The driver of Siglent's SDG1000X generators."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from instruments.drivers.generator import OPEN_V, drive
from instruments.drivers.setting import Setting
from instruments.errors import CommandRefused
from instruments.ieee488 import INFINITY, Form

#: "1000HZ", "4V", "-1.999V", "1e-06HZ": as the C language's %g, no zero that need not be (measured on an SDG2042X).
_DIGITS = r"-?(0|[1-9]\d{0,11})(\.\d{0,14}[1-9])?(e[+-]\d{2})?"
_NUMBER, _HERTZ, _VOLTS, _SECONDS = (Form(_DIGITS, f"1000{unit}", suffix=unit) for unit in ("", "HZ", "V", "S"))
#: The only word that is no number: the load of an open circuit.
_OPEN = "HZ"
#: A reset, and so the answer to *OPC?, may take this long [s] (assumed).
_RESET = 5.0
#: The symmetry of a ramp that is a triangle [%].
_TRIANGLE = 50.0


@dataclass(eq=False)
class _LongWord(Setting[str]):
    """A word that is sent in its long form."""

    def _spell(self, value: str) -> str:
        return next(word.upper() for word in self.choices if self._canonical(word) == self._canonical(value))


@dataclass(eq=False)
class _Load(drive.LoadSetting):
    """The load, which is HZ (high impedance) for open terminals."""

    def _parse(self, answer: str, form: Form) -> bool | float | str:
        return INFINITY if answer == _OPEN else super()._parse(answer, form)

    def _spell(self, value: float) -> str:
        return _OPEN if value >= INFINITY else super()._spell(value)


@dataclass(eq=False)
class _Whole(Setting[float]):
    """A whole number."""

    def _spell(self, value: float) -> str:
        return f"{value:.0f}"


class SiglentSDG1000X(drive.DriveGenerator):
    """Siglent SDG1000X: SDG1032X, SDG1062X; two channels, of which the first drives the coil.

    Source: SDG Programming Guide PG02-E04A as public drivers and an emulator that was compared with an SDG1032X quote
    it; the answers to ``C1:BSWV?`` and ``C1:OUTP?`` after a reset as a public driver of the SDG2042X has them from the
    instrument.

    - One header has many fields, each with its name: ``C1:BSWV FRQ,30.5`` sets one, ``C1:BSWV?`` answers with all of
      them behind the header: ``C1:BSWV WVTP,SINE,FRQ,30.5HZ,…``.
    - A number beyond its limits becomes the limit without a word, and the guide has no error queue: each setting is
      asked for after it was sent.
    - It prints six digits of a number, ten of a frequency, and none that are zero at the end (measured on an SDG2042X).
    - A burst has its fields only while it is on: ``C1:BTWV?`` answers ``STATE,OFF``, or all of them, then ``CARR`` and
      those of the waveform; with a trigger from outside ``EDGE`` is among them, with a gate ``PLRT``
      alone.  No delay is shorter than the latency, 2.4e-07 s or 5.2e-07 s in two public records.
    - A triangle is a ramp of 50 % symmetry; so `waveform` answers RAMP for it.
    """

    MODELS: ClassVar[str] = r"SDG1\d{3}X( Plus)?"
    NUMBER: ClassVar[Form] = _NUMBER
    HAS_ERROR_QUEUE = False
    OUTPUT: ClassVar[str] = "C1:OUTP"
    BURST = ("NCYC", "EXT", "FALL", "RISE")
    #: The first field of an output's answer, and the switch that it stands for.
    _STATES: ClassVar[Mapping[str, str]] = {"ON": "1", "OFF": "0"}

    waveform = _LongWord(
        *("C1:BSWV", str),
        choices=("SINe", "SQUare", "RAMP"),
        answers=("PULSE", "NOISE", "ARB", "DC", "PRBS", "IQ"),
        key="WVTP",
    )
    frequency = drive.LimitedSetting(
        *("C1:BSWV", float, "Hz", 1e-6, 60e6),
        key="FRQ",
        form=_HERTZ,
        resolution=1e-6,
        digits=10,
        quantity="frequency_hz",
    )
    amplitude = drive.LimitedSetting(
        *("C1:BSWV", float, "Vpp", 2e-3, 20.0),
        key="AMP",
        form=_VOLTS,
        span=(0.0, 20.0),
        digits=6,
        quantity="amplitude_vpp",
        partner="offset_v",
    )
    offset = drive.LimitedSetting(
        *("C1:BSWV", float, "V", -OPEN_V, OPEN_V),
        key="OFST",
        form=_VOLTS,
        digits=6,
        quantity="offset_v",
        partner="amplitude_vpp",
    )
    #: Whole ohms; a fraction is cut off.
    load = _Load("C1:OUTP", float, unit="ohm", low=50.0, high=INFINITY, key="LOAD", resolution=1.0, digits=6)
    output = drive.OutputSwitch("C1:OUTP", bool)
    burst = Setting("C1:BTWV", bool, key="STATE", on_demand=True)
    burst_mode = drive.burst_word("C1:BTWV", "GATE", "NCYC", key="GATE_NCYC")
    burst_cycles = _Whole("C1:BTWV", float, low=1.0, high=1e6, key="TIME", on_demand=True)
    burst_phase = drive.burst_setting("C1:BTWV", 0.0, 360.0, unit="deg", key="STPS")
    trigger_source = drive.burst_word("C1:BTWV", "EXT", "INT", "MAN", key="TRSR")
    trigger_slope = drive.burst_word("C1:BTWV", "RISE", "FALL", key="EDGE")
    trigger_delay = drive.burst_setting("C1:BTWV", 0.0, 100.0, unit="s", key="DLAY", form=_SECONDS)

    def field_of(self, answer: str, header: str, key: str) -> str:
        """Return the value behind its name; that of an output, which has none, is the first field."""
        head, _, rest = answer.partition(" ")
        fields = rest.partition(",CARR,")[0].split(",")
        if head != header:
            raise ValueError(answer)
        if not key:
            return self._STATES.get(fields[0], answer)
        named = fields[fields[0] in self._STATES :]  # names and values follow each other, behind the state of an output
        pairs = dict(zip(named[::2], named[1::2], strict=True))
        if 2 * len(pairs) != len(named):
            raise ValueError(answer)  # a name that comes twice
        value = pairs.get(key, answer)
        return self._STATES.get(value, value)

    def forget_errors(self) -> None:
        """Ask for answers with headers; there is no error queue."""
        self.transport.write("CHDR SHORT")

    def _set_burst(self, phase_deg: float, *, rising: bool) -> None:
        """Choose bursts first: before, the instrument takes none of their fields."""
        self.burst = True
        super()._set_burst(phase_deg, rising=rising)

    def _reset(self) -> None:
        self.command("*RST")
        answer = self.transport.query("*OPC?", patience=_RESET)
        if answer != "1":
            self.reject("*OPC?", answer, "1")
        self.load = INFINITY

    def _shape(self, waveform: str) -> None:
        triangle = waveform.upper() == "TRI"
        self.waveform = "RAMP" if triangle else waveform
        if not triangle:
            return
        self.command("C1:BSWV SYM,50")  # an answer has it for ramps alone: it is no setting like the others
        answer = self.transport.query("C1:BSWV?")
        try:
            symmetry = _NUMBER.number(self.field_of(answer, "C1:BSWV", "SYM"))
        except ValueError:
            self.reject("C1:BSWV?", answer, "the fields of a ramp, SYM among them")
        if symmetry != _TRIANGLE:
            raise CommandRefused(self.transport.address, "C1:BSWV SYM,50", (f"SYM is {symmetry:g} afterwards",))

    def outputs(self) -> tuple[str, ...]:
        """Return the beginning of the headers of both outputs."""
        return ("C1:OUTP", "C2:OUTP")

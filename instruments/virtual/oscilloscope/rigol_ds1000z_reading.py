"""What a virtual DS1000Z tells of its record: the samples, measurements, pictures, its setup."""

from __future__ import annotations

from typing import TYPE_CHECKING

from instruments.virtual.core.device import answers
from instruments.virtual.core.parameters import boolean, choice, one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.oscilloscope.scope import VirtualOscilloscope
from instruments.virtual.oscilloscope.screenshot import bmp8, bmp24, draw, grey, png
from instruments.virtual.oscilloscope.setup import block_content

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.oscilloscope.record import Codes, Record

#: The code in the middle of the screen, and how many points a trace on the screen has.
MIDDLE, _ON_SCREEN = 127, 1200
#: Points that one block may have, by format.
_LONGEST = {"BYTE": 250_000, "WORD": 125_000, "ASC": 15_625}

#: The items of :MEASure:ITEM as this maker spells them, and what they are called here.
_ITEMS = {
    "VMAX": "VMAX",
    "VMIN": "VMIN",
    "VPP": "VPP",
    "VTOP": "VTOP",
    "VBASe": "VBASE",
    "VAMP": "VAMPLITUDE",
    "VAVG": "VAVERAGE",
    "VRMS": "VRMS",
    "PVRMS": "PVRMS",
    "VARIance": "VARIANCE",
    "VUPPer": "VUPPER",
    "VUP": "VUPPER",
    "VMID": "VMID",
    "VLOWer": "VLOWER",
    "OVERshoot": "OVERSHOOT",
    "PREShoot": "PRESHOOT",
    "MARea": "AREA",
    "MPARea": "PERIODAREA",
    "PERiod": "PERIOD",
    "FREQuency": "FREQUENCY",
    "RTIMe": "RISETIME",
    "FTIMe": "FALLTIME",
    "PWIDth": "PWIDTH",
    "NWIDth": "NWIDTH",
    "PDUTy": "PDUTY",
    "NDUTy": "NDUTY",
    "TVMAX": "TVMAX",
    "TVMIN": "TVMIN",
    "PSLEWrate": "PSLEWRATE",
    "NSLEWrate": "NSLEWRATE",
    "PPULses": "PPULSES",
    "NPULses": "NPULSES",
    "PEDGes": "PEDGES",
    "NEDGes": "NEDGES",
}
_WORDS = tuple(_ITEMS)
_STATISTICS = ("MAXimum", "MINimum", "CURRent", "AVERages", "DEViation")
_PERSISTENCES = ("MIN", "0.1", "0.2", "0.5", "1", "5", "10", "INF")


class RigolReading(VirtualOscilloscope):
    """The part of a DS1000Z that is asked when a record is there."""

    # --- reading the record ---

    def waveform(self) -> tuple[Command, ...]:
        """The rows for reading the record."""
        sources = tuple(f"CHANnel{n}" for n in self.channels)
        parts: tuple[tuple[str, int], ...] = (
            ("XINCrement", 4),
            ("XORigin", 5),
            ("XREFerence", 6),
            ("YINCrement", 7),
            ("YORigin", 8),
            ("YREFerence", 9),
        )
        return (
            self.word("WAVeform:SOURce", "wav_source", sources, "CHAN1"),
            self.word("WAVeform:MODE", "wav_mode", ("NORMal", "MAXimum", "RAW"), "NORM"),
            self.word("WAVeform:FORMat", "wav_format", ("WORD", "BYTE", "ASCii"), "BYTE"),
            self.whole("WAVeform:STARt", "wav_start", 1.0, low=1, high=24e6),
            self.whole("WAVeform:STOP", "wav_stop", float(_ON_SCREEN), low=1, high=24e6),
            Command("WAVeform:PREamble", get=answers(lambda: ",".join(self._preamble()))),
            *(Command(f"WAVeform:{word}", get=answers(self._part(k))) for word, k in parts),
            Command("WAVeform:DATA", get=answers(self._data)),
            Command("WAVeform:POINts", get=answers(lambda: str(self._sequence()[3]))),
        )

    def _part(self, k: int) -> Callable[[], str]:
        return lambda: self._preamble()[k]

    def _sequence(self) -> tuple[Record, float, float, int]:
        """The record, and of the points that can be read: where they begin [s], their distance [s], how many.

        Raises ScpiError: the memory can only be read when the scope has stopped.
        """
        mode = str(self.settings["wav_mode"])
        if mode == "RAW" and self.running():
            raise ScpiError(-221)
        record = self.record()
        if mode == "RAW" or (mode == "MAX" and not self.running()):
            return record, record.origin, 1 / record.rate, record.points
        start, length = record.screen
        return record, start, length / _ON_SCREEN, _ON_SCREEN

    def _source(self) -> int:
        return int(str(self.settings["wav_source"])[4:])

    def _preamble(self) -> list[str]:
        record, start, step, points = self._sequence()
        scale = record.inputs[self._source()]
        kind = {"BYTE": 0, "WORD": 1, "ASC": 2}[str(self.settings["wav_format"])]
        mode = {"NORM": 0, "MAX": 1, "RAW": 2}[str(self.settings["wav_mode"])]
        averages = round(self.value("averages")) if self.settings["acquisition"] == "AVER" else 1
        times = (self.spell(step), self.spell(start), "0")
        volts = (self.spell(scale.volts_per_code), str(scale.zero - MIDDLE), str(MIDDLE))
        return [str(kind), str(mode), str(points), str(averages), *times, *volts]

    def _data(self) -> str:
        record, start, step, points = self._sequence()
        first = round(self.value("wav_start"))
        last = min(points, round(self.value("wav_stop")))
        form = str(self.settings["wav_format"])
        if first > last or last - first + 1 > _LONGEST[form]:
            raise ScpiError(-222)
        channel = self._source()
        codes = record.codes(channel, first - 1, last - first + 1, of=points, start=start, step=step)
        return self.block(self._encoded(form, codes, record, channel), digits=9)

    def _encoded(self, form: str, codes: Codes, record: Record, channel: int) -> bytes:
        if form == "BYTE":
            return codes.tobytes()
        if form == "WORD":  # the higher byte is always 0
            return codes.astype("<u2").tobytes()
        scale = record.inputs[channel]
        volts = (codes.astype(float) - scale.zero) * scale.volts_per_code
        return ",".join(self.spell(v) for v in volts).encode()

    # --- measurements, pictures, setups ---

    def rest(self) -> tuple[Command, ...]:
        """The rows for measurements, pictures and setups."""

        def ignored(_: list[str]) -> None:
            """What only changes the picture."""

        sources = tuple(f"CHANnel{n}" for n in self.channels)
        return (
            self.word("MEASure:SOURce", "measure_source", sources, "CHAN1"),
            Command("MEASure:ITEM", set=self._install, get=self._item),
            Command("MEASure:STATistic:ITEM", set=self._install, get=self._statistic),
            *(Command(f"MEASure:{word}", set=self._install_one(word), get=self._one_item(word)) for word in _WORDS),
            *(
                Command(f"MEASure:{header}", set=ignored)
                for header in ("CLEar", "RECover", "ADISplay", "AMSource", "STATistic:DISPlay", "STATistic:RESet")
            ),
            self.word("MEASure:STATistic:MODE", "statistic_mode", ("DIFFerence", "EXTRemum"), "EXTR"),
            Command("MEASure:COUNter:VALue", get=answers(self._counter)),
            self.word("DISPlay:TYPE", "display_type", ("VECTors", "DOTS"), "VECT"),
            self.word("DISPlay:GRID", "grid", ("FULL", "HALF", "NONE"), "FULL"),
            self.word("DISPlay:GRADing:TIME", "persistence", _PERSISTENCES, "MIN"),
            self.percent("DISPlay:WBRightness", "brightness"),
            self.percent("DISPlay:GBRightness", "grid_brightness"),
            Command("DISPlay:DATA", get=self._picture),
            Command("SYSTem:SETup", set=lambda p: self.restore(block_content(one(p))), get=answers(self._setup)),
            Command("SYSTem:ERRor:COUNt", get=answers(lambda: str(len(self.parser.errors)))),
            Command("SYSTem:GAM", get=answers(lambda: "12")),
            Command("SYSTem:RAM", get=answers(lambda: str(len(self.channels)))),
            Command("MATH:DISPlay", set=lambda p: _never(boolean(one(p))), get=answers(lambda: "0")),
        )

    def _setup(self) -> str:
        return self.block(self.setup(), digits=9)

    def _where(self, parameters: list[str]) -> int:
        if len(parameters) > 1:
            raise ScpiError(-108)
        return self.channel_of(parameters[0] if parameters else str(self.settings["measure_source"]))

    def _install(self, parameters: list[str]) -> None:
        if not parameters:
            raise ScpiError(-109)
        _named(parameters[0])
        self._where(parameters[1:])

    def _install_one(self, word: str) -> Callable[[list[str]], None]:
        return lambda parameters: self._install([word, *parameters])

    def _one_item(self, word: str) -> Callable[[list[str]], str]:
        return lambda parameters: self._item([word, *parameters])

    def _item(self, parameters: list[str]) -> str:
        if not parameters:
            raise ScpiError(-109)
        name, channel = _named(parameters[0]), self._where(parameters[1:])
        return self.spell(self.measured(name, channel))

    def _statistic(self, parameters: list[str]) -> str:
        """Statistics of one: every value but the deviation is the present one."""
        if not parameters:
            raise ScpiError(-109)
        kind = choice(parameters[0], _STATISTICS)
        return self.spell(0.0) if kind == "DEV" else self._item(parameters[1:])

    def _counter(self) -> str:
        return self.spell(self.measured("FREQUENCY", self._where([])))

    def _picture(self, parameters: list[str]) -> str:
        """``[<colour>[,<invert>[,<format>]]]``; without, a picture with 24 bits in colours."""
        if len(parameters) > 3:
            raise ScpiError(-108)
        colour, invert, form = (*parameters, *("ON", "OFF", "BMP24")[len(parameters) :])
        writers = {"BMP24": lambda p: bmp24(p) + b"\0\0", "BMP8": bmp8, "PNG": png}
        name = choice(form, tuple(writers))
        picture = draw(self.heights(), columns=self.columns)
        picture = picture if boolean(colour) else grey(picture)
        picture = 255 - picture if invert.upper() in {"ON", "1", "INVERT", "INV"} else picture
        return self.block(writers[name](picture), digits=9)


def _never(on: bool) -> None:  # noqa: FBT001
    """There is no mathematics in this model.  Raises ScpiError when it is switched on."""
    if on:
        raise ScpiError(-221)


def _named(item: str) -> str:
    spelled = choice(item, _WORDS)
    return next(name for word, name in _ITEMS.items() if choice(word, (word,)) == spelled)

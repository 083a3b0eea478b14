"""What a virtual DSOX1102G tells of its record: the samples, measurements, pictures, its setup."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import choice, number, one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.oscilloscope.scope import VirtualOscilloscope
from instruments.virtual.oscilloscope.screenshot import bmp8, bmp24, draw, grey, png
from instruments.virtual.oscilloscope.setup import block_content

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.oscilloscope.record import Record

#: The code in the middle of the screen, and how many points a record for the screen has.
MIDDLE, _FOR_SCREEN = 128, 62_500

_MEASUREMENTS = {
    "FREQuency": "FREQUENCY",
    "PERiod": "PERIOD",
    "VPP": "VPP",
    "VMAX": "VMAX",
    "VMIN": "VMIN",
    "VAMPlitude": "VAMPLITUDE",
    "VTOP": "VTOP",
    "VBASe": "VBASE",
    "VAVerage": "VAVERAGE",
    "VRMS": "VRMS",
    "SDEViation": "SDEVIATION",
    "RISetime": "RISETIME",
    "FALLtime": "FALLTIME",
    "PWIDth": "PWIDTH",
    "NWIDth": "NWIDTH",
    "DUTYcycle": "PDUTY",
    "NDUTy": "NDUTY",
    "OVERshoot": "OVERSHOOT",
    "PREShoot": "PRESHOOT",
    "XMAX": "TVMAX",
    "XMIN": "TVMIN",
    "AREa": "AREA",
    "PPULses": "PPULSES",
    "NPULses": "NPULSES",
    "PEDGes": "PEDGES",
    "NEDGes": "NEDGES",
    "COUNter": "FREQUENCY",
}
#: Told as percentages.
_PERCENT = {"PDUTY", "NDUTY", "OVERSHOOT", "PRESHOOT"}
#: Words before the source that say over what is measured.
_INTERVALS = ("CYCLe", "DISPlay", "AC", "DC")
#: Sources that a waveform may have beside the channels; this model has nothing in them.
EMPTY_SOURCES = ("FUNCtion", "MATH", "FFT", "WMEMory1", "WMEMory2", "EXTernal", "ABUS")


class KeysightReading(VirtualOscilloscope):
    """The part of an InfiniiVision scope that is asked when a record is there."""

    # --- reading the record ---

    def waveform(self) -> tuple[Command, ...]:
        """The rows for reading the record."""
        sources = (*(f"CHANnel{n}" for n in self.channels), *EMPTY_SOURCES)
        parts = ("FORMat", "TYPE", "POINts", "COUNt", "XINC", "XOR", "XREF", "YINC", "YOR", "YREF")
        words = {"XINC": "XINCrement", "XOR": "XORigin", "XREF": "XREFerence", "YINC": "YINCrement", "YOR": "YORigin"}
        words |= {"YREF": "YREFerence", "TYPE": "TYPE", "COUNt": "COUNt"}
        self._defaults["wav_points"] = float(_FOR_SCREEN)
        return (
            self.word("WAVeform:SOURce", "wav_source", sources, "CHAN1"),
            self.word("WAVeform:FORMat", "wav_format", ("WORD", "BYTE", "ASCii"), "BYTE"),
            self.word("WAVeform:BYTeorder", "wav_order", ("LSBFirst", "MSBFirst"), "MSBF"),
            self.switch("WAVeform:UNSigned", "wav_unsigned", default=True),
            self.word("WAVeform:VIEW", "wav_view", ("MAIN",), "MAIN"),
            self.word("WAVeform:POINts:MODE", "wav_mode", ("NORMal", "MAXimum", "RAW"), "NORM"),
            Command("WAVeform:POINts", self._set_points, answers(lambda: f"{self._sequence()[2]:+d}")),
            Command("WAVeform:PREamble", get=answers(lambda: ",".join(self._preamble()))),
            *(
                Command(f"WAVeform:{words[part]}", get=answers(self._part(k)))
                for k, part in enumerate(parts)
                if part in words
            ),
            Command("WAVeform:DATA", get=answers(self._data)),
        )

    def _part(self, k: int) -> Callable[[], str]:
        return lambda: self._preamble()[k]

    def _set_points(self, parameters: list[str]) -> None:
        """A number, rounded to the next the scope can give when it is asked for; MAXimum takes what there is."""
        self.settings["wav_points"] = number(one(parameters), low=1, high=8e6, default=_FOR_SCREEN)

    def _sequence(self) -> tuple[Record, float, int]:
        """The record, the distance of the points that can be read [s], how many.  Raises ScpiError."""
        if self.settings["time_mode"] in {"ROLL", "XY"}:
            raise ScpiError(-221)
        record = self.record()
        raw = self.settings["wav_mode"] == "RAW" or (self.settings["wav_mode"] == "MAX" and not self.running())
        most = record.points if raw else min(_FOR_SCREEN, record.points)
        wanted = self.value("wav_points")
        every = math.ceil(record.points / min(max(wanted, 1), most))
        return record, every / record.rate, max(1, record.points // every)

    def _source(self) -> int:
        """Raises ScpiError for a source with nothing in it."""
        source = str(self.settings["wav_source"])
        if not source.startswith("CHAN"):
            raise ScpiError(-230)
        return int(source[4:])

    def _preamble(self) -> list[str]:
        record, step, points = self._sequence()
        form = str(self.settings["wav_format"])
        kind = {"BYTE": 0, "WORD": 1, "ASC": 4}[form]
        mode = {"NORM": 0, "PEAK": 1, "AVER": 2, "HRES": 3}[str(self.settings["acquisition"])]
        averages = round(self.value("averages")) if mode == 2 else 1
        per_code, reference = (1, MIDDLE) if form == "BYTE" else (256, 256 * MIDDLE)
        shown = record.inputs.get(self._channel_or_none())
        volts = shown.volts_per_code / per_code if shown else 1.0
        offset = (MIDDLE - shown.zero) * shown.volts_per_code if shown else 0.0
        signed = not self.settings["wav_unsigned"] and form != "ASC"
        return [
            *(f"{value:+d}" for value in (kind, mode, points, averages)),
            f"{step:+.8E}",
            f"{record.origin:+.8E}",
            "+0",
            self.spell(volts),
            self.spell(offset),
            f"{0 if signed else reference:+d}",
        ]

    def _channel_or_none(self) -> int:
        source = str(self.settings["wav_source"])
        return int(source[4:]) if source.startswith("CHAN") else 0

    def _data(self) -> str:
        record, step, points = self._sequence()
        channel = self._channel_or_none()
        codes = (
            record.codes(channel, 0, points, of=points, start=record.origin, step=step)
            if channel
            else np.zeros(points, np.uint8)
        )
        form = str(self.settings["wav_format"])
        if form == "ASC":
            return self.block(self._as_text(record, channel, codes.astype(float)), digits=8)
        signed = 0 if self.settings["wav_unsigned"] else MIDDLE
        shifted = codes.astype(np.int32) - signed
        if form == "WORD":
            order = "<" if self.settings["wav_order"] == "LSBF" else ">"
            return self.block((256 * shifted).astype(f"{order}i4").astype(f"{order}u2").tobytes(), digits=8)
        return self.block(shifted.astype(np.uint8).tobytes(), digits=8)

    @staticmethod
    def _as_text(record: Record, channel: int, codes: np.ndarray[tuple[int], np.dtype[np.float64]]) -> bytes:
        if not channel:  # no sample
            return ",".join(["+9.90000E+37"] * codes.size).encode()
        scale = record.inputs[channel]
        return ",".join(f"{v:+.5E}" for v in (codes - scale.zero) * scale.volts_per_code).encode()

    # --- measurements, pictures, setups ---

    def rest(self) -> tuple[Command, ...]:
        """The rows for measurements, pictures and setups."""

        def ignored(_: list[str]) -> None:
            """What only changes the picture."""

        self._defaults["measure_source"] = "CHAN1"
        self._results: list[tuple[str, int]] = []
        return (
            Command("MEASure:SOURce", set=self._set_source, get=answers(lambda: str(self.settings["measure_source"]))),
            self.word("MEASure:SHOW", "measure_shown", ("1", "ON"), "1"),
            Command("MEASure:CLEar", set=does(self._clear_results)),
            Command("MEASure:RESults", get=answers(self._all_results)),
            *(
                Command(f"MEASure:{word}", set=self._install(name), get=self._ask(name))
                for word, name in _MEASUREMENTS.items()
            ),
            Command("DISPlay:DATA", get=self._picture),
            *(Command(header, set=ignored) for header in ("DISPlay:CLEar", "SYSTem:DSP", "SYSTem:LOCK")),
            self.switch("HARDcopy:INKSaver", "ink_saver", default=True),
            self.switch("DISPlay:LABel", "labels"),
            self.word("MEASure:STATistics", "statistics", ("ON", "CURRent", "MEAN"), "ON"),
            Command("SYSTem:SETup", set=lambda p: self.restore(block_content(one(p))), get=answers(self._setup)),
            Command("SYSTem:PRESet", set=does(self.reset)),
        )

    def _setup(self) -> str:
        return self.block(self.setup(), digits=8)

    def _set_source(self, parameters: list[str]) -> None:
        """One source, or two, of which only the first is measured."""
        if not 1 <= len(parameters) <= 2:
            raise ScpiError(-109 if not parameters else -108)
        self.settings["measure_source"] = f"CHAN{self.channel_of(parameters[0])}"

    def _where(self, parameters: list[str]) -> int:
        """The channel that is named last, after words that say over what is measured.  Raises ScpiError."""
        for word in parameters[:-1]:
            choice(word, _INTERVALS)
        if not parameters or parameters[-1].upper() in {"CYCL", "CYCLE", "DISP", "DISPLAY", "AC", "DC"}:
            return self.channel_of(str(self.settings["measure_source"]))
        return self.channel_of(parameters[-1])

    def _install(self, name: str) -> Callable[[list[str]], None]:
        def set_(parameters: list[str]) -> None:
            self._results = [*self._results, (name, self._where(parameters))][-8:]

        return set_

    def _clear_results(self) -> None:
        self._results = []

    def _ask(self, name: str) -> Callable[[list[str]], str]:
        return lambda parameters: self._value(name, self._where(parameters))

    def _value(self, name: str, channel: int) -> str:
        value = self.measured(name, channel)
        return self.spell(100 * value if name in _PERCENT and value < self.no_measurement else value)

    def _all_results(self) -> str:
        return ",".join(self._value(name, channel) for name, channel in self._results) or "NONE"

    def _picture(self, parameters: list[str]) -> str:
        """``[<format>[,<palette>]]``.  Raises ScpiError."""
        if len(parameters) > 2:
            raise ScpiError(-108)
        form, palette = (*parameters, *("BMP", "COLor")[len(parameters) :])
        writers = {"BMP": bmp24, "BMP8": bmp8, "PNG": png}
        write = writers[choice(form, ("BMP", "BMP8bit", "PNG"))]
        picture = draw(self.heights(), columns=self.columns)
        grey_wanted = choice(palette, ("COLor", "GRAYscale", "MONochrome")) != "COL"
        picture = grey(picture) if grey_wanted else picture
        return self.block(write(255 - picture if self.settings["ink_saver"] else picture), digits=8)

"""A virtual DS1000Z.

Sources: MSO1000Z/DS1000Z Programming Guide as public drivers quote it (ds1054z by P. Klaus; PyMeasure's DS1000Z
driver).  From there: 25 codes per division, code 127 in the middle, 12 divisions, the limits of a block, the
preamble's form, ASCII data with a block's head too.
Assumed: what the error queue says when too much is asked for, the depth that AUTO takes.  The delayed sweep keeps its
numbers within the limits that the guide of a sister series gives, with 12 divisions for 14, and is not drawn.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import boolean, choice, number, one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.oscilloscope.scope import VirtualOscilloscope, block_content, one_two_five
from instruments.virtual.oscilloscope.screenshot import bmp8, bmp24, draw, grey, png

if TYPE_CHECKING:
    from collections.abc import Callable

    from instruments.virtual.oscilloscope.record import Codes, Record

#: Points of the record for one channel shown; half of it for two, a quarter for more.
_DEPTHS = (12_000, 120_000, 1_200_000, 12_000_000, 24_000_000)
_FASTEST = 1e9
_CODES_PER_DIVISION = 25

_SUPPLIES = ("EXT", "EXT5", "ACLine")
#: The code in the middle of the screen, and how many points a trace on the screen has.
_MIDDLE, _ON_SCREEN = 127, 1200
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


class VirtualDS1000Z(VirtualOscilloscope):
    """A DS1054Z: four channels, 24 million points, 50 MHz."""

    identity = "RIGOL TECHNOLOGIES,DS1054Z,DS1ZVIRTUAL,00.04.04.SP4"
    no_error = '0,"No error"'
    columns, lowest, digits, keeps_old = 12, 0, 9, True

    def spell(self, value: float) -> str:
        """As in the preamble that public drivers quote: 2.000000e-05."""
        return f"{value:.6e}"

    def table(self) -> tuple[Command, ...]:
        """Its commands."""
        channels = tuple(row for n in self.channels for row in self._channel(n))
        return (*self._control(), *channels, *self._time(), *self._trigger(), *self._waveform(), *self._rest())

    def _control(self) -> tuple[Command, ...]:
        return (
            Command("RUN", set=does(self.run)),
            Command("STOP", set=does(self.stop)),
            Command("SINGle", set=does(self._single)),
            Command("TFORce", set=does(self.force)),
            Command("AUToscale", set=does(self.autoscale)),
            Command("CLEar", set=does(self._clear_screen)),
            Command("DISPlay:CLEar", set=does(self._clear_screen)),
            Command("CLS", set=does(self._clear_status)),
            *(Command(f"CALibrate:{word}", set=does(lambda: None)) for word in ("STARt", "QUIT")),
            *self.presets(),
        )

    def _clear_screen(self) -> None:
        if self.running():
            self.run()

    def _single(self) -> None:
        self.settings["trigger_sweep"] = "SING"
        self.single()

    def _channel(self, n: int) -> tuple[Command, ...]:
        head, name = f"CHANnel{n}:", f"chan{n}_"

        def probe() -> float:
            return self.value(name + "probe")

        def offsets() -> tuple[float, float]:
            reach = (100.0 if self.value(name + "scale") / probe() >= 0.5 else 2.0) * probe()
            return -reach, reach

        return (
            self.quantity(head + "PROBe", name + "probe", 10.0, limits=lambda: (0.01, 1000.0), rounded=one_two_five),
            self.quantity(head + "SCALe", name + "scale", 1.0, unit="V", limits=lambda: (1e-3 * probe(), 10 * probe())),
            self.quantity(head + "OFFSet", name + "offset", 0.0, unit="V", limits=offsets),
            self.full_range(
                head + "RANGe",
                name + "scale",
                divisions=8,
                limits=lambda: (8e-3 * probe(), 80 * probe(), 8 * probe()),
                unit="V",
            ),
            self.quantity(head + "TCAL", name + "delay", 0.0, unit="S", limits=lambda: (-1e-7, 1e-7)),
            self.word(head + "COUPling", name + "coupling", ("AC", "DC", "GND"), "DC"),
            self.word(head + "BWLimit", name + "bandwidth", ("20M", "OFF"), "OFF"),
            self.word(head + "UNITs", name + "unit", ("VOLTage", "WATT", "AMPere", "UNKNown"), "VOLT"),
            self.switch(head + "DISPlay", name + "display", default=n == 1),
            self.switch(head + "INVert", name + "invert"),
            self.switch(head + "VERNier", name + "vernier"),
        )

    def _time(self) -> tuple[Command, ...]:
        def offsets() -> tuple[float, float]:
            return -6 * self.value("time_scale"), max(1.0, 100 * self.value("time_scale"))

        return (
            self.quantity(
                "TIMebase[:MAIN]:SCALe",
                "time_scale",
                1e-6,
                unit="S",
                limits=lambda: (5e-9, 50.0),
                rounded=one_two_five,
            ),
            self.quantity("TIMebase[:MAIN]:OFFSet", "time_offset", 0.0, unit="S", limits=offsets),
            self.word("TIMebase:MODE", "time_mode", ("MAIN", "XY", "ROLL"), "MAIN"),
            self.switch("TIMebase:DELay:ENABle", "zoom"),
            self.word("ACQuire:TYPE", "acquisition", ("NORMal", "AVERages", "PEAK", "HRESolution"), "NORM"),
            self.whole("ACQuire:AVERages", "averages", 2.0, low=2, high=1024),
            Command("ACQuire:SRATe", get=answers(lambda: self.spell(self.full_scale()[0]))),
            self._depth(),
            # behind all that the sample rate depends on, so that a setup can be restored row by row
            self.quantity(
                "TIMebase:DELay:SCALe",
                "zoom_scale",
                5e-7,
                unit="S",
                limits=self._zoom_scales,
                rounded=one_two_five,
            ),
            self.quantity("TIMebase:DELay:OFFSet", "zoom_offset", 0.0, unit="S", limits=self._zoom_offsets),
        )

    def _zoom_scales(self) -> tuple[float, float]:
        """The delayed sweep: no coarser than the main one, no finer than a fortieth of 50 sample intervals."""
        return one_two_five(50 / self.full_scale()[0] / 40, up=True), self.value("time_scale")

    def _zoom_offsets(self) -> tuple[float, float]:
        """The delayed sweep: all of it within the main one."""
        reach = 6 * (self.value("time_scale") - self.value("zoom_scale"))
        return self.value("time_offset") - reach, self.value("time_offset") + reach

    def _keep_zoom_within(self) -> None:
        for name, limits in (("zoom_scale", self._zoom_scales), ("zoom_offset", self._zoom_offsets)):
            low, high = limits()
            self.settings[name] = min(max(self.value(name), low), high)

    def _depth(self) -> Command:
        self._defaults["depth"] = "AUTO"
        self._headers["depth"] = ":ACQ:MDEP"

        def set_(parameters: list[str]) -> None:
            text = one(parameters).upper()
            if text != "AUTO":
                depths = self._depths()
                points = int(number(text, low=depths[0], high=depths[-1], default=depths[0]))
                if points not in depths:
                    raise ScpiError(-222)
                text = str(points)
            self.settings["depth"] = text
            self.changed("depth")

        return Command("ACQuire:MDEPth", set_, answers(lambda: str(self.settings["depth"])))

    def _depths(self) -> tuple[int, ...]:
        share = self._share()
        return tuple(depth // share for depth in _DEPTHS)

    def _share(self) -> int:
        """By how many the converter and the memory are shared: 1, 2 or 4."""
        return {0: 1, 1: 1, 2: 2}.get(len(self.shown()), 4)

    def _trigger(self) -> tuple[Command, ...]:
        sources = (*(f"CHANnel{n}" for n in self.channels), *_SUPPLIES)

        def levels() -> tuple[float, float]:
            source = str(self.settings["trigger_source"])
            channel = int(source[4:]) if source.startswith("CHAN") else 1
            reach, offset = 5 * self.division(channel), self.value(f"chan{channel}_offset")
            return -reach - offset, reach - offset

        return (
            self.word("TRIGger:MODE", "trigger_mode", ("EDGE", "PULSe", "SLOPe", "VIDeo", "TIMeout"), "EDGE"),
            self.word("TRIGger:EDGe:SOURce", "trigger_source", sources, "CHAN1"),
            self.word("TRIGger:EDGe:SLOPe", "trigger_slope", ("POSitive", "NEGative", "RFALl"), "POS"),
            self.quantity("TRIGger[:EDGe]:LEVel", "trigger_level", 0.0, unit="V", limits=levels),
            self.word("TRIGger:SWEep", "trigger_sweep", ("AUTO", "NORMal", "SINGle"), "AUTO"),
            self.word("TRIGger:COUPling", "trigger_coupling", ("AC", "DC", "LFReject", "HFReject"), "DC"),
            self.quantity("TRIGger:HOLDoff", "holdoff", 16e-9, unit="S", limits=lambda: (16e-9, 10.0)),
            self.switch("TRIGger:NREJect", "noise_rejection"),
            Command("TRIGger:STATus", get=answers(self._status)),
            Command("TLHAlf", set=does(self.half_level)),
        )

    def adjusted(self, name: str, before: float) -> None:
        """A sweep of SINGle waits for one record, the others go on."""
        self._keep_zoom_within()
        super().adjusted(name, before)
        if name == "trigger_sweep" and self.acquisition.armed is not None:
            self.acquisition.arm(self.now, once=self.settings[name] == "SING")

    def autoscale(self) -> None:
        """See the base; the delayed sweep follows the main one."""
        super().autoscale()
        self._keep_zoom_within()

    def run(self) -> None:
        """``:RUN`` after a single record goes on with normal sweep, as the key does."""
        if self.settings["trigger_sweep"] == "SING":
            self.settings["trigger_sweep"] = "NORM"
        super().run()

    def _status(self) -> str:
        acquisition = self.acquisition
        if not self.running():
            return "STOP"
        if self.now < acquisition.filled and (acquisition.once or acquisition.latest is None):
            return "RUN"
        under_way = acquisition.first(self.now)
        latest = under_way or (None if acquisition.once else acquisition.latest)
        if latest is None:
            return "WAIT"
        if latest.forced and self.settings["trigger_sweep"] == "AUTO":
            return "AUTO"
        return "TD" if self.now - latest.done < max(0.1, latest.points / latest.rate) else "WAIT"

    # --- scaling ---

    def full_scale(self) -> tuple[float, int]:
        """The record fills the screen, or goes beyond it where even the fastest rate is too slow to fill it."""
        fastest, length = _FASTEST / self._share(), self.columns * self.value("time_scale")
        depth = str(self.settings["depth"])
        if depth == "AUTO":
            rate = min(fastest, _DEPTHS[-2] / self._share() / length)
            return rate, max(1, round(rate * length))
        # the depth that is left when channels were added after it had been set
        points = max((d for d in self._depths() if d <= int(depth)), default=self._depths()[0])
        return min(fastest, points / length), points

    def screen(self) -> tuple[float, float]:
        """Twelve divisions around the offset."""
        scale = self.value("time_scale")
        return self.value("time_offset") - 6 * scale, 12 * scale

    def scaling(self, channel: int) -> tuple[float, int]:
        """25 codes per division; the offset lifts the trace by whole codes."""
        volts_per_code = self.division(channel) / _CODES_PER_DIVISION
        return volts_per_code, _MIDDLE + round(self.value(f"chan{channel}_offset") / volts_per_code)

    def window(self, channel: int) -> tuple[float, float]:
        """Eight divisions around the middle."""
        return float(_MIDDLE), 8.0 * _CODES_PER_DIVISION

    def fit(self, channel: int, middle: float, division: float) -> None:
        """The offset is what is added to the trace."""
        self.settings |= {f"chan{channel}_scale": division, f"chan{channel}_offset": -middle}

    # --- reading the record ---

    def _waveform(self) -> tuple[Command, ...]:
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
        volts = (self.spell(scale.volts_per_code), str(scale.zero - _MIDDLE), str(_MIDDLE))
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
        return self.block(self._encoded(form, codes, record, channel))

    def _encoded(self, form: str, codes: Codes, record: Record, channel: int) -> bytes:
        if form == "BYTE":
            return codes.tobytes()
        if form == "WORD":  # the higher byte is always 0
            return codes.astype("<u2").tobytes()
        scale = record.inputs[channel]
        volts = (codes.astype(float) - scale.zero) * scale.volts_per_code
        return ",".join(self.spell(v) for v in volts).encode()

    # --- measurements, pictures, setups ---

    def _rest(self) -> tuple[Command, ...]:
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
        return self.block(self.setup())

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
        return self.block(writers[name](picture))


def _never(on: bool) -> None:  # noqa: FBT001
    """There is no mathematics in this model.  Raises ScpiError when it is switched on."""
    if on:
        raise ScpiError(-221)


def _named(item: str) -> str:
    spelled = choice(item, _WORDS)
    return next(name for word, name in _ITEMS.items() if choice(word, (word,)) == spelled)

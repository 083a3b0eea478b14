"""A virtual DS1000Z.

Sources: MSO1000Z/DS1000Z Programming Guide as public drivers quote it (ds1054z by P. Klaus; PyMeasure's DS1000Z
driver).  From there: 25 codes per division, code 127 in the middle, 12 divisions, the limits of a block, the
preamble's form, ASCII data with a block's head too.
Assumed: what the error queue says when too much is asked for, the depth that AUTO takes.  The delayed sweep keeps its
numbers within the limits that the guide of a sister series gives, with 12 divisions for 14, and is not drawn.
"""

from __future__ import annotations

from typing import ClassVar

from instruments.virtual.core.parameters import boolean, choice, limit, number, optional_parameter, parameter
from instruments.virtual.core.parser import ScpiError
from instruments.virtual.core.rows import Ask, Both, Do, Number, Row, Switch, Word, whole
from instruments.virtual.oscilloscope.record import Codes, Record
from instruments.virtual.oscilloscope.scope import SETUP, VirtualOscilloscope, at_input, levels, one_two_five

#: Points of the record for one channel shown; half of it for two, a quarter for more.
_DEPTHS = (12_000, 120_000, 1_200_000, 12_000_000, 24_000_000)
_FASTEST = 1e9
#: Points of a trace on the screen.
_ON_SCREEN = 1200
#: Points that one block may have, by format.
_LONGEST = {"BYTE": 250_000, "WORD": 125_000, "ASC": 15_625}

#: The items of :MEASure:ITEM as this maker spells them, and their names in `measure`: most are the same in capitals.
_ITEMS = {
    word: word.upper()
    for word in (
        *("VMAX", "VMIN", "VPP", "VTOP", "VBASe", "VRMS", "PVRMS", "VARIance", "VUPPer", "VMID", "VLOWer"),
        *("OVERshoot", "PREShoot", "PERiod", "FREQuency", "PWIDth", "NWIDth", "PDUTy", "NDUTy", "TVMAX", "TVMIN"),
        *("PSLEWrate", "NSLEWrate", "PPULses", "NPULses", "PEDGes", "NEDGes"),
    )
}
_ITEMS |= {"VAMP": "VAMPLITUDE", "VAVG": "VAVERAGE", "VUP": "VUPPER", "MARea": "AREA", "MPARea": "PERIODAREA"}
_ITEMS |= {"RTIMe": "RISETIME", "FTIMe": "FALLTIME"}
_WORDS = tuple(_ITEMS)
_STATISTICS = ("MAXimum", "MINimum", "CURRent", "AVERages", "DEViation")


def _offsets(scope: VirtualDS1000Z, n: int) -> tuple[float, float]:
    reach = (100.0 if scope.value(f"chan{n}_scale") / scope.probe(n) >= 0.5 else 2.0) * scope.probe(n)
    return -reach, reach


def _times(scope: VirtualDS1000Z) -> tuple[float, float]:
    return -6 * scope.value("time_scale"), max(1.0, 100 * scope.value("time_scale"))


_CHANNEL: tuple[Row, ...] = (
    Number("CHANnel{n}:PROBe", "chan{n}_probe", 10.0, (0.01, 1000.0), rounded=one_two_five),
    Number("CHANnel{n}:SCALe", "chan{n}_scale", 1.0, at_input(1e-3, 10), "V"),
    Number("CHANnel{n}:OFFSet", "chan{n}_offset", 0.0, _offsets, "V"),
    Number("CHANnel{n}:RANGe", "chan{n}_scale", 1.0, at_input(8e-3, 80), "V", factor=8, alias=True),
    Number("CHANnel{n}:TCAL", "chan{n}_delay", 0.0, (-1e-7, 1e-7), "S"),
    Word("CHANnel{n}:COUPling", "chan{n}_coupling", "AC *DC GND"),
    Word("CHANnel{n}:BWLimit", "chan{n}_bandwidth", "20M *OFF"),
    Word("CHANnel{n}:UNITs", "chan{n}_unit", "VOLTage WATT AMPere UNKNown"),
    Switch("CHANnel{n}:DISPlay", "chan{n}_display", lambda n: n == 1),
    Switch("CHANnel{n}:INVert", "chan{n}_invert"),
    Switch("CHANnel{n}:VERNier", "chan{n}_vernier"),
)
_CONTROL: tuple[Row, ...] = (
    Do("RUN", lambda s: s.run()),
    Do("STOP", lambda s: s.stop()),
    Do("SINGle", lambda s: s.take_one()),
    Do("TFORce", lambda s: s.force()),
    Do("AUToscale", lambda s: s.autoscale()),
    Do("CLEar", lambda s: s.clear_screen()),
    Do("DISPlay:CLEar", lambda s: s.clear_screen()),
    Do("CLS", lambda s: s.clear_status()),
    Do("CALibrate:STARt"),
    Do("CALibrate:QUIT"),
)
_TIME: tuple[Row, ...] = (
    Number("TIMebase[:MAIN]:SCALe", "time_scale", 1e-6, (5e-9, 50.0), "S", rounded=one_two_five),
    Number("TIMebase[:MAIN]:OFFSet", "time_offset", 0.0, _times, "S"),
    Word("TIMebase:MODE", "time_mode", "MAIN XY ROLL"),
    Switch("TIMebase:DELay:ENABle", "zoom"),
    Word("ACQuire:TYPE", "acquisition", "NORMal AVERages PEAK HRESolution"),
    whole("ACQuire:AVERages", "averages", 2.0, (2, 1024)),
    Ask("ACQuire:SRATe", lambda s: s.spell(s.full_scale()[0])),
    Both("ACQuire:MDEPth", lambda s, p: s.set_depth(p), lambda s, p: s.depth(p), keeps=("depth", "AUTO")),
    # behind all that the sample rate depends on, so that a setup can be restored row by row
    Number("TIMebase:DELay:SCALe", "zoom_scale", 5e-7, lambda s: s.zoom_scales(), "S", rounded=one_two_five),
    Number("TIMebase:DELay:OFFSet", "zoom_offset", 0.0, lambda s: s.zoom_offsets(), "S"),
)
_TRIGGER: tuple[Row, ...] = (
    Word("TRIGger:MODE", "trigger_mode", "EDGE PULSe SLOPe VIDeo TIMeout"),
    Word("TRIGger:EDGe:SOURce", "trigger_source", lambda s: s.channel_words() + " EXT EXT5 ACLine", "CHAN1"),
    Word("TRIGger:EDGe:SLOPe", "trigger_slope", "POSitive NEGative RFALl"),
    Number("TRIGger[:EDGe]:LEVel", "trigger_level", 0.0, levels(5), "V"),
    Word("TRIGger:SWEep", "trigger_sweep", "AUTO NORMal SINGle"),
    Word("TRIGger:COUPling", "trigger_coupling", "AC *DC LFReject HFReject"),
    Number("TRIGger:HOLDoff", "holdoff", 16e-9, (16e-9, 10.0), "S"),
    Switch("TRIGger:NREJect", "noise_rejection"),
    Ask("TRIGger:STATus", lambda s: s.status_word()),
)
_PARTS = ("XINCrement", "XORigin", "XREFerence", "YINCrement", "YORigin", "YREFerence")
_WAVEFORM: tuple[Row, ...] = (
    Word("WAVeform:SOURce", "wav_source", VirtualOscilloscope.channel_words, "CHAN1"),
    Word("WAVeform:MODE", "wav_mode", "NORMal MAXimum RAW"),
    Word("WAVeform:FORMat", "wav_format", "WORD *BYTE ASCii"),
    whole("WAVeform:STARt", "wav_start", 1.0, (1, 24e6)),
    whole("WAVeform:STOP", "wav_stop", float(_ON_SCREEN), (1, 24e6)),
    Ask("WAVeform:PREamble", lambda s: ",".join(s.preamble())),
    *(Ask(f"WAVeform:{word}", lambda s, k=k: s.preamble()[k]) for k, word in enumerate(_PARTS, start=4)),
    Ask("WAVeform:DATA", lambda s: s.data()),
    Ask("WAVeform:POINts", lambda s: str(s.sequence()[3])),
)
#: What only changes the picture.
_IGNORED = ("CLEar", "RECover", "ADISplay", "AMSource", "STATistic:DISPlay", "STATistic:RESet")
_REST: tuple[Row, ...] = (
    Word("MEASure:SOURce", "measure_source", VirtualOscilloscope.channel_words, "CHAN1"),
    Both("MEASure:ITEM", lambda s, p: s.install(p), lambda s, p: s.item(p)),
    Both("MEASure:STATistic:ITEM", lambda s, p: s.install(p), lambda s, p: s.statistic(p)),
    *(
        Both(f"MEASure:{word}", lambda s, p, w=word: s.install([w, *p]), lambda s, p, w=word: s.item([w, *p]))
        for word in _WORDS
    ),
    *(Both(f"MEASure:{word}", lambda _s, _p: None) for word in _IGNORED),
    Word("MEASure:STATistic:MODE", "statistic_mode", "DIFFerence *EXTRemum"),
    Ask("MEASure:COUNter:VALue", lambda s: s.item(["FREQ"])),
    Word("DISPlay:TYPE", "display_type", "VECTors DOTS"),
    Word("DISPlay:GRID", "grid", "FULL HALF NONE"),
    Word("DISPlay:GRADing:TIME", "persistence", "MIN 0.1 0.2 0.5 1 5 10 INF"),
    whole("DISPlay:WBRightness", "brightness", 50.0, (0, 100)),
    whole("DISPlay:GBRightness", "grid_brightness", 50.0, (0, 100)),
    Both("DISPlay:DATA", None, lambda s, p: s.picture(p)),
    SETUP,
    Ask("SYSTem:ERRor:COUNt", lambda s: str(len(s.parser.errors))),
    Ask("SYSTem:GAM", lambda _s: "12"),
    Ask("SYSTem:RAM", lambda s: str(len(s.channels))),
    Both("MATH:DISPlay", lambda _s, p: _refuse_mathematics(boolean(parameter(p))), lambda _s, _p: "0"),
)


class VirtualDS1000Z(VirtualOscilloscope):
    """A DS1054Z: four channels, 24 million points, 50 MHz."""

    identity = "RIGOL TECHNOLOGIES,DS1054Z,DS1ZVIRTUAL,00.04.04.SP4"
    no_error = '0,"No error"'
    columns, lowest, digits, keeps_old = 12, 0, 9, True
    middle = 127
    CHANNEL_ROWS: ClassVar = _CHANNEL
    ROWS: ClassVar = (*_CONTROL, *_TIME, *_TRIGGER, *_WAVEFORM, *_REST)

    def spell(self, value: float) -> str:
        """Return a number as in the preamble that public drivers quote: 2.000000e-05."""
        return f"{value:.6e}"

    # --- acquiring ---

    def clear_screen(self) -> None:
        """CLEar: begin the acquisition again."""
        if self.running():
            self.run()

    def take_one(self) -> None:
        """SINGle: the sweep says so, too."""
        self.settings["trigger_sweep"] = "SING"
        self.single()

    def on_number_change(self, name: str, before: float) -> None:
        """Begin to acquire: one record with a sweep of SINGle, without end with the others."""
        self._keep_zoom_within()
        super().on_number_change(name, before)
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

    def status_word(self) -> str:
        """TRIGger:STATus?: STOP, RUN (filling), WAIT, TD (triggered) or AUTO."""
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

    # --- time base and memory ---

    def zoom_scales(self) -> tuple[float, float]:
        """Return the delayed sweep: no coarser than the main one, no finer than a fortieth of 50 sample intervals."""
        return one_two_five(50 / self.full_scale()[0] / 40, up=True), self.value("time_scale")

    def zoom_offsets(self) -> tuple[float, float]:
        """Return the delayed sweep: all of it within the main one."""
        reach = 6 * (self.value("time_scale") - self.value("zoom_scale"))
        return self.value("time_offset") - reach, self.value("time_offset") + reach

    def _keep_zoom_within(self) -> None:
        for name, limits in (("zoom_scale", self.zoom_scales), ("zoom_offset", self.zoom_offsets)):
            low, high = limits()
            self.settings[name] = min(max(self.value(name), low), high)

    def set_depth(self, parameters: list[str]) -> None:
        """ACQuire:MDEPth: AUTO, or one of the depths.  Raises ScpiError."""
        text = parameter(parameters).upper()
        if text != "AUTO":
            depths = self._depths()
            points = int(number(text, low=depths[0], high=depths[-1], default=depths[0]))
            if points not in depths:
                raise ScpiError(-222)
            text = str(points)
        self.settings["depth"] = text
        self.on_change("depth")

    def depth(self, parameters: list[str]) -> str:
        """ACQuire:MDEPth?: what is set, or its limits.  Raises ScpiError."""
        asked, depths = optional_parameter(parameters), self._depths()
        return (
            str(int(limit(asked, low=depths[0], high=depths[-1], default=depths[0])))
            if asked
            else str(self.settings["depth"])
        )

    def _depths(self) -> tuple[int, ...]:
        share = self._share()
        return tuple(depth // share for depth in _DEPTHS)

    def _share(self) -> int:
        """Return the number of channels that share converter and memory: 1, 2 or 4."""
        return {0: 1, 1: 1, 2: 2}.get(len(self.visible_channels()), 4)

    # --- scaling ---

    def full_scale(self) -> tuple[float, int]:
        """Return rate and points of a record that fills the screen, or more where even the fastest rate is too slow."""
        fastest, length = _FASTEST / self._share(), self.columns * self.value("time_scale")
        depth = str(self.settings["depth"])
        if depth == "AUTO":
            rate = min(fastest, _DEPTHS[-2] / self._share() / length)
            return rate, max(1, round(rate * length))
        # the depth that is left when channels were added after it had been set
        points = max((d for d in self._depths() if d <= int(depth)), default=self._depths()[0])
        return min(fastest, points / length), points

    def screen(self) -> tuple[float, float]:
        """Return twelve divisions around the offset."""
        scale = self.value("time_scale")
        return self.value("time_offset") - 6 * scale, 12 * scale

    # --- reading the record ---

    def sequence(self) -> tuple[Record, float, float, int]:
        """Return the record, and of the points that can be read: where they begin [s], their distance [s], how many.

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

    def preamble(self) -> list[str]:
        """WAVeform:PREamble?: format, mode, points, averages; distance, first, reference of times and of voltages."""
        record, start, step, points = self.sequence()
        scale = record.inputs[self._source()]
        kind = {"BYTE": 0, "WORD": 1, "ASC": 2}[str(self.settings["wav_format"])]
        mode = {"NORM": 0, "MAX": 1, "RAW": 2}[str(self.settings["wav_mode"])]
        averages = round(self.value("averages")) if self.settings["acquisition"] == "AVER" else 1
        times = (self.spell(step), self.spell(start), "0")
        volts = (self.spell(scale.volts_per_code), str(scale.zero - self.middle), str(self.middle))
        return [str(kind), str(mode), str(points), str(averages), *times, *volts]

    def data(self) -> str:
        """WAVeform:DATA?: the points from STARt to STOP, as a block.  Raises ScpiError if they are too many."""
        record, start, step, points = self.sequence()
        first = round(self.value("wav_start"))
        last = min(points, round(self.value("wav_stop")))
        form = str(self.settings["wav_format"])
        if first > last or last - first + 1 > _LONGEST[form]:
            raise ScpiError(-222)
        channel = self._source()
        codes = record.codes(channel, first - 1, last - first + 1, of=points, start=start, step=step)
        return self.block(self._encode(form, codes, record, channel))

    def _encode(self, form: str, codes: Codes, record: Record, channel: int) -> bytes:
        if form == "BYTE":
            return codes.tobytes()
        if form == "WORD":  # the higher byte is always 0
            return codes.astype("<u2").tobytes()
        return ",".join(self.spell(v) for v in record.inputs[channel].shown(codes)).encode()

    # --- measurements and pictures ---

    def _where(self, parameters: list[str]) -> int:
        if len(parameters) > 1:
            raise ScpiError(-108)
        return self.channel_of(parameters[0] if parameters else str(self.settings["measure_source"]))

    def install(self, parameters: list[str]) -> None:
        """MEASure:ITEM: a measurement for the screen; it must exist.  Raises ScpiError."""
        if not parameters:
            raise ScpiError(-109)
        _name_of_item(parameters[0])
        self._where(parameters[1:])

    def item(self, parameters: list[str]) -> str:
        """MEASure:ITEM?: what is measured.  Raises ScpiError."""
        if not parameters:
            raise ScpiError(-109)
        name, channel = _name_of_item(parameters[0]), self._where(parameters[1:])
        return self.spell(self.measure(name, channel))

    def statistic(self, parameters: list[str]) -> str:
        """Return a statistic of a measurement: every value but the deviation is the present one."""
        if not parameters:
            raise ScpiError(-109)
        kind = choice(parameters[0], _STATISTICS)
        return self.spell(0.0) if kind == "DEV" else self.item(parameters[1:])

    def picture(self, parameters: list[str]) -> str:
        """``[<colour>[,<invert>[,<format>]]]``; without, a picture with 24 bits in colours."""
        if len(parameters) > 3:
            raise ScpiError(-108)
        colour, invert, form = (*parameters, *("ON", "OFF", "BMP24")[len(parameters) :])
        form = choice(form, ("BMP24", "BMP8", "PNG"))
        inverted = invert.upper() in {"ON", "1", "INVERT", "INV"}
        picture = self.screenshot(form, colour=boolean(colour), inverted=inverted)
        return self.block(picture + b"\0\0" * (form == "BMP24"))


def _refuse_mathematics(on: bool) -> None:  # noqa: FBT001
    """Refuse mathematics, which this model has not.  Raises ScpiError when it is switched on."""
    if on:
        raise ScpiError(-221)


def _name_of_item(item: str) -> str:
    spelled = choice(item, _WORDS)
    return next(name for word, name in _ITEMS.items() if choice(word, (word,)) == spelled)

"""A virtual DS1000Z.

Sources: MSO1000Z/DS1000Z Programming Guide as public drivers quote it (ds1054z by P. Klaus; PyMeasure's DS1000Z
driver).  From there: 25 codes per division, code 127 in the middle, 12 divisions, the limits of a block, the
preamble's form, ASCII data with a block's head too.
Assumed: what the error queue says when too much is asked for, the depth that AUTO takes.
"""

from __future__ import annotations

from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import number, one
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.oscilloscope.rigol_ds1000z_reading import MIDDLE, RigolReading
from instruments.virtual.oscilloscope.setup import one_two_five

#: Points of the record for one channel shown; half of it for two, a quarter for more.
_DEPTHS = (12_000, 120_000, 1_200_000, 12_000_000, 24_000_000)
_FASTEST = 1e9
_CODES_PER_DIVISION = 25

_SUPPLIES = ("EXT", "EXT5", "ACLine")


class VirtualDS1000Z(RigolReading):
    """A DS1054Z: four channels, 24 million points, 50 MHz."""

    identity = "RIGOL TECHNOLOGIES,DS1054Z,DS1ZVIRTUAL,00.04.04.SP4"
    no_error = '0,"No error"'
    columns, lowest, keeps_old = 12, 0, True

    def spell(self, value: float) -> str:
        """As in the preamble that public drivers quote: 2.000000e-05."""
        return f"{value:.6e}"

    def table(self) -> tuple[Command, ...]:
        """Its commands."""
        channels = tuple(row for n in self.channels for row in self._channel(n))
        return (*self._control(), *channels, *self._time(), *self._trigger(), *self.waveform(), *self.rest())

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
        )

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
        super().adjusted(name, before)
        if name == "trigger_sweep" and self._armed is not None:
            self._arm(once=self.settings[name] == "SING")

    def run(self) -> None:
        """``:RUN`` after a single record goes on with normal sweep, as the key does."""
        if self.settings["trigger_sweep"] == "SING":
            self.settings["trigger_sweep"] = "NORM"
        super().run()

    def _status(self) -> str:
        if not self.running():
            return "STOP"
        if self.now < self.filled and (self._once or self._record is None):
            return "RUN"
        under_way = self._first_record(self.now)
        latest = under_way or (None if self._once else self._record)
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
        return volts_per_code, MIDDLE + round(self.value(f"chan{channel}_offset") / volts_per_code)

    def window(self, channel: int) -> tuple[float, float]:
        """Eight divisions around the middle."""
        return float(MIDDLE), 8.0 * _CODES_PER_DIVISION

    def fit(self, channel: int, middle: float, division: float) -> None:
        """The offset is what is added to the trace."""
        self.settings |= {f"chan{channel}_scale": division, f"chan{channel}_offset": -middle}

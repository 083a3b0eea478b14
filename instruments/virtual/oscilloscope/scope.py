"""What the virtual oscilloscopes tell of their record: the trace on the screen, measurements, blocks; and autoscale."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from instruments.virtual.oscilloscope.acquisition import ScopeAcquisition
from instruments.virtual.oscilloscope.measure import Measured, edges, measure
from instruments.virtual.oscilloscope.record import COARSEST, open_input
from instruments.virtual.oscilloscope.setup import one_two_five

if TYPE_CHECKING:
    from numpy.typing import NDArray


class VirtualOscilloscope(ScopeAcquisition):
    """A digital oscilloscope of eight bits; a subclass gives the commands and how codes and records are scaled."""

    #: Divisions of the screen from left to right.
    columns: ClassVar[int]
    #: Bytes per second of a long answer (assumed).
    transfer: ClassVar[float] = 1e6
    #: What a measurement is answered with that the trace does not show.
    no_measurement: ClassVar[float] = 9.9e37

    def shown(self) -> list[int]:
        """The channels that are on."""
        return [n for n in self.channels if self.settings[f"chan{n}_display"]]

    def half_level(self) -> None:
        """The trigger level half way between the lowest and the highest voltage on the screen."""
        source = str(self.settings["trigger_source"])
        if source.startswith("CHAN"):
            trace = self.on_screen(int(source[4:]))
            self.settings["trigger_level"] = float(trace.volts.max() + trace.volts.min()) / 2
            self.changed("trigger_level")

    def block(self, data: bytes, *, digits: int) -> str:
        """A definite-length block as text, and the time that it takes."""
        self.busy_until(self._ready + len(data) / self.transfer)
        return f"#{digits}{len(data):0{digits}d}" + data.decode("latin-1")

    def on_screen(self, channel: int, points: int = 50_000) -> Measured:
        """The trace on the screen, from its codes.  Raises ScpiError if there is none."""
        record = self.record()
        start, length = record.screen
        points = max(2, min(points, round(length * record.rate)))
        step = length / points
        codes = record.codes(channel, 0, points, of=points, start=start, step=step)
        scale = record.inputs[channel]
        return Measured((codes.astype(np.float64) - scale.zero) * scale.volts_per_code, step, start)

    def measured(self, name: str, channel: int) -> float:
        """A measurement on the screen, or what stands for none."""
        value = measure(name, self.on_screen(channel))
        return self.no_measurement if value is None else value

    def heights(self) -> dict[int, NDArray[np.float64]]:
        """For the picture: each shown trace, 800 columns from the lower edge of the screen, 0, to the upper, 1."""
        record = self.record()
        heights: dict[int, NDArray[np.float64]] = {}
        start, length = record.screen
        for n in self.shown():
            codes = record.codes(n, 0, 800, of=800, start=start, step=length / 800)
            middle, span = self.window(n)
            heights[n] = 0.5 + (codes.astype(np.float64) - middle) / span
        return heights

    def window(self, channel: int) -> tuple[float, float]:
        """The code in the middle of the screen, and how many codes it is high."""
        raise NotImplementedError

    def autoscale(self) -> None:
        """Scale, offset, time base and level to fit what stands at the inputs."""
        for n in self.channels:
            signal, factor = self._signals.get(n, open_input), self.value(f"chan{n}_probe")
            volts = factor * signal(max(0.0, self.now - 0.5), COARSEST, round(0.5 / COARSEST))
            low, high = float(volts.min()), float(volts.max())
            if high - low < 0.02 * factor:
                continue
            self.settings |= {f"chan{n}_display": True, f"chan{n}_coupling": "DC"}
            self.fit(n, (low + high) / 2, one_two_five((high - low) / 6, up=True))
            found = edges(volts, (low + high) / 2, 0.1 * (high - low))
            if found.size > 1:
                period = float(np.diff(found).mean()) * COARSEST
                self.settings["time_scale"] = one_two_five(3 * period / self.columns, up=True)
            self.settings |= {"trigger_source": f"CHAN{n}", "trigger_level": (low + high) / 2, "trigger_slope": "POS"}
            break
        self.settings |= {"time_offset": 0.0, "trigger_sweep": "AUTO"}
        self.run()

    def fit(self, channel: int, middle: float, division: float) -> None:
        """Show this voltage in the middle of the screen, with so many volts per division."""
        raise NotImplementedError

"""How a virtual CNT-91 hands its results over: series, formats, statistics.  Sources: see its class."""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING

from instruments.ieee488 import NOT_A_NUMBER
from instruments.virtual.core.device import answers
from instruments.virtual.core.parameters import number
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.counter.counter import darkness
from instruments.virtual.counter.parameters import block, without_channels
from instruments.virtual.counter.pendulum_cnt91_settings import SettingsCNT91, number_text

if TYPE_CHECKING:
    from instruments.virtual.core.device import Clock
    from instruments.virtual.core.steps import Steps
    from instruments.virtual.counter.edges import Array, Signal

#: Most readings that one FETCh:ARRay? brings (handbook, 8-39).
_MOST = 10_000


class ReadingsCNT91(SettingsCNT91):
    """Rows for results, and what they answer.  native: see VirtualCNT91."""

    def __init__(self, clock: Clock, *, signal: Signal, second: Signal = darkness, native: bool = False) -> None:
        self._native = native
        super().__init__(clock, signal=signal, second=second)

    # --- tables ---

    def _fetching(self) -> tuple[Command, ...]:
        return (
            Command("FETCh[:SCALar]", get=answers(lambda: self._fetch(1))),
            Command("FETCh:ARRay", get=self._fetch_array),
            Command("READ[:SCALar]", get=answers(self._read)),
            Command("READ:ARRay", get=self._read_array),
            Command("CALCulate:DATA", get=answers(lambda: self._fetch(-1))),
        )

    def _formatting(self) -> tuple[Command, ...]:
        return (
            self.word("FORMat[:DATA]", "format", ("ASCii", "REAL", "PACKed"), "ASC"),
            self.word("FORMat:BORDer", "byte_order", ("NORMal", "SWAPped"), "NORM"),
            self.toggle("FORMat:TINFormation", "stamps"),
            self.integer("FORMat:SMAX", "most", low=4, high=_MOST, default=_MOST),
        )

    def _calculation(self) -> tuple[Command, ...]:
        head = "CALCulate:AVERage:"
        words = ("MEAN", "SDEViation", "MINimum", "MAXimum", "ADEViation")
        return (
            self.toggle("CALCulate:STATe", "mathematics"),
            self.toggle("CALCulate:AVERage[:STATe]", "averaging"),
            self.integer(head + "COUNt", "averaged", low=2, high=2e9, default=100),
            Command(head + "COUNt:CURRent", get=answers(lambda: str(self.there()))),
            self.word(head + "TYPE", "average_type", (*words, "MINMax"), "MEAN"),
            Command(head + "ALL", get=answers(self._all_statistics)),
        )

    # --- series ---

    def _wanted(self) -> float:
        """Results of one INITiate."""
        if self.settings["averaging"]:
            return self._value("averaged")
        return self._value("armings") * self._value("triggers")

    def _read(self) -> Steps[str]:
        """READ? is ABORt, INITiate and FETCh?."""
        self._restart()
        return (yield from self._fetch(1))

    def _read_array(self, parameters: list[str]) -> Steps[str]:
        count = self._size(parameters)
        if count > self._wanted():
            raise ScpiError(-221)
        self._restart()
        most = count if math.isfinite(count) else min(self._wanted(), self._value("most"))
        return (yield from self._fetch(int(most)))

    def _restart(self) -> None:
        self._stop()
        self.settings["continuous"] = False
        self._initiate()

    def _initiate(self, *, endless: bool = False) -> None:
        """INITiate."""
        raise NotImplementedError

    def _size(self, parameters: list[str]) -> float:
        words = without_channels(parameters)
        if len(words) != 1:
            raise ScpiError(-108 if words else -109)
        if words[0].upper() in {"MAX", "MAXIMUM"}:
            return math.inf
        return float(round(number(words[0], low=-_MOST, high=_MOST, default=1)))

    def _fetch_array(self, parameters: list[str]) -> Steps[str]:
        count = self._size(parameters)
        if not count:
            raise ScpiError(-222)
        if math.isfinite(count):
            return (yield from self._fetch(int(count)))
        there = self.there()
        fresh = there - self._memory.fetched
        if not fresh and not self.idle(self._ready):
            raise ScpiError(-230)
        if not fresh:  # all were fetched: it begins again with the first one
            self._memory.fetched, fresh = 0, there
        return (yield from self._fetch(int(min(fresh, self._value("most"))), size_known=False))

    def _fetch(self, count: int, *, size_known: bool = True) -> Steps[str]:
        """So many results, from where the last fetch ended; a negative number: the last ones, the place is kept."""
        if self._run is None and not self._memory.held:
            raise ScpiError(-230)
        if self.settings["averaging"]:
            return (yield from self._fetch_statistic())
        if count < 0:
            there = self.there()
            if there < -count and not (yield from self._wait_until(-count)):
                return ""
            there = self.there()
            return self._spell(*self._memory.part(there + count, there))
        if self._memory.fetched >= self._memory.held and self.idle(self._ready):
            self._memory.fetched = 0
        start = self._memory.fetched
        if not (yield from self._wait_until(start + count)):
            return ""
        self._memory.fetched = start + count
        return self._spell(*self._memory.part(start, start + count), size_known=size_known)

    def _wait_until(self, held: int) -> Steps[bool]:
        """Wait until the memory holds so many.  Raises ScpiError if it never will."""
        gone = self._run.taken - self._memory.held if self._run else 0
        if held > self._memory.held and (self._run is None or gone + held > self._run.wanted):
            raise ScpiError(-230)
        return (yield from self.wait_for(gone + held))

    def _fetch_statistic(self) -> Steps[str]:
        """With statistics on, what is fetched is their result."""
        if not (yield from self.wait_for()):
            return ""
        name = {"MEAN": "mean", "SDEV": "sdev", "MIN": "min", "MAX": "max", "ADEV": "adev", "MINM": "min"}
        return number_text(self.statistics()[name[str(self.settings["average_type"])]])

    def _all_statistics(self) -> Steps[str]:
        """Mean, standard deviation, least, greatest, peak to peak."""
        yield from self.wait_for()
        found = self.statistics()
        return ",".join(number_text(found[name]) for name in ("mean", "sdev", "min", "max", "ptp"))

    # --- formats ---

    def _spell(self, values: Array, stamps: Array, *, size_known: bool = True) -> str:
        """Results in the format that is set (handbook, 8-36 and 8-39).

        REAL is a block of eight bytes for each number, PACKed one block for all, time stamps in it as whole
        picoseconds; and if the size was not told, its length has six digits.
        """
        kind, order = self.settings["format"], "<" if self.settings["byte_order"] == "SWAP" else ">"
        pairs = [(float(value), float(stamp)) for value, stamp in zip(values, stamps, strict=True)]
        stamped = bool(self.settings["stamps"])
        numbers = [number for pair in pairs for number in pair[: 1 + stamped]]
        if kind == "ASC":
            return ",".join(self._missing(value) for value in numbers)
        missing = math.nan if self._native else NOT_A_NUMBER
        if kind == "REAL":
            reals = (missing if value == NOT_A_NUMBER else value for value in numbers)
            return ",".join(block(struct.pack(order + "d", value)) for value in reals)
        data = b"".join(
            struct.pack(order + "d", missing if value == NOT_A_NUMBER else value)
            + (struct.pack(order + "q", round(stamp * 1e12)) if stamped else b"")
            for value, stamp in pairs
        )
        return block(data) if size_known else f"#6{len(data):06d}" + data.decode("latin-1")

    def _missing(self, value: float) -> str:
        return "" if self._native and value == NOT_A_NUMBER else number_text(value)

"""How a virtual 53230A hands its readings over: memory, formats, statistics.  Sources: see its class."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from instruments.ieee488 import NOT_A_NUMBER
from instruments.virtual.core.device import answers, does
from instruments.virtual.core.parameters import at_most_one, choice, nr3, number
from instruments.virtual.core.parser import Command, ScpiError
from instruments.virtual.counter.keysight_53230a_settings import Settings53230A
from instruments.virtual.counter.parameters import block, without_channels

if TYPE_CHECKING:
    from instruments.virtual.core.steps import Steps
    from instruments.virtual.counter.edges import Array


class Readings53230A(Settings53230A):
    """Rows for readings, and what they answer."""

    # --- tables ---

    def _memory_rows(self) -> tuple[Command, ...]:
        return (
            Command("R", get=self._remove_what_is_there),
            Command("DATA:REMove", get=self._remove),
            Command("DATA:POINts", get=answers(lambda: f"{self.there() - self._memory.fetched:+d}")),
            Command("DATA:LAST", get=answers(self._last)),
            Command("FORMat[:DATA]", self._set_format, answers(self._format)),
            self.word("FORMat:BORDer", "byte_order", ("NORMal", "SWAPped"), "NORM"),
        )

    def _calculation(self) -> tuple[Command, ...]:
        self._defaults["format"] = "ASC"
        head = "CALCulate[1]:AVERage:"
        names = {"AVERage": "mean", "SDEViation": "sdev", "MINimum": "min", "MAXimum": "max"}
        names |= {"PTPeak": "ptp", "ADEViation": "adev"}
        return (
            self.toggle("CALCulate[1][:STATe]", "mathematics"),
            self.toggle("CALCulate[1]:AVERage[:STATe]", "averaging"),
            Command(head + "ALL", get=answers(lambda: self._statistic("mean", "sdev", "min", "max"))),
            Command(head + "COUNt[:CURRent]", get=answers(lambda: f"{self.there() - self._counted_from:+d}")),
            Command(head + "CLEar[:IMMediate]", set=does(self._clear_statistics)),
            *(
                Command(head + word, get=answers(lambda name=name: self._statistic(name)))  # type: ignore[misc]
                for word, name in names.items()
            ),
        )

    # --- the memory ---

    def _fetch(self) -> Steps[str]:
        """FETCh?: all readings, when there are all; they stay in the memory."""
        if self._run is None and not self._memory.held:
            raise ScpiError(-230)
        if not (yield from self.wait_for()):
            return ""
        values, _ = self._memory.part(self._memory.fetched, self._memory.held)
        return self._spell(values, head="#0")

    def _remove_what_is_there(self, parameters: list[str]) -> str:
        """R? [n]: at most n of the readings that are there, as a block, taken out of the memory."""
        text = at_most_one(parameters)
        most = number(text, low=1, high=1e6, default=1e6) if text else math.inf
        there = self.there()
        if there == self._memory.fetched and self.idle(self._ready):
            raise ScpiError(-230)
        return self._take(int(min(most, there - self._memory.fetched)), as_block=True)

    def _remove(self, parameters: list[str]) -> Steps[str]:
        """DATA:REMove? n[,WAIT]: n readings, taken out of the memory, waited for if they are still to come."""
        words = without_channels(parameters)
        if not words:
            raise ScpiError(-109)
        if len(words) > 2 or (len(words) == 2 and words[1].upper() != "WAIT"):
            raise ScpiError(-224)
        count = int(number(words[0], low=1, high=1e6, default=1))
        there = self.there()
        if there - self._memory.fetched < count:
            gone = self._run.taken - self._memory.held if self._run else 0
            wanted = gone + self._memory.fetched + count
            if len(words) == 1 or self._run is None or wanted > self._run.wanted:
                raise ScpiError(-230)
            if not (yield from self.wait_for(wanted)):
                return ""
        return self._take(count, as_block=False)

    def _take(self, count: int, *, as_block: bool) -> str:
        start = self._memory.fetched
        self._memory.fetched += count
        values, _ = self._memory.part(start, start + count)
        if as_block and self.settings["format"] == "ASC":
            return block(",".join(map(nr3, values)).encode())
        return self._spell(values)

    def _last(self) -> str:
        there = self.there()
        return nr3(float(self._memory.part(there - 1, there)[0][0]) if there else NOT_A_NUMBER)

    # --- formats and statistics ---

    def _spell(self, values: Array, head: str = "") -> str:
        """Readings in the format that is set.  head: of a block, if it does not tell its length."""
        if self.settings["format"] == "ASC":
            return ",".join(map(nr3, values))
        data = values.astype("<f8" if self.settings["byte_order"] == "SWAP" else ">f8").tobytes()
        return head + data.decode("latin-1") if head else block(data)

    def _set_format(self, parameters: list[str]) -> None:
        words = without_channels(parameters)
        if not words:
            raise ScpiError(-109)
        wanted = choice(words[0], ("ASCii", "REAL"))
        length = {"ASC": "15", "REAL": "64"}[wanted]
        if len(words) > 2 or (len(words) == 2 and words[1].upper() not in {length, "DEF", "MIN", "MAX"}):
            raise ScpiError(-224)
        self.settings["format"] = wanted

    def _format(self) -> str:
        return "ASC,15" if self.settings["format"] == "ASC" else "REAL,64"

    def _statistic(self, *names: str) -> str:
        found = self.statistics()
        return ",".join(nr3(found[name]) for name in names)

    def _clear_statistics(self) -> None:
        self._counted_from = self.there()

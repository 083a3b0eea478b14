"""A virtual instrument that takes its time, and says what is no text."""

from instruments.virtual.core.device import VirtualInstrument
from instruments.virtual.core.rows import Ask

IDENTITY = "levilab,slow,0,0"
ANY_BYTES = bytes(range(256)) * 4


class Slow(VirtualInstrument):
    """Answers ``SLOW?`` after five seconds, ``DATA?`` with a block, ``BINary?`` with what is no text."""

    identity = IDENTITY

    ROWS = (
        Ask("SLOW", lambda d: d._slow()),
        Ask("DATA", lambda _d: f"#4{len(ANY_BYTES):04d}" + ANY_BYTES.decode("latin-1")),
        Ask("CUT", lambda _d: "#4102"),
        Ask("LIST", lambda _d: "1,2,1,1,1"),
        Ask("BINary", lambda _d: "\xff\xfe"),
    )

    def _slow(self):
        self.busy_until(self.clock.now() + 5.0)
        return "slow"

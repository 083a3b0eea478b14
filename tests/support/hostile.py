"""What an instrument may have to bear: words to make messages of, a cheap world, and what must hold afterwards.

Used by tests/instruments/virtual/bench/test_fuzz.py and by fuzz/.
"""

import functools
import inspect
import math
import re
import sys

import numpy as np

from instruments.catalogue import CATALOGUE
from instruments.clock import VirtualClock
from instruments.virtual.bench.session import Session
from instruments.virtual.core.message import LONGEST_LINE
from instruments.virtual.core.parser import LONGEST_ANSWER
from levilab.world.bench import VIRTUAL_MODELS

#: Samples that one message may make a model look at: three channels for three hours at 20 kHz (see `counting`).
MOST_LOOKS = 3 * 12_100 * 20_000
#: Numbers that an instrument never gives back bigger [s].
LATEST = 1e38


class Room:
    """A world that costs little: light at 30 Hz, a field at rest; it counts what is looked at and driven."""

    seed = 0

    def __init__(self):
        self.clock = VirtualClock()
        self.looks = self.driven = 0

    def light(self, start, step, n):
        self._looked(start, step, n)
        # the phase of one look; what the signal does within it is a triangle, which is cheap
        return np.abs((30.0 * (start % 1.0) + 30.0 * step * np.arange(n)) % 1.0 - 0.5) * 2.4

    def coil_field(self, start, step, n):
        self._looked(start, step, n)
        return np.zeros(n)

    laser = coil_field

    def crossings(self, start, stop, triggers):
        return None

    def _looked(self, start, step, n):
        assert math.isfinite(start)
        assert step > 0
        assert n >= 0
        self.looks += n

    def drive(self, time, output):
        assert all(map(math.isfinite, (time, output.frequency, output.amplitude, output.offset)))
        self.driven += 1

    def flux_density(self, time):
        assert math.isfinite(time)
        self.looks += 1
        return 0.019


#: The models that answer messages of SCPI; those with a scheme of their own have a link of their own, too.
NAMES = {row.name: (kind, row.name) for kind, rows in CATALOGUE.items() for row in rows if not row.scheme}


def instrument(name, room=None):
    """A virtual instrument of this model, in a room of its own."""
    kind, model = NAMES[name]
    return VIRTUAL_MODELS[kind][model](room or Room())


# --- words ---


def spellings(pattern):
    """Headers that a pattern of a table stands for: short with all that is optional left out, and long with all of it.

    >>> spellings("[SOURce[1]:]FREQuency[:CW|:FIXed]")
    ['FREQ', 'SOURCE1:FREQUENCY:CW', 'source:freq:fix']
    >>> spellings("C1:(VDIV|VOLT_DIV)")
    ['C1:VDIV', 'C1:VOLT_DIV', 'c1:vdiv']
    """
    first, second = (re.sub(r"\(([^|)]*)\|?([^)]*)\)", place, pattern) for place in (r"\1", r"\2"))
    if first != pattern:  # one word or the other, as the LeCroy dialect has them
        return [first, second, first.lower()]
    bare = _without_brackets(pattern)
    whole = re.sub(r"\|[^\]|]*", "", pattern).replace("[", "").replace("]", "")
    other = re.sub(r"\[[^\]|]*\|", "[", pattern)
    other = re.sub(r"\[\d\]", "", other).replace("[", "").replace("]", "").replace("|", "")
    short = re.sub("[a-z]", "", bare)
    mixed = re.sub(r"([A-Z]+)([a-z]*)", lambda m: m[1].lower() if len(m[0]) % 2 else m[0].lower(), other)
    return [short, whole.upper(), mixed]


def _without_brackets(pattern):
    while (shorter := re.sub(r"\[[^\[\]]*\]", "", pattern)) != pattern:
        pattern = shorter
    return pattern


def headers(device):
    """Every header of an instrument, in several spellings, as commands and as questions."""
    found = [spelled for row in device.commands.rows for spelled in spellings(row.header)]
    return [*found, *(header + "?" for header in found)]


def words(device):
    """The words in quotes in the sources of an instrument: parameters, units and names among them."""
    modules = {sys.modules[owner.__module__] for owner in type(device).__mro__ if owner is not object}
    found = {
        word for module in modules for word in re.findall(r'"([A-Z][A-Za-z0-9_:\\.]*)"', inspect.getsource(module))
    }
    return sorted({spelled for word in found for spelled in (re.sub("[a-z]", "", word), word)})


_PLAIN = """
0 -0 1 2 3 1.0 -1 10 -3 99 1e3 2.5e-3 1e-9 1e9 12000 24000000 1000000 1e99 -1e99 1e999 -1e999 1e-999 9.9e37 9.91E37
99999999999999999999 1_000 + . 1e 0x10 NAN INF -INF MIN MAX DEF ON OFF ONCE mV (@1) (@1,2) (@2),(@1) (@1:2) (@) (@3) (1)
(( )) (@ ) , ,,, ; : ? * MAX,1 10,WAIT 1,2,3,4,5,6,7,8 CHAN1 CHAN2 CHAN9 D0 MATH VOLATILE TEST VOLATILE,1,1 1,nan,1
1e999,1 0,0.5,1,0.5,0,-0.5,-1,-0.5
"""
#: Parameters that have broken programs before: numbers, words, channels, strings and blocks, whole and in part.
NASTY = (
    *_PLAIN.split(),
    *("1 kHz", "1MHZ", "1 MAHZ", "5 Vpp", "1 VRMS", "300 DBM", "-1e999 DBM", "1e999 dbm", "180 DEG", "3 RAD", "1ms"),
    *("9" * 5000, f"(@{'9' * 5000})", "-" + "1" * 400, f"0.{'0' * 5000}1", "1e" + "9" * 50, "a" * 300, "50 OHM"),
    *('"', "'", '""', "''", '"a;b,c"', "'\"", f'"{"x" * 3000}"', '" "', '"FREQ 1"', '"PER:BTB 2"', '"FREQ (@1),(@2)"'),
    *("#", "#0", "#0abc", "#1", "#10", "#11\n", "#12ab", "#15abc", "#9999999999", "#900000000", "#\xb2\xb2\xb2"),
    *("#3\xb2\xb3\xb9", "#216" + "\x00" * 16, "#216" + "\xff" * 16, "#232" + "?\0\0\0" * 8, "#6000012:CHAN1:SCAL 1"),
    *("#9000000016" + "\x01" * 16, "VOLATILE,#216" + "?\0\0\0" * 4, "TEST2,#232" + "?\0\0\0" * 8, "T,#\xb2\xb2"),
    *("TEST,0,.1,.2,.3,.4,.5,.6,.7", ",".join(["0.1"] * 200), "\xb2", "\xe9", "\xff", "\0", "\x80\x81", "\xa0", "\x0b"),
)


# --- what must hold ---


#: An entry of the error queue (IEEE 488.2, 8.7.8): a number, and a string in which quotes are doubled.
ENTRY = re.compile(r'[+-]\d+,"(?:[ !#-~]|"")*"')


@functools.lru_cache(100)
def is_entry(text):
    """Whether a text is an entry of the error queue; most of the queue was there after the message before, too."""
    return ENTRY.fullmatch(text) is not None


class Bench:
    """One instrument, a program's link to it, and the watch over both."""

    def __init__(self, name, *, stream=False):
        self.room = Room()
        self.device = instrument(name, self.room)
        self.session = Session(self.device, stream=stream)
        self.name, self.stream = name, stream
        self._sound: dict[str, object] = {}

    def send(self, data, *, end=True):
        """Bytes to the instrument: no time passes by itself, and what is worked out and kept is bounded."""
        clock, before, looks = self.room.clock, self.room.clock.now(), self.room.looks
        self.session.write(data, end=end)
        assert clock.now() == before, "an instrument lets no time pass"
        messages = 1 + data.count(b"\n")
        units = messages + data.count(b";")
        assert self.room.looks - looks <= units * MOST_LOOKS
        self.check()

    def check(self):
        device, session = self.device, self.session
        assert len(device.parser.errors) <= device.queue_size
        assert all(map(is_entry, device.parser.errors))
        assert len(device.commands._actions) <= 20_000
        assert len(session._framer._buffer) <= LONGEST_LINE + (1 << 26)
        assert not math.isnan(device._ready)
        assert 0 <= device.status.events < 256
        if device.settings == self._sound:
            return
        for name, value in device.settings.items():
            assert isinstance(value, float | int | str | bool), name
            if isinstance(value, float):
                assert math.isfinite(value) or name == "timeout", name
            elif isinstance(value, str):
                assert len(value) < 5000, name
        self._sound = dict(device.settings)

    def read(self, timeout=1.0, most=1 << 20):
        """What has come, at least up to the time-out and never later."""
        clock, before = self.room.clock, self.room.clock.now()
        got = self.session.read(most, timeout)
        assert before <= clock.now() <= before + timeout + 1e-9 * max(1.0, before)
        if got is not None:
            assert len(got[0]) <= LONGEST_ANSWER + (1 << 24)
        return got

    def recover(self):
        """As a program does: a device clear or a new link, the queue emptied, and who is there?"""
        self.session.clear()
        if self.stream:
            self.session = Session(self.device, stream=True)
        self.send(b"*CLS\n*IDN?\n")
        got = self.read(10.0)
        expected = (self.device.identity + self.device.line_end).encode()
        assert got is not None, "no identity"
        assert got[0] == expected
        self.send(b"SYST:ERR?\n")
        if self.device.takes_blocks:
            assert self.read(10.0)[0].decode().strip() == self.device.no_error

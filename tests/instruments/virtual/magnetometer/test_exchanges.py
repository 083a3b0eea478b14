"""What the virtual gaussmeters answer: an exchange a row.

Sources: Lake Shore Model 425 User's Manual, chapter 6; Model 475 User's Manual, chapter 6; drivers of PyMeasure and
fsc2.
"""

import math

import pytest

from instruments.virtual.magnetometer.lakeshore_425 import Virtual425
from instruments.virtual.magnetometer.lakeshore_475 import Virtual475
from support.exchanges import about, carry_out, exchanges


def meter(kind, field=0.0123, **options):
    """What makes a meter without an error of its own; field: a number or a function of time [T]."""
    density = field if callable(field) else lambda _: field

    def make(clock):
        return kind(clock, flux_density=density, **({"zero_error": 0.0} | options))

    make.__name__ = kind.__name__
    return make


def alternating(amplitude, frequency, offset=0.0):
    return lambda time: offset + amplitude * math.sin(2 * math.pi * frequency * time)


NEW, OLD = (meter(Virtual475),), (meter(Virtual425),)
BOTH = OLD + NEW
ALTERNATING = alternating(2e-3, 50.0, offset=0.01)


def has(bit, *, on=True):
    """The operation status has a bit, or not."""
    return lambda device: bool(int(device.execute("OPST?").data) & bit) is on


def is_unchanged(device):
    return device.settings == device.commands.defaults


def near(value, rel):
    return pytest.approx(value, rel=rel)


NOT_UNDERSTOOD = ("FOO?", "RDGFIELD", "SYST:ERR?", "UNIT", "UNIT 5;UNIT?", "UNIT x;UNIT?", "?")
NO_NUMBERS = ("UNIT 0", "UNIT 5", "UNIT 1.5", "RANGE 0", "RANGE 9", "AUTO 2", "RDGMODE 9,1,1")
MESSAGES = {
    "a 425 says who it is": (OLD, ("*IDN?", "LSCI,MODEL425,VIRTUAL,1.0")),
    "a 475 says who it is": (NEW, ("*IDN?", "LSCI,MODEL475,VIRTUAL,01012020")),
    "so does a 455": (
        *((meter(Virtual475, identity="LSCI,MODEL455,VIRTUAL,01012020"),), ("*IDN?", "LSCI,MODEL455,VIRTUAL,01012020")),
    ),
    **{f"{message} is ignored": (BOTH, (message, None), ("UNIT?", "1")) for message in NOT_UNDERSTOOD},
    **{f"{message} changes nothing": (BOTH, message, is_unchanged) for message in NO_NUMBERS},
    **{
        f"the field in the unit {unit}": (
            *(BOTH, f"UNIT {unit}", ("RDGFIELD?", near(0.0123 * per_tesla, 1e-3)), ("UNIT?", str(unit))),
        )
        for unit, per_tesla in ((1, 1e4), (2, 1.0), (3, 1e4), (4, 1 / (4e-7 * math.pi)))
    },
    **{
        f"what is no character is a blank: {message!r}": (OLD, (message, "1"))
        for message in ("\0UNIT? \r", "  UNIT? \r", "\x0bUNIT?\x0c", "UNIT?;\x85")
    },
    "several questions in one message": (OLD, ("UNIT 2;UNIT?;RANGE 3;RANGE?", "2;3")),
    "a question mark alone asks again": (
        *(OLD, ("UNIT?", "1"), ("?", "1"), ("AUTO?", "1"), ("?", "1"), "UNIT 2", ("UNIT?", "2"), ("?", "2")),
    ),
}

READINGS = {
    **{
        f"an alternating field is its r.m.s. without the steady part, {kind.__name__}": (
            *((meter(kind, ALTERNATING),), ("UNIT 2;RDGMODE " + mode + ";UNIT?", "2"), 1.0),
            ("RDGFIELD?", near(2e-3 / math.sqrt(2), 3e-3)),
        )
        for kind, mode in ((Virtual425, "2,1,1"), (Virtual475, "2,2,1,1,1"))
    },
    "a steady reading is a mean over the filter": (
        *((meter(Virtual425, ALTERNATING), meter(Virtual475, ALTERNATING)), 2.0),
        ("UNIT 2;RDGFIELD?", near(0.01, 2e-2)),
    ),
    "positive and negative peaks": (
        *((meter(Virtual475, alternating(2e-3, 47.0, 1e-3)),), "UNIT 2;RDGMODE 3,2,1,1,1", 1.0),
        *(("RDGFIELD?", about(3e-3, 1e-5)), "RDGMODE 3,2,1,1,2", ("RDGFIELD?", about(-1e-3, 1e-5))),
    ),
    "a mode set in part keeps the rest": (NEW, ("RDGMODE 2, 3;RDGMODE?", "2,3,1,1,1")),  # so does fsc2 with a 455
    "control, and the compensations of the probe": (  # both on, as the maker delivers it
        *(NEW, ("PRBFCOMP?;PRBTCOMP?", "1;1"), ("CPARAM 0.25,0.5,100,3;CPARAM?", [0.25, 0.5, 100, 3])),
    ),
    "without a probe there is no field": (
        *((meter(Virtual425, probe=None), meter(Virtual475, probe=None)), ("RDGFIELD?", "NO PROBE")),
        ("OPST?;TYPE?", "001;00"),
    ),
    "a range chosen by hand ends the automatic choice": (
        *(BOTH, ("AUTO?", "1"), ("RANGE 4;AUTO?;RANGE?", "0;4"), ("AUTO;AUTO?", "1")),  # as PyMeasure sends it
    ),
}

ZERO = {
    "zeroing takes its time, and then the present field is zero": (
        *((meter(Virtual425, 20e-6, zero_error=5e-6), meter(Virtual475, 20e-6, zero_error=5e-6)), "UNIT 2", 2.0),
        *(("RDGFIELD?", near(25e-6, 0.1)), "ZPROBE", ("RDGFIELD?", near(25e-6, 0.1)), has(128, on=False), 6.0),
        *(has(128), ("RDGFIELD?", about(0.0, 5e-7)), "ZCLEAR", 1.0, ("RDGFIELD?", near(25e-6, 0.1))),
    ),
    "peaks are counted from the zero that was taken": (  # a steady 12.3 mT: both are the field, and the probe's error
        *((meter(Virtual475, zero_error=5e-6),), 2.0, ("UNIT 2;RDGMODE 3;RDGFIELD?", near(12.305e-3, 1e-3))),
        *(("ZPROBE;*OPC?", "1"), 2.0, ("RDGFIELD?", about(0.0, 5e-7))),
    ),
    "the 475 holds its answer until it is zeroed": (
        *(NEW, ("ZPROBE;*OPC?", "1"), lambda device: device.clock.now() == about(5.0, 0.1), has(128)),
    ),
}

STATUS = {
    **{f"the 425 has no {question}": (OLD, (question, None)) for question in ("*ESR?", "*STB?", "*OPC?", "*TST?")},
    "the 475 sets event bits for what it does not understand": (
        *(NEW, ("*ESR?", "128"), "FOO?", "UNIT 9", ("*ESR?;*ESR?", "048;000")),
    ),
    "a reset leaves the masks of the status": (*(NEW, "*ESE 48;*SRE 16;FOO;*RST", ("*ESE?;*SRE?;*STB?", "48;16;032")),),
}


@exchanges(MESSAGES | READINGS | ZERO | STATUS)
def test_an_exchange_goes_as_the_manual_says(make, steps):
    carry_out(make, steps)

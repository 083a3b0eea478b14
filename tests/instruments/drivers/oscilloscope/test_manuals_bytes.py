"""The oscilloscopes' drivers: the manuals' bytes.

Sources: MSO1000Z/DS1000Z Programming Guide, InfiniiVision X-Series Programmer's Guides, as public drivers quote them.
"""

import math

import pytest

from instruments.clock import VirtualClock
from instruments.drivers.oscilloscope import NeverTriggered, NothingAcquired
from instruments.drivers.oscilloscope.keysight_dsox import KeysightDSOX
from instruments.drivers.oscilloscope.rigol_ds1000z import RigolDS1000Z
from instruments.errors import BadAnswer, CommandRefused, InstrumentError, NoAnswer, OutOfRange, WrongInstrument
from support.conversation import CLEAR, NO_ERROR, SILENCE, accepted
from support.talks import Raises, talk, talks


def rigol(script):
    return RigolDS1000Z(script, clock=VirtualClock())


def keysight(script):
    return KeysightDSOX(script, clock=VirtualClock())


RIGOL = ("*IDN?", "RIGOL TECHNOLOGIES,DS1054Z,DS1ZA171812345,00.04.04.SP4")
KEYSIGHT = ("*IDN?", "KEYSIGHT TECHNOLOGIES,DSO-X 1102G,CN57096441,01.20.2019061038")
#: As in the guide of the DS1000Z, and as a DSOX1102G says after ``*RST``, in bytes.
RIGOL_PREAMBLE = "0,2,5,1,2.000000e-05,-1.456000e-02,0,4.000000e-02,-75,127"
KEYSIGHT_PREAMBLE = "+0,+0,+5,+1,+1.60000000E-008,-5.00000000E-004,+0,+2.01005025E-001,+1.50000000E+000,+128"
PULSES = {"duration_s": 0.1, "points": 100_000, "volts_per_division": 0.2, "offset_v": 0.6, "trigger_level_v": 0.65}


def answered(*lines):
    return [tuple(line.split()) for line in lines]


#: The settings sent to the scope, as it answers them: numbers in another form, a depth and switches as numbers.
RIGOL_KEPT = answered(
    *("CHAN1:DISP? 1", "CHAN1:PROB? 1.000000e+00", "CHAN1:COUP? DC", "CHAN1:INV? 0", "CHAN1:SCAL? 2.000000e-01"),
    *("CHAN1:OFFS? -6.000000e-01", ":TIM:MODE? MAIN", ":TIM:SCAL? 1.000000e-02", ":TIM:OFFS? 0.000000e+00"),
    *(":ACQ:TYPE? NORM", ":ACQ:MDEP? 1.200000e+05", ":TRIG:MODE? EDGE", ":TRIG:EDGE:SOUR? CHAN1"),
    *(":TRIG:EDGE:SLOP? POS", ":TRIG:EDGE:LEV? 6.480000e-01", ":TRIG:SWE? NORM"),
)
KEYSIGHT_KEPT = answered(
    *("CHAN1:DISP? 1", "CHAN1:PROB? +1.0E+00", "CHAN1:COUP? DC", "CHAN1:INV? 0", "CHAN1:SCAL? +200E-03"),
    *("CHAN1:OFFS? +6.03015E-01", ":TIM:MODE? MAIN", ":TIM:REF? CENT", ":TIM:RANG? +1.00E-01", ":TIM:POS? +0.0E+00"),
    *(":ACQ:TYPE? NORM", ":TRIG:MODE? EDGE", ":TRIG:EDGE:SOUR? CHAN1", ":TRIG:EDGE:SLOP? POSITIVE"),
    *(":TRIG:EDGE:LEV? +650E-03", ":TRIG:SWE? NORM"),
)
OTHERS = accepted("CHAN3:DISP OFF", "CHAN4:DISP OFF")


def rigol_prepared(others=OTHERS, sweep="NORM", first=RIGOL):
    sent = (
        *(":RUN", "CHAN1:DISP ON", "CHAN1:PROB 1.0", "CHAN1:COUP DC", "CHAN1:INV OFF", "CHAN1:SCAL 0.2"),
        *("CHAN1:OFFS -0.6", "CHAN2:DISP OFF"),
    )
    then = (
        *(":TIM:MODE MAIN", ":TIM:SCAL 0.01", ":TIM:OFFS 0.0", ":ACQ:TYPE NORM", ":ACQ:MDEP 120000"),
        *(":TRIG:MODE EDGE", ":TRIG:EDGE:SOUR CHAN1", ":TRIG:EDGE:SLOP POS", ":TRIG:EDGE:LEV 0.65"),
        f":TRIG:SWE {sweep}",
    )
    return [first, ("*CLS", None), *accepted(*sent), *others, *accepted(*then), *RIGOL_KEPT[:-1], (":TRIG:SWE?", sweep)]


KEYSIGHT_SENT = (
    *(":STOP", "CHAN1:DISP ON", "CHAN1:PROB 1.0", "CHAN1:COUP DC", "CHAN1:INV OFF", "CHAN1:SCAL 0.2"),
    *("CHAN1:OFFS 0.6", "CHAN2:DISP OFF", ":TIM:MODE MAIN", ":TIM:REF CENT", ":TIM:RANG 0.1", ":TIM:POS 0.0"),
    *(":ACQ:TYPE NORM", ":TRIG:MODE EDGE", ":TRIG:EDGE:SOUR CHAN1", ":TRIG:EDGE:SLOP POS"),
    *(":TRIG:EDGE:LEV 0.65", ":TRIG:SWE NORM"),
)
KEYSIGHT_PREPARED = [KEYSIGHT, ("*CLS", None), *accepted(*KEYSIGHT_SENT), *KEYSIGHT_KEPT]
STOPPED = [("*CLS", None), *accepted(":STOP")]
SINGLE = accepted(":SING")
RIGOL_ACQUIRED = [*SINGLE, *((":TRIG:STAT?", word) for word in ("WAIT", "TD", "STOP"))]
RIGOL_READ = [*RIGOL_ACQUIRED, *accepted(":WAV:SOUR CHAN1", ":WAV:MODE RAW", ":WAV:FORM BYTE")]
KEYSIGHT_ACQUIRED = [
    *((":AER?", "+1"), *SINGLE, (":AER?", "+0"), (":OPER:COND?", "+8"), (":AER?", "+1"), (":OPER:COND?", "+40")),
    (":OPER:COND?", "+0"),
]
KEYSIGHT_READ = [
    *(*KEYSIGHT_PREPARED, *KEYSIGHT_ACQUIRED, *accepted(":WAV:SOUR CHAN1", ":WAV:FORM BYTE", ":WAV:UNS 1")),
    *accepted(":WAV:POIN:MODE RAW", ":WAV:POIN 100000"),
]
PREPARED = {"rigol": (rigol, rigol_prepared()), "keysight": (keysight, KEYSIGHT_PREPARED)}


def piece(first, last, block):
    """The lines that ask a Rigol for a piece of its memory."""
    return [(f":WAV:STAR {first}", None), (f":WAV:STOP {last}", None), NO_ERROR, (":WAV:DATA?", block)]


def prepare(scope, **changes):
    scope.prepare(**PULSES | changes)


def acquire(scope):
    scope.acquire(timeout_s=1.0)


def trace(scope):
    acquire(scope)
    return scope.trace(1)


def prepare_and_trace(scope):
    prepare(scope)
    return trace(scope)


def acquire_twice(scope):
    acquire(scope)
    with pytest.raises(NeverTriggered):
        scope.acquire(timeout_s=0.0)
    list(scope.blocks(1))


def another_first(lines, answer):
    """The lines with another answer; the others are still asked for."""
    return [answer if line[0] == answer[0] else line for line in lines]


NAMES = (
    *((rigol, model) for model in ("DS1054Z", "DS1104Z Plus", "DS1074Z-S Plus", "MSO1104Z", "DS1202Z-E")),
    *((keysight, model) for model in ("DSOX1102G", "DSO-X 2024A", "EDUX1002A", "EDU-X 1002G", "MSO-X 2012A")),
)
WRONG = (
    *({"duration_s": 0.0}, {"duration_s": 1e4}, {"points": 0}, {"points": 25_000_000}, {"coupling": "GND"}),
    *({"sweep": "manual"}, {"trigger_slope": "POS"}, {"trigger_source": 5}, {"channels": (0,)}),
)
PREPARING = {
    **{f"the {name} is prepared for pulses of 25 Hz": (*row, prepare, None) for name, row in PREPARED.items()},
    "a scope with two inputs is not asked for four": (
        *(rigol, rigol_prepared((), first=("*IDN?", RIGOL[1].replace("DS1054Z", "DS1202Z-E"))), prepare, None),
    ),
    **{
        f"{model} is known": (driver, [("*IDN?", f"MAKER,{model},1,2")], lambda it: it.identity().split(",")[1], model)
        for driver, model in NAMES
    },
    **{
        f"another family, {model}, is refused": (
            *(driver, [("*IDN?", f"MAKER,{model},1,2")], lambda it: it.identity(), Raises(WrongInstrument)),
        )
        for driver, model in ((rigol, "DHO804"), (keysight, "DSO-X 6004A"))
    },
    **{
        f"{wrong}, which the {driver.__name__} does not have, is refused before anything is sent": (
            *(driver, [identity], lambda scope, wrong=wrong: prepare(scope, **wrong) if scope.identity() else None),
            Raises(OutOfRange),
        )
        for driver, identity in ((rigol, RIGOL), (keysight, KEYSIGHT))
        for wrong in WRONG
    },
    "what the Rigol sets otherwise without a word is out of range": (
        *(rigol, another_first(rigol_prepared(), ("CHAN1:OFFS?", "0.000000e+00")), prepare),
        Raises(OutOfRange, has={"name": "channel1_offset_v"}),
    ),
    "what the Keysight sets otherwise without a word is out of range": (
        *(keysight, another_first(KEYSIGHT_PREPARED, (":TIM:RANG?", "+5E-02")), prepare),
        Raises(OutOfRange, has={"name": "time_range_s"}),
    ),
    **{
        f"twelve divisions of the Rigol hold at least {duration} s": (
            *(rigol, [], lambda scope, duration=duration: scope._time_scale(duration), scale),
        )
        for duration, scale in ((0.12, 0.01), (0.1201, 0.02), (60e-9, 5e-9), (600.0, 50.0), (1e-3, 1e-4))
    },
    **{
        f"the memory of the Rigol is shared between its channels: {points}, {channels}": (
            *(rigol, [], lambda scope, points=points, channels=channels: scope._depth(points, channels), depth),
        )
        for points, channels, depth in (
            *((1, 1, 12_000), (12_001, 1, 120_000), (24_000_000, 1, 24_000_000)),
            *((12_000_000, 2, 12_000_000), (3_001, 3, 30_000)),
        )
    },
}


def acquire_with_force(scope):
    prepare(scope, sweep="auto")
    acquire(scope)


def time_of_acquiring(scope):
    acquire(scope)
    return scope.clock.now()


def never(driver, waiting, form):
    """A trigger that never comes stops the scope, and the error says at which level."""

    def act(scope):
        try:
            scope.acquire(timeout_s=0.5)
        finally:
            assert scope.clock.now() == pytest.approx(0.5)

    lines = [*waiting, (":TRIG:EDGE:LEV?", form), (":TRIG:EDGE:SOUR?", "CHAN1"), *STOPPED]
    return driver, lines, act, Raises(InstrumentError, has={"level_v": 1.3, "source": "CHAN1", "waited_s": 0.5})


def nothing_acquired(scope):
    with pytest.raises(BadAnswer):
        acquire(scope)
    scope.trace(1)


ACQUIRING = {
    "the Rigol is asked until it has stopped": (rigol, RIGOL_ACQUIRED, acquire, None),
    "a stop from before the arming is not taken for a record": (
        *(rigol, [*SINGLE, (":TRIG:STAT?", "STOP"), *RIGOL_ACQUIRED[2:]], acquire, None),
    ),
    "a record that was complete before the first question is one": (  # that is asked after a fifth of a second
        *(rigol, [*SINGLE, *[(":TRIG:STAT?", "STOP")] * 12], time_of_acquiring, pytest.approx(0.22)),
    ),
    "with sweep AUTO the Rigol is triggered by force": (
        rigol,
        [
            *(*rigol_prepared(sweep="AUTO"), *SINGLE, *[(":TRIG:STAT?", "WAIT")] * 6, *accepted(":TFOR")),
            (":TRIG:STAT?", "STOP"),
        ],
        *(acquire_with_force, None),
    ),
    "the Keysight is asked whether it was armed, then until it no longer runs": (
        *(keysight, KEYSIGHT_ACQUIRED, acquire, None),
    ),
    "a trigger of the Rigol never comes": never(rigol, [*SINGLE, *[(":TRIG:STAT?", "WAIT")] * 26], "1.300000e+00"),
    "a trigger of the Keysight never comes": never(
        keysight, [(":AER?", "+0"), *SINGLE, (":AER?", "+1"), *[(":OPER:COND?", "+40")] * 26], "+1.300000E+00"
    ),
    "after a state of the Rigol that is none the link is cleared and the scope stopped": (
        *(rigol, [*SINGLE, (":TRIG:STAT?", "PERHAPS"), (CLEAR, None), *STOPPED], nothing_acquired),
        Raises(NothingAcquired),
    ),
    "after a state of the Keysight that is none the link is cleared and the scope stopped": (
        *(keysight, [(":AER?", "+0"), *SINGLE, (":AER?", "perhaps"), (CLEAR, None), *STOPPED], nothing_acquired),
        Raises(NothingAcquired),
    ),
    "what goes wrong while it is stopped does not hide why it is": (
        rigol,
        [*SINGLE, (":TRIG:STAT?", SILENCE), ("*CLS", None), (":STOP", None), ("SYST:ERR?", SILENCE)],
        *(acquire, Raises(NoAnswer, "TRIG:STAT")),
    ),
    "off stops the Rigol": (rigol, STOPPED, lambda scope: scope.off(), None),
    "off stops the Keysight": (keysight, STOPPED, lambda scope: scope.off(), None),
}


def scaled(act):
    def read(scope):
        found = act(scope)
        return [found.dt_s, found.t0_s, *found.volts, *found.clipped]

    return read


CLIPPED = [True, False, False, False, True]
READING = {
    "a trace of the Rigol is scaled by its preamble": (  # (code + 75 − 127)·0.04 V
        rigol,
        [*RIGOL_READ, (":WAV:PRE?", RIGOL_PREAMBLE), *piece(1, 5, bytes([0, 10, 52, 127, 255]))],
        *(scaled(trace), pytest.approx([2e-5, -1.456e-2, -2.08, -1.68, 0.0, 3.0, 8.12, *CLIPPED])),
    ),
    "a trace of the Keysight is scaled by its preamble": (  # code 0: no sample
        keysight,
        [
            *(*KEYSIGHT_READ, (":WAV:PRE?", KEYSIGHT_PREAMBLE), NO_ERROR),
            *((":WAV:DATA?", bytes([1, 10, 128, 0, 255])), *KEYSIGHT_KEPT),
        ],
        scaled(prepare_and_trace),
        pytest.approx(
            [1.6e-8, -5e-4, *(1.5 + 0.201005025 * n for n in (-127, -118, 0, math.nan, 127)), *CLIPPED],
            rel=1e-12,
            nan_ok=True,
        ),
    ),
    "a long trace comes in blocks of 250000 bytes": (
        rigol,
        [
            *(*RIGOL_READ, (":WAV:PRE?", RIGOL_PREAMBLE.replace(",5,", ",600000,"))),
            *(*piece(1, 250_000, bytes(250_000)), *piece(250_001, 500_000, bytes(250_000))),
            *piece(500_001, 600_000, bytes(100_000)),
        ],
        lambda scope: acquire(scope) or [piece.size for piece in scope.blocks(1)],
        [250_000, 250_000, 100_000],
    ),
    **{
        f"a block of {len(block)} bytes is no trace of 5": (
            *(rigol, [*RIGOL_READ, (":WAV:PRE?", RIGOL_PREAMBLE), *piece(1, 5, block), (CLEAR, None)]),
            *(trace, Raises(BadAnswer, "5 bytes")),
        )
        for block in (b"", bytes(4), bytes(6))
    },
    "a block that does not come is explained by the error queue": (
        rigol,
        [
            *(*RIGOL_READ, (":WAV:PRE?", RIGOL_PREAMBLE), *piece(1, 5, SILENCE)),
            *(("SYST:ERR?", '-230,"Data corrupt or stale"'), NO_ERROR),
        ],
        *(trace, Raises(CommandRefused, "stale")),
    ),
    **{
        f"{preamble} is no preamble": (
            *(rigol, [*RIGOL_READ, (":WAV:PRE?", preamble), (CLEAR, None)], trace, Raises(BadAnswer)),
        )
        for preamble in ("", "0,2,5", "0,2,x,1,1,0,0,1,0,0", "0,2,0,1,1,0,0,1,0,0", "0,2,5,1,0,0,0,1,0,0")
    },
    "a preamble with a digit of an exponent lost is an error": (
        keysight,
        [*KEYSIGHT_READ, (":WAV:PRE?", KEYSIGHT_PREAMBLE.replace("E-004", "E-00")), (CLEAR, None), *KEYSIGHT_KEPT],
        *(prepare_and_trace, Raises(BadAnswer, "ten numbers")),
    ),
    "what an earlier program left in the memory of the Rigol is not read": (
        *(rigol, [], lambda scope: scope.trace(1), Raises(NothingAcquired)),
    ),
    "what an earlier program left in the memory of the Keysight is not read": (
        *(keysight, [], lambda scope: scope.trace(1), Raises(NothingAcquired)),
    ),
    "after a trigger that did not come the old record is not read": (
        rigol,
        [
            *(*RIGOL_ACQUIRED, *SINGLE, (":TRIG:STAT?", "WAIT"), (":TRIG:EDGE:LEV?", "1.300000e+00")),
            *((":TRIG:EDGE:SOUR?", "CHAN1"), *STOPPED),
        ],
        *(acquire_twice, Raises(NothingAcquired)),
    ),
    "a new preparation ends the old record": (
        *(rigol, [*RIGOL_ACQUIRED, *rigol_prepared()]),
        *(lambda scope: (acquire(scope), prepare(scope), scope.trace(1)), Raises(NothingAcquired)),
    ),
    "a channel that was not recorded has no trace": (
        *(rigol, RIGOL_ACQUIRED, lambda scope: (acquire(scope), scope.trace(2)), Raises(OutOfRange)),
    ),
}


@talks(PREPARING | ACQUIRING | READING)
def test_a_scope_is_talked_to_as_its_manual_says(driver, lines, act, end):
    talk(driver, lines, act, end)

"""The oscilloscopes' drivers: the manuals' bytes.

Sources: MSO1000Z/DS1000Z Programming Guide, InfiniiVision X-Series Programmer's Guides, as public drivers quote them.
"""

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.oscilloscope import NeverTriggered, NothingAcquired
from instruments.drivers.oscilloscope.keysight_dsox import KeysightDSOX
from instruments.drivers.oscilloscope.rigol_ds1000z import RigolDS1000Z
from instruments.errors import BadAnswer, CommandRefused, InstrumentError, NoAnswer, OutOfRange, WrongInstrument
from support.conversation import CLEAR, NO_ERROR, SILENCE, Script, accepted

RIGOL = "RIGOL TECHNOLOGIES,DS1054Z,DS1ZA171812345,00.04.04.SP4"
KEYSIGHT = "KEYSIGHT TECHNOLOGIES,DSO-X 1102G,CN57096441,01.20.2019061038"
#: As in the guide of the DS1000Z, and as a DSOX1102G says after ``*RST``, in bytes.
RIGOL_PREAMBLE = "0,2,5,1,2.000000e-05,-1.456000e-02,0,4.000000e-02,-75,127"
KEYSIGHT_PREAMBLE = "+0,+0,+5,+1,+1.60000000E-008,-5.00000000E-004,+0,+2.01005025E-001,+1.50000000E+000,+128"


class BlockScript(Script):
    """A script whose answers may be blocks; they stand there as bytes."""

    def query_block(self, message, *, patience=0.0, form=None):
        answer = self._next(message)
        self.waited.append(patience)
        if answer == SILENCE:
            raise NoAnswer(self.address, message, self.timeout + patience)
        assert isinstance(answer, bytes), f"{message!r} is not answered with a block"
        return answer


def talk(driver, *lines, clock=None):
    script = BlockScript(lines)
    return script, driver(script, clock=clock or VirtualClock())


def said(script):
    assert not script.left, f"never sent: {[sent for sent, _ in script.left]}"


PULSES = {"duration_s": 0.1, "points": 100_000, "volts_per_division": 0.2, "offset_v": 0.6, "trigger_level_v": 0.65}

#: The settings sent to the scope, as it answers them: numbers in another form, a depth and switches as numbers.
RIGOL_KEPT = [
    ("CHAN1:DISP?", "1"),
    ("CHAN1:PROB?", "1.000000e+00"),
    ("CHAN1:COUP?", "DC"),
    ("CHAN1:INV?", "0"),
    ("CHAN1:SCAL?", "2.000000e-01"),
    ("CHAN1:OFFS?", "-6.000000e-01"),
    (":TIM:MODE?", "MAIN"),
    (":TIM:SCAL?", "1.000000e-02"),
    (":TIM:OFFS?", "0.000000e+00"),
    (":ACQ:TYPE?", "NORM"),
    (":ACQ:MDEP?", "1.200000e+05"),
    (":TRIG:MODE?", "EDGE"),
    (":TRIG:EDGE:SOUR?", "CHAN1"),
    (":TRIG:EDGE:SLOP?", "POS"),
    (":TRIG:EDGE:LEV?", "6.480000e-01"),
    (":TRIG:SWE?", "NORM"),
]
KEYSIGHT_KEPT = [
    ("CHAN1:DISP?", "1"),
    ("CHAN1:PROB?", "+1.0E+00"),
    ("CHAN1:COUP?", "DC"),
    ("CHAN1:INV?", "0"),
    ("CHAN1:SCAL?", "+200E-03"),
    ("CHAN1:OFFS?", "+6.03015E-01"),
    (":TIM:MODE?", "MAIN"),
    (":TIM:REF?", "CENT"),
    (":TIM:RANG?", "+1.00E-01"),
    (":TIM:POS?", "+0.0E+00"),
    (":ACQ:TYPE?", "NORM"),
    (":TRIG:MODE?", "EDGE"),
    (":TRIG:EDGE:SOUR?", "CHAN1"),
    (":TRIG:EDGE:SLOP?", "POSITIVE"),
    (":TRIG:EDGE:LEV?", "+650E-03"),
    (":TRIG:SWE?", "NORM"),
]

RIGOL_PREPARED = [
    ("*IDN?", RIGOL),
    ("*CLS", None),
    *accepted(
        ":RUN",
        "CHAN1:DISP ON",
        "CHAN1:PROB 1.0",
        "CHAN1:COUP DC",
        "CHAN1:INV OFF",
        "CHAN1:SCAL 0.2",
        "CHAN1:OFFS -0.6",
        "CHAN2:DISP OFF",
        "CHAN3:DISP OFF",
        "CHAN4:DISP OFF",
        ":TIM:MODE MAIN",
        ":TIM:SCAL 0.01",
        ":TIM:OFFS 0.0",
        ":ACQ:TYPE NORM",
        ":ACQ:MDEP 120000",
        ":TRIG:MODE EDGE",
        ":TRIG:EDGE:SOUR CHAN1",
        ":TRIG:EDGE:SLOP POS",
        ":TRIG:EDGE:LEV 0.65",
        ":TRIG:SWE NORM",
    ),
    *RIGOL_KEPT,
]

KEYSIGHT_PREPARED = [
    ("*IDN?", KEYSIGHT),
    ("*CLS", None),
    *accepted(
        ":STOP",
        "CHAN1:DISP ON",
        "CHAN1:PROB 1.0",
        "CHAN1:COUP DC",
        "CHAN1:INV OFF",
        "CHAN1:SCAL 0.2",
        "CHAN1:OFFS 0.6",
        "CHAN2:DISP OFF",
        ":TIM:MODE MAIN",
        ":TIM:REF CENT",
        ":TIM:RANG 0.1",
        ":TIM:POS 0.0",
        ":ACQ:TYPE NORM",
        ":TRIG:MODE EDGE",
        ":TRIG:EDGE:SOUR CHAN1",
        ":TRIG:EDGE:SLOP POS",
        ":TRIG:EDGE:LEV 0.65",
        ":TRIG:SWE NORM",
    ),
    *KEYSIGHT_KEPT,
]

STOPPED = [("*CLS", None), *accepted(":STOP")]
RIGOL_ACQUIRED = [*accepted(":SING"), *((":TRIG:STAT?", word) for word in ("WAIT", "TD", "STOP"))]
RIGOL_SELECTED = accepted(":WAV:SOUR CHAN1", ":WAV:MODE RAW", ":WAV:FORM BYTE")
KEYSIGHT_ACQUIRED = [
    (":AER?", "+1"),
    *accepted(":SING"),
    *((":AER?", "+0"), (":OPER:COND?", "+8")),
    *((":AER?", "+1"), (":OPER:COND?", "+40")),
    (":OPER:COND?", "+0"),
]
KEYSIGHT_SELECTED = accepted(
    ":WAV:SOUR CHAN1", ":WAV:FORM BYTE", ":WAV:UNS 1", ":WAV:POIN:MODE RAW", ":WAV:POIN 100000"
)


# --- preparing ---


@pytest.mark.parametrize(("driver", "lines"), [(RigolDS1000Z, RIGOL_PREPARED), (KeysightDSOX, KEYSIGHT_PREPARED)])
def test_a_scope_is_prepared_for_pulses_of_25_hz(driver, lines):
    script, scope = talk(driver, *lines)
    scope.prepare(**PULSES)
    said(script)


@pytest.mark.parametrize(
    ("driver", "identity"), [(RigolDS1000Z, RIGOL), (KeysightDSOX, KEYSIGHT)], ids=["rigol", "keysight"]
)
@pytest.mark.parametrize(
    "wrong",
    [
        {"duration_s": 0.0},
        {"duration_s": 1e4},
        {"points": 0},
        {"points": 25_000_000},
        {"coupling": "GND"},
        {"sweep": "manual"},
        {"trigger_slope": "POS"},
        {"trigger_source": 5},
        {"channels": (0,)},
    ],
    ids=str,
)
def test_what_the_scope_does_not_have_is_refused_before_anything_is_sent(driver, identity, wrong):
    _, scope = talk(driver, ("*IDN?", identity))
    with pytest.raises(OutOfRange):
        scope.prepare(**PULSES | wrong)


@pytest.mark.parametrize(
    ("duration", "scale"), [(0.12, 0.01), (0.1201, 0.02), (60e-9, 5e-9), (600.0, 50.0), (1e-3, 1e-4)]
)
def test_twelve_divisions_of_the_rigol_hold_at_least_the_duration(duration, scale):
    _, scope = talk(RigolDS1000Z)
    assert scope._time_scale(duration) == scale


@pytest.mark.parametrize(
    ("points", "channels", "depth"),
    [
        (1, 1, 12_000),
        (12_001, 1, 120_000),
        (24_000_000, 1, 24_000_000),
        (12_000_000, 2, 12_000_000),
        (3_001, 3, 30_000),
    ],
)
def test_the_memory_of_the_rigol_is_shared_between_its_channels(points, channels, depth):
    _, scope = talk(RigolDS1000Z)
    assert scope._depth(points, channels) == depth


@pytest.mark.parametrize(
    ("driver", "model"),
    [
        *((RigolDS1000Z, model) for model in ("DS1054Z", "DS1104Z Plus", "DS1074Z-S Plus", "MSO1104Z", "DS1202Z-E")),
        *((KeysightDSOX, model) for model in ("DSOX1102G", "DSO-X 2024A", "EDUX1002A", "EDU-X 1002G", "MSO-X 2012A")),
    ],
)
def test_all_of_a_family_are_known_by_their_names(driver, model):
    _, scope = talk(driver, ("*IDN?", f"MAKER,{model},1,2"))
    assert model in scope.identity()


@pytest.mark.parametrize(("driver", "model"), [(RigolDS1000Z, "DHO804"), (KeysightDSOX, "DSO-X 6004A")])
def test_another_family_is_refused(driver, model):
    _, scope = talk(driver, ("*IDN?", f"MAKER,{model},1,2"))
    with pytest.raises(WrongInstrument):
        scope.identity()


def test_a_scope_with_two_inputs_is_not_asked_for_four():
    others = accepted("CHAN3:DISP OFF", "CHAN4:DISP OFF")
    k = RIGOL_PREPARED.index(others[0])
    lines = [("*IDN?", RIGOL.replace("DS1054Z", "DS1202Z-E")), *RIGOL_PREPARED[1:k], *RIGOL_PREPARED[k + 4 :]]
    script, scope = talk(RigolDS1000Z, *lines)
    scope.prepare(**PULSES)
    said(script)


@pytest.mark.parametrize(
    ("driver", "lines", "answer", "name"),
    [
        (RigolDS1000Z, RIGOL_PREPARED, ("CHAN1:OFFS?", "0.000000e+00"), "channel1_offset_v"),
        (KeysightDSOX, KEYSIGHT_PREPARED, (":TIM:RANG?", "+5E-02"), "time_range_s"),
    ],
)
def test_what_the_scope_sets_otherwise_without_a_word_is_out_of_range(driver, lines, answer, name):
    _, scope = talk(driver, *(answer if line[0] == answer[0] else line for line in lines))
    with pytest.raises(OutOfRange) as refused:
        scope.prepare(**PULSES)
    assert refused.value.name == name


# --- acquiring ---


def test_the_rigol_is_asked_until_it_has_stopped():
    script, scope = talk(RigolDS1000Z, *RIGOL_ACQUIRED)
    scope.acquire(timeout_s=1.0)
    said(script)


def test_a_stop_from_before_the_arming_is_not_taken_for_a_record():
    script, scope = talk(RigolDS1000Z, *accepted(":SING"), (":TRIG:STAT?", "STOP"), *RIGOL_ACQUIRED[2:])
    scope.acquire(timeout_s=1.0)
    said(script)


def test_a_record_that_was_complete_before_the_first_question_is_one():
    clock = VirtualClock()
    script, scope = talk(RigolDS1000Z, *accepted(":SING"), *[(":TRIG:STAT?", "STOP")] * 12, clock=clock)
    scope.acquire(timeout_s=1.0)
    said(script)
    assert clock.now() == pytest.approx(0.22)  # the first question after a fifth of a second


def test_with_sweep_auto_the_rigol_is_triggered_by_force():
    auto = [*RIGOL_PREPARED[: -2 - len(RIGOL_KEPT)], *accepted(":TRIG:SWE AUTO"), *RIGOL_KEPT[:-1]]
    auto += [(":TRIG:SWE?", "AUTO")]
    lines = [*accepted(":SING"), *[(":TRIG:STAT?", "WAIT")] * 6, *accepted(":TFOR"), (":TRIG:STAT?", "STOP")]
    script, scope = talk(RigolDS1000Z, *auto, *lines)
    scope.prepare(**PULSES, sweep="auto")
    scope.acquire(timeout_s=1.0)
    said(script)


def test_the_keysight_is_asked_whether_it_was_armed_then_until_it_no_longer_runs():
    script, scope = talk(KeysightDSOX, *KEYSIGHT_ACQUIRED)
    scope.acquire(timeout_s=1.0)
    said(script)


@pytest.mark.parametrize(
    ("driver", "lines"),
    [
        (
            RigolDS1000Z,
            [
                *accepted(":SING"),
                *[(":TRIG:STAT?", "WAIT")] * 26,
                (":TRIG:EDGE:LEV?", "1.300000e+00"),
                (":TRIG:EDGE:SOUR?", "CHAN1"),
                *STOPPED,
            ],
        ),
        (
            KeysightDSOX,
            [
                (":AER?", "+0"),
                *accepted(":SING"),
                (":AER?", "+1"),
                *[(":OPER:COND?", "+40")] * 26,
                (":TRIG:EDGE:LEV?", "+1.300000E+00"),
                (":TRIG:EDGE:SOUR?", "CHAN1"),
                *STOPPED,
            ],
        ),
    ],
    ids=["rigol", "keysight"],
)
def test_a_trigger_that_never_comes_stops_the_scope_and_says_at_which_level(driver, lines):
    clock = VirtualClock()
    script, scope = talk(driver, *lines, clock=clock)
    with pytest.raises(NeverTriggered) as never:
        scope.acquire(timeout_s=0.5)
    said(script)
    assert isinstance(never.value, InstrumentError)
    assert (never.value.level_v, never.value.source, never.value.waited_s) == (1.3, "CHAN1", 0.5)
    assert clock.now() == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("driver", "lines"),
    [
        (RigolDS1000Z, [*accepted(":SING"), (":TRIG:STAT?", "PERHAPS")]),
        (KeysightDSOX, [(":AER?", "+0"), *accepted(":SING"), (":AER?", "perhaps")]),
    ],
)
def test_after_a_state_that_is_none_the_link_is_cleared_and_the_scope_stopped(driver, lines):
    script, scope = talk(driver, *lines, (CLEAR, None), *STOPPED)
    with pytest.raises(BadAnswer):
        scope.acquire(timeout_s=1.0)
    said(script)
    with pytest.raises(NothingAcquired):
        scope.trace(1)


def test_what_goes_wrong_while_it_is_stopped_does_not_hide_why_it_is():
    lines = [*accepted(":SING"), (":TRIG:STAT?", SILENCE), ("*CLS", None), (":STOP", None), ("SYST:ERR?", SILENCE)]
    script, scope = talk(RigolDS1000Z, *lines)
    with pytest.raises(NoAnswer, match="TRIG:STAT"):
        scope.acquire(timeout_s=1.0)
    said(script)


# --- reading ---


def test_a_trace_of_the_rigol_is_scaled_by_its_preamble():
    lines = [
        *RIGOL_ACQUIRED,
        *RIGOL_SELECTED,
        (":WAV:PRE?", RIGOL_PREAMBLE),
        (":WAV:STAR 1", None),
        (":WAV:STOP 5", None),
        NO_ERROR,
        (":WAV:DATA?", bytes([0, 10, 52, 127, 255])),
    ]
    script, scope = talk(RigolDS1000Z, *lines)
    scope.acquire(timeout_s=1.0)
    trace = scope.trace(1)
    said(script)
    assert (trace.dt_s, trace.t0_s, trace.channel) == (2e-5, -1.456e-2, 1)
    # (code + 75 − 127)·0.04 V
    np.testing.assert_allclose(trace.volts, [-2.08, -1.68, 0.0, 3.0, 8.12], atol=1e-12)
    assert trace.clipped.tolist() == [True, False, False, False, True]


def test_a_trace_of_the_keysight_is_scaled_by_its_preamble():
    lines = [
        *KEYSIGHT_PREPARED,
        *KEYSIGHT_ACQUIRED,
        *KEYSIGHT_SELECTED,
        (":WAV:PRE?", KEYSIGHT_PREAMBLE),
        NO_ERROR,
        (":WAV:DATA?", bytes([1, 10, 128, 0, 255])),
        *KEYSIGHT_KEPT,
    ]
    script, scope = talk(KeysightDSOX, *lines)
    scope.prepare(**PULSES)
    scope.acquire(timeout_s=1.0)
    trace = scope.trace(1)
    said(script)
    assert (trace.dt_s, trace.t0_s) == (1.6e-8, -5e-4)
    expected = 1.5 + 0.201005025 * np.array([-127, -118, 0, np.nan, 127])  # code 0: no sample
    np.testing.assert_allclose(trace.volts, expected, rtol=1e-12)
    assert trace.clipped.tolist() == [True, False, False, False, True]


def test_a_long_trace_comes_in_blocks_of_250000_bytes():
    lines = [*RIGOL_ACQUIRED, *RIGOL_SELECTED, (":WAV:PRE?", RIGOL_PREAMBLE.replace(",5,", ",600000,"))]
    for first, last in ((1, 250_000), (250_001, 500_000), (500_001, 600_000)):
        lines += [(f":WAV:STAR {first}", None), (f":WAV:STOP {last}", None), NO_ERROR]
        lines += [(":WAV:DATA?", bytes(last - first + 1))]
    script, scope = talk(RigolDS1000Z, *lines)
    scope.acquire(timeout_s=1.0)
    assert [piece.size for piece in scope.blocks(1)] == [250_000, 250_000, 100_000]
    said(script)


@pytest.mark.parametrize("block", [b"", bytes(4), bytes(6)])
def test_a_block_of_another_length_is_no_trace(block):
    lines = [*RIGOL_ACQUIRED, *RIGOL_SELECTED, (":WAV:PRE?", RIGOL_PREAMBLE)]
    lines += [(":WAV:STAR 1", None), (":WAV:STOP 5", None), NO_ERROR, (":WAV:DATA?", block), (CLEAR, None)]
    script, scope = talk(RigolDS1000Z, *lines)
    scope.acquire(timeout_s=1.0)
    with pytest.raises(BadAnswer, match="5 bytes"):
        scope.trace(1)
    said(script)


def test_a_block_that_does_not_come_is_explained_by_the_error_queue():
    lines = [
        *RIGOL_ACQUIRED,
        *RIGOL_SELECTED,
        (":WAV:PRE?", RIGOL_PREAMBLE),
        (":WAV:STAR 1", None),
        (":WAV:STOP 5", None),
    ]
    lines += [NO_ERROR, (":WAV:DATA?", SILENCE), ("SYST:ERR?", '-230,"Data corrupt or stale"'), NO_ERROR]
    _, scope = talk(RigolDS1000Z, *lines)
    scope.acquire(timeout_s=1.0)
    with pytest.raises(CommandRefused, match="stale"):
        scope.trace(1)


@pytest.mark.parametrize("preamble", ["", "0,2,5", "0,2,x,1,1,0,0,1,0,0", "0,2,0,1,1,0,0,1,0,0", "0,2,5,1,0,0,0,1,0,0"])
def test_a_preamble_that_is_none_is_an_error(preamble):
    script, scope = talk(RigolDS1000Z, *RIGOL_ACQUIRED, *RIGOL_SELECTED, (":WAV:PRE?", preamble), (CLEAR, None))
    scope.acquire(timeout_s=1.0)
    with pytest.raises(BadAnswer):
        scope.trace(1)
    said(script)


def test_a_preamble_with_a_digit_of_an_exponent_lost_is_an_error():
    cut = KEYSIGHT_PREAMBLE.replace("E-004", "E-00")
    lines = [*KEYSIGHT_ACQUIRED, *KEYSIGHT_SELECTED, (":WAV:PRE?", cut), (CLEAR, None)]
    script, scope = talk(KeysightDSOX, *KEYSIGHT_PREPARED, *lines, *KEYSIGHT_KEPT)
    scope.prepare(**PULSES)
    scope.acquire(timeout_s=1.0)
    with pytest.raises(BadAnswer, match="ten numbers"):
        scope.trace(1)
    said(script)


@pytest.mark.parametrize("driver", [RigolDS1000Z, KeysightDSOX])
def test_what_an_earlier_program_left_in_the_memory_is_not_read(driver):
    _, scope = talk(driver)
    with pytest.raises(NothingAcquired):
        scope.trace(1)


def test_after_a_trigger_that_did_not_come_the_old_record_is_not_read():
    never = [*accepted(":SING"), (":TRIG:STAT?", "WAIT")]
    asked = [(":TRIG:EDGE:LEV?", "1.300000e+00"), (":TRIG:EDGE:SOUR?", "CHAN1")]
    _, scope = talk(RigolDS1000Z, *RIGOL_ACQUIRED, *never, *asked, *STOPPED)
    scope.acquire(timeout_s=1.0)
    with pytest.raises(NeverTriggered):
        scope.acquire(timeout_s=0.0)
    with pytest.raises(NothingAcquired):
        list(scope.blocks(1))


def test_a_new_preparation_ends_the_old_record():
    _, scope = talk(RigolDS1000Z, *RIGOL_ACQUIRED, *RIGOL_PREPARED)
    scope.acquire(timeout_s=1.0)
    scope.prepare(**PULSES)
    with pytest.raises(NothingAcquired):
        scope.trace(1)


def test_a_channel_that_was_not_recorded_has_no_trace():
    _, scope = talk(RigolDS1000Z, *RIGOL_ACQUIRED)
    scope.acquire(timeout_s=1.0)
    with pytest.raises(OutOfRange):
        scope.trace(2)


@pytest.mark.parametrize("driver", [RigolDS1000Z, KeysightDSOX])
def test_off_stops_the_scope(driver):
    script, scope = talk(driver, ("*CLS", None), *accepted(":STOP"))
    scope.off()
    said(script)

"""What the virtual oscilloscopes answer: an exchange a row.

Sources: MSO1000Z/DS1000Z Programming Guide; Programmer's Guides of the InfiniiVision X-Series; PyMeasure's suite for a
real DSOX1102G; rigol-ds1000z 0.2.1 for the time base.
"""

import math
import struct

from support.conversation import CLEAR
from support.exchanges import about, carry_out, exchanges
from support.scopes import (
    KEYSIGHT_READY,
    RIGOL_READY,
    block,
    constant,
    keysight,
    pulses,
    ramp,
    rigol,
    rigol_stopped,
    sine,
)
from support.wire import errors


def of(make, *given):
    """What makes a scope that looks at a signal, after these messages."""

    def scope(_clock):
        return make(*given)

    scope.__name__ = make.__name__
    return (scope,)


def gives(question, data, head=None):
    """A question is answered with this block, and this head where one is given."""
    return lambda device: block(device, question) in ([(head, data)] if head else [(h, data) for h in HEADS(data)])


def HEADS(data):
    return (b"#9%09d" % len(data), b"#8%08d" % len(data))


def has_points(count):
    """The record that is read has this number of bytes."""
    return lambda device: len(block(device, ":WAV:DATA?")[1]) == count


RIGOL, KEYSIGHT = of(rigol, pulses), of(keysight, pulses)
PROBE = "CHAN1:PROB 1;SCAL 0.2;OFFS 0"
WIDE = "CHAN1:PROB 1;RANG 1.6;OFFS 0"
READY, HIGH = of(keysight, pulses, *KEYSIGHT_READY), (*KEYSIGHT_READY, ":TRIG:EDGE:LEV 1.3")
DIGITIZED = ":WAV:FORM WORD;POIN 100"

BLOCKS = {
    "a block of the Rigol byte for byte": (  # code 10: a line feed
        *(of(rigol, constant(-0.936), PROBE), ":WAV:STAR 1;STOP 5"),
        gives(":WAV:DATA?", b"\n" * 5, b"#9000000005"),
    ),
    "words of the Rigol have an empty upper byte": (
        *(of(rigol, constant(0.0), PROBE), ":WAV:FORM WORD;STOP 2"),
        gives(":WAV:DATA?", b"\x7f\x00\x7f\x00", b"#9000000004"),
    ),
    "text of the Rigol has a head, too": (
        *(of(rigol, constant(0.2), PROBE), ":WAV:FORM ASC;STOP 2"),
        gives(":WAV:DATA?", b"2.000000e-01,2.000000e-01", b"#9000000025"),
    ),
    "the preamble of the Rigol is that of the guide": (
        *(of(rigol, pulses, "CHAN1:PROB 1;SCAL 1;OFFS -3", ":TIM:SCAL 0.002;OFFS -0.00256"),),
        (":WAV:PRE?", "0,0,1200,1,2.000000e-05,-1.456000e-02,0,4.000000e-02,-75,127"),
        (":WAV:XINC?;XOR?;XREF?;YINC?;YOR?;YREF?", "2.000000e-05;-1.456000e-02;0;4.000000e-02;-75;127"),
    ),
    "the preamble of the Keysight is that of a real one after a reset": (
        *(of(keysight, pulses, "*RST", ":WAV:FORM ASC"),),
        (":WAV:PRE?", [4, 0, 62500, 1, 1.6e-8, -5e-4, 0, 0.0007851759, 0, 32768]),
    ),
    **{
        f"words of the Keysight, unsigned {unsigned}, {order}": (
            *(of(keysight, constant(0.2), WIDE, DIGITIZED), f":WAV:UNS {unsigned};BYT {order}"),
            *(gives(":WAV:DATA?", 100 * word, b"#800000200"), (":WAV:YREF?", 32768 if unsigned else 0)),
        )
        for unsigned, order, word in (
            *((1, "MSBF", b"\x99\x00"), (1, "LSBF", b"\x00\x99")),
            *((0, "MSBF", b"\x19\x00"), (0, "LSBF", b"\x00\x19")),
        )
    },
    "signed bytes of the Keysight": (
        *(of(keysight, constant(-0.2), WIDE), ":WAV:UNS 0;POIN 100"),
        gives(":WAV:DATA?", 100 * struct.pack("b", -25), b"#800000100"),
    ),
    "text of the Keysight": (
        *(of(keysight, constant(0.0), WIDE), ":WAV:FORM ASC;POIN 100"),
        gives(":WAV:DATA?", b",".join([b"+0.00000E+00"] * 100), b"#800001299"),
    ),
    **{
        f"{points} points of the Keysight, {mode}": (
            *(KEYSIGHT, f":WAV:POIN:MODE {mode};:WAV:POIN {points}", has_points(points), (":WAV:POIN?", points)),
        )
        for points in (100, 250, 500, 1000, 2000, 5000, 10000, 20000, 50000, 62500)
        for mode in ("NORM", "MAX", "RAW")
    },
    **{
        f"a block of the Rigol has at most {most} points, {form}": (
            *(of(rigol_stopped, pulses, ":ACQ:MDEP 1200000"), f":WAV:MODE RAW;FORM {form};STAR 1;STOP {most}"),
            lambda device, most=most: len(block(device, ":WAV:DATA?")[1]) > most - 1,
            *(f":WAV:STOP {most + 1}", (":WAV:DATA?", None), [-222]),
        )
        for form, most in (("BYTE", 250_000), ("WORD", 125_000), ("ASC", 15_625))
    },
    "the memory of the Rigol cannot be read while it runs": (
        *(RIGOL, ":WAV:MODE RAW", (":WAV:DATA?", None), [-221], ":STOP"),
        lambda device: device.execute(":WAV:PRE?").data.startswith(b"0,2,12000,"),
    ),
    "normal reading always gives 1200 points": (
        *(of(rigol_stopped, pulses), ":WAV:MODE NORM", has_points(1200)),
        lambda device: device.execute(":WAV:PRE?").data.split(b",")[2] == b"1200",
    ),
    **{
        f"{volts} V are the code {code} of the Rigol": (  # 25 to a division, clipped
            *(
                of(rigol, constant(volts), PROBE),
                lambda device, code=code: set(block(device, ":WAV:DATA?")[1]) == {code},
            ),
        )
        for volts, code in ((-100.0, 0), (100.0, 255), (0.0, 127), (0.2, 152), (0.004001, 128))
    },
    **{
        f"{volts} V are the code {code} of the Keysight": (  # 199 to the screen, never 0
            of(keysight, constant(volts), WIDE),
            lambda device, code=code: set(block(device, ":WAV:DATA?")[1]) == {code},
        )
        for volts, code in ((-100.0, 1), (100.0, 255), (0.0, 128), (0.2, 128 + 25))
    },
    "a probe makes the same volts at the input ten times as many": (
        (*of(rigol, constant(0.2)), *of(keysight, constant(0.2))),
        *("CHAN1:PROB 1", "CHAN1:SCAL 0.2", "CHAN1:PROB 10", ("CHAN1:SCAL?", 2.0)),
        (":MEAS:VMAX? CHAN1", about(2.0, 0.05)),
    ),
    "after power-on a probe is taken for granted": ((*RIGOL, *KEYSIGHT), ("CHAN1:PROB?", 10.0)),
}

#: What a sine of 1 kHz and 1 V is, and how near.  The rise from 10 % to 90 % is 2·asin(0.8)/2π of a period; top and
#: base lie a little inside the extremes.
OF_A_SINE = {
    "FREQuency": (1000.0, 1.0), "PERiod": (1e-3, 1e-6), "VPP": (2.0, 0.02), "VMAX": (1.0, 0.01), "VMIN": (-1.0, 0.01),
    "VAVG": (0.0, 0.01), "VRMS": (math.sqrt(0.5), 0.01), "PDUTy": (0.5, 0.005), "PWIDth": (5e-4, 5e-6),
    "RTIMe": (2 * math.asin(0.8) / (2 * math.pi) * 1e-3, 1.5e-5),
}  # fmt: skip
OF_PULSES = {"FREQ": (25, 0.01), "PER": (0.04, 1e-5), "VPP": (1.1, 0.016), "PWID": (0.03 / 25, 2e-5), "DUTY": (3, 0.1)}
MEASURED = {
    **{
        f"{item} of a sine": (
            of(rigol, sine, "CHAN1:PROB 1;SCAL 0.3;OFFS 0", ":TIM:SCAL 0.0005", ":TRIG:EDGE:LEV 0"),
            (f":MEAS:ITEM? {item},CHAN1;:MEAS:STAT:ITEM? CURR,{item},CHAN1", about([expected] * 2, within)),
        )
        for item, (expected, within) in OF_A_SINE.items()
    },
    **{
        f"{item} of pulses of 25 Hz": (
            *(READY, (f":MEAS:{item}? CHAN1;:MEAS:SOUR CHAN1;:MEAS:{item}?", about([expected] * 2, within))),
        )
        for item, (expected, within) in OF_PULSES.items()
    },
    "what a trace does not show, the Rigol": (of(rigol, constant(0.0)), (":MEAS:ITEM? FREQ,CHAN1", 9.9e37)),
    "what a trace does not show, the Keysight": (of(keysight, constant(0.0)), (":MEAS:FREQ? CHAN1", 9.9e37)),
}

WRONG = (
    *(":TIM:SCAL 100", "CHAN1:PROB 1;SCAL 20", "CHAN5:SCAL 1", ":TRIG:EDGE:LEV 1e6", ":TRIG:EDGE:SOUR CHAN9"),
    *(":ACQ:MDEP 13000", ":WAV:FORM FLOAT", ":MEAS:ITEM? NOTHING,CHAN1", ":MEAS:ITEM? VPP,CHAN9", ":MEAS:ITEM?"),
    ":DISP:DATA? ON,OFF,PNG,1",
)
NO_SETUPS = ("#10", "#15hello", "#512", "hello", "#224:SYST:SET #212:SYST:SET #", "#216:CHAN1:SCAL 1e999")
SETTINGS = {
    **{
        f"{message} has no answer, but an entry": (RIGOL, (message, None), lambda device: len(errors(device)) == 1)
        for message in WRONG
    },
    # 80 V at the input, ten times as much at the tip of the probe after a reset
    "limits of a full scale": (RIGOL, (":CHAN1:PROB 10;RANG? MAX;:CHAN1:SCAL? MAX", [800, 100])),
    "limits of the memory": (RIGOL, (":ACQ:MDEP? MAX;MDEP? MIN", "24000000;12000")),
    "limits of the time base": (KEYSIGHT, (":TIM:RANG? MAX", "+5.000000E+02")),
    "whole settings of the Keysight": (
        of(keysight, pulses, "*RST"),
        (":TIM?", ":TIM:MODE MAIN;REF CENT;MAIN:RANG +1.00000E-03;POS +0.000000E+00"),
        (
            ":CHAN1?",
            (
                ":CHAN1:RANG +4.00000E+01;OFFS +0.00000E+00;COUP DC;IMP ONEM;DISP 1;BWL 0;INV 0;"
                'LAB "1";UNIT VOLT;PROB +1.00000E+01;PROB:SKEW +0.00E+00;STYP SING'
            ),
        ),
    ),
    **{
        f"{setup} is no setup": (
            (*RIGOL, *KEYSIGHT),
            *(
                f":SYST:SET {setup}",
                lambda device: device.execute("*IDN?").data.count(b",") == 3 and errors(device) != [],
            ),
        )
        for setup in NO_SETUPS
    },
    "the time base after a reset": (
        *(RIGOL, (":TIM:MODE?", "MAIN"), (":TIM:SCAL?", "1.000000e-06")),
        (":TIM:OFFS?;DEL:ENAB?;SCAL?;OFFS?", "0.000000e+00;0;5.000000e-07;0.000000e+00"),
    ),
    "a public driver sets the time base": (
        *(RIGOL, ":TIM:MODE MAIN;*WAI", ":TIM:SCAL 0.0100000000;*WAI", ":TIM:OFFS 0.0200000000;*WAI"),
        *(":TIM:DEL:ENAB 1;*WAI", ":TIM:DEL:SCAL 0.0020000000;*WAI", ":TIM:DEL:OFFS 0.0600000000;*WAI"),
        (":TIM:SCAL?;OFFS?;DEL:ENAB?;SCAL?;OFFS?;*WAI", [0.01, 0.02, 1, 0.002, 0.06]),
    ),
    **{
        f"{message} is beyond the delayed sweep": (  # no coarser than the main one, nor than (50/sample rate)/40
            *(of(rigol, pulses, ":TIM:SCAL 0.01", ":TIM:DEL:SCAL 0.005"), message, [-222]),
            (":TIM:DEL:SCAL?;OFFS?", [0.005, 0.0]),  # 6 main divisions less 6 of the delayed sweep: 0.03 s
        )
        for message in (":TIM:DEL:SCAL 0.02", ":TIM:DEL:SCAL 1e-9", ":TIM:DEL:OFFS 0.0301", ":TIM:DEL:OFFS -0.0301")
    },
    "the delayed sweep follows a shorter main one": (
        *(of(rigol, pulses, ":TIM:SCAL 0.01", ":TIM:DEL:SCAL 0.005", ":TIM:DEL:OFFS 0.03"), ":TIM:SCAL 0.002"),
        (":TIM:DEL:SCAL?;OFFS?", [0.002, 0.0]),
    ),
}

WAITING = {
    "DIGitize without a trigger blocks until a device clear": (
        *(of(keysight, pulses, *HIGH), ":DIG CHAN1\n*OPC?", ("*IDN?", None), CLEAR, (":OPER:COND?", "+0")),
    ),
    "the operation register shows running and waiting": (  # at first the part before the trigger is filled
        *(of(keysight, pulses, *HIGH, ":SING"), (":OPER:COND?", "+8"), 1.0, (":OPER:COND?", "+40")),
        *((":AER?", "+1"), (":AER?", "+0"), ":STOP", (":OPER:COND?", "+0")),
    ),
    **{
        f"there is no record in the mode {mode}": (
            *(KEYSIGHT, f":TIM:MODE {mode}", ":DIG CHAN1", (":WAV:DATA?", None), [-221, -221]),
        )
        for mode in ("ROLL", "XY")
    },
    **{
        f"the preamble names the acquisition {kind}": (  # Programmer's Guide: 0 normal, 1 peak, 2 average, 3 hres
            *(of(keysight, pulses, *KEYSIGHT_READY, f":ACQ:TYPE {kind}", ":ACQ:COUN 4", ":SING"), 5.0),
            (":WAV:TYPE?;COUN?", [number, count]),
        )
        for kind, number, count in (("NORM", 0, 1), ("AVER", 2, 4), ("HRES", 3, 1))
    },
    **{
        f"while the part before the trigger fills the scope runs, after {how}": (
            of(rigol, ramp, *RIGOL_READY, "CHAN1:OFFS 0", ":TRIG:EDGE:LEV 0", ":TIM:SCAL 0.1", ":STOP", how),
            (":TRIG:STAT?", "RUN"),
        )
        for how in (":RUN", ":SING")
    },
    "with sweep AUTO a record comes without a trigger": (
        *(of(rigol, pulses, *RIGOL_READY, ":TRIG:EDGE:LEV 1.3", ":TRIG:SWE AUTO"), 1.0, (":TRIG:STAT?", "AUTO")),
        lambda device: device.record().forced,
    ),
    "a forced trigger ends the waiting": (
        *(of(rigol, pulses, *RIGOL_READY, ":TRIG:EDGE:LEV 1.3", ":SING"), 1.0, ":TFOR", 0.5, (":TRIG:STAT?", "STOP")),
        lambda device: device.record().forced,
    ),
    **{
        f"a level of {level} V is not crossed": (
            of(rigol, pulses, *RIGOL_READY, f":TRIG:EDGE:LEV {level}", ":SING"),
            *(5.0, (":TRIG:STAT?", "WAIT")) * 20,
        )
        for level in (1.3, 0.05)
    },
    "the Keysight forgets the old record when it is armed": (
        *(of(keysight, pulses, *KEYSIGHT_READY, ":SING"), 1.0, lambda device: block(device, ":WAV:DATA?")[1]),
        *(":TRIG:EDGE:LEV 1.3", ":SING", 1.0, (":WAV:DATA?", None), [-230]),
    ),
}


@exchanges(BLOCKS | MEASURED | SETTINGS | WAITING)
def test_an_exchange_goes_as_the_manual_says(make, steps):
    carry_out(make, steps)

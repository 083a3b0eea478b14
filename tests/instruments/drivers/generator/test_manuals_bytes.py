"""The generators' drivers: the manual's bytes.

Source: Keysight 33500 Series Operating and Service Guide; Agilent 33220A User's Guide; public drivers of both.
"""

import pytest

from instruments.clock import VirtualClock
from instruments.drivers.generator import Limits
from instruments.drivers.generator.agilent_33220a import Agilent33220A
from instruments.drivers.generator.keysight_33500b import Keysight33500B
from instruments.errors import BadAnswer, CommandRefused, NoAnswer, OutOfRange
from instruments.virtual.generator.agilent_33220a import Virtual33220A
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from support.conversation import CLEAR, SILENCE, accepted
from support.talks import Raises, connected, talk, talks


def signal(*sent, output="OUTP1", waveform="SIN", frequency=30.5):
    """The lines that set a signal from a clean state: the offset is gone before the amplitude comes."""
    clean = ("*RST", f"{output}:LOAD INF", "VOLT:UNIT VPP")
    return accepted(*clean, f"FUNC {waveform}", f"FREQ {frequency}", "VOLT:OFFS 0.0", *sent)


def prepare(waveform="SIN", amplitude_vpp=10.0, frequency_hz=30.5, **options):
    return lambda it: it.prepare(waveform=waveform, frequency_hz=frequency_hz, amplitude_vpp=amplitude_vpp, **options)


def switch_on(generator):
    generator.output = True


def off(generator):
    generator.off()


def limited(act, limits=None):
    """The same with limits of the bench."""

    def do(generator):
        generator.limits = limits or LIMITS
        act(generator)

    return do


def setting(name, value):
    return lambda generator: setattr(generator, name, value)


def in_order(*acts):
    """One after the other; what the last one returns."""
    return lambda generator: [act(generator) for act in acts][-1]


#: The messages before the first question, and the identity question, where it was not asked before.
OFF = (("*CLS", None), ("OUTP1 OFF", None))
ONE, TWO = (("*IDN?", f"Agilent Technologies,{model},MY52812345,3.05") for model in ("33521A", "33522B"))
SECOND_OFF = ("OUTP2 OFF", None)
LIMITS = Limits(drive_amplitude_vpp=4.0, drive_offset_v=1.0, drive_frequency_hz=50.0, drive_lowest_hz=5.0)
NAN = float("nan")
FORBIDDEN = [
    *(("amplitude", 4.01, "drive_amplitude_vpp"), ("amplitude", NAN, "drive_amplitude_vpp")),
    *(("amplitude", -1.0, "drive_amplitude_vpp"), ("offset", 1.01, "drive_offset_v")),
    *(("offset", -1.01, "drive_offset_v"), ("offset", NAN, "drive_offset_v")),
    *(("frequency", 50.1, "drive_frequency_hz"), ("frequency", 4.9, "drive_lowest_hz")),
    ("frequency", NAN, "drive_frequency_hz"),
    ("load", 50.0, "drive_amplitude_vpp"),  # twice the voltage that is displayed would be there
    ("load", NAN, "drive_amplitude_vpp"),
    ("output", True, "drive_amplitude_vpp"),  # its value is not known
]
WITH_UNITS = {"amplitude": "amplitude_vpp", "offset": "offset_v", "frequency": "frequency_hz"}
ALLOWED = {"amplitude_vpp": 4.0, "offset_v": 1.0, "frequency_hz": 30.0}
OLDER = {"output": "OUTP", "frequency": "30.0"}
#: Headers as in the 33220A's User's Guide, numbers as it prints them: fourteen digits.
WIRE_33220A = [
    *(("waveform", "RAMP", "FUNC RAMP", "RAMP"), ("symmetry", 50.0, "FUNC:RAMP:SYMM 50.0", "+5.0000000000000E+01")),
    *(
        ("frequency", 38.25, "FREQ 38.25", "+3.8250000000000E+01"),
        ("offset", 0.5, "VOLT:OFFS 0.5", "+5.0000000000000E-01"),
    ),
    *(
        ("amplitude", 10.0, "VOLT 10.0", "+1.0000000000000E+01"),
        ("load", 50.0, "OUTP:LOAD 50.0", "+5.0000000000000E+01"),
    ),
    ("output", True, "OUTP ON", "1"),
]
SIGNALS = {
    "a signal for a coil": (Keysight33500B, signal("VOLT 10.0"), prepare(), None),
    "an offset is set once there is room for it": (
        *(Keysight33500B, signal("VOLT 4.0", "VOLT:OFFS -1.5"), prepare(amplitude_vpp=4.0, offset_v=-1.5), None),
    ),
    "an amplitude that is too small stops the preparation before it is sent": (
        *(Keysight33500B, signal(), prepare(amplitude_vpp=0.001)),
        Raises(OutOfRange, has={"name": "amplitude", "value": 0.001}),
    ),
    **{
        f"{amplitude} V and {offset} V are beyond the terminals": (
            *(Keysight33500B, [], prepare(amplitude_vpp=amplitude, offset_v=offset), Raises(OutOfRange, "10 V")),
        )
        for amplitude, offset in ((20.5, 0.0), (20.0, -0.1), (12.0, 4.1), (NAN, 0.0), (1.0, NAN))
    },
    "the older generator is set up in its dialect": (
        *(Agilent33220A, signal("VOLT 10.0", output="OUTP", waveform="SQU"), prepare("SQU"), None),
    ),
    "its triangle is a symmetric ramp": (
        Agilent33220A,
        accepted(
            *("*RST", "OUTP:LOAD INF", "VOLT:UNIT VPP", "FUNC RAMP", "FUNC:RAMP:SYMM 50.0", "FREQ 30.5"),
            *("VOLT:OFFS 0.0", "VOLT 10.0"),
        ),
        *(prepare("TRI"), None),
    ),
    **{
        f"{name} of the older generator is sent and asked for": (
            Agilent33220A,
            [*accepted(sent), (sent.split()[0] + "?", answer)],
            *(in_order(setting(name, value), lambda it, name=name: getattr(it, name)), value),
        )
        for name, value, sent, answer in WIRE_33220A
    },
    **{
        f"{name} {value} is more than the older generator can do": (
            *(Agilent33220A, [], setting(name, value), Raises(OutOfRange)),
        )
        for name, value in (("waveform", "TRI"), ("frequency", 21e6), ("amplitude", 0.01), ("offset", 11.0))
    },
}
SWITCHED_OFF = {
    "off is sent and seen": (Keysight33500B, [*OFF, ONE, ("OUTP1?", "0")], off, None),
    "both outputs of two are switched off and seen to be off": (  # the identity need not be asked again
        *(Keysight33500B, [TWO, *OFF, SECOND_OFF, ("OUTP1?", "0"), ("OUTP2?", "0")]),
        *(in_order(lambda it: it.identity(), off), None),
    ),
    "an output that stays on is an error": (
        *(Keysight33500B, [*OFF, TWO, SECOND_OFF, ("OUTP1?", "1")], off),
        Raises(CommandRefused, "still on", {"command": "OUTP1 OFF"}),
    ),
    "the second output that stays on is an error": (
        *(Keysight33500B, [*OFF, TWO, SECOND_OFF, ("OUTP1?", "0"), ("OUTP2?", "1")], off),
        Raises(CommandRefused, "still on", {"command": "OUTP2 OFF"}),
    ),
    "an answer that makes no sense is not taken for off": (
        *(Keysight33500B, [*OFF, TWO, SECOND_OFF, ("OUTP1?", "0"), ("OUTP2?", "+3.0E+01"), (CLEAR, None)], off),
        Raises(BadAnswer),
    ),
    "a silent generator is not taken for one that is off": (
        *(Keysight33500B, [*OFF, ONE, ("OUTP1?", SILENCE)], off, Raises(NoAnswer)),
    ),
}
WITHIN_LIMITS = {
    **{
        f"{name} {value} of the {driver.__name__} is beyond {limit}": (
            *(driver, [], limited(setting(name, value)), Raises(OutOfRange, rf"limits\.{limit}")),
        )
        for driver in (Keysight33500B, Agilent33220A)
        for name, value, limit in FORBIDDEN
    },
    **{
        f"a preparation of the {driver.__name__} with {name} {value} is beyond {limit}": (
            driver,
            [],
            *(limited(prepare(**ALLOWED | {WITH_UNITS[name]: value})), Raises(OutOfRange, limit)),
        )
        for driver in (Keysight33500B, Agilent33220A)
        for name, value, limit in FORBIDDEN
        if name in WITH_UNITS
    },
    "after a reset the output stays off until a signal is prepared": (
        Agilent33220A,
        [*signal("VOLT 4.0", "OUTP ON", **OLDER), *accepted("*RST")],
        limited(in_order(prepare("SIN", 4.0, 30.0), switch_on, lambda it: it.command("*RST"), switch_on)),
        Raises(OutOfRange, r"prepare\(\) first"),
    ),
    **{
        f"limits bind what was prepared before they were set on the {driver.__name__}": (
            *(driver, signal("VOLT 20.0", output=driver.OUTPUT, frequency="30.0")),
            in_order(prepare("SIN", 20.0, 30.0), limited(switch_on, Limits(drive_amplitude_vpp=1.0))),
            Raises(OutOfRange, r"prepare\(\) first.*limits\.drive_amplitude_vpp"),
        )
        for driver in (Keysight33500B, Agilent33220A)
    },
    "without new limits what was prepared goes on": (
        *(Agilent33220A, signal("VOLT 4.0", "OUTP ON", **OLDER)),
        *(limited(in_order(prepare("SIN", 4.0, 30.0), switch_on)), None),
    ),
}


@talks(SIGNALS | SWITCHED_OFF | WITHIN_LIMITS)
def test_a_generator_is_talked_to_as_its_manual_says(driver, lines, act, end):
    talk(driver, lines, act, end)


@pytest.mark.parametrize(("driver", "device"), [(Keysight33500B, Virtual33500B), (Agilent33220A, Virtual33220A)])
@pytest.mark.parametrize("waveform", ["SIN", "SQU", "TRI", "RAMP"])
def test_both_families_put_the_same_signal_on_the_coil(driver, device, waveform):
    virtual = device(VirtualClock())
    generator = connected(driver, virtual)
    generator.identity()
    generator.prepare(waveform=waveform, frequency_hz=30.5, amplitude_vpp=12.0)
    assert virtual.signal().amplitude == 0.0
    generator.output = True
    signal = virtual.signal()
    assert (signal.frequency, signal.amplitude, signal.offset) == (30.5, 6.0, 0.0)
    generator.frequency, generator.offset = 31.0, 1.5
    assert (generator.frequency, generator.offset) == (31.0, 1.5)
    with pytest.raises(OutOfRange):
        generator.offset = 8.0  # 6 V are there already
    assert virtual.signal().offset == 1.5  # refused, not clipped
    generator.off()
    assert virtual.signal().amplitude == 0.0
    generator.close()

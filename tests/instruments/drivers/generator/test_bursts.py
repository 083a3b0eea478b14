"""Bursts that the trigger input starts: the manuals' bytes, and what the models make of them.

Sources: Keysight 33500 Series Operating and Service Guide and Agilent 33220A User's Guide, BURSt and TRIGger; DG800
Programming Guide, pages 2-60 to 2-65; SDG Programming Guide, BTWV, as public records of its answers have it.
"""

import math

import pytest

from instruments.clock import VirtualClock
from instruments.drivers.generator import Limits
from instruments.drivers.generator.agilent_33220a import Agilent33220A
from instruments.drivers.generator.keysight_33500b import Keysight33500B
from instruments.drivers.generator.rigol_dg1000z import RigolDG1000Z
from instruments.drivers.generator.siglent_sdg1000x import SiglentSDG1000X
from instruments.errors import CommandRefused, OutOfRange
from instruments.virtual.generator.agilent_33220a import Virtual33220A
from instruments.virtual.generator.channel import Triggered
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from instruments.virtual.generator.rigol_dg1000z import VirtualDG1000Z
from instruments.virtual.generator.siglent_sdg1000x import VirtualSDG1000X
from support.conversation import accepted, conversation
from support.talks import connected
from support.wire import ask, errors, send

ASKED = {"waveform": "SIN", "frequency_hz": 33.0, "amplitude_vpp": 10.0, "phase_deg": 180.0}
PLAIN = ("VOLT:UNIT VPP", "FUNC SIN", "FREQ 33.0", "VOLT:OFFS 0.0", "VOLT 10.0", "BURS:MODE TRIG")
KEYSIGHT = ("TRIG:SOUR EXT", "BURS:NCYC 1.0", "BURS:PHAS 180.0", "TRIG:SLOP POS", "TRIG:DEL 0.0", "BURS:STAT ON")
RIGOL = (
    *("BURS:TRIG:SOUR EXT", "BURS:NCYC 1.0", "BURS:PHAS 180.0", "BURS:TRIG:SLOP POS"),
    *("BURS:TDEL 0.0", "BURS:STAT ON"),
)


@pytest.mark.parametrize(
    ("driver", "output", "burst"),
    [(Keysight33500B, "OUTP1", KEYSIGHT), (Agilent33220A, "OUTP", KEYSIGHT), (RigolDG1000Z, "OUTP1", RIGOL)],
)
def test_a_burst_is_set_in_the_dialect_of_the_manual(driver, output, burst):
    with conversation(driver, *accepted("*RST", f"{output}:LOAD INF", *PLAIN, *burst)) as generator:
        generator.prepare_triggered(**ASKED)


WAVE = "WVTP,SINE,FRQ,33HZ,PERI,0.030303S,AMP,10V,AMPVRMS,3.535Vrms,OFST,0V,HLEV,5V,LLEV,-5V,PHSE,0"
BURST = "C1:BTWV STATE,ON,PRD,0.01S,STPS,180,TRSR,EXT,EDGE,RISE,TIME,1,DLAY,2.4e-07S,GATE_NCYC,NCYC,CARR," + WAVE


def test_a_siglent_takes_a_burst_once_bursts_are_on_and_each_field_is_asked_back():
    sent = ("STATE,ON", "GATE_NCYC,NCYC", "TRSR,EXT", "TIME,1", "STPS,180.0", "EDGE,RISE", "DLAY,0.0", "STATE,ON")
    reset = (("*RST", None), ("*OPC?", "1"), ("C1:OUTP LOAD,HZ", None), ("C1:OUTP?", "C1:OUTP OFF,LOAD,HZ,PLRT,NOR"))
    wave = [("C1:BSWV " + sets, None) for sets in ("WVTP,SINE", "FRQ,33.0", "OFST,0.0", "AMP,10.0")]
    lines = [*reset, *(line for one in wave for line in (one, ("C1:BSWV?", "C1:BSWV " + WAVE)))]
    lines += [line for field in sent for line in (("C1:BTWV " + field, None), ("C1:BTWV?", BURST))]
    with conversation(SiglentSDG1000X, *lines) as generator:
        generator.prepare_triggered(**ASKED)


def test_a_siglent_that_stays_without_bursts_is_an_error():
    lines = (("C1:BTWV STATE,ON", None), ("C1:BTWV?", "C1:BTWV STATE,OFF"))
    with (
        conversation(SiglentSDG1000X, *lines) as generator,
        pytest.raises(CommandRefused, match="burst is False afterwards"),
    ):
        generator.burst = True


@pytest.mark.parametrize("wrong", [{"phase_deg": 400.0}, {"amplitude_vpp": 4.5}])
def test_a_burst_beyond_the_limits_is_refused_before_anything_is_sent(wrong):
    with conversation(Agilent33220A) as generator:
        generator.limits = Limits(drive_amplitude_vpp=4.0)
        with pytest.raises(OutOfRange):
            generator.prepare_triggered(**{**ASKED, "amplitude_vpp": 4.0} | wrong)


def test_the_output_stays_off_until_the_whole_burst_is_set():
    refused = (*PLAIN, *KEYSIGHT[:-1])
    lines = [*accepted("*RST", "OUTP:LOAD INF", *refused), ("BURS:STAT ON", None)]
    lines += [("SYST:ERR?", '-221,"Settings conflict"'), ("SYST:ERR?", '+0,"No error"')]
    with conversation(Agilent33220A, *lines) as generator:
        generator.limits = Limits(drive_amplitude_vpp=10.0)
        with pytest.raises(CommandRefused):
            generator.prepare_triggered(**ASKED)
        with pytest.raises(OutOfRange, match=r"prepare\(\) first"):
            generator.output = True


PAIRS = [
    (Keysight33500B, Virtual33500B, 185e-9),
    (Agilent33220A, Virtual33220A, 500e-9),
    (RigolDG1000Z, VirtualDG1000Z, 500e-9),
    (SiglentSDG1000X, VirtualSDG1000X, 0.0),  # its delay has the latency
]


@pytest.mark.parametrize(("driver", "twin", "latency"), PAIRS)
def test_every_model_waits_for_the_edges_that_its_driver_names(driver, twin, latency):
    device = twin(VirtualClock())
    generator = connected(driver, device)
    generator.identity()
    generator.forget_errors()
    generator.prepare_triggered(**ASKED, rising=False)
    assert device.signal().triggered is None  # off
    generator.output = True
    waits = device.signal()
    assert (waits.amplitude, waits.frequency, waits.phase) == (0.0, 33.0, 180.0)
    least = latency or 2.4e-7  # no delay
    assert waits.triggered == Triggered(
        5.0, 1.0, rising=False, delay=pytest.approx(least), jitter=waits.triggered.jitter
    )
    assert waits.times(2.0).triggered.amplitude == 10.0
    generator.burst_phase, generator.frequency, generator.amplitude = 90.0, 40.0, 4.0
    assert (device.signal().phase, device.signal().frequency) == (90.0, 40.0)
    assert device.signal().triggered.amplitude == 2.0
    asked = generator.settings()
    assert (asked["burst"], asked["burst_phase_deg"], asked["trigger_source"]) == (True, 90.0, "EXT")
    assert generator.changed_settings() == {}
    generator.burst_mode = "GATE" if driver is SiglentSDG1000X else "GATed"
    gated = device.signal().triggered  # the pulse is shorter than a cycle, which is completed: 33500 guide, page 177
    assert gated == Triggered(2.0, 1.0, rising=True, delay=pytest.approx(least), jitter=waits.triggered.jitter)
    inverted = (
        b"C1:BTWV PLRT,NEG" if driver is SiglentSDG1000X else b"BURS:GATE:POL INV"
    )  # open while there is no pulse
    send(device, inverted + b"\n")
    assert (device.signal().amplitude, device.signal().triggered) == (2.0, None)
    generator.off()
    assert device.signal().triggered is None
    generator.prepare(waveform="SIN", frequency_hz=33.0, amplitude_vpp=10.0)  # a plain signal again
    generator.output = True
    assert (device.signal().amplitude, device.signal().triggered) == (5.0, None)
    assert "burst" not in generator.settings()


def test_a_siglent_without_bursts_takes_none_of_their_fields():
    device = VirtualSDG1000X(VirtualClock())
    send(device, b"C1:BTWV TIME,5\n")
    assert ask(device, "C1:BTWV?") == "C1:BTWV STATE,OFF"
    send(device, b"C1:BTWV STATE,ON,GATE_NCYC,NCYC,TRSR,EXT,TIME,5,STPS,90,DLAY,0.002\n")
    assert ask(device, "C1:BTWV?").startswith(
        "C1:BTWV STATE,ON,PRD,0.01S,STPS,90,TRSR,EXT,EDGE,RISE,TIME,5,DLAY,0.002S,GATE_NCYC,NCYC,CARR,WVTP,SINE,FRQ,"
    )
    send(device, b"C1:OUTP ON\n")
    assert device.signal().triggered == Triggered(2.0, 5.0, rising=True, delay=0.002, jitter=5e-9)
    send(device, b"C1:BTWV STPS,400,DLAY,0\n")  # beyond the limits
    assert "STPS,360,TRSR,EXT,EDGE,RISE,TIME,5,DLAY,2.4e-07S," in ask(device, "C1:BTWV?")
    send(device, b"C1:BTWV TRSR,INT,GATE_NCYC,GATE,PLRT,NEG\n")  # a public record of the guide's §3.7
    assert ask(device, "C1:BTWV?").startswith(
        "C1:BTWV STATE,ON,PRD,0.01S,STPS,360,TRSR,INT,GATE_NCYC,GATE,PLRT,NEG,CARR,WVTP,SINE"
    )
    send(device, b"C1:BTWV TRSR,INT,PRD,0.1\n")
    assert (device.signal().amplitude, device.signal().burst.period) == (2.0, 0.1)


def test_an_endless_burst_waits_too():
    device = Virtual33500B(VirtualClock())
    send(device, b"BURS:NCYC INF;:TRIG:SOUR EXT;:BURS:STAT ON;:OUTP ON\n")
    assert device.signal().triggered.cycles == math.inf
    assert errors(device) == []

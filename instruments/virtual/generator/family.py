"""What the models of a family of generators have in common: waveforms, limits, independent settings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


HZ, S, V, DEG, PERCENT = ("", "HZ"), ("", "S"), ("", "V"), ("", "DEG"), ("", "PCT")
INNER = ("SINusoid", "SQUare", "TRIangle", "RAMP", "NRAMp", "NOISe", "PRBS", "ARB", "USER")

#: header, name, low, high, default, units.  Nothing else depends on these, as far as the model goes.
Plain = tuple[str, str, float, float, float, tuple[str, ...]]
PLAIN: tuple[Plain, ...] = (
    ("BURSt:PHASe", "burst_phase", -360, 360, 0, DEG),
    ("MARKer:FREQuency", "marker_frequency", 1e-6, 30e6, 500, HZ),
    ("FREQuency:STARt", "sweep_start", 1e-6, 30e6, 100, HZ),
    ("FREQuency:STOP", "sweep_stop", 1e-6, 30e6, 1000, HZ),
    ("SWEep:HTIMe", "sweep_hold", 0, 3600, 0, S),
    ("SWEep:RTIMe", "sweep_return", 0, 3600, 0, S),
    ("AM[:DEPTh]", "am_depth", 0, 120, 100, PERCENT),
    ("FM[:DEViation]", "fm_deviation", 1e-6, 15e6, 100, HZ),
    ("PM[:DEViation]", "pm_deviation", 0, 360, 180, DEG),
    ("PWM[:DEViation]", "pwm_deviation", 0, 1e6, 1e-5, S),
    ("FSKey:FREQuency", "fsk_frequency", 1e-6, 30e6, 100, HZ),
    ("FSKey:INTernal:RATE", "fsk_rate", 1e-6, 1e6, 10, HZ),
    ("AM:INTernal:FREQuency", "am_frequency", 1e-6, 30e6, 100, HZ),
    ("FM:INTernal:FREQuency", "fm_frequency", 1e-6, 30e6, 10, HZ),
    ("PM:INTernal:FREQuency", "pm_frequency", 1e-6, 30e6, 10, HZ),
    ("PWM:INTernal:FREQuency", "pwm_frequency", 1e-6, 30e6, 10, HZ),
)
#: header, name, words, default.
Choice = tuple[str, str, tuple[str, ...], str]
CHOICES: tuple[Choice, ...] = (
    ("FUNCtion:PULSe:HOLD", "pulse_hold", ("WIDTh", "DCYCle"), "WIDT"),
    ("BURSt:MODE", "burst_mode", ("TRIGgered", "GATed"), "TRIG"),
    ("BURSt:GATE:POLarity", "gate_polarity", ("NORMal", "INVerted"), "NORM"),
    ("FREQuency:MODE", "frequency_mode", ("CW", "LIST", "SWEep", "FIXed"), "CW"),
    ("SWEep:SPACing", "sweep_spacing", ("LINear", "LOGarithmic"), "LIN"),
    *(
        (f"{mode}:SOURce", f"{mode.lower()}_source", ("INTernal", "EXTernal"), "INT")
        for mode in ("AM", "FM", "PM", "PWM")
    ),
    ("FSKey:SOURce", "fsk_source", ("INTernal", "EXTernal"), "INT"),
    *((f"{mode}:INTernal:FUNCtion", f"{mode.lower()}_function", INNER, "SIN") for mode in ("AM", "FM", "PM", "PWM")),
)
#: Modes of which only one can be on, as their headers begin.
SWITCHES = ("BURSt", "SWEep", "AM", "FM", "PM", "PWM", "FSKey")


@dataclass(frozen=True)
class Waveform:
    """A waveform that a family can make.

    word: as the manual prints it; top, bottom: of its frequency [Hz]; crest: peak to peak over r.m.s.
    """

    word: str
    top: float
    bottom: float = 1e-6
    crest: float = 2.0
    bursts: bool = True
    sweeps: bool = True

    @cached_property
    def short(self) -> str:
        """What a query answers."""
        return "".join(c for c in self.word if not c.islower())


@dataclass(frozen=True)
class Family:
    """What the models of a family have in common.

    least_vpp: smallest amplitude into 50 Ω [V]; shortest_pulse, shortest_edge, longest_edge [s]; longest_period: of
    pulses [s]; edge_part: an edge is no longer than this part of the shorter half of a pulse; square: the limits of
    the duty cycle [%] at a frequency [Hz]; most_cycles, longest_burst [s], burst_rest [s]: of bursts;
    longest_delay: of a trigger [s]; longest_sweep [s]; arb: the word for arbitrary waveforms;
    points: how many an arbitrary waveform may have; room: of the memory for them; plain, choices: settings on which
    nothing else depends; modes: of which only one can be on.
    """

    waveforms: tuple[Waveform, ...]
    square: Callable[[float], tuple[float, float]]
    arb: str
    least_vpp: float
    shortest_pulse: float
    shortest_edge: float
    longest_edge: float
    first_edge: float
    longest_period: float
    most_cycles: float
    longest_burst: float
    burst_rest: float
    longest_delay: float
    longest_sweep: float
    points: tuple[int, int]
    room: int
    edge_part: float = 0.625
    plain: tuple[Plain, ...] = PLAIN
    choices: tuple[Choice, ...] = CHOICES
    modes: tuple[str, ...] = SWITCHES

    def waveform(self, short: str) -> Waveform:
        """The waveform with this short name."""
        return next(waveform for waveform in self.waveforms if waveform.short == short)

"""What a sound card hears now: level, clipping, hum, and whether something changes its gain."""

import math
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.arrays import Array
from analysis.pulses.clean import mains_lines
from analysis.pulses.search import shorten
from instruments.drivers.oscilloscope.sound import SoundCard
from instruments.links.sound import inputs
from levilab.texts.text import how_many

#: How long is listened [s], and in how many parts the level is compared.
_LISTENS_S, _PARTS = 3.0, 6
#: A level that changes by more than this factor from the first to the last parts may be changed by automatic gain;
#: the level of a top that keeps up changes by some per cent.
_GAIN_CHANGES = 1.26
#: Share of clipped samples that is worth a warning, and level below which nothing but noise is there.
_CLIPPED, _FAINT = 1e-3, 1e-3
#: Samples per second in which hum is looked for, as in a trace [1/s]; where it is: the mains in wires, twice the mains
#: in the light of lamps, and how near [Hz].  Higher lines may be a top's.
_HUM_RATE, _HUM_HZ, _NEAR_HZ = 2500.0, (50.0, 60.0, 100.0, 120.0), 0.3

#: Operating system → how automatic gain is switched off.
AUTOMATIC_GAIN_OFF = {
    "win32": "Settings, System, Sound, the input's properties: Audio enhancements off, and the boost if it clips",
    "darwin": "Control Centre, Mic Mode: Standard; the input's level is set by hand in System Settings, Sound, Input",
    "linux": "alsamixer, F4, F6 for the card: switch off Auto Gain Control and boost; in PulseAudio or PipeWire unload "
    "module-echo-cancel",
}


@dataclass(frozen=True)
class Heard:
    """What a channel hears.

    Attributes:
        level: root mean square, in parts of full scale.
        peak: greatest value, in parts of full scale.
        clipped: share of samples at the end of the range.
        hum: frequency [Hz] and amplitude, in parts of full scale, of lines of the mains.
        gain: level at the end over that at the beginning.
    """

    level: float
    peak: float
    clipped: float
    hum: tuple[tuple[float, float], ...]
    gain: float

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is wrong with it, and what to do."""
        found = []
        if self.clipped > _CLIPPED:
            found.append(f"clipped for {100 * self.clipped:.2g} % of the time: lower the input's level")
        if self.peak < _FAINT:
            found.append("hardly anything: raise the input's level, or is nothing plugged in?")
        if self.hum and max(amplitude for _, amplitude in self.hum) > 0.1 * self.peak:
            found.append("hum: twist or shield the wires, or run a laptop from its battery")
        if self.peak >= _FAINT and not 1 / _GAIN_CHANGES < self.gain < _GAIN_CHANGES:
            found.append(
                f"its level changed by {decibels(self.gain):+.0f} dB in {_LISTENS_S:g} s: is automatic gain on?  "
                f"{AUTOMATIC_GAIN_OFF.get(sys.platform, AUTOMATIC_GAIN_OFF['linux'])}"
            )
        return tuple(found)

    @property
    def text(self) -> str:
        """Level, peak and hum in decibels of full scale."""
        hum = ", ".join(f"{frequency:.0f} Hz at {decibels(amplitude):.0f} dB" for frequency, amplitude in self.hum)
        return f"level {decibels(self.level):.0f} dB, peak {decibels(self.peak):.0f} dB, hum {hum or 'none'}"


def hear(shares: Array, clipped: NDArray[np.bool_], rate: float) -> Heard:
    """Return what a record holds.

    Args:
        shares: of full scale, shape (n,).
        clipped: whether each sample is, shape (n,).
        rate: samples per second [1/s].
    """
    steady = shares - np.mean(shares)
    # at 25 Hz a part of half a second has 12 or 13 pulses: a level without automatic gain changes by 4 %
    parts = np.array([math.sqrt(float(np.mean(part**2))) for part in np.array_split(steady, _PARTS)])
    factor = max(int(rate // _HUM_RATE), 1)
    hum = mains_lines(shorten(steady, factor), rate / factor)
    return Heard(
        math.sqrt(float(np.mean(steady**2))),
        float(np.abs(shares).max()),
        float(clipped.mean()),
        tuple((float(at), float(size)) for at, size in hum if min(abs(at - line) for line in _HUM_HZ) < _NEAR_HZ),
        float(parts[-2:].mean()) / max(float(parts[:2].mean()), 1e-9),
    )


def decibels(share: float) -> float:
    """Return an amplitude in decibels; −200 for none."""
    return 20 * math.log10(max(share, 1e-10))


def listen(scope: SoundCard) -> tuple[str, float]:
    """Return what the channels of a sound card hear, a line each, the inputs there are, and the level of the first."""
    channels = tuple(range(1, scope.channels + 1))
    scope.prepare(channels=channels, duration_s=_LISTENS_S, sweep="auto")
    scope.acquire(timeout_s=_LISTENS_S)
    lines, levels = [], []
    for channel in channels:
        trace = scope.trace(channel)
        heard = hear(trace.volts, trace.clipped, scope.rate)
        levels.append(decibels(heard.level))
        lines += [f"channel {channel}: {heard.text}", *(f"  {remark}" for remark in heard.remarks)]
    if "VIRTUAL" not in scope.identity():
        lines += [
            f"input {one.number}: {one.name} ({one.host}, {how_many(one.channels, 'channel')}, "
            f"{one.rate:g} Hz){', the default' if one.is_default else ''}"
            for one in inputs(scope.transport.address)
        ]
    return "\n  ".join(lines), levels[0]

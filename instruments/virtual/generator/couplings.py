"""Conflicts between the settings of one output of a generator: the command wins, the other setting changes.

Sources: see channel.py.
"""

import math

from instruments.virtual.generator.channel import INFINITE, Channel

#: Modes of which only one can be on.
MODES = ("burst", "sweep")

#: Waveforms as the error queue names them.
_LONG = {
    "SIN": "sine", "SQU": "square", "TRI": "triangle", "RAMP": "ramp", "PULS": "pulse", "PRBS": "prbs", "NOIS": "noise",
    "DC": "dc", "ARB": "user", "USER": "user",
}  # fmt: skip


def resolve(channel: Channel, cause: str) -> None:
    """Change the other settings where they do not fit the one, the cause, that has changed."""
    _turn_off_other_modes(channel, cause)
    _drop_impossible_modes(channel)
    _limit_frequency(channel)
    _limit_voltage(channel, cause)
    _limit_square_duty(channel)
    _fit_pulse(channel, cause)
    _fit_bursts(channel)


def _turn_off_other_modes(channel: Channel, cause: str) -> None:
    if cause not in MODES or not channel[cause]:
        return
    for mode in MODES:
        if mode != cause and channel[mode]:
            channel[mode] = False
            channel.conflict(f"turned off {mode} by selection of other mode or modulation")


def _drop_impossible_modes(channel: Channel) -> None:
    for mode, able in (("burst", channel.waveform.bursts), ("sweep", channel.waveform.sweeps)):
        if channel[mode] and not able:
            channel[mode] = False
            channel.conflict(f"not able to {mode} this function")


def _limit_frequency(channel: Channel) -> None:
    low, high = channel.frequency_limits()
    if channel.frequency > high * (1 + 1e-12):
        channel.set_frequency(high)
        channel.conflict(f"frequency reduced for {_LONG[channel.waveform.short]} function")
    elif channel.frequency < low:
        channel.set_frequency(low)
        channel.conflict(f"frequency changed for {_LONG[channel.waveform.short]} function")


def _limit_voltage(channel: Channel, cause: str) -> None:
    least, most = channel.amplitude_limits()
    if not least * (1 - 1e-9) <= channel.number("amplitude_vpp") <= most * (1 + 1e-9):
        channel["amplitude_vpp"] = min(max(channel.number("amplitude_vpp"), least), most)
        channel.conflict("amplitude changed due to function")
    low, high = channel.offset_limits()
    offset = channel.number("offset")
    if not low - 1e-9 <= offset <= high + 1e-9:
        channel["offset"] = min(max(offset, low), high)
        channel.conflict(
            "offset changed on exit from dc function" if cause == "waveform" else "offset changed due to amplitude"
        )


def _limit_square_duty(channel: Channel) -> None:
    if channel["waveform"] != "SQU":
        return
    low, high = channel.family.square(channel.number("frequency"))
    if not low <= channel.number("duty") <= high:
        channel["duty"] = min(max(channel.number("duty"), low), high)
        channel.conflict("duty cycle changed due to frequency")


def _fit_pulse(channel: Channel, cause: str) -> None:
    """Fit width and edges of pulses into the period, where the waveform is a pulse."""
    frequency = channel.number("frequency")
    if cause not in {"pulse_width", "pulse_duty"}:
        if channel["pulse_hold"] == "DCYC":
            channel["pulse_width"] = channel.number("pulse_duty") / 100 / frequency
        else:
            channel["pulse_duty"] = 100 * channel.number("pulse_width") * frequency
    if channel["waveform"] != "PULS":
        return
    low, high = channel.pulse_limits()
    width = channel.number("pulse_width")
    if not low <= width <= high:
        channel.set_width(min(max(width, low), high))
        channel.conflict(f"pulse width {'decreased' if width > high else 'increased'} due to period")
    edge = channel.family.edge_part * min(channel.number("pulse_width"), 1 / frequency - channel.number("pulse_width"))
    if channel.number("pulse_edge") > edge * (1 + 1e-9):
        channel["pulse_edge"] = max(edge, channel.family.shortest_edge)
        channel.conflict("edge time decreased due to pulse width")


def _fit_bursts(channel: Channel) -> None:
    least = channel.number("burst_cycles") / channel.frequency + channel.family.burst_rest
    if channel.repeats and channel.number("burst_cycles") < INFINITE and channel.number("burst_period") < least:
        channel["burst_period"] = min(least, channel.family.longest_burst)
        channel.conflict("burst period increased to fit entire burst")
        if least > channel.family.longest_burst:
            channel["burst_cycles"] = max(1.0, math.floor(channel.family.longest_burst * channel.frequency))
            channel.conflict("burst count reduced to fit entire burst")

"""What `levilab bench check` says of a sound card: level, clipping, hum, automatic gain."""

import sys

import numpy as np
import pytest

from instruments.clock import VirtualClock
from instruments.drivers.oscilloscope.sound import SoundCard
from instruments.links.sound import SoundLink
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.oscilloscope.sound import VirtualSoundCard
from levilab.bench.hearing import AUTOMATIC_GAIN_OFF, hear, listen
from levilab.world.spin_world import SpinScene, SpinWorld

ADDRESS = "sound://oscilloscope.levilab"


def heard(**changes):
    """The text of a check of the virtual light, with a card that has other attributes."""
    clock = VirtualClock()
    card = VirtualSoundCard(clock, signals={1: SpinWorld(SpinScene(), clock).light})
    for name, value in changes.items():
        setattr(card, name, value)
    link = SoundLink(ADDRESS, library=library_for(VirtualBench({ADDRESS: card})), clock=clock)
    return listen(SoundCard(link, clock=clock))


def test_a_good_input_has_a_level_and_no_remark():
    text, level = heard()
    assert text == "channel 1: level -19 dB, peak -3 dB, hum none"
    assert level == pytest.approx(-20, abs=1)  # pulses of 0.6 of full scale, 0.03 of the time


def test_clipping_hum_and_silence_are_named():
    assert "clipped for" in heard(gain=3.0)[0]
    assert "clipped" not in heard()[0]
    assert "hum 50 Hz at -20 dB" in heard(hum=0.1)[0]
    assert "hum: twist or shield the wires" in heard(hum=0.1)[0]
    assert "hardly anything: raise the input's level" in heard(gain=1e-3, noise=1e-5)[0]


@pytest.mark.parametrize("system", AUTOMATIC_GAIN_OFF)
def test_a_gain_that_changes_is_suspected_and_the_way_to_end_it_said(system, monkeypatch):
    monkeypatch.setattr(sys, "platform", system)
    text, _ = heard(automatic_gain=True, gain=0.3)
    assert "is automatic gain on?" in text
    assert AUTOMATIC_GAIN_OFF[system] in text
    assert "automatic gain" not in heard()[0]


def test_noise_alone_is_no_automatic_gain():
    noise = np.random.default_rng(1).normal(0, 0.01, 3 * 48_000)
    assert not hear(noise, np.zeros(noise.size, bool), 48_000.0).remarks

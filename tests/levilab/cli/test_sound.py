"""The sound card on the command line: a WAV of the virtual bench, played into PulseAudio's null sink and recorded."""

import json
import subprocess
import sys

import numpy as np
import pytest

from analysis.pulses import spin_of_trace
from instruments.clock import VirtualClock
from instruments.virtual.oscilloscope.sound import VirtualSoundCard
from levilab.runs.run import Run
from levilab.world.spin_world import SpinScene, SpinWorld
from support.pulse_audio import RATE, null_sink, playing


def light(duration_s):
    """The light of a top that spins down, as a sound card converts it, shape (n,)."""
    clock = VirtualClock()
    world = SpinWorld(SpinScene(seed=4), clock)
    source = VirtualSoundCard(clock, signals={1: world.light}).open_input()
    source.start()
    blocks = []
    while clock.now() < duration_s:
        blocks.append(source.read(1.0)[0][:, 0])
    return np.concatenate(blocks)


def levilab(*words, cwd, environment):
    command = [sys.executable, "-m", "levilab", *words]
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_a_file_played_to_a_sound_card_is_recorded_bit_for_bit(tmp_path):
    samples = light(40.0)  # longer than the commands take to begin on a machine that is busy
    with null_sink() as environment, playing(samples, tmp_path / "bench.wav", environment):
        settings = ("--set", "trace.records=1", "--set", "trace.duration_s=2", "--json")
        done = levilab("acquire", "trace", "--scope", "sound", *settings, cwd=tmp_path, environment=environment)
        assert done.returncode == 0, done.stderr
    run = Run.load(tmp_path / json.loads(done.stdout)["run"])
    assert not run.record.synthetic
    *_, stored = run.traces()  # a machine that is busy loses samples: that record is cut short, and taken again
    recorded = (stored.trace.codes.astype(np.int32) - (1 << 15)).astype(np.int16)
    assert recorded.size == 2 * RATE
    at = samples.tobytes().find(recorded.tobytes())
    assert at > 0
    same = samples[at // 2 : at // 2 + recorded.size] / (1 << 15)
    assert spin_of_trace(same, RATE).frequency == spin_of_trace(stored.trace.volts, RATE).frequency

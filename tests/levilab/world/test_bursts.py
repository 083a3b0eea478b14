"""Bursts that the top triggers: their mean pull against the motion integrated turn by turn, and edges that fail.

The second computation has no mean over a turn: it integrates I₃ ω̇ = −μ⊥ sin ψ B(t) − drag through every burst, which
an edge of the tape's place starts, with scipy.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from instruments.clock import VirtualClock
from instruments.virtual.generator.channel import Output, Triggered
from levilab.world.bursts import TriggerWire, burst_starts, mean_pull
from levilab.world.spin_world import SpinScene, SpinWorld

#: Pull of a sine of 0.4 mT in phase with the top [Hz/s] (PHYSICS, drive: μδB₀/2I₃).
PULL_HZ_PER_S = SpinScene().lock_torque * 4e-4 / (2 * math.pi)


def bursts(phase=180.0, frequency=33.0, amplitude=4e-4, cycles=1, waveform="SIN", **trigger):
    about = {"rising": True, "delay": 5e-7, "jitter": 6e-9} | trigger
    return Output(waveform, frequency, 0.0, 0.0, phase=phase, triggered=Triggered(amplitude, cycles, **about))


def spin_after(scene, output, duration):
    world = SpinWorld(scene, VirtualClock())
    world.drive(0.0, output)
    return float(world.motion(np.array([duration]))[0][0]) / (2 * math.pi)


def integrated(scene, output, duration):
    """The spin after the bursts, each integrated, without scatter of the edges [Hz]."""
    edge = 2 * math.pi * (0.5 + scene.tape.offset(scene.trigger.thresholds(rising=True), scene.start_hz))
    lasts, free_at, now = output.triggered.cycles / output.frequency, -1.0, 0.0
    state = np.array([0.0, 2 * math.pi * scene.start_hz])  # angle of the tape, and spin
    pull = 2 * scene.lock_torque * output.triggered.amplitude * (-1 if output.inverted else 1)
    (c,) = scene.constants

    def motion(on):
        def rates(t, y):
            field = math.sin(2 * math.pi * output.frequency * (t - on) + math.radians(output.phase))
            moment = y[0] + 2 * math.pi * (scene.moment_turns - 0.5)
            torque = -pull * math.sin(moment) * field if on <= t < on + lasts else 0.0
            return [y[1], torque - c * y[1] ** 1.5]

        return rates

    on = -9.0
    while now < duration:
        turn = math.floor((state[0] - edge) / (2 * math.pi) + 1e-9) + 1

        def at_edge(_, y, place=edge + 2 * math.pi * turn):
            return y[0] - place

        at_edge.terminal = True
        passed = solve_ivp(motion(on), (now, duration), state, events=at_edge, rtol=1e-8, max_step=2e-3)
        now, state = passed.t[-1], passed.y[:, -1]
        if passed.status == 1 and now >= free_at:
            free_at = (on := now + output.triggered.delay) + lasts
    return state[1] / (2 * math.pi)


@pytest.mark.parametrize(
    ("output", "place"),
    [
        *((bursts(), 0.0), (bursts(phase=0.0), 0.0), (bursts(frequency=45.0), 0.1)),
        *((bursts(cycles=2, frequency=40.0), 0.3), (replace(bursts(frequency=45.0, delay=5e-3), inverted=True), 0.5)),
    ],
    ids=["drives", "brakes", "short", "every second turn", "late and inverted"],
)
def test_the_mean_pull_moves_the_top_as_bursts_one_by_one_do(output, place):
    scene = SpinScene(jitter=0.0, moment_turns=place)
    change = integrated(scene, output, 3.0) - scene.start_hz
    # a burst more or less at the end: 0.4 Hz/s in a turn of 1/30 s
    assert spin_after(scene, output, 3.0) - scene.start_hz == pytest.approx(change, abs=0.02)
    assert abs(change) > 0.15


def test_a_full_turn_in_phase_pulls_as_a_sine_that_holds_the_top():
    scene = SpinScene(jitter=0.0, constants=(1e-12,), tape=SpinScene().tape)
    edge = 360 * scene.tape.offset(scene.trigger.thresholds(rising=True), 30.0)
    gained = spin_after(scene, bursts(phase=180.0 + edge, frequency=30.2), 0.5) - 30.0
    assert gained == pytest.approx(0.5 * PULL_HZ_PER_S, rel=0.02)  # the top is 0.7 % slower than the cycle
    assert pytest.approx(0.394, abs=5e-4) == PULL_HZ_PER_S


def test_the_top_speeds_up_for_minutes_and_falls_when_it_is_braked():
    world = SpinWorld(SpinScene(), VirtualClock())
    world.drive(0.0, bursts(phase=160.0, frequency=45.0))
    spin, angle = world.motion(np.array([0.0, 20.0, 60.0]))
    assert (np.diff(spin) > 0).all()
    assert (np.diff(angle) > 0).all()
    world.drive(60.0, bursts(phase=340.0, frequency=45.0))
    assert world.motion(np.array([300.0]))[0][0] == 0.0
    assert world.motion(np.array([60.0]))[0][0] == pytest.approx(spin[-1])


def test_the_angle_is_the_integral_of_the_spin_across_the_steps():
    world = SpinWorld(SpinScene(), VirtualClock())
    world.drive(0.3, bursts())
    times = np.linspace(0.0, 5.0, 5001)
    spin, angle = world.motion(times)
    integral = np.concatenate(([0.0], np.cumsum((spin[1:] + spin[:-1]) / 2 * 1e-3)))
    assert angle == pytest.approx(integral, abs=1e-3)


def test_scatter_of_the_edges_averages_the_pull_over_their_places():
    points, weights = np.polynomial.hermite_e.hermegauss(20)
    mean = np.average([mean_pull(bursts(frequency=45.0), 30.0, 0.1 + 0.05 * x) for x in points], weights=weights)
    of_tape = mean_pull(bursts(frequency=45.0), 30.0, 0.1, jitter=0.05)
    of_start = mean_pull(bursts(frequency=45.0, jitter=0.05 / 30), 30.0, 0.1)
    assert [of_tape, of_start] == pytest.approx([mean, mean], rel=1e-4)  # 1e-6 of the edges come too early


def test_lost_edges_take_their_share_of_the_pull():
    def gain(lost):
        scene = SpinScene(constants=(1e-12,), trigger=TriggerWire(lost=lost))
        return spin_after(scene, bursts(), 1.0) - 30.0

    assert gain(0.2) == pytest.approx(0.8 * gain(0.0), rel=5e-3)  # the higher spin changes the rest


def test_a_cycle_longer_than_a_turn_is_triggered_every_second_turn():
    def gain(frequency):
        return spin_after(SpinScene(constants=(1e-12,), jitter=1e-4), bursts(160.0, frequency), 1.0) - 30.0

    assert 0.4 < gain(29.5) / gain(31.5) < 0.6


@pytest.mark.parametrize("wire", [None, TriggerWire(level_v=3.0)], ids=["cable off", "comparator above the pulse"])
def test_without_edges_the_top_coasts(wire):
    scene = SpinScene(trigger=wire)
    world = SpinWorld(scene, VirtualClock())
    free = float(world.motion(np.array([5.0]))[0][0]) / (2 * math.pi)
    assert spin_after(scene, bursts(), 5.0) == pytest.approx(free, abs=1e-5)
    world.drive(0.0, bursts())
    assert not world.coil_field(0.0, 1e-3, 1000).any()


def test_the_coil_has_a_cycle_for_each_pulse_of_the_tape():
    world = SpinWorld(SpinScene(jitter=0.0, constants=(1e-12,)), VirtualClock())
    world.drive(0.0, bursts(phase=90.0, frequency=40.0))
    field = world.coil_field(1.0, 1e-5, 100_000)
    assert np.abs(field).max() == pytest.approx(4e-4, rel=1e-3)
    starts = 1.0 + 1e-5 * (np.flatnonzero((field[1:] > 3.9e-4) & (field[:-1] == 0.0)) + 1)
    light = world.light(1.0, 1e-5, 100_000)
    edges = 1.0 + 1e-5 * (np.flatnonzero((light[1:] >= 0.6) & (light[:-1] < 0.6)) + 1)
    edges = edges[np.diff(edges, prepend=0.0) > 0.01]  # noise crosses the level again
    assert starts == pytest.approx(edges, abs=1e-4)
    assert np.mean(field == 0.0) == pytest.approx(1 - 30 / 40, abs=0.02)
    pieces = np.concatenate([world.coil_field(1.0 + 0.1 * k, 1e-5, 10_000) for k in range(10)])
    assert pieces == pytest.approx(field, abs=2e-6)  # of a sample's place


def test_an_edge_doubled_within_a_burst_starts_none():
    edges = np.sort(np.concatenate([np.arange(30) / 30, np.arange(30) / 30 + 0.004]))
    assert burst_starts(edges, 1 / 33) == pytest.approx(np.arange(30) / 30)

"""A phone beside a top for tests: its twin, a link to it, and an estimator that costs nothing."""

import numpy as np

from instruments.clock import VirtualClock
from instruments.drivers.counter.phyphox import FieldLine, Phyphox
from instruments.links.opening import open_link
from instruments.virtual.bench.bench import VirtualBench
from instruments.virtual.bench.visa_library import library_for
from instruments.virtual.counter.phyphox import VirtualPhyphox

ADDRESS = "phyphox://counter.levilab"


def turning(spin_hz=30.0, amplitude_t=5e-6, base_t=1e-3):
    """The field of a moment that turns: times → shape (n, 3) [T]."""

    def field(times):
        angle = 2 * np.pi * spin_hz * times
        still = np.full_like(times, base_t)
        return np.stack([still + 2 * amplitude_t * np.cos(angle), amplitude_t * np.sin(angle), still], axis=1)

    return field


def strongest_line(times, field, *, near=None):
    """The strongest line in 15 to 49 Hz, to 0.01 Hz, if it has more than a microtesla."""
    trial = np.arange(15.0, 49.0, 0.02)
    wave = np.exp(-2j * np.pi * np.outer(trial, times)) @ (field - field.mean(axis=0)) * 2 / times.size
    height = np.linalg.norm(np.abs(wave), axis=1)
    k = int(height.argmax())
    return FieldLine(float(trial[k]), 0.01, float(times.mean())) if height[k] > 1e-6 else None


class Phone:
    """A twin on a virtual bench, and its driver."""

    def __init__(self, field=None, estimator=strongest_line, log=None, **options):
        self.clock = VirtualClock()
        self.twin = VirtualPhyphox(self.clock, magnetic_field=field or turning(), **options)
        self.bench = VirtualBench({ADDRESS: self.twin})
        library = library_for(self.bench)
        link = open_link(ADDRESS, line={}, library=library, clock=self.clock, log=log)
        self.driver = Phyphox(link, clock=self.clock, estimator=estimator)

    def prepared(self, gate_s=1.0):
        self.driver.prepare(gate_s=gate_s, trigger_level_v=0.6)
        return self

"""Spin frequency of a top from the light pulses of its mark: traces and lists of pulse times."""

from analysis.pulses.phases import Phase, phases
from analysis.pulses.result import Finding, SpinFrequency
from analysis.pulses.times import spin_of_times
from analysis.pulses.trace import spin_of_trace
from analysis.pulses.track import Track, collect_findings, track_of_blocks, track_of_samples, track_of_times

__all__ = [
    "Finding",
    "Phase",
    "SpinFrequency",
    "Track",
    "collect_findings",
    "phases",
    "spin_of_times",
    "spin_of_trace",
    "track_of_blocks",
    "track_of_samples",
    "track_of_times",
]

"""Spin frequency of a top from the magnetic field that its tilted moment turns past a magnetometer."""

from analysis.rotation.record import rate_of
from analysis.rotation.result import FieldSpin, Fold
from analysis.rotation.spin import LineSamples, samples_of_line, spin_of_field
from analysis.rotation.tilt import transverse_moment
from analysis.rotation.track import FieldTrack, Flight, track_of_field

__all__ = [
    "FieldSpin",
    "FieldTrack",
    "Flight",
    "Fold",
    "LineSamples",
    "rate_of",
    "samples_of_line",
    "spin_of_field",
    "track_of_field",
    "transverse_moment",
]

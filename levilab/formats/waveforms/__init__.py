"""Samples of a signal against time, and times of pulses, out of other people's files."""

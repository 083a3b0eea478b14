"""Analyses: pure functions, arrays in, frozen results out."""

"""Limits of the spin: lower and upper, top after top."""

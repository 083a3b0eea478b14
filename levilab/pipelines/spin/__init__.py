"""Traces and pulse times → spin frequency."""

"""Scans of the base's field: strength, origin, thickness, and what follows for the tops that float there."""

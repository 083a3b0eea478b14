"""Blocks of a document → one HTML page with everything in it."""

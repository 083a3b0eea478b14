"""Inputs of the analyses: how they are found, named, read, corrected, and why some are not taken."""

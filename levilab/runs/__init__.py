"""The run folder: written, loaded, found, listed."""

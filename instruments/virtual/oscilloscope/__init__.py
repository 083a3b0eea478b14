"""Virtual oscilloscopes."""

"""Error and speed of frequencies from light pulses: ours, and what a user would otherwise do; easy and hard traces."""

"""The virtual world: what the simulated bench measures."""

"""Virtual gaussmeters."""

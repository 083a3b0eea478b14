"""The laboratory's instruments: configured, discovered, opened, checked."""

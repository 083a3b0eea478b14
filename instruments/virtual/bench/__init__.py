"""The virtual bench: instruments behind addresses, sessions, locks, faults, serial lines."""

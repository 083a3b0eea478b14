"""Drivers for the instruments of the bench. Knows nothing of levilab."""

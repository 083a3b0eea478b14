"""The precession: what the laser counts against the frequency of the drive, and whether the top is locked to it."""

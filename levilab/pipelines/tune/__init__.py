"""Which washers today: the owner's trials, kept in a file, and what to try next."""

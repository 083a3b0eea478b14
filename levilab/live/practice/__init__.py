"""A virtual bench to practise with, in a process of its own: a drive, a top, instruments, runs and their analysis."""

"""One simulated motion: its run, lines, summary, effects, table and figure."""

"""From the bench to a run folder."""

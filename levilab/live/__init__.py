"""The bench in a web browser: a view of a run folder and of what the bench publishes, in a process of its own."""

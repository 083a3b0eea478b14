"""What the virtual instruments see, and the virtual bench joined from it."""

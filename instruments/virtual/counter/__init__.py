"""Virtual frequency counters."""

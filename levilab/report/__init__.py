"""From results to the report a person reads."""

"""A top filmed from above: its rim, the mark on it, and whether camera and view stayed as they were."""

"""Virtual function generators."""

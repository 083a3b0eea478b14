"""A film of a top from above → where it is, how fast it turns, and a still with what was followed."""

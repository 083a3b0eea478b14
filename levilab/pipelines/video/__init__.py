"""A film of a top from above → its place and spin, and a still with rim, mark and path."""

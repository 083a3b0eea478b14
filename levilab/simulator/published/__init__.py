"""What others published about Levitrons, as printed, with its place in the source."""

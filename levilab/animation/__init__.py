"""The top in motion: its parts, its poses, and films of them."""

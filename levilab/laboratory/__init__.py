"""A whole laboratory in one process, from one number: bench, top, person, computer, and what goes wrong with them."""

"""The drag of a top of which nothing is known: what its exponent is, and how the spin bends under it."""

#: A drag in proportion to the n-th power of the spin changes its slope by n slope²/spin a second.  n is evenly
#: distributed from 1 to 2: its standard deviation is 1/√12.
EXPONENT, EXPONENT_U = 1.5, 0.29

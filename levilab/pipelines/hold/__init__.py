"""Held spins: the drag that the amplitude of a triggered drive balances."""

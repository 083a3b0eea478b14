"""Many inputs by one analysis: a row each in one table, whatever becomes of the others."""

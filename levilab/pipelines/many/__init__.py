"""Many inputs by one analysis: a table with a row for each."""

"""Other people's files, read as one table in SI."""

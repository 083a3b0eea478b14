"""How the names of exports end; nothing heavy is imported, so that a wrong one is refused at once."""

ENDINGS = (".nc", ".h5", ".csv", ".xlsx", ".zip")

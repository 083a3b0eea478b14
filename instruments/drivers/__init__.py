"""The drivers: the near end of the wire."""

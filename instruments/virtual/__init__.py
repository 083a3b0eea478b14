"""Wire-level models of the instruments: bytes in, bytes out."""

"""The links between a driver and its instrument: messages over a port of bytes."""

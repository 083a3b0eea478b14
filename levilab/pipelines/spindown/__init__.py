"""The spin-down: drag laws fitted to the readings of a top that slows down."""

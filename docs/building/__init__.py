"""What Sphinx does to the pages beside its own work."""

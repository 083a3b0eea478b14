"""Where a top floats: windows, maps, tables, figures."""

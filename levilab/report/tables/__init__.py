"""The tables of results beside a report: CSV in full precision for programs, LaTeX as people read them."""

"""Slow swings of a floating top, and the geometric magnetism that splits them."""

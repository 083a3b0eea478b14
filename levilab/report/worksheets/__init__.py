"""Worksheets for students and keys for their teacher: the texts are a file for each language."""

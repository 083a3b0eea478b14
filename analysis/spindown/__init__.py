"""Drag laws from spin-downs."""

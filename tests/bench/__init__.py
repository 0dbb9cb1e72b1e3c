"""Measurements: nothing here asserts a time; each prints a table."""

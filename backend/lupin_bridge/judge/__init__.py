"""Judges what the twin reports by the ranges of one file, for page, frames and HTTP alike."""

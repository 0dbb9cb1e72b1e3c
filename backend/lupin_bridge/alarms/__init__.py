"""Alarms while the bridge runs: derived from the log, kept in order, with people's notes."""

"""Alarms while the bridge runs: where they come from, how they stand, and who is told."""

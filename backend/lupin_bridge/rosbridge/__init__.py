"""The read-only part of rosbridge v2."""

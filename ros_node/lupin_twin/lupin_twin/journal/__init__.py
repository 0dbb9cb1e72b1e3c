"""The log: what was observed, in plain SQL, and all that is asked of it."""

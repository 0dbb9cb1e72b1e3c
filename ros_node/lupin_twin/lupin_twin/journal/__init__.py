"""The journal: the log of one twin's observations in SQLite, and every query on it."""

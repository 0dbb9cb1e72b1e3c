"""The durable log of everything the twin accepted: one SQLite file, one thread that writes it."""

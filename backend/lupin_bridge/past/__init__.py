"""The past over HTTP: queries of the log, and their answers."""

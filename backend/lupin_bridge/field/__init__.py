"""Fields: their queries, formats and colours."""

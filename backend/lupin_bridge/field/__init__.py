"""Fields: what was asked, how it is written, what colour it has."""

"""The estimate: a field in space and time, with its error, from a day of readings. Pure."""

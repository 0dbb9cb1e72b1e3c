"""A field with its error, in space and time, from all readings of a day. Pure."""

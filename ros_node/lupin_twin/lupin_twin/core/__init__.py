"""The twin's state, and the rules for updating it: values in, values out. Pure."""

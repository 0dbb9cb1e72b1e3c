"""What the twin knows, and the rules by which it takes in more: values in, values out. Pure."""

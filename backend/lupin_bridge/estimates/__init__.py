"""What the twin's estimates are worth: asked for, kept for a moment, told to the judge."""

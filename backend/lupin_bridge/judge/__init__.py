"""What the twin says, judged: by the ranges of one file, for page, frames and HTTP alike."""

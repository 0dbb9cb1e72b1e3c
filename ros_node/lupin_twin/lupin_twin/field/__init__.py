"""Heat maps by inverse distance weighting: grid, explored ground, cache, quality. Pure."""

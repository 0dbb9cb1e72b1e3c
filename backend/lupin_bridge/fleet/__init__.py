"""Many greenhouses on one page: their overview, and each one's page, from the archive alone."""

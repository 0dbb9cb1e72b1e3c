"""Sources of state: a twin in this process or elsewhere, and the one crossing of threads."""

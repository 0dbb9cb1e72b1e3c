"""Where snapshots and the log come from: a twin in this process, or one elsewhere."""

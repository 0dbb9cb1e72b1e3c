"""Who may read: policy, credentials, TLS."""

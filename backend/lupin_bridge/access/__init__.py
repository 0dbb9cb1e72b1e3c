"""Access control: policy, credentials, accounts."""

"""The command `lupin-twin`, its roles, and its configuration."""

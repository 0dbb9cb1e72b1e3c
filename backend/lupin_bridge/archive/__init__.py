"""The archive: the logs of many sites in one PostgreSQL, each forwarded from its journal."""

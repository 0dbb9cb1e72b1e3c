"""The past over HTTP: queries, and the answers made of a source's."""

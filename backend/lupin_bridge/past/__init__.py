"""The past over HTTP: what is asked, and what is made of a source's answers."""

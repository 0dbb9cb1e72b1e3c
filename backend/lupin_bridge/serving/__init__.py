"""The web server: uvicorn's protocols for slow clients, and the limits on clients."""

"""uvicorn's protocols, and the bounds on connections."""

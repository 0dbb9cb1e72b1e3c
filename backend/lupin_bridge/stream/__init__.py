"""The state on its way to clients: JSON, frames, fan-out, status."""

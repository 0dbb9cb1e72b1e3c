"""The read-only part of Foxglove's WebSocket protocol."""

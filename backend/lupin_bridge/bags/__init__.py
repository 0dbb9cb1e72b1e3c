"""Recordings (MCAP files, as `ros2 bag` writes them): made from a journal, read, and played."""

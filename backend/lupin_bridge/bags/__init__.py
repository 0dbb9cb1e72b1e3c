"""Recordings (MCAP files, as `ros2 bag` has them): made, mended, and played again."""

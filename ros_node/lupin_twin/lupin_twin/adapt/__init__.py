"""Observations made of what any robot publishes: standard messages, poses, fixed sensors."""

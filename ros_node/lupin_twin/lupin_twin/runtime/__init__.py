"""Threads, processes, signals, and what runs on them beside the node."""

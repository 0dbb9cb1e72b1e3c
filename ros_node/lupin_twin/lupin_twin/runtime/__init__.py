"""Threads, processes and signals, and the background work of the node."""

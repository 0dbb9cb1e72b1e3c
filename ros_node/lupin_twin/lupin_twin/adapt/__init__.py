"""Adapter: makes observations from any robot's standard messages, and from fixed sensors."""

"""Viewers with protocols of their own: roslib by rosbridge, Foxglove and Lichtblick."""

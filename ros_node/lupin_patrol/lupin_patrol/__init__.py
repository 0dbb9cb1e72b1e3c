"""A simulated robot on patrol: stands in for the mission orchestrator and for perception."""

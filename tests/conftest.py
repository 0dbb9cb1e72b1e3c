"""Fixtures that every test may use."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, settings

from tests.support.domains import own_domain
from tests.support.shared_memory import remove_what_the_dead_left

# Before anything imports rclpy: ROS would swallow a field of the wrong type, and leave the machine.
os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"

# How long an example takes is the machine's business.
settings.register_profile("here", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("here")


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Leave the machine's memory as it was: many tests kill processes."""
    if not hasattr(session.config, "workerinput"):  # once, not by each worker
        remove_what_the_dead_left()


@pytest.fixture
def domain() -> Iterator[int]:
    """A ROS domain of the test's own."""
    with own_domain() as leased:
        yield leased

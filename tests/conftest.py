"""Fixtures that every test may use."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from tests.support.domains import own_domain


@pytest.fixture
def domain() -> Iterator[int]:
    """A ROS domain of the test's own."""
    with own_domain() as leased:
        yield leased


@pytest.fixture(scope="session", autouse=True)
def checked_ros() -> None:
    """Refuse to run where ROS would swallow a field of the wrong type, or leave this machine."""
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    if os.environ.get("ROS_PYTHON_CHECK_FIELDS") != "1":
        pytest.exit("set ROS_PYTHON_CHECK_FIELDS=1 (`make unit` does)", returncode=2)

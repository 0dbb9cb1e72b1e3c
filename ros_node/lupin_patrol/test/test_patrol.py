"""Smoke test of the installed patrol package: its geometry and its messages."""

from __future__ import annotations

from lupin_msgs.msg import Observation

from lupin_patrol.greenhouse import Rect
from lupin_patrol.mission import ScanStatus, Visited
from lupin_patrol.node import observation
from lupin_twin.core import state


def test_a_rectangle_does_not_contain_its_edge() -> None:
    rect = Rect(0.0, 0.0, 2.0, 1.0)
    assert rect.contains((1.0, 0.5))
    assert not rect.contains((2.0, 0.5))


def test_a_failed_scan_is_an_observation_without_readings() -> None:
    scan = state.Observation("7", 0, status=ScanStatus.UNREACHABLE, status_detail="blocked")
    message = observation(Visited(3.0, 0, 0.0, scan), 12_000_000_000, "map")
    assert (message.kind, message.status) == (
        Observation.KIND_TAG_READING,
        Observation.STATUS_UNREACHABLE,
    )
    assert (message.tag_reading.tag_id, list(message.tag_reading.readings)) == ("7", [])

"""The events, as plain data."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace
from typing import get_args

import pytest
from lupin_msgs.msg import Observation

from lupin_patrol.mission import Event, PassCompleted, ScanStatus


def test_events_are_values() -> None:
    event = PassCompleted(1.0, 0, ("7",))
    assert event == PassCompleted(1.0, 0, ("7",))
    assert event != replace(event, at_s=2.0)
    with pytest.raises(FrozenInstanceError):
        event.at_s = 3.0  # type: ignore[misc]  # that is what is tried


def test_every_event_says_when_it_happens() -> None:
    for kind in get_args(Event):
        assert next(iter(kind.__dataclass_fields__)) == "at_s"


def test_the_names_of_the_statuses_are_the_messages_own() -> None:
    assert all(hasattr(Observation, f"STATUS_{status.name}") for status in ScanStatus)

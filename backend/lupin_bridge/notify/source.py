"""What the channels need of the bridge."""

from __future__ import annotations

from typing import Protocol

from lupin_bridge.alarms.board import AlarmBoard
from lupin_bridge.alarms.notes import NoteBoard
from lupin_bridge.feed.source import TwinSource
from lupin_bridge.judge.options import Criteria
from lupin_bridge.notify.messages import GreenhouseState
from lupin_twin.core.diagnostics import Origin


class Source(Protocol):
    """The bridge."""

    alarms: AlarmBoard
    notes: NoteBoard
    source: TwinSource
    criteria: Criteria

    def seen(self) -> GreenhouseState:
        """The state of now."""

    @property
    def ros_time_ns(self) -> int | None:
        """ROS time now; None: it is not known."""

    @property
    def origin(self) -> Origin:
        """Where observations come from."""

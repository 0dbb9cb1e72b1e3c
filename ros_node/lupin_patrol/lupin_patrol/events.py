"""What happens on a patrol, as plain data. `at_s` is patrol time: seconds since the start.

Positions are metres in the map frame; times of day are seconds since simulated midnight.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import cos, sin

from lupin_patrol.exploration import Grid
from lupin_patrol.geometry import Point, Rect
from lupin_patrol.house import TAG_HEIGHT_M
from lupin_patrol.perception import Sighting
from lupin_patrol.plants import Look


class ScanStatus(Enum):
    """How a scan went; the names are those of lupin_msgs/Observation's STATUS_*."""

    OK = "OK"
    UNREACHABLE = "UNREACHABLE"
    SCAN_FAILED = "SCAN_FAILED"


@dataclass(frozen=True, slots=True)
class TagPose:
    """Where a tag was located. `yaw` (rad, from x towards y) points from the tag into the aisle."""

    position: Point
    yaw: float

    @property
    def numbers(self) -> tuple[float, float, float, float, float, float, float]:
        """x, y, z (m) and the quaternion's x, y, z, w, as a pose of ROS has them."""
        x, y = self.position
        return x, y, TAG_HEIGHT_M, 0.0, 0.0, sin(self.yaw / 2), cos(self.yaw / 2)


@dataclass(frozen=True, slots=True)
class MapGrown:
    """The map shows more than before."""

    at_s: float
    grid: Grid


@dataclass(frozen=True, slots=True)
class TagsDiscovered:
    """Perception's whole list, after it got longer or at the end of a pass."""

    at_s: float
    sightings: tuple[Sighting, ...]


@dataclass(frozen=True, slots=True)
class TagScanned:
    """One try at a tag's sensors. Without success there are neither readings nor a pose."""

    at_s: float
    pass_index: int
    tag_id: str
    status: ScanStatus
    status_detail: str
    time_of_day_s: float
    readings: tuple[tuple[str, float], ...]
    pose: TagPose | None


@dataclass(frozen=True, slots=True)
class FlowersSeen:
    """One look at the plants around a tag; `box` is the outline of their table."""

    at_s: float
    pass_index: int
    tag_id: str
    pose: TagPose
    look: Look
    box: Rect


@dataclass(frozen=True, slots=True)
class PassCompleted:
    """Every tag was visited, and those that failed were tried again."""

    at_s: float
    pass_index: int
    failed: tuple[str, ...]


Event = MapGrown | TagsDiscovered | TagScanned | FlowersSeen | PassCompleted

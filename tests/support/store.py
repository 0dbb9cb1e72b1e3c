"""Writes for a store, with short calls."""

from lupin_twin.core.state import (
    NANOSECONDS_PER_SECOND,
    STATUS_OK,
    Flower,
    Inspection,
    Pose,
    Reading,
    Scan,
)

S = NANOSECONDS_PER_SECOND
SCAN_FAILED = 2


def at(x: float, y: float = 0.0) -> Pose:
    """A pose at (x, y), m."""
    return Pose(x, y, 0.0, 0.0, 0.0, 0.0, 1.0)


def scan(
    tag_id: str,
    at_s: float = 1.0,
    pose: Pose | None = None,
    succeeded: bool = True,
    source: str = "",
    **readings: float,
) -> Scan:
    """A scan; the other keyword arguments are its readings."""
    values = tuple(Reading(name, value) for name, value in readings.items())
    status = STATUS_OK if succeeded else SCAN_FAILED
    return Scan(tag_id, round(at_s * S), values, pose, status, source=source)


def inspection(
    tag_id: str, at_s: float = 1.0, pose: Pose | None = None, **flower: object
) -> Inspection:
    """An inspection of the flowers; keyword arguments are its results."""
    return Inspection(tag_id, round(at_s * S), Flower(**flower), pose)  # type: ignore[arg-type]

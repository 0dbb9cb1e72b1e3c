"""What is written into a store, with the least to write in a test."""

from __future__ import annotations

from lupin_twin.state import (
    NANOSECONDS_PER_SECOND,
    Flower,
    FlowerObservation,
    Observation,
    Pose,
    Reading,
)

S = NANOSECONDS_PER_SECOND


def at(x: float, y: float = 0.0) -> Pose:
    """A pose at (x, y), m."""
    return Pose(x, y, 0.0, 0.0, 0.0, 0.0, 1.0)


def scan(
    tag_id: str,
    at_s: float = 1.0,
    pose: Pose | None = None,
    succeeded: bool = True,
    **readings: float,
) -> Observation:
    """A scan; keyword arguments are its readings."""
    values = tuple(Reading(name, value) for name, value in readings.items())
    return Observation(tag_id, round(at_s * S), values, pose, succeeded)


def look(
    tag_id: str, at_s: float = 1.0, pose: Pose | None = None, **flower: object
) -> FlowerObservation:
    """A look at the flowers; keyword arguments are what was seen."""
    return FlowerObservation(tag_id, round(at_s * S), Flower(**flower), pose)  # type: ignore[arg-type]

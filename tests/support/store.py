"""Writes for a store, with short calls."""

from collections.abc import Sequence

from lupin_twin.core.state import (
    KIND_FLOWER,
    NANOSECONDS_PER_SECOND,
    STATUS_OK,
    Flower,
    Observation,
    Pose,
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
) -> Observation:
    """A scan; the other keyword arguments are its readings."""
    status = STATUS_OK if succeeded else SCAN_FAILED
    return Observation(tag_id, round(at_s * S), readings, pose, status, source=source)


def inspection(
    tag_id: str, at_s: float = 1.0, pose: Pose | None = None, **flower: object
) -> Observation:
    """An inspection of the flowers; keyword arguments are its results."""
    seen = Flower(**flower)  # type: ignore[arg-type]
    return Observation(tag_id, round(at_s * S), pose=pose, kind=KIND_FLOWER, flower=seen)


def logged(  # noqa: PLR0917  # the order of a journal's columns
    number: int,
    run: int,
    tag_id: str,
    stamp_ns: int,
    kind: int,
    status: int,
    sensors: Sequence[str] = (),
    values: Sequence[float] = (),
    flower: Flower | None = None,
) -> Observation:
    """An observation of a journal."""
    named = dict(zip(sensors, values, strict=True))
    of = (number, run)
    return Observation(tag_id, stamp_ns, named, None, status, "", "", 0, "", 0, kind, flower, *of)

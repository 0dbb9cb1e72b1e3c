"""Snapshot to JSON text: the names of the ROS messages, NaN and infinity as null.

Pure. A tag's text is kept until the tag changes, but for its age, which changes in every frame: so
the text of a tag is two pieces with the age between them, and a frame of thousands of unchanged
tags is one join.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import orjson

from lupin_twin.state import (
    NANOSECONDS_PER_SECOND,
    Observation,
    Pose,
    Snapshot,
    TagState,
)

_AGE = b'"stale_seconds":'
# An age to the millisecond: a browser shows seconds, and shorter numbers make shorter frames.
_AGE_DECIMALS = 3


class StateJson:
    """Writes snapshots as JSON and keeps the text of unchanged tags."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[TagState, bytes, bytes]] = {}

    def state(self, snapshot: Snapshot, now_ns: int | None = None) -> bytes:
        """The snapshot as JSON of `schema.TwinState`, ages as of `now_ns`, or of its own time."""
        if now_ns is None:
            now_ns = snapshot.stamp_ns
        return b'{"header":%b,"tags":[%b]}' % (
            orjson.dumps(header(snapshot.stamp_ns, snapshot.frame_id)),
            b",".join([self.tag(tag, now_ns) for tag in snapshot.tags]),
        )

    def tag(self, tag: TagState, now_ns: int) -> bytes:
        """One tag as JSON of `schema.TwinTagState`, its age as of `now_ns` (ROS time, ns)."""
        kept = self._kept.get(tag.tag_id)
        if kept is None or kept[0] is not tag:
            kept = (tag, *_split_at_age(orjson.dumps(tag_fields(tag))))
            self._kept[tag.tag_id] = kept
        return kept[1] + age(tag.stale_seconds(now_ns)) + kept[2]


def _split_at_age(text: bytes) -> tuple[bytes, bytes]:
    # The key cannot occur earlier inside a string: there its quotes would be escaped.
    head, _, tail = text.partition(_AGE + b"null")
    return head + _AGE, tail


def age(stale_seconds: float) -> bytes:
    """An age as JSON; a tag never observed has none."""
    if not math.isfinite(stale_seconds):
        return b"null"
    return b"%.*f" % (_AGE_DECIMALS, stale_seconds)


def tag_fields(tag: TagState) -> dict[str, Any]:
    """The fields of `schema.TwinTagState`, in the message's order, the age left at None."""
    flower = tag.flower
    return {
        "tag_id": tag.tag_id,
        "pose": pose(tag.pose),
        "readings": [{"name": r.name, "value": r.value} for r in tag.readings],
        "last_observed": stamp(tag.last_observed_ns or 0),
        "stale_seconds": None,
        "species": flower.species,
        "species_confidence": flower.confidence,
        "anomaly": flower.anomaly,
        "flower_count": flower.flower_count,
        "bug_count": flower.bug_count,
        "flowers": [
            {
                "position": {"x": bloom.x, "y": bloom.y, "z": bloom.z},
                "height_m": bloom.height_m,
                "species": bloom.species,
                "confidence": bloom.confidence,
                "anomaly": bloom.anomaly,
            }
            for bloom in flower.blooms
        ],
        "box_footprint": {"points": [{"x": x, "y": y, "z": z} for x, y, z in flower.footprint]},
    }


def pose(value: Pose | None) -> dict[str, Any]:
    """`schema.Pose`; no pose is `w == 0`."""
    if value is None:
        value = Pose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return {
        "position": {"x": value.x, "y": value.y, "z": value.z},
        "orientation": {"x": value.qx, "y": value.qy, "z": value.qz, "w": value.qw},
    }


def stamp(stamp_ns: int) -> dict[str, int]:
    """Nanoseconds of ROS time as `schema.Time`."""
    sec, nanosec = divmod(max(0, stamp_ns), NANOSECONDS_PER_SECOND)
    return {"sec": sec, "nanosec": nanosec}


def header(stamp_ns: int, frame_id: str) -> dict[str, Any]:
    """`schema.Header`."""
    return {"stamp": stamp(stamp_ns), "frame_id": frame_id}


def history(tag_id: str, scans: Iterable[Observation]) -> dict[str, Any]:
    """`schema.TagHistory` of scans, oldest first."""
    sensors: dict[str, list[dict[str, Any]]] = {}
    for scan in scans:
        for reading in scan.readings:
            value = reading.value if math.isfinite(reading.value) else None
            sensors.setdefault(reading.name, []).append(
                {"stamp": stamp(scan.stamp_ns), "value": value}
            )
    return {
        "tag_id": tag_id,
        "sensors": [{"name": name, "values": values} for name, values in sensors.items()],
    }

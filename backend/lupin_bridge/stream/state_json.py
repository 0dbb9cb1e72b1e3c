"""Snapshot to JSON text: the names of the ROS messages, NaN and infinity as null.

Pure. A tag's text is kept until the tag changes, but for its ages, which change in every frame: so
what is kept is a template with their places, and a frame of thousands of unchanged tags is one
short formatting each. Readings of one scan are of one age, which is written once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Final

import orjson

from lupin_twin.history import TagHistory
from lupin_twin.state import (
    NANOSECONDS_PER_SECOND,
    Pose,
    Snapshot,
    TagState,
    age_seconds,
)

# In place of a moment: that of the snapshot itself.
OWN_TIME: Final = -1


@dataclass(frozen=True, slots=True)
class _Template:
    """A tag's text with a `%b` for each age; `picks` says which of the ages of `stamps_ns`."""

    tag: TagState
    text: bytes
    stamps_ns: tuple[int, ...]
    picks: tuple[int, ...]

    def at(self, now_ns: int | None, write_age: Callable[[float], bytes], no_age: bytes) -> bytes:
        """The text as of `now_ns`; None: now is not known, and no age is."""
        if now_ns is None:
            return self.text % ((no_age,) * len(self.picks))
        ages = [write_age(age_seconds(stamp_ns, now_ns)) for stamp_ns in self.stamps_ns]
        if len(ages) == 1:  # a tag that was scanned, and nothing else since
            return self.text % tuple(ages * len(self.picks))
        return self.text % tuple([ages[pick] for pick in self.picks])


class StateJson:
    """Writes snapshots as JSON and keeps the text of unchanged tags.

    `has_times`: as the web contract has it, with the time and the age of each reading, the last
    look and the last try; without, as the ROS message has it.
    """

    def __init__(self, *, has_times: bool = True) -> None:
        self._has_times = has_times
        self._kept: dict[str, _Template] = {}

    def state(self, snapshot: Snapshot, now_ns: int | None = OWN_TIME) -> bytes:
        """The snapshot as JSON of `schema.TwinState`, ages as of `now_ns`, or of its own time.

        None: now is not known, and no age is.
        """
        if now_ns == OWN_TIME:
            now_ns = snapshot.now_ns
        return b'{"header":%b,"tags":[%b]}' % (
            orjson.dumps(header(snapshot.stamp_ns, snapshot.frame_id)),
            b",".join([self.tag(tag, now_ns) for tag in snapshot.tags]),
        )

    def tag(self, tag: TagState, now_ns: int | None) -> bytes:
        """One tag as JSON of `schema.TwinTagState`, its ages as of `now_ns` (ROS time, ns)."""
        kept = self._kept.get(tag.tag_id)
        if kept is None or kept.tag is not tag:
            kept = self._template(tag)
            self._kept[tag.tag_id] = kept
        return kept.at(now_ns, self.write_age, self.null)

    # --- what another encoding writes in another way ----------------------------------------------

    null: ClassVar[bytes] = b"null"
    # It cannot occur inside a string: there the quotes of the key would be escaped.
    no_age: ClassVar[bytes] = b'"stale_seconds":null'

    @staticmethod
    def write(fields: dict[str, Any]) -> bytes:
        """A tag's fields, NaN and infinity as null."""
        return orjson.dumps(fields)

    @staticmethod
    def write_age(stale_seconds: float) -> bytes:
        """To the millisecond: a browser shows seconds, and short numbers make short frames."""
        return b"%.3f" % stale_seconds

    def keep_only(self, snapshot: Snapshot) -> None:
        """Forget the tags that are not in it: a restarted twin may know others."""
        if len(self._kept) > len(snapshot.tags):
            ids = {tag.tag_id for tag in snapshot.tags}
            self._kept = {tag_id: kept for tag_id, kept in self._kept.items() if tag_id in ids}

    def _template(self, tag: TagState) -> _Template:
        times = [r.observed_at_ns for r in tag.readings] if self._has_times else []
        times.append(tag.last_observed_ns)
        known = [stamp_ns for stamp_ns in times if stamp_ns is not None]
        stamps_ns = tuple(dict.fromkeys(known))
        places = iter(times)
        no_age = self.no_age
        key = no_age[: -len(self.null)]
        text, *rest = self.write(self._fields(tag)).replace(b"%", b"%%").split(no_age)
        for piece in rest:
            text += (no_age if next(places) is None else key + b"%b") + piece
        return _Template(tag, text, stamps_ns, tuple(map(stamps_ns.index, known)))

    def _fields(self, tag: TagState) -> dict[str, Any]:
        fields = message_fields(tag)
        if not self._has_times:
            return fields
        for reading, own in zip(fields["readings"], tag.readings, strict=True):
            reading["observed_at"] = moment(own.observed_at_ns)
            reading["stale_seconds"] = None
        last = tag.last_try
        return fields | {
            "looked_at": moment(tag.looked_at_ns),
            "last_try": None if last is None else moment(last.stamp_ns),
            "last_try_status": None if last is None else last.status,
            "last_try_detail": "" if last is None else last.detail,
        }


def message_fields(tag: TagState) -> dict[str, Any]:
    """The fields of lupin_msgs/TwinTagState, in the message's order, the age left at None."""
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


def moment(stamp_ns: int | None) -> dict[str, int] | None:
    """`schema.Time`, or None for what never was, or when is not known."""
    return None if stamp_ns is None else stamp(stamp_ns)


def header(stamp_ns: int, frame_id: str) -> dict[str, Any]:
    """`schema.Header`."""
    return {"stamp": stamp(stamp_ns), "frame_id": frame_id}


def history(tag_id: str, past: TagHistory) -> dict[str, Any]:
    """`schema.TagHistory`."""
    sensors: dict[str, list[dict[str, Any]]] = {}
    for scan in past.scans:
        for reading in scan.readings:
            value = reading.value if math.isfinite(reading.value) else None
            sensors.setdefault(reading.name, []).append(
                {"stamp": stamp(scan.stamp_ns), "value": value}
            )
    return {
        "tag_id": tag_id,
        "is_known": past.is_known,
        "sensors": [{"name": name, "values": values} for name, values in sensors.items()],
        "tries": [
            {
                "stamp": stamp(tried.stamp_ns),
                "status": tried.what.status,
                "status_detail": tried.what.detail,
                "kind": tried.kind,
            }
            for tried in past.tries
        ],
    }

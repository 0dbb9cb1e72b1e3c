"""What each tag read of one sensor in the time before a moment, for an estimate as of then."""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Iterator

from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import newest, series
from lupin_twin.past import MAX_POINTS, SeriesPast, SeriesRequest

# A tag's id, its place (m, map frame), and its readings: (ns of ROS time, value).
TagLately = tuple[str, float, float, tuple[tuple[int, float], ...]]


def lately(
    connection: sqlite3.Connection, sensor_type: str, at_ns: int, reach_ns: int, most: int
) -> Iterator[TagLately]:
    """The tags that had a place and a reading at `at_ns`, with their last finite readings.

    `reach_ns` is how far back, `most` how many of all tags together. Where rows were deleted, the
    means of stretches.
    """
    tags = [
        tag
        for tag in state_at(connection, at_ns, "").tags
        if tag.pose is not None and any(reading.name == sensor_type for reading in tag.readings)
    ]
    each = max(most // max(len(tags), 1), 1)
    for tag in tags:
        if tag.pose is None:
            continue
        asked = SeriesRequest(
            tag.tag_id, sensor_type, max(1, at_ns - reach_ns), at_ns + 1, MAX_POINTS
        )
        found = newest(connection, asked, each)
        if found is None:
            found = [
                (min(stamp_ns, at_ns), value)
                for stamp_ns, value in _values(series(connection, asked, at_ns))
            ]
        if found:
            yield tag.tag_id, tag.pose.x, tag.pose.y, tuple(found)


def _values(past: SeriesPast) -> Iterator[tuple[int, float]]:
    half_ns = (past.bucket_ns or 0) // 2
    for stamp_ns, value in zip(past.stamps_ns, past.means, strict=True):
        if math.isfinite(value):
            yield stamp_ns + half_ns, value

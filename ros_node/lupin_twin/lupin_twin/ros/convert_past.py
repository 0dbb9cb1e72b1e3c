"""Questions about the past and their answers, as messages and as values.

What is built here may be large: a state of 20,000 tags is half a million objects. So it is built on
a worker, and nothing of it is cached.
"""

from __future__ import annotations

import re
from array import array
from typing import Any, Final

from lupin_msgs.msg import TwinState, TwinTimes
from lupin_msgs.srv import GetHistory, GetStateAt, GetWrites
from std_msgs.msg import Header

from lupin_twin.core.past import (
    DEFAULT_POINTS,
    MAX_POINTS,
    PastRefused,
    SeriesPast,
    SeriesRequest,
    error_of,
)
from lupin_twin.core.state import Snapshot
from lupin_twin.core.writes import DEFAULT_WRITES, MAX_WRITES, PastWrites, WritesRequest
from lupin_twin.journal.follow import Lot, NotALotError
from lupin_twin.ros import convert
from lupin_twin.runtime.workers import in_turns

# Of tables that are small the rows come each time.
_MAX_ROWS: Final = 50_000
# It becomes the name of a file.
_ID: Final = re.compile("[0-9a-f]{32}")


def writes_request(request: Any) -> WritesRequest:
    """GetWrites.Request as a value."""
    return WritesRequest(
        after=int(request.after),
        reach_s=float(request.reach_s),
        reach_count=int(request.reach_count),
        max_count=int(request.max_count) or DEFAULT_WRITES,
    )


def rows_request_message(after: int) -> Any:
    """A question for the log's rows behind a number."""
    return GetWrites.Request(after=after, max_count=MAX_WRITES, as_rows=True)


def rows_response(lot: Lot) -> Any:
    """Rows as GetWrites.Response."""
    return GetWrites.Response(
        ok=True, journal=lot.journal, last=lot.last, is_all=lot.is_all, rows=list(lot.rows)
    )


def lot_of(response: Any, after: int) -> Lot:
    """The rows in a GetWrites.Response: the other direction of `rows_response`.

    Raises:
        PastRefused, NotRemembered: it is not `ok`.
        NotALotError: it says nothing new, and that there is more, or it is too much.

    """
    if not response.ok:
        raise error_of(response.error_message)
    lot = Lot(response.journal, tuple(response.rows), int(response.last), bool(response.is_all))
    if lot.last < after or (lot.last == after and not lot.is_all):
        raise NotALotError(f"it ends with {lot.last}, requested was what is behind {after}")
    if len(lot.rows) > _MAX_ROWS:
        raise NotALotError(f"it has {len(lot.rows)} rows, the limit is {_MAX_ROWS}")
    if not _ID.fullmatch(lot.journal):
        raise NotALotError(f"{lot.journal[:64]!r} names no journal")
    return lot


def writes_response(past: PastWrites) -> Any:
    """Writes as GetWrites.Response."""
    texts: dict[str, int] = {}

    def place(text: str) -> int:
        return texts.setdefault(text, len(texts))

    found = past.writes
    response = GetWrites.Response(
        ok=True,
        journal=past.journal,
        last=past.last,
        is_all=past.is_all,
        span_runs=array("I", (span.run for span in past.spans)),
        span_starts_ns=array("q", (span.start_ns for span in past.spans)),
        span_ends_ns=array("q", (span.end_ns for span in past.spans)),
        numbers=array("Q", (write.number for write in found)),
        runs=array("I", (write.run for write in found)),
        tags=array("I", (place(write.tag_id) for write in found)),
        stamps_ns=array("q", (write.stamp_ns for write in found)),
        kinds=array("B", (write.kind & 0xFF for write in found)),
        statuses=array("B", (write.status & 0xFF for write in found)),
        reading_counts=array("I", (len(write.values) for write in found)),
        has_seen=[write.has_seen for write in found],
        species=array("I", (place(write.species) for write in found)),
        anomalies=[write.anomaly for write in found],
        bug_counts=array("H", (write.bug_count & 0xFFFF for write in found)),
        sensors=array("I", (place(name) for write in found for name in write.sensors)),
        values=array("d", (value for write in found for value in write.values)),
    )
    response.texts = list(texts)
    return response


UINT32_MAX: Final = 4_294_967_295
# What building an answer takes, and reading one, roughly and at worst, for each tag, and for each
# reading, flower and point of it.
TAG_S: Final = 60e-6
ITEM_S: Final = 20e-6


# --- the state as of a moment ---------------------------------------------------------------


def state_response(snapshot: Snapshot) -> Any:
    """A snapshot as GetStateAt.Response: its state, and its times with the same stamp.

    For a worker's thread: it rests often.
    """
    tags, times = [], []
    for tag in in_turns(snapshot.tags):
        msg = convert.tag_message(tag)
        msg.stale_seconds = tag.stale_seconds(snapshot.now_ns)
        tags.append(msg)
        times.append(convert.times_message(tag))
    header = Header(stamp=convert.time_msg(snapshot.stamp_ns), frame_id=snapshot.frame_id)
    return GetStateAt.Response(
        ok=True,
        state=TwinState(header=header, tags=tags),
        times=TwinTimes(header=header, tags=times),
    )


# --- a series -------------------------------------------------------------------------------


def series_request(request: Any) -> SeriesRequest:
    """GetHistory.Request as a value.

    Raises:
        PastRefused: it cannot be answered.

    """
    max_points = int(request.max_points) or DEFAULT_POINTS
    if max_points > MAX_POINTS:
        raise PastRefused(f"max_points is {max_points}, the limits are 1 and {MAX_POINTS}")
    return SeriesRequest(
        tag_id=request.tag_id,
        sensor_type=request.sensor_type,
        start_ns=convert.nanoseconds(request.start),
        end_ns=convert.nanoseconds(request.end),
        max_points=max_points,
    )


def series_response(past: SeriesPast) -> Any:
    """A series as GetHistory.Response."""
    return GetHistory.Response(
        ok=True,
        is_bucketed=past.is_bucketed,
        stamps=[convert.time_msg(stamp_ns) for stamp_ns in past.stamps_ns],
        counts=array("I", (min(count, UINT32_MAX) for count in past.counts)),
        means=array("d", past.means),
        minima=array("d", past.minima),
        maxima=array("d", past.maxima),
    )

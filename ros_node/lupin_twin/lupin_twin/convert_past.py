"""Questions about the past and their answers, as messages and as values.

What is built here may be large: a state of 20,000 tags is half a million objects. So it is built on
a worker, and nothing of it is kept.
"""

from __future__ import annotations

import operator
from array import array
from itertools import pairwise
from typing import Any, Final, NamedTuple

from lupin_msgs.msg import TwinState, TwinTimes
from lupin_msgs.srv import GetHistory, GetStateAt, GetWrites
from std_msgs.msg import Header

from lupin_twin import convert
from lupin_twin.bounds import MAX_ITEMS, MAX_SENSORS_PER_TAG, MAX_TAGS
from lupin_twin.past import (
    DEFAULT_POINTS,
    MAX_POINTS,
    Event,
    SeriesPast,
    SeriesRequest,
    error_of,
    message_of,
)
from lupin_twin.past_writes import DEFAULT_WRITES, PastWrite, PastWrites, RunSpan, WritesRequest
from lupin_twin.state import Snapshot, TwinStore
from lupin_twin.workers import in_turns


def writes_request(request: Any) -> WritesRequest:
    """GetWrites.Request as a value.

    Raises:
        PastRefused: see `WritesRequest`.

    """
    return WritesRequest(
        after=int(request.after),
        reach_s=float(request.reach_s),
        reach_count=int(request.reach_count),
        max_count=int(request.max_count) or DEFAULT_WRITES,
    )


def writes_request_message(request: WritesRequest) -> Any:
    """The other direction of `writes_request`."""
    return GetWrites.Request(
        after=request.after,
        reach_s=request.reach_s,
        reach_count=request.reach_count,
        max_count=request.max_count,
    )


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


def writes_of(response: Any, asked: WritesRequest) -> PastWrites:
    """The writes in a GetWrites.Response: the other direction of `writes_response`.

    Raises:
        PastRefused, NotRemembered: it is not `ok`.
        NotAnAnswerError: arrays that do not fit, or more than was asked for.

    """
    if not response.ok:
        raise error_of(response.error_message)
    try:
        found, last = tuple(_writes(response)), int(response.last)
        spans = zip(response.span_runs, response.span_starts_ns, response.span_ends_ns, strict=True)
        axis = tuple(RunSpan(int(run), int(start), int(end)) for run, start, end in spans)
    except (IndexError, ValueError) as error:
        raise NotAnAnswerError(f"arrays that do not fit: {error}") from error
    if len(found) > asked.max_count:
        raise NotAnAnswerError(f"{len(found)} writes, asked for were {asked.max_count}")
    numbers = [asked.after, *(write.number for write in found), last + 1]
    if not all(one < other for one, other in pairwise(numbers)):
        raise NotAnAnswerError("its numbers do not ascend")
    if not (response.is_all or found):
        raise NotAnAnswerError("nothing, and that is not all")
    return PastWrites(response.journal, axis, found, last, bool(response.is_all))


def _writes(response: Any) -> Any:
    texts = [str(text) for text in response.texts]
    columns = zip(
        response.numbers,
        response.runs,
        response.tags,
        response.stamps_ns,
        response.kinds,
        response.statuses,
        response.reading_counts,
        response.has_seen,
        response.species,
        response.anomalies,
        response.bug_counts,
        strict=True,
    )
    names, values = response.sensors, response.values
    if len(names) != len(values) or sum(response.reading_counts) != len(values):
        raise ValueError(f"{len(values)} values of {len(names)} sensors")
    at = 0
    for number, run, tag, stamp_ns, kind, status, count, seen, species, pest, bugs in columns:
        if count > MAX_SENSORS_PER_TAG:
            raise ValueError(f"{count} readings in a scan, the limit is {MAX_SENSORS_PER_TAG}")
        yield PastWrite(
            int(number),
            int(run),
            texts[tag],
            int(stamp_ns),
            int(kind),
            int(status),
            tuple(texts[name] for name in names[at : at + count]),
            tuple(map(float, values[at : at + count])),
            bool(seen),
            texts[species],
            bool(pest),
            int(bugs),
        )
        at += count


UINT32_MAX: Final = 4_294_967_295
# What building an answer takes, and reading one, roughly and at worst, for each tag, and for each
# reading, flower and point of it.
TAG_S: Final = 60e-6
ITEM_S: Final = 20e-6


class NotAnAnswerError(ValueError):
    """What a service gave is not what it promises; says what is wrong with it."""


# --- the state as of a moment ---------------------------------------------------------------


def moment_message(at_ns: int) -> Any:
    """A moment as GetStateAt.Request."""
    return GetStateAt.Request(at=convert.time_msg(at_ns))


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


def snapshot_of(response: Any, at_ns: int) -> Snapshot:
    """The snapshot in a GetStateAt.Response: the other direction of `state_response`.

    For a worker's thread too.

    Raises:
        PastRefused, NotRemembered: it is not `ok`.
        NotAnAnswerError: another moment, times of another, or more than a twin holds.

    """
    _check_ok(response)
    state, times = response.state, response.times
    for header in (state.header, times.header):
        stamp_ns = convert.nanoseconds(header.stamp)
        if stamp_ns != at_ns:
            raise NotAnAnswerError(f"a state as of {stamp_ns} ns, asked for was {at_ns} ns")
    _check_length("tags", len(state.tags), MAX_TAGS)
    if [tag.tag_id for tag in state.tags] != [tag.tag_id for tag in times.tags]:
        raise NotAnAnswerError("its times are not those of its tags")
    items = sum(
        len(tag.readings) + len(tag.flowers) + len(tag.box_footprint.points) for tag in state.tags
    )
    _check_length("readings, flowers and footprint points", items, MAX_ITEMS)
    pairs = zip(state.tags, times.tags, strict=True)
    return Snapshot(
        at_ns, state.header.frame_id, tuple(convert.tag_state(*pair) for pair in in_turns(pairs))
    )


def building_s(store: TwinStore) -> float:
    """About how long the message of a state as large as that of now takes, s of one core."""
    tags, items = store.size
    return tags * TAG_S + items * ITEM_S


# --- a series -------------------------------------------------------------------------------


def series_request(request: Any) -> SeriesRequest:
    """GetHistory.Request as a value.

    Raises:
        PastRefused: see `SeriesRequest`.

    """
    return SeriesRequest(
        tag_id=request.tag_id,
        sensor_type=request.sensor_type,
        start_ns=convert.nanoseconds(request.start),
        end_ns=convert.nanoseconds(request.end),
        max_points=int(request.max_points) or DEFAULT_POINTS,
    )


def series_request_message(request: SeriesRequest) -> Any:
    """A question for a series as GetHistory.Request: the other direction of `series_request`."""
    return GetHistory.Request(
        tag_id=request.tag_id,
        sensor_type=request.sensor_type,
        start=convert.time_msg(request.start_ns),
        end=convert.time_msg(request.end_ns),
        max_points=request.max_points,
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


class Entries(NamedTuple):
    """What a GetHistory.Response holds: the period that buckets divide is not in it."""

    is_bucketed: bool
    stamps_ns: tuple[int, ...]
    counts: tuple[int, ...]
    means: tuple[float, ...]
    minima: tuple[float, ...]
    maxima: tuple[float, ...]


def entries_of(response: Any, asked: SeriesRequest) -> Entries:
    """The readings or buckets in a GetHistory.Response to `asked`.

    Raises:
        PastRefused, NotRemembered: it is not `ok`.
        NotAnAnswerError: arrays of several lengths, more entries than asked for, stamps that do not
            ascend or are of another time, counts or ranges that cannot be.

    """
    _check_ok(response)
    entries = Entries(
        bool(response.is_bucketed),
        tuple(map(convert.nanoseconds, response.stamps)),
        tuple(response.counts),
        tuple(response.means),
        tuple(response.minima),
        tuple(response.maxima),
    )
    lengths = set(map(len, entries[1:]))
    if len(lengths) > 1:
        raise NotAnAnswerError(f"arrays of {sorted(lengths)} entries")
    # The runs of the clock are told all.
    is_run = asked.event is Event.RUNS
    _check_length("entries", len(entries.stamps_ns), MAX_POINTS if is_run else asked.max_points)
    ascends = operator.lt if entries.is_bucketed else operator.le
    if not all(ascends(one, other) for one, other in pairwise(entries.stamps_ns)):
        raise NotAnAnswerError("its stamps do not ascend")
    if entries.is_bucketed:
        _check_buckets(entries)
    else:
        _check_readings(entries, asked)
    return entries


def _check_buckets(entries: Entries) -> None:
    if not all(entries.counts) or not all(map(operator.le, entries.minima, entries.maxima)):
        raise NotAnAnswerError("a bucket of nothing, or of no range")


def _check_readings(entries: Entries, asked: SeriesRequest) -> None:
    if any(count != 1 for count in entries.counts):
        raise NotAnAnswerError("a reading that counts more than one")
    if not entries.stamps_ns:
        return
    is_early = entries.stamps_ns[0] < asked.start_ns
    if is_early or (asked.end_ns and entries.stamps_ns[-1] >= asked.end_ns):
        raise NotAnAnswerError("a reading that is not of the period")


# --- no answer ------------------------------------------------------------------------------


def refused(response: Any, error: Exception) -> Any:
    """A fresh response, empty but for why: of the type that `response` has."""
    return type(response)(error_message=message_of(error))


def _check_ok(response: Any) -> None:
    if not response.ok:
        raise error_of(response.error_message)


def _check_length(what: str, length: int, limit: int) -> None:
    if length > limit:
        raise NotAnAnswerError(f"{length} {what}, the limit is {limit}")

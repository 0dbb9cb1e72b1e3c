"""GetWrites: questions and answers, as messages and as values."""

from __future__ import annotations

from array import array
from itertools import pairwise
from typing import Any

from lupin_msgs.srv import GetWrites

from lupin_twin.bounds import MAX_SENSORS_PER_TAG
from lupin_twin.convert_past import NotAnAnswerError
from lupin_twin.past import error_of
from lupin_twin.past_writes import DEFAULT_WRITES, PastWrite, PastWrites, RunSpan, WritesRequest


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

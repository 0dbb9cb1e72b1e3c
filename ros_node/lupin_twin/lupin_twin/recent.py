"""The past without a journal: a series, as far as the history in memory reaches. Pure.

That is the last scans and tries of each tag. What a look saw and which run of the clock it was are
not kept there, nor is a stretch in which nothing was tried told from one that is forgotten.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from lupin_twin.history import KIND_TAG_READING, TagHistory
from lupin_twin.past import (
    EVERY_TAG,
    Event,
    NotRemembered,
    SeriesPast,
    SeriesRequest,
    grid,
)
from lupin_twin.state import STATUS_OK

NO_JOURNAL: Final = "the twin keeps no journal (parameter journal)"
_KNOWN: Final = (Event.SCANS, Event.FAILURES)

_Entry = tuple[int, float]


def check_known(request: SeriesRequest) -> None:
    """Refuse an event that memory does not hold.

    Raises:
        NotRemembered: see above.

    """
    if request.event is not None and request.event not in _KNOWN:
        raise NotRemembered(
            f"{request.event} are not kept in memory, and {NO_JOURNAL}", is_lasting=True
        )


def series(request: SeriesRequest, histories: Mapping[str, TagHistory], now_ns: int) -> SeriesPast:
    """What is asked for, of the `histories` of all tags that may be meant, by their ids.

    A period without a start begins with the first entry, that of events with the first try.

    Raises:
        NotRemembered: see `check_known`.

    """
    check_known(request)
    is_every = request.event is not None and request.tag_id == EVERY_TAG
    mine = [tag for tag_id, tag in histories.items() if is_every or tag_id == request.tag_id]
    # A reading of this very moment counts as one of the past.
    end_ns = max(request.end_ns or now_ns + 1, request.start_ns)
    found = [entry for tag in mine for entry in _entries(request, tag)]
    found.sort(key=lambda entry: entry[0])  # of one stamp, in the order of arrival
    stamps = [stamp_ns for stamp_ns, _ in found]
    if request.event is not None:
        stamps = [past.stamp_ns for tag in mine for past in tag.tries]
    start_ns = request.start_ns or min([*stamps, end_ns])
    within = [entry for entry in found if start_ns <= entry[0] < end_ns]
    if len(within) > request.max_points:
        return _bucketed(found, request.max_points, start_ns, end_ns)
    values = tuple(value for _, value in within)
    return SeriesPast(
        start_ns,
        end_ns,
        None,
        tuple(stamp_ns for stamp_ns, _ in within),
        (1,) * len(within),
        values,
        values,
        values,
    )


def _entries(request: SeriesRequest, tag: TagHistory) -> Iterator[_Entry]:
    match request.event:
        case None:
            for scan in tag.scans:
                for reading in scan.readings:
                    if reading.name == request.sensor_type:
                        yield scan.stamp_ns, reading.value
        case Event.FAILURES:
            for past in tag.tries:
                if past.what.status != STATUS_OK:
                    yield past.stamp_ns, float(past.what.status)
        case _:
            counts = {scan.stamp_ns: len(scan.readings) for scan in tag.scans}
            for past in tag.tries:
                if past.kind == KIND_TAG_READING and past.what.status == STATUS_OK:
                    yield past.stamp_ns, float(counts.get(past.stamp_ns, 0))


def _bucketed(found: Sequence[_Entry], max_points: int, start_ns: int, end_ns: int) -> SeriesPast:
    told = grid(start_ns, end_ns, max_points)
    buckets: dict[int, list[float]] = {}
    for stamp_ns, value in found:
        is_within = told.start_ns <= stamp_ns < told.end_ns
        if is_within and value - value == 0.0:  # finite
            buckets.setdefault((stamp_ns - told.start_ns) // told.bucket_ns, []).append(value)
    return SeriesPast(
        told.start_ns,
        told.end_ns,
        told.bucket_ns,
        tuple(told.start_ns + number * told.bucket_ns for number in buckets),
        tuple(map(len, buckets.values())),
        tuple(sum(values) / len(values) for values in buckets.values()),
        tuple(map(min, buckets.values())),
        tuple(map(max, buckets.values())),
    )

"""What happened over a period, at one tag or in the whole house: each event, or counts of them.

The values are those of GetHistory.srv. Everything goes by spans: what a run has said of moments
that another one holds is not told.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable, Sequence
from typing import Final

from lupin_twin.journal.happenings import Happenings, OfHouse, OfTag
from lupin_twin.journal.silences import cut, first_from, silences
from lupin_twin.journal.spans import Span, spans
from lupin_twin.journal.tallies import Count, merge
from lupin_twin.past import EVERY_TAG, MAX_POINTS, Event, Grid, SeriesPast, SeriesRequest, grid

_SECOND_NS: Final = 1e9


def events(connection: sqlite3.Connection, request: SeriesRequest, now_ns: int) -> SeriesPast:
    """The events that are asked for, see GetHistory.srv.

    Raises:
        NotRemembered: a damaged file is being read: the house cannot be told of before that ends.

    """
    is_house = request.tag_id == EVERY_TAG
    happened: Happenings = OfHouse(connection) if is_house else OfTag(connection, request.tag_id)
    axis = spans(connection)
    # What is of this very moment counts as past.
    end_ns = max(request.end_ns or now_ns + 1, request.start_ns)
    start_ns = request.start_ns
    if not start_ns:
        oldest_ns = first_from(happened, axis, 0)
        start_ns = end_ns if oldest_ns is None else min(oldest_ns, end_ns)
    match request.event:
        case Event.RUNS:
            return _runs(list(cut(axis, start_ns, end_ns)), start_ns, end_ns)
        case Event.SILENCES:
            found = list(silences(happened, axis, start_ns, end_ns, now_ns))
            if len(found) > request.max_points:
                return _bucketed(found, grid(start_ns, end_ns, request.max_points))
            return _individually(found, start_ns, end_ns)
    assert request.event is not None
    return _happened(happened, request.event, axis, (start_ns, end_ns), request.max_points)


def _happened(
    happened: Happenings,
    event: Event,
    axis: Sequence[Span],
    period: tuple[int, int],
    max_points: int,
) -> SeriesPast:
    within = list(cut(axis, *period))
    if not any(happened.is_given_up(event, span) for span in within):
        entries: list[tuple[int, int, int]] = []
        for span in within:
            entries += happened.entries(event, span, max_points + 1 - len(entries))
            if len(entries) > max_points:
                break
        else:
            entries.sort()
            return _individually([(at, float(value)) for at, _, value in entries], *period)
    told = grid(*period, max_points)
    told = grid(*period, max_points, happened.least_bucket_ns(within, told))
    found: dict[int, Count] = {}
    for span in cut(axis, told.start_ns, told.end_ns):
        for index, count in happened.counts(event, span, told).items():
            merge(found, index, count)
    counted = sorted(found.items())
    return SeriesPast(
        told.start_ns,
        told.end_ns,
        told.bucket_ns,
        tuple(told.start_ns + index * told.bucket_ns for index, _ in counted),
        tuple(count.n for _, count in counted),
        tuple(count.total / count.n for _, count in counted),
        tuple(float(count.low) for _, count in counted),
        tuple(float(count.high) for _, count in counted),
    )


def _individually(found: Sequence[tuple[int, float]], start_ns: int, end_ns: int) -> SeriesPast:
    values = tuple(value for _, value in found)
    stamps = tuple(stamp_ns for stamp_ns, _ in found)
    return SeriesPast(start_ns, end_ns, None, stamps, (1,) * len(found), values, values, values)


def _bucketed(found: Iterable[tuple[int, float]], told: Grid) -> SeriesPast:
    values: dict[int, list[float]] = {}
    for stamp_ns, value in found:
        values.setdefault((stamp_ns - told.start_ns) // told.bucket_ns, []).append(value)
    return SeriesPast(
        told.start_ns,
        told.end_ns,
        told.bucket_ns,
        tuple(told.start_ns + index * told.bucket_ns for index in values),
        tuple(len(of) for of in values.values()),
        tuple(sum(of) / len(of) for of in values.values()),
        tuple(min(of) for of in values.values()),
        tuple(max(of) for of in values.values()),
    )


def _runs(found: Sequence[Span], start_ns: int, end_ns: int) -> SeriesPast:
    found = found[-MAX_POINTS:]
    simulated = tuple(float(span.run.begun.is_simulated) for span in found)
    return SeriesPast(
        start_ns,
        end_ns,
        None,
        tuple(span.start_ns for span in found),
        (1,) * len(found),
        tuple((span.end_ns - span.start_ns) / _SECOND_NS for span in found),
        simulated,
        simulated,
    )

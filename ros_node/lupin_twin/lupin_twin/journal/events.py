# ruff: noqa: S608  # SQL is put together of constants
"""What happened over a period, at one tag or at the whole site: each event, or counts of them.

The values are those of GetHistory.srv. Everything goes by spans: what a run has said of moments
that another one holds is left out. At a tag all is read off its rows. Of the site scans, failures
and looks come by the hour where they are many, or deleted; what is rare is kept one by one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from statistics import median
from typing import Any, Final, Protocol

from lupin_twin.journal.hours import (
    SILENCE_NS,
    TALLIED,
    Buckets,
    deleted_ns,
    extent,
    silence_over,
    whole_hours,
)
from lupin_twin.journal.reading import sensor_names
from lupin_twin.journal.runs import FOREVER_NS, Run, Span, runs, spans
from lupin_twin.journal.site_log import SiteLog
from lupin_twin.past import (
    EVERY_TAG,
    HOUR_NS,
    MAX_POINTS,
    Event,
    SeriesPast,
    SeriesRequest,
    grid,
)

# A silence is longer than so many median intervals between the attempts of the period.
INTERVALS: Final = 3
# Rows of the site that are counted within less than an hour: a tenth of a second.
MAX_ROWS: Final = 50_000

# The first and the last attempt of a stretch in which no gap matters.
Extent = tuple[int, int]

_FROM_SCAN: Final = (
    "FROM series CROSS JOIN scan WHERE series.site = :site AND run = :run{tag}"
    " AND scan.site = :site AND scan.series = series.series"
    " AND stamp_ns >= :start AND stamp_ns < :end AND is_copy = 0"
)
_FROM_LOOK: Final = (
    "FROM look WHERE site = :site AND run = :run{tag}"
    " AND stamp_ns >= :start AND stamp_ns < :end AND is_copy = 0"
)
_FROM_EVENT: Final = (
    "FROM event WHERE site = :site AND run = :run AND event = :event{tag}"
    " AND stamp_ns >= :start AND stamp_ns < :end"
)
# What has the value of an event, and where the rows are.
_ROWS: Final = {
    Event.SCANS: ("sensors", f"{_FROM_SCAN} AND kind = 0 AND status = 0"),
    Event.FAILURES: ("status", f"{_FROM_SCAN} AND status != 0"),
    Event.LOOKS: ("bug_count", _FROM_LOOK),
    Event.PESTS_SEEN: ("value", _FROM_EVENT),
    Event.PESTS_CLEARED: ("value", _FROM_EVENT),
}
_STAMPS: Final = f"SELECT stamp_ns {_FROM_SCAN} UNION ALL SELECT stamp_ns {_FROM_LOOK}"
# A few steps in the index for each series.
_IN_SERIES: Final = (
    "(SELECT {0}(stamp_ns) FROM scan WHERE site = s.site AND series = s.series"
    " AND stamp_ns >= :start AND stamp_ns < :end AND is_copy = 0)"
)
_ENDS: Final = (
    f"SELECT min({_IN_SERIES.format('min')}), max({_IN_SERIES.format('max')})"
    " FROM series AS s WHERE site = :site AND run = :run{tag}"
    f" UNION ALL SELECT min(stamp_ns), max(stamp_ns) {_FROM_LOOK}"
)
_FROM_TALLY: Final = (
    "FROM tally WHERE site = :site AND run = :run AND hour >= :first AND hour < :last"
)
_SILENCES: Final = (
    "SELECT stamp_ns, stamp_ns + value FROM event WHERE site = :site AND run = :run"
    " AND event = :event AND value > :longest AND stamp_ns < :end AND stamp_ns + value > :start"
    " AND stamp_ns >= :least AND stamp_ns + value <= :most ORDER BY stamp_ns"
)


def events(log: SiteLog, request: SeriesRequest, now_ns: int) -> SeriesPast:
    """The events that are asked for, see GetHistory.srv."""
    is_site = request.tag_id == EVERY_TAG
    source: _Source = _OfSite(log) if is_site else _OfTag(log, request.tag_id)
    axis = spans(runs(log.execute, log.site))
    # What is of this very moment counts as past.
    end_ns = max(request.end_ns or now_ns + 1, request.start_ns)
    start_ns = request.start_ns
    if not start_ns:
        oldest_ns = _first(source, axis)
        start_ns = end_ns if oldest_ns is None else min(oldest_ns, end_ns)
    period = start_ns, end_ns
    match request.event:
        case Event.RUNS:
            return _runs(cut(axis, *period), *period)
        case Event.SILENCES:
            found = list(_silences(source, axis, period, now_ns))
            if len(found) <= request.max_points:
                return _individually(found, *period)
            buckets = Buckets(grid(*period, request.max_points))
            for at_ns, length_s in found:
                buckets.add_value(at_ns, length_s)
            return buckets.past()
    assert request.event is not None
    return _happened(source, request.event, axis, period, request.max_points)


def cut(axis: Iterable[Span], start_ns: int, end_ns: int) -> list[Span]:
    """The spans of a period, cut to it."""
    return [
        Span(span.run, max(span.start_ns, start_ns), min(span.end_ns, end_ns))
        for span in axis
        if max(span.start_ns, start_ns) < min(span.end_ns, end_ns)
    ]


def _happened(
    source: _Source, event: Event, axis: Sequence[Span], period: Extent, max_points: int
) -> SeriesPast:
    within = cut(axis, *period)
    if not any(source.is_deleted(event, span) for span in within):
        entries: list[tuple[int, int, int]] = []
        for span in within:
            entries += source.rows.entries(event, span, max_points + 1 - len(entries))
            if len(entries) > max_points:
                break
        else:
            entries.sort()
            return _individually([(at_ns, float(value)) for at_ns, _, value in entries], *period)
    told = grid(*period, max_points)
    if told.bucket_ns < HOUR_NS and source.is_hourly(event, within):
        told = grid(*period, max_points, HOUR_NS)
    buckets = Buckets(told)
    for span in cut(axis, told.start_ns, told.end_ns):
        source.count(buckets, event, span)
    return buckets.past()


def _individually(found: Sequence[tuple[int, float]], start_ns: int, end_ns: int) -> SeriesPast:
    values = tuple(value for _, value in found)
    stamps = tuple(stamp_ns for stamp_ns, _ in found)
    return SeriesPast(start_ns, end_ns, None, stamps, (1,) * len(found), values, values, values)


def _runs(found: Sequence[Span], start_ns: int, end_ns: int) -> SeriesPast:
    found = found[-MAX_POINTS:]
    simulated = tuple(float(span.run.begun.is_simulated) for span in found)
    return SeriesPast(
        start_ns,
        end_ns,
        None,
        tuple(span.start_ns for span in found),
        (1,) * len(found),
        tuple((span.end_ns - span.start_ns) / 1e9 for span in found),
        simulated,
        simulated,
    )


# --- silences -------------------------------------------------------------------------------------


def _silences(
    source: _Source, axis: Sequence[Span], period: Extent, now_ns: int
) -> Iterator[tuple[int, float]]:
    """(start, seconds) of each, cut to the period; the last one lasts until now.

    Before the first attempt that is known there is no silence.
    """
    start_ns, end_ns = period
    within = cut(axis, start_ns, end_ns)
    longest_ns = max(SILENCE_NS, int(INTERVALS * _usual_ns(source, within, end_ns - start_ns)))
    earlier = [span for span in axis if span.end_ns <= start_ns]
    held = [span for span in axis if span.end_ns > start_ns and span.start_ns < end_ns]
    later = [span for span in axis if span.start_ns >= end_ns]
    found = [extent for span in held for extent in source.stretches(span, longest_ns, period)]
    before_ns = _last(source, earlier)
    if before_ns is not None:
        found.insert(0, (before_ns, before_ns))
    if not found:
        return
    after_ns = _first(source, later)
    last_ns = max(now_ns, *(last for _, last in found)) if after_ns is None else after_ns
    found.append((last_ns, last_ns))
    for (_, silent_ns), (until_ns, _) in pairwise(found):
        if until_ns - silent_ns > longest_ns:
            begun_ns, ended_ns = max(silent_ns, start_ns), min(until_ns, end_ns)
            if begun_ns < ended_ns:
                yield begun_ns, (ended_ns - begun_ns) / 1e9


def _usual_ns(source: _Source, within: Sequence[Span], period_ns: int) -> float:
    """The median interval; 0 where it is too short to matter."""
    # Half of the intervals would have to be longer than that, and there is no room for so many.
    most = 1 + 2 * INTERVALS * period_ns / SILENCE_NS
    if sum(source.attempts(span) for span in within) > most:
        return 0.0
    stamps = sorted(stamp_ns for span in within for stamp_ns in source.stamps(span))
    return median(b - a for a, b in pairwise(stamps)) if len(stamps) > 1 else 0.0


def _first(source: _Source, axis: Iterable[Span]) -> int | None:
    found = (ends for span in axis if (ends := source.ends(span)) is not None)
    return next((first for first, _ in found), None)


def _last(source: _Source, axis: Sequence[Span]) -> int | None:
    found = (ends for span in reversed(axis) if (ends := source.ends(span)) is not None)
    return next((last for _, last in found), None)


# --- where it stands ------------------------------------------------------------------------------


class _Source(Protocol):
    """What is asked of one tag, or of the site, about a span."""

    rows: _Rows

    def is_deleted(self, event: Event, span: Span) -> bool:
        """Whether only their counts are left."""

    def is_hourly(self, event: Event, within: Iterable[Span]) -> bool:
        """Whether less than an hour cannot be told apart."""

    def count(self, buckets: Buckets, event: Event, span: Span) -> None:
        """Add the events of a span."""

    def attempts(self, span: Span) -> int:
        """How many there were, at least."""

    def stamps(self, span: Span) -> Iterable[int]:
        """Of each attempt."""

    def stretches(self, span: Span, longest_ns: int, period: Extent) -> Iterable[Extent]:
        """The attempts of a period and the next ones on both sides, in order.

        Such as follow each other within `longest_ns` may be in one.
        """

    def ends(self, span: Span) -> Extent | None:
        """The first and the last attempt; None if there was none."""


class _Rows:
    """Of one tag, or all: as far back as rows are kept, what is rare for ten years."""

    def __init__(self, log: SiteLog, tag: str | None) -> None:
        self._log = log
        self._tag = tag

    def entries(self, event: Event, span: Span, limit: int) -> list[tuple[int, int, int]]:
        """(stamp, seq, value) of some of the events, at most `limit`."""
        value, rows = _ROWS[event]
        found = self._ask(f"SELECT stamp_ns, seq, {value} {rows} LIMIT {limit}", span, event)
        return [(stamp_ns, seq, _number(of)) for stamp_ns, seq, of in found]

    def count(self, buckets: Buckets, event: Event, span: Span) -> None:
        """Add the events of a span."""
        value, rows = _ROWS[event]
        told = buckets.told
        for index, of, n in self._ask(
            f"SELECT (stamp_ns - {told.start_ns}) / {told.bucket_ns}, {value}, count(*) {rows}"
            " GROUP BY 1, 2",
            span,
            event,
        ):
            number = _number(of)
            buckets.add(index, n, n * number, number, number)

    def stamps(self, span: Span) -> list[int]:
        """Of each attempt."""
        return [stamp_ns for (stamp_ns,) in self._ask(_STAMPS, span)]

    def ends(self, span: Span) -> Extent | None:
        """The first and the last attempt; None if there was none."""
        found = [row for row in self._ask(_ENDS, span) if row[0] is not None]
        return (min(found)[0], max(last for _, last in found)) if found else None

    def _ask(self, sql: str, span: Span, event: Event | None = None) -> list[tuple[Any, ...]]:
        asked = {"run": span.run.id, "start": span.start_ns, "end": span.end_ns}
        sql = sql.replace("{tag}", "" if self._tag is None else " AND tag = :tag")
        found = self._log.execute(sql, asked | {"tag": self._tag, "event": event})
        return list(found.fetchall())


def _number(value: int | str) -> int:
    """Of a scan the number of its sensors."""
    return len(sensor_names(value)) if isinstance(value, str) else value


class _OfTag:
    """One tag's."""

    def __init__(self, log: SiteLog, tag: str) -> None:
        self.rows = _Rows(log, tag)
        self.count = self.rows.count
        self.stamps = self.rows.stamps
        self.ends = self.rows.ends

    def is_deleted(self, event: Event, span: Span) -> bool:  # noqa: ARG002
        """See `_Source`."""
        return False

    def is_hourly(self, event: Event, within: Iterable[Span]) -> bool:  # noqa: ARG002
        """See `_Source`."""
        return False

    def attempts(self, span: Span) -> int:  # noqa: ARG002
        """See `_Source`."""
        return 0

    def stretches(self, span: Span, longest_ns: int, period: Extent) -> Iterable[Extent]:  # noqa: ARG002
        """See `_Source`."""
        found = [stamp_ns for part in cut([span], *period) for stamp_ns in self.stamps(part)]
        for part in cut([span], 0, period[0]):
            found += (self.ends(part) or ())[1:]
        for part in cut([span], period[1], FOREVER_NS):
            found += (self.ends(part) or ())[:1]
        return [(stamp_ns, stamp_ns) for stamp_ns in sorted(found)]


class _OfSite:
    """All tags'."""

    def __init__(self, log: SiteLog) -> None:
        self._log = log
        self.rows = _Rows(log, None)

    def is_deleted(self, event: Event, span: Span) -> bool:
        """See `_Source`."""
        return event in TALLIED and span.start_ns <= deleted_ns(self._log, span.run.id)

    def is_hourly(self, event: Event, within: Iterable[Span]) -> bool:
        """See `_Source`."""
        if event not in TALLIED:
            return False
        count = 0
        for span in within:
            hours = span.start_ns // HOUR_NS, -(-span.end_ns // HOUR_NS)
            count += self._tallied(span, hours, [event])
            if self.is_deleted(event, span) or count > MAX_ROWS:
                return True
        return False

    def count(self, buckets: Buckets, event: Event, span: Span) -> None:
        """See `_Source`."""
        told = buckets.told
        if event not in TALLIED or not buckets.are_hours():
            self.rows.count(buckets, event, span)
            return
        hours, rest = whole_hours(span, deleted_ns(self._log, span.run.id))
        for index, *numbers in self._ask(
            f"SELECT (hour - {told.start_ns // HOUR_NS}) / {told.bucket_ns // HOUR_NS}, sum(n),"
            f" sum(total), min(low), max(high) {_FROM_TALLY} AND event = :event GROUP BY 1",
            span,
            hours,
            event,
        ):
            buckets.add(index, *map(int, numbers))
        for part in rest:
            self.rows.count(buckets, event, part)

    def attempts(self, span: Span) -> int:
        """See `_Source`."""
        hours = -(-span.start_ns // HOUR_NS), span.end_ns // HOUR_NS
        return self._tallied(span, hours, TALLIED)

    def stamps(self, span: Span) -> Iterator[int]:
        """See `_Source`; what was deleted is spread over its hour."""
        kept_ns = (deleted_ns(self._log, span.run.id) // HOUR_NS + 1) * HOUR_NS
        for part in cut([span], kept_ns, FOREVER_NS):
            yield from self.rows.stamps(part)
        for part in cut([span], 0, kept_ns):
            hours = part.start_ns // HOUR_NS, -(-part.end_ns // HOUR_NS)
            sql = f"SELECT n, first_ns, last_ns {_FROM_TALLY}"
            for n, first_ns, last_ns in self._ask(sql, part, hours):
                for number in range(n):
                    stamp_ns = first_ns + (last_ns - first_ns) * number // max(1, n - 1)
                    if part.start_ns <= stamp_ns < part.end_ns:
                        yield stamp_ns

    def stretches(self, span: Span, longest_ns: int, period: Extent) -> Iterable[Extent]:
        """See `_Source`."""
        ends = self.ends(span)
        if ends is None:
            return
        first_ns = ends[0]
        asked = {"run": span.run.id, "event": Event.SILENCES, "longest": longest_ns}
        asked |= {"start": period[0], "end": period[1], "least": ends[0], "most": ends[1]}
        for silent_ns, until_ns in self._log.execute(_SILENCES, asked).fetchall():
            yield first_ns, silent_ns
            first_ns = until_ns
        yield first_ns, ends[1]

    def ends(self, span: Span) -> Extent | None:
        """See `_Source`."""
        every = extent(self._log, span.run.id)
        if every is None or every[1] < span.start_ns or every[0] >= span.end_ns:
            return None
        first_ns, last_ns = every
        if span.start_ns > first_ns:
            first_ns = self._attempt_from(span.run, span.start_ns)
        if span.end_ns <= last_ns:
            last_ns = self._attempt_until(span.run, span.end_ns - 1)
        return (first_ns, last_ns) if first_ns <= last_ns else None

    def _attempt_from(self, run: Run, at_ns: int) -> int:
        """The first attempt from a moment on, of which there are earlier and later ones."""
        over = silence_over(self._log, run.id, at_ns)
        if over is not None:
            return over[1]
        near = self.rows.ends(Span(run, at_ns, at_ns + SILENCE_NS + 1))
        return at_ns if near is None else near[0]  # it is deleted

    def _attempt_until(self, run: Run, at_ns: int) -> int:
        """The last attempt up to a moment, of which there are earlier and later ones."""
        over = silence_over(self._log, run.id, at_ns + 1)
        if over is not None:
            return over[0]
        near = self.rows.ends(Span(run, at_ns - SILENCE_NS, at_ns + 1))
        return at_ns if near is None else near[1]

    def _tallied(self, span: Span, hours: Extent, which: Sequence[Event]) -> int:
        sql = f"SELECT coalesce(sum(n), 0) {_FROM_TALLY} AND event = :event"
        return sum(int(self._ask(sql, span, hours, event)[0][0]) for event in which)

    def _ask(
        self, sql: str, span: Span, hours: Extent, event: Event | None = None
    ) -> list[tuple[Any, ...]]:
        asked = {"run": span.run.id, "first": hours[0], "last": hours[1], "event": event}
        return list(self._log.execute(sql, asked).fetchall())

"""Queries over a period: one sensor of one tag, or events of one tag or of the whole site.

The answer has each reading or event, or buckets of them, as in GetHistory.srv. Queries go by spans:
rows of a run are left out at times that belong to another run. For a tag, all is read from its
rows. For the site, scans, failures and inspections come from the hourly counts if they are many or
deleted; rare events are stored one by one.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import Any, Final

from lupin_twin.core.past import (
    EVERY_TAG,
    FOREVER_NS,
    MAX_POINTS,
    RECENT_COUNT,
    SILENCE_NS,
    Event,
    RunSpan,
    SeriesPast,
    SeriesRequest,
    grid,
    silence_ns,
)
from lupin_twin.journal import sql
from lupin_twin.journal.counts import (
    TALLIED,
    Buckets,
    Entry,
    Part,
    Table,
    answer,
    bounds,
    extent,
    individually,
    is_counted,
    silence_over,
)
from lupin_twin.journal.rows import named_numbers, sensor_names
from lupin_twin.journal.runs import cut, runs, spans
from lupin_twin.journal.schema import SiteLog

# Approximate cost of an answer, s; and of events of the whole site, s for each tag.
SERIES_S: Final = 0.01
SERIES_S_PER_TAG: Final = 1e-5
# Approximate cost of the latest readings of a sensor, s for each tag.
NEWEST_S_PER_TAG: Final = 3e-4


def series(connection: Any, request: SeriesRequest, now_ns: int) -> SeriesPast:
    """Return the readings of a sensor, or the requested events, see GetHistory.srv.

    If rows were deleted, the answer is in buckets of whole hours.
    """
    log = SiteLog(connection)
    if request.event is not None:
        return _events(log, request, now_ns)
    # A reading with the stamp of now counts as past.
    end_ns = max(request.end_ns or now_ns + 1, request.start_ns)
    start_ns = request.start_ns
    if not start_ns:
        oldest = (at_ns for part in _parts(log, request, 0, end_ns) for at_ns in part.oldest())
        start_ns = min(oldest, default=end_ns)
    return answer(partial(_parts, log, request), start_ns, end_ns, request.max_points)


def newest(
    connection: Any, sensor_type: str, start_ns: int, end_ns: int, each: int
) -> dict[str, list[tuple[int, float]]]:
    """Return each tag's last `each` readings of a sensor in a period: (ns of ROS time, value).

    They are in order of time, without those that are not finite.
    """
    log = SiteLog(connection)
    found: dict[str, list[Entry]] = {}
    for span in cut(spans(runs(log.execute)), start_ns, end_ns):
        within = {"run": span.run, "start": span.start_ns, "end": span.end_ns}
        for (text,) in log.execute(sql.SENSORS, within).fetchall():
            names = sensor_names(text)
            if sensor_type not in names:
                continue
            query = within | {"sensors": text, "more": each - 1}
            rows = log.execute(sql.RECENT_READINGS, query).fetchall()
            place = names.index(sensor_type)
            every = named_numbers([text] * len(rows), [row[-1] for row in rows])
            for (tag, stamp_ns, seq, _), (_, values) in zip(rows, every, strict=True):
                if is_counted(values[place]):
                    found.setdefault(tag, []).append((stamp_ns, seq, values[place]))
    return {
        tag: [(stamp_ns, value) for stamp_ns, _, value in sorted(entries)[-each:]]
        for tag, entries in found.items()
    }


def _parts(log: SiteLog, request: SeriesRequest, start_ns: int, end_ns: int) -> list[Part]:
    found = []
    for span in cut(spans(runs(log.execute)), start_ns, end_ns):
        of_run = {"run": span.run, "tag": request.tag_id}
        for number, text in log.execute(sql.SERIES, of_run).fetchall():
            names = sensor_names(text)
            if request.sensor_type in names:
                place = names.index(request.sensor_type)
                read = partial(_at, text, place)
                table = Table(sql.READINGS, "readings", read, sql.HOURS)
                found.append(Part(log, span, table, {"series": number, "place": place}))
    return found


def _at(sensors: str, place: int, texts: list[str]) -> list[float]:
    return [values[place] for _, values in named_numbers([sensors] * len(texts), texts)]


# --- what happened -------------------------------------------------------------------------------

# The first and the last attempt of a period without a silence.
Extent = tuple[int, int]

# By event: the column of its value, and the rows that it is read from.
_ROWS: Final = {
    Event.SCANS: ("sensors", f"{sql.SCANS} AND kind = 0 AND status = 0"),
    Event.FAILURES: ("status", f"{sql.SCANS} AND status != 0"),
    Event.INSPECTIONS: ("bug_count", sql.INSPECTIONS),
    Event.PESTS_SEEN: ("value", sql.EVENTS),
    Event.PESTS_CLEARED: ("value", sql.EVENTS),
}


def _events(log: SiteLog, request: SeriesRequest, now_ns: int) -> SeriesPast:
    """Return the requested events, see GetHistory.srv."""
    source = _Source(log, None if request.tag_id == EVERY_TAG else request.tag_id)
    axis = spans(runs(log.execute))
    # An event with the stamp of now counts as past.
    end_ns = max(request.end_ns or now_ns + 1, request.start_ns)
    start_ns = request.start_ns
    if not start_ns:
        oldest_ns = _outermost(source, axis, 0)
        start_ns = end_ns if oldest_ns is None else min(oldest_ns, end_ns)
    period = start_ns, end_ns
    match request.event:
        case Event.RUNS:
            return _runs(cut(axis, *period), *period)
        case Event.SILENCES:
            found = list(_silences(source, axis, period, now_ns))
            if len(found) <= request.max_points:
                return individually(found, *period)
            buckets = Buckets(grid(*period, request.max_points))
            for at_ns, length_s in found:
                buckets.add_value(at_ns, length_s)
            return buckets.past()
    assert request.event is not None
    parts_of = partial(source.parts, request.event, axis)
    return answer(parts_of, start_ns, end_ns, request.max_points)


def _runs(found: Sequence[RunSpan], start_ns: int, end_ns: int) -> SeriesPast:
    found = found[-MAX_POINTS:]
    simulated = tuple(float(span.is_simulated) for span in found)
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
    source: _Source, axis: Sequence[RunSpan], period: Extent, now_ns: int
) -> Iterator[tuple[int, float]]:
    """Yield (start, seconds) of each silence, cut to the period; the last may last until now.

    Before the first known attempt, there is no silence.
    """
    start_ns, end_ns = period
    longest_ns = silence_ns(source.scans(axis, end_ns))
    earlier = [span for span in axis if span.end_ns <= start_ns]
    held = [span for span in axis if span.end_ns > start_ns and span.start_ns < end_ns]
    later = [span for span in axis if span.start_ns >= end_ns]
    found = [extent for span in held for extent in source.stretches(span, longest_ns, period)]
    before_ns = _outermost(source, reversed(earlier), 1)
    if before_ns is not None:
        found.insert(0, (before_ns, before_ns))
    if not found:
        return
    after_ns = _outermost(source, later, 0)
    last_ns = max(now_ns, *(last for _, last in found)) if after_ns is None else after_ns
    found.append((last_ns, last_ns))
    for (_, silent_ns), (until_ns, _) in pairwise(found):
        if until_ns - silent_ns > longest_ns:
            begun_ns, ended_ns = max(silent_ns, start_ns), min(until_ns, end_ns)
            if begun_ns < ended_ns:
                yield begun_ns, (ended_ns - begun_ns) / 1e9


def _outermost(source: _Source, axis: Iterable[RunSpan], which: int) -> int | None:
    """The first (0) or last (1) attempt of the first span with any."""
    found = (ends[which] for span in axis if (ends := source.ends(span)) is not None)
    return next(found, None)


# --- the attempts and events of a tag or the site -------------------------------------------------


class _Source:
    """The attempts and events of a tag, or of the site (`tag` None), span by span.

    Rows exist as far back as they are retained, rare events forever; for the site, also the hourly
    counts of all attempts.
    """

    def __init__(self, log: SiteLog, tag: str | None) -> None:
        self._log = log
        self.tag = tag

    def parts(
        self, event: Event, axis: Iterable[RunSpan], start_ns: int, end_ns: int
    ) -> list[Part]:
        """The events of a period, by spans."""
        value, rows = _ROWS[event]
        is_tallied = self.tag is None and event in TALLIED
        hours = f"{sql.TALLIES} AND event = :event" if is_tallied else ""
        table = Table(sql.of_tag(rows, self.tag), value, _numbers, hours)
        of = {"tag": self.tag, "event": event}
        return [
            Part(self._log, span, table, of | {"run": span.run})
            for span in cut(axis, start_ns, end_ns)
        ]

    def scans(self, axis: Sequence[RunSpan], end_ns: int) -> list[list[int]]:
        """Each tag's last attempts to scan it before a moment, oldest first."""
        found = defaultdict[str, list[int]](list)
        for span in cut(axis, 0, end_ns)[-1:]:
            for tag, stamp_ns in self.ask(sql.RECENT_STAMPS, span, more=RECENT_COUNT - 1):
                found[tag].append(stamp_ns)
        return [sorted(stamps)[-RECENT_COUNT:] for stamps in found.values()]

    def stretches(self, span: RunSpan, longest_ns: int, period: Extent) -> Iterable[Extent]:
        """The attempts of a period and the next ones on both sides, as extents in order.

        Attempts that follow each other within `longest_ns` may be in one extent.
        """
        if self.tag is not None:
            found = [row[0] for part in cut([span], *period) for row in self.ask(sql.STAMPS, part)]
            for part in cut([span], 0, period[0]):
                found += (self.ends(part) or ())[1:]
            for part in cut([span], period[1], FOREVER_NS):
                found += (self.ends(part) or ())[:1]
            return [(stamp_ns, stamp_ns) for stamp_ns in sorted(found)]
        ends = self.ends(span)
        if ends is None:
            return []
        query = {"run": span.run, "event": Event.SILENCES, "longest": longest_ns}
        query |= {"start": period[0], "end": period[1], "least": ends[0], "most": ends[1]}
        silences = self._log.execute(sql.SILENCES, query).fetchall()
        edges = [ends[0], *(at_ns for silence in silences for at_ns in silence), ends[1]]
        return list(zip(edges[::2], edges[1::2], strict=True))

    def ends(self, span: RunSpan) -> Extent | None:
        """The first and the last attempt; None if there was none."""
        if self.tag is not None:
            found = [row for row in self.ask(sql.ENDS, span) if row[0] is not None]
            return (min(found)[0], max(last for _, last in found)) if found else None
        every = extent(self._log, span.run)
        if every is None or every[1] < span.start_ns or every[0] >= span.end_ns:
            return None
        first_ns, last_ns = every
        if span.start_ns > first_ns:
            first_ns = self._near(span.run, span.start_ns, 1)
        if span.end_ns <= last_ns:
            last_ns = self._near(span.run, span.end_ns - 1, 0)
        return (first_ns, last_ns) if first_ns <= last_ns else None

    def _near(self, run: int, at_ns: int, which: int) -> int:
        """The last attempt up to a moment (0) or the first from then on (1).

        There have to be attempts on both sides.
        """
        over = silence_over(self._log, run, at_ns if which else at_ns + 1)
        if over is not None:
            return over[which]
        start_ns = at_ns if which else at_ns - SILENCE_NS
        rows = self.ask(sql.ENDS, RunSpan(run, start_ns, start_ns + SILENCE_NS + 1))
        found: list[int] = [row[1 - which] for row in rows if row[0] is not None]
        if not found:  # its rows are deleted
            return at_ns
        return min(found) if which else max(found)

    def ask(self, select: str, span: RunSpan, **more: int) -> list[tuple[Any, ...]]:
        query = bounds(span) | {"run": span.run, "tag": self.tag} | more
        return list(self._log.execute(sql.of_tag(select, self.tag), query).fetchall())


def _numbers(values: list[int | str]) -> list[float]:
    """Convert the values of rows to numbers; that of a scan is the number of its sensors."""
    return [
        float(len(sensor_names(value)) if isinstance(value, str) else value) for value in values
    ]

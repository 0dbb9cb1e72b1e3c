# ruff: noqa: S608  # SQL is put together of constants and numbers
"""What happened within a span: at a tag, off its own rows; in the whole house, off its tallies."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from typing import Final, Protocol

from lupin_twin.journal.retention import purged_ns
from lupin_twin.journal.spans import Span
from lupin_twin.journal.tallies import Count, Extent, Tallies, merge
from lupin_twin.past import SLOT_NS, Event, Grid

# Tries that are read for counts within less than five minutes: some tens of milliseconds. Of more,
# the five minutes are told.
MAX_TRIES: Final = 20_000

# Each gives (stamp, number of the write, value) of :start <= stamp < :end in the run :run; {tag} is
# filled in.
_WITHIN: Final = "run = :run{tag} AND stamp_ns >= :start AND stamp_ns < :end"
_SCAN: Final = "series CROSS JOIN scan ON scan.series = series.id"
_LOOK: Final = "series CROSS JOIN look ON look.series = series.id"
_SQL: Final = {
    Event.SCANS: (
        "SELECT stamp_ns, scan.id, json_array_length(names) AS value FROM series"
        " CROSS JOIN sensors ON sensors.id = sensors CROSS JOIN scan ON scan.series = series.id"
        f" WHERE {_WITHIN} AND kind = 0 AND status = 0"
    ),
    Event.FAILURES: (
        f"SELECT stamp_ns, scan.id, status AS value FROM {_SCAN} WHERE {_WITHIN} AND status != 0"
    ),
    Event.LOOKS: f"SELECT stamp_ns, look.id, bug_count AS value FROM {_LOOK} WHERE {_WITHIN}",
    Event.PESTS_SEEN: (
        f"SELECT stamp_ns, id, bug_count AS value FROM change WHERE {_WITHIN} AND anomaly = 1"
    ),
    Event.PESTS_CLEARED: (
        f"SELECT stamp_ns, id, bug_count AS value FROM change WHERE {_WITHIN} AND anomaly = 0"
    ),
}
# (series, value) of events whose value is that of their series.
_OF_SERIES: Final = {
    Event.SCANS: "SELECT series.id, json_array_length(names) FROM series JOIN sensors"
    " ON sensors.id = sensors WHERE run = :run{tag} AND kind = 0 AND status = 0",
    Event.FAILURES: "SELECT id, status FROM series WHERE run = :run{tag} AND status != 0",
}
_TALLIED: Final = {Event.SCANS: "scan", Event.FAILURES: "failure", Event.LOOKS: "look"}
_STAMPS: Final = (
    f"SELECT stamp_ns FROM {_SCAN} WHERE {_WITHIN}"
    f" UNION ALL SELECT stamp_ns FROM {_LOOK} WHERE {_WITHIN}"
)
# One step in the index for each series.
_ENDS: Final = (
    "SELECT min(least), max(most) FROM ("
    + " UNION ALL ".join(
        f"SELECT (SELECT min(stamp_ns) FROM {table} WHERE series = s.id AND stamp_ns >= :start"
        " AND stamp_ns < :end) AS least,"
        f" (SELECT max(stamp_ns) FROM {table} WHERE series = s.id AND stamp_ns >= :start"
        " AND stamp_ns < :end) AS most FROM series AS s WHERE run = :run{tag}"
        for table in ("scan", "look")
    )
    + ")"
)


class Happenings(Protocol):
    """What is asked of one tag, or of the house, about a span."""

    def is_given_up(self, event: Event, span: Span) -> bool:
        """Whether only their counts are left."""

    def entries(self, event: Event, span: Span, limit: int) -> list[tuple[int, int, int]]:
        """(stamp, number of the write, value) of some of the events, at most `limit`."""

    def counts(self, event: Event, span: Span, told: Grid) -> dict[int, Count]:
        """The events by bucket."""

    def least_bucket_ns(self, spans: Iterable[Span], told: Grid) -> int:
        """How short buckets may be at least."""

    def tries(self, span: Span) -> int:
        """How many tries there were."""

    def stamps(self, span: Span) -> Iterable[int]:
        """Of each try."""

    def extents(self, span: Span, longest_ns: int) -> Iterable[Extent]:
        """All tries, those that follow each other within that in one."""

    def ends(self, span: Span) -> Extent | None:
        """The first and the last try; None if there was none."""


class OfTag:
    """One tag's; as far back as its scans are kept, changes for ten years."""

    def __init__(self, connection: sqlite3.Connection, tag_id: str) -> None:
        self._connection = connection
        found = connection.execute("SELECT id FROM tag WHERE tag_id = ?", (tag_id,)).fetchone()
        self._tag = found[0] if found else -1

    def is_given_up(self, event: Event, span: Span) -> bool:  # noqa: ARG002
        """See `Happenings`."""
        return False

    def entries(self, event: Event, span: Span, limit: int) -> list[tuple[int, int, int]]:
        """See `Happenings`."""
        return self._ask(f"{_SQL[event]} LIMIT {limit}", span).fetchall()

    def counts(self, event: Event, span: Span, told: Grid) -> dict[int, Count]:
        """See `Happenings`."""
        found: dict[int, Count] = {}
        if event not in _OF_SERIES:
            return _grouped(self._ask(_by_bucket(_SQL[event], told), span))
        first = (span.start_ns - told.start_ns) // told.bucket_ns
        # A span may go on for ever, what is asked for does not.
        last = (min(span.end_ns, told.end_ns) - 1 - told.start_ns) // told.bucket_ns
        for series, value in self._ask(_OF_SERIES[event], span).fetchall():
            for index in range(max(0, first), last + 1):
                start_ns = told.start_ns + index * told.bucket_ns
                (n,) = self._connection.execute(
                    "SELECT count(*) FROM scan WHERE series = ? AND stamp_ns >= ? AND stamp_ns < ?",
                    (
                        series,
                        max(start_ns, span.start_ns),
                        min(start_ns + told.bucket_ns, span.end_ns),
                    ),
                ).fetchone()
                if n:
                    merge(found, index, Count(n, n * value, value, value))
        return found

    def least_bucket_ns(self, spans: Iterable[Span], told: Grid) -> int:  # noqa: ARG002
        """See `Happenings`."""
        return 0

    def tries(self, span: Span) -> int:
        """See `Happenings`."""
        return int(self._ask(f"SELECT count(*) FROM ({_STAMPS})", span).fetchone()[0])

    def stamps(self, span: Span) -> Iterable[int]:
        """See `Happenings`."""
        return (stamp_ns for (stamp_ns,) in self._ask(_STAMPS, span))

    def extents(self, span: Span, longest_ns: int) -> Iterable[Extent]:
        """See `Happenings`."""
        stamps = sorted(self.stamps(span))
        if not stamps:
            return
        first_ns = last_ns = stamps[0]
        for stamp_ns in stamps:
            if stamp_ns - last_ns > longest_ns:
                yield first_ns, last_ns
                first_ns = stamp_ns
            last_ns = stamp_ns
        yield first_ns, last_ns

    def ends(self, span: Span) -> Extent | None:
        """See `Happenings`."""
        first_ns, last_ns = self._ask(_ENDS, span).fetchone()
        return None if first_ns is None else (first_ns, last_ns)

    def _ask(self, sql: str, span: Span) -> sqlite3.Cursor:
        return _ask(self._connection, sql, span, self._tag)


class OfHouse:
    """All tags'; where it is much, and for ten years, off the tallies."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection
        self._tallies = Tallies(connection)

    def is_given_up(self, event: Event, span: Span) -> bool:
        """See `Happenings`."""
        return event in _TALLIED and self._is_purged(span)

    def entries(self, event: Event, span: Span, limit: int) -> list[tuple[int, int, int]]:
        """See `Happenings`."""
        return self._ask(f"{_SQL[event]} LIMIT {limit}", span).fetchall()

    def counts(self, event: Event, span: Span, told: Grid) -> dict[int, Count]:
        """See `Happenings`."""
        kind = _TALLIED.get(event)
        if kind is None or told.bucket_ns % SLOT_NS or told.start_ns % SLOT_NS:
            return _grouped(self._ask(_by_bucket(_SQL[event], told), span))
        return self._tallies.counts(kind, span, told)

    def least_bucket_ns(self, spans: Iterable[Span], told: Grid) -> int:
        """See `Happenings`."""
        if told.bucket_ns >= SLOT_NS:
            return 0
        spans = list(spans)
        is_given_up = any(self._is_purged(span) for span in spans)
        is_much = sum(self._tallies.tries(span) for span in spans) > MAX_TRIES
        return SLOT_NS if is_given_up or is_much else 0

    def tries(self, span: Span) -> int:
        """See `Happenings`."""
        return self._tallies.tries(span)

    def stamps(self, span: Span) -> Iterable[int]:
        """See `Happenings`."""
        if self._is_purged(span):
            return self._tallies.spread(span)
        return (stamp_ns for (stamp_ns,) in self._ask(_STAMPS, span))

    def extents(self, span: Span, longest_ns: int) -> Iterable[Extent]:
        """See `Happenings`."""
        return self._tallies.extents(span, longest_ns)

    def ends(self, span: Span) -> Extent | None:
        """See `Happenings`."""
        return self._tallies.ends(span)

    def _is_purged(self, span: Span) -> bool:
        return span.start_ns <= purged_ns(self._connection, span.run)

    def _ask(self, sql: str, span: Span) -> sqlite3.Cursor:
        return _ask(self._connection, sql, span, None)


def _ask(connection: sqlite3.Connection, sql: str, span: Span, tag: int | None) -> sqlite3.Cursor:
    of_tag = "" if tag is None else " AND tag = :tag"
    return connection.execute(
        sql.replace("{tag}", of_tag),
        {"run": span.run.id, "tag": tag, "start": span.start_ns, "end": span.end_ns},
    )


def _by_bucket(sql: str, told: Grid) -> str:
    return (
        f"SELECT (stamp_ns - {told.start_ns}) / {told.bucket_ns} AS bucket, count(*), sum(value),"
        f" min(value), max(value) FROM ({sql}) GROUP BY bucket"
    )


def _grouped(rows: sqlite3.Cursor) -> dict[int, Count]:
    found: dict[int, Count] = {}
    for index, *numbers in rows:
        merge(found, index, Count(*numbers))
    return found

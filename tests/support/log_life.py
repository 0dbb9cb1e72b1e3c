"""A log with any history, and its simplest model: every row, in a list."""

import math
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Any

from hypothesis import strategies as st

from lupin_twin.core.history import KNOWN_BY_NOTHING
from lupin_twin.core.past import EVERY_TAG, Event, PastRow, SeriesPast, SeriesRequest
from lupin_twin.core.state import STATUS_OK, Flower, Observation, Pin, Write
from lupin_twin.journal.appending import Appender
from lupin_twin.journal.retention import Limits, purge_step
from lupin_twin.journal.runs import runs, spans
from lupin_twin.journal.schema import open_writer, transaction
from tests.support.journal import NOW, SECOND, inspection, pin, scan

MINUTE = 60 * SECOND
HOUR = 60 * MINUTE
BEGUN = NOW // HOUR * HOUR
LATEST = 400  # minutes
TAGS = ("7", "8", "ü 9")
SILENCE_NS = 600 * SECOND
Entry = tuple[int, int, float]  # stamp, number, value


def failure(tag: str = "7", at_ns: int = BEGUN, status: int = 2, kind: int = 0) -> Observation:
    return Observation(tag, at_ns, {}, None, status, "no", "robot", 0, "", at_ns + 1000, kind)


def _seen(row: Write) -> Flower | None:
    return None if isinstance(row, Pin) else row.flower


def _is_scan(row: Write) -> bool:
    return isinstance(row, Observation) and not row.kind


def longest(tags: Iterable[list[int]]) -> float:
    """How long a time without an attempt may be, by the scans of each tag."""
    usual = [median(b - a for a, b in pairwise(it[-9:])) for it in tags if len(it) > 1]
    return max(SILENCE_NS, 3 * median(usual) if usual else 0)


@dataclass
class Life:
    """Writes rows into a log and records each new one, with its run."""

    connection: sqlite3.Connection
    rows: list[tuple[int, Write]] = field(default_factory=list)
    run: int = 0
    _known: dict[object, set[str]] = field(default_factory=dict)
    _copied: dict[object, Write] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._appender = Appender(self.connection)

    def write(self, rows: Iterable[Write]) -> None:
        """Rows that arrive together."""
        rows = list(rows)
        with transaction(self.connection):
            self._appender.append(self.run, rows)
            self._appender.flush()
        for row in rows:
            if (new := self._new(row)) is not None:
                self.rows.append((self.run, new))

    def _new(self, row: Write) -> Write | None:
        """The new part of it: of a known write, other sensors."""
        if isinstance(row, Pin):
            return row
        key = (self.run, row.tag_id, row.kind, row.stamp_ns, row.source)
        known = self._known.get(key)
        sensors = self._known.setdefault(key, set())
        row = replace(row, readings={it: v for it, v in row.readings.items() if it not in sensors})
        sensors.update(row.readings)
        return row if known is None or row.readings else None

    def begin(self, at_ns: int, ended_ns: int | None = None) -> None:
        """A clock that is new, or has gone back; the latest of what was known is copied."""
        before, self.run = self.run, self.run + 1
        for run, row in self.rows:
            if run == before:
                self._copied[getattr(row, "kind", None), row.tag_id] = row
        for key, row in self._copied.items():
            self._copied[key] = replace(row, stamp_ns=min(row.stamp_ns, at_ns))
        with transaction(self.connection):
            self.connection.execute(
                "UPDATE run SET ended_stamp_ns = ? WHERE run = ?", (ended_ns, before)
            )
            self.connection.execute(
                "INSERT INTO run VALUES ('local', ?, 1, ?, ?, ?, NULL, NULL)",
                (self.run, at_ns, at_ns, self._appender.last_seq + 1),
            )
            self._appender.append(
                self.run,
                [
                    row if isinstance(row, Pin) else replace(row, own_stamp_ns=KNOWN_BY_NOTHING)
                    for row in self._copied.values()
                ],
                are_copies=True,
            )
            self._appender.flush()

    def delete(self, before_ns: int) -> None:
        """Let retention delete what arrived before."""
        with transaction(self.connection):
            while purge_step(self.connection, Limits(0.0, 10**12), before_ns):
                pass

    def holds(self) -> list[tuple[int, Write]]:
        axis = spans(runs(self.connection.execute))
        return [
            (number, row)
            for number, (run, row) in enumerate(self.rows)
            if any(s.start_ns <= row.stamp_ns < s.end_ns and s.run == run for s in axis)
        ]

    def _of(self, tag_id: str) -> list[tuple[int, Write]]:
        return [(n, row) for n, row in self.holds() if tag_id in (EVERY_TAG, row.tag_id)]

    def readings(self, tag_id: str, sensor: str) -> list[Entry]:
        return sorted(
            (row.stamp_ns, number, row.readings[sensor])
            for number, row in self._of(tag_id)
            if isinstance(row, Observation) and sensor in row.readings
        )

    def events(self, tag_id: str, event: Event) -> list[Entry]:
        if event in (Event.PESTS_SEEN, Event.PESTS_CLEARED):
            return self._changes(tag_id, is_seen=event is Event.PESTS_SEEN)
        found = []
        for number, row in self._of(tag_id):
            value: float | None = None
            if isinstance(row, Pin):
                continue
            if (flower := _seen(row)) is not None:
                value = flower.bug_count if event is Event.INSPECTIONS else None
            elif row.status != STATUS_OK and event is Event.FAILURES:
                value = row.status
            elif not row.kind and row.status == STATUS_OK and event is Event.SCANS:
                value = len(row.readings)
            if value is not None:
                found.append((row.stamp_ns, number, float(value)))
        return sorted(found)

    def _changes(self, tag_id: str, *, is_seen: bool) -> list[Entry]:
        held = {number for number, _ in self.holds()}
        found = []
        had: dict[tuple[int, str], bool] = {}
        looks = [(row.stamp_ns, n, run, row) for n, (run, row) in enumerate(self.rows)]
        for stamp_ns, number, run, row in sorted(looks, key=lambda inspection: inspection[:2]):
            flower = _seen(row)
            if flower is None or tag_id not in (EVERY_TAG, row.tag_id):
                continue
            has = flower.anomaly
            if has != had.get((run, row.tag_id), False) and has == is_seen and number in held:
                found.append((stamp_ns, number, float(flower.bug_count)))
            had[run, row.tag_id] = has
        return found

    def attempts(self, tag_id: str) -> list[int]:
        found = self._of(tag_id)
        return sorted(row.stamp_ns for _, row in found if not isinstance(row, Pin))

    def silences(
        self, tag_id: str, start_ns: int, end_ns: int, now_ns: int
    ) -> list[tuple[int, float]]:
        attempts = self.attempts(tag_id)
        scans: dict[str, set[int]] = {}
        last_run = None
        for span in spans(runs(self.connection.execute)):
            last_run = span.run if span.start_ns < end_ns else last_run
        for number, row in self._of(tag_id):
            if _is_scan(row) and row.stamp_ns < end_ns and self.rows[number][0] == last_run:
                scans.setdefault(row.tag_id, set()).add(row.stamp_ns)
        longest_ns = longest(sorted(stamps) for stamps in scans.values())
        if attempts:
            attempts.append(max(now_ns, attempts[-1]))
        return [
            (max(a, start_ns), (min(b, end_ns) - max(a, start_ns)) / 1e9)
            for a, b in pairwise(attempts)
            if b - a > longest_ns and max(a, start_ns) < min(b, end_ns)
        ]

    def export(self, start_ns: int, end_ns: int, tag_id: str | None) -> list[PastRow]:
        # Each run carries the state of the one before it; it knows nothing of later ones.
        places: dict[tuple[int, str], tuple[float, float]] = {}
        for since, row in self.rows:
            if isinstance(row, Pin):
                for run in range(since, self.run + 1):
                    places.setdefault((run, row.tag_id), (row.pose.x, row.pose.y))
        held = {number for number, _ in self.holds()}
        scans = sorted(
            (row.stamp_ns, number, run, row)
            for number, (run, row) in enumerate(self.rows)
            if not isinstance(row, Pin)
            and _seen(row) is None
            and start_ns <= row.stamp_ns < end_ns
            and tag_id in (None, row.tag_id)
        )
        found = []
        for stamp_ns, number, run, row in scans:
            x, y = places.get((run, row.tag_id), (math.nan, math.nan))
            if number in held:
                found += [
                    PastRow(stamp_ns, row.tag_id, x, y, name, value, row.status, row.source)
                    for name, value in row.readings.items() or [("", math.nan)]
                ]
        return found


def check(answer: SeriesPast, request: SeriesRequest, entries: list[Entry], *, now_ns: int) -> None:
    """An answer contains all expected entries: each, or each bucket's count and values."""
    end_ns = request.end_ns or now_ns + 1
    requested = [entry for entry in entries if request.start_ns <= entry[0] < end_ns]
    if not answer.is_bucketed:
        assert len(requested) <= request.max_points
        assert list(answer.stamps_ns) == [stamp_ns for stamp_ns, *_ in requested]
        # A value that is no number is null in the log.
        values = [value if math.isfinite(value) else math.nan for *_, value in requested]
        assert repr(answer.means) == repr(tuple(values))
        assert repr(answer.minima) == repr(answer.maxima) == repr(answer.means)
        assert answer.counts == (1,) * len(requested)
        return
    bucket_ns = answer.bucket_ns or 0
    if entries:
        assert answer.start_ns <= max(request.start_ns, entries[0][0])
    assert answer.end_ns >= end_ns
    assert bucket_ns * request.max_points >= answer.end_ns - answer.start_ns
    buckets: dict[int, list[float]] = {}
    for stamp_ns, _, value in entries:
        if answer.start_ns <= stamp_ns < answer.end_ns and math.isfinite(value):
            index = (stamp_ns - answer.start_ns) // bucket_ns
            buckets.setdefault(answer.start_ns + index * bucket_ns, []).append(value)
    assert list(answer.stamps_ns) == sorted(buckets)
    for start_ns, n, mean, low, high in zip(
        answer.stamps_ns, answer.counts, answer.means, answer.minima, answer.maxima, strict=True
    ):
        values = buckets[start_ns]
        assert n == len(values)
        size = max(map(abs, values))
        assert math.isclose(mean, sum(values) / n, rel_tol=1e-9, abs_tol=1e-12 * size)
        assert (low, high) == (min(values), max(values))
        assert low <= mean <= high


# For hypothesis: rows in any order, some late, some again; clocks go back.

_stamps = st.builds(
    lambda minute, ns: BEGUN + minute * MINUTE + ns, st.integers(0, LATEST), st.integers(0, 3)
)
_values = st.one_of(
    st.floats(-1e6, 1e6), st.sampled_from([float("nan"), float("inf"), 21.5, 1e-7, 21.53])
)
_tags = st.sampled_from(TAGS)
_rows: st.SearchStrategy[Write] = st.one_of(
    st.builds(
        lambda tag, at_ns, source, values: scan(tag, at_ns, source=source, **values),
        _tags,
        _stamps,
        st.sampled_from(["robot", "other"]),
        st.dictionaries(st.sampled_from(["temperature", "co2"]), _values, min_size=1),
    ),
    st.builds(failure, _tags, _stamps, st.integers(1, 3), st.integers(0, 1)),
    st.builds(
        lambda tag, at, anomaly: inspection(tag, at, anomaly=anomaly), _tags, _stamps, st.booleans()
    ),
    st.builds(pin, _tags, _stamps),
)
steps = st.lists(
    st.one_of(
        st.tuples(st.just("rows"), st.lists(_rows, min_size=1, max_size=12)),
        st.tuples(st.just("again"), st.integers(0, 9)),
        st.tuples(st.just("back"), st.integers(0, LATEST)),
    ),
    min_size=1,
    max_size=8,
)
one_run = steps.map(lambda taken: [step for step in taken if step[0] != "back"])
periods = st.one_of(
    st.tuples(_stamps, _stamps).map(sorted),
    st.tuples(st.just(0), _stamps),
    st.tuples(_stamps, st.just(0)),
    st.just((0, 0)),
)


@contextmanager
def lived(path: Path, taken: Iterable[tuple[str, Any]] = ()) -> Iterator[Life]:
    """A log that has gone through the steps."""
    connection = open_writer(path)
    connection.execute("PRAGMA synchronous = OFF")
    try:
        life = Life(connection)
        life.begin(BEGUN)
        for what, arg in taken:
            match what:
                case "rows":
                    life.write(arg)
                case "again":
                    life.write([row for run, row in life.rows if run == life.run][-arg:])
                case "back":
                    life.begin(BEGUN + arg * MINUTE, BEGUN + (arg + 60) * MINUTE)
        yield life
    finally:
        connection.close()

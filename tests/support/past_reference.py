"""The past by the plainest means: every row that was handed over, in a list."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from statistics import median

from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.rows import STATUS_OK, LookRow, Row, ScanRow
from lupin_twin.journal.runs import Clock, Run
from lupin_twin.journal.spans import Span, spans
from lupin_twin.past import EVERY_TAG, Event, PastRow, SeriesPast, SeriesRequest

SILENCE_NS = 600 * 1_000_000_000
Entry = tuple[int, int, float]  # stamp, number, value


@dataclass
class Reference:
    """Writes rows into a file and remembers each that is new, with its run."""

    file: JournalFile
    run: Run
    rows: list[tuple[int, Row]] = field(default_factory=list)
    _known: set[object] = field(default_factory=set)
    _axis: tuple[Run | None, tuple[Span, ...]] = (None, ())

    def write(self, rows: Iterable[Row]) -> None:
        for row in rows:
            self.file.append([(self.run, row)])
            what = (
                (row.kind, row.status, tuple(reading.name for reading in row.readings))
                if isinstance(row, ScanRow)
                else type(row)
            )
            source = getattr(row, "source", None)
            key = (self.run.id, row.tag_id, what, source, row.stamp_ns)
            if key not in self._known:
                self._known.add(key)
                self.rows.append((self.run.id, row))

    def go_back(self, to_ns: int, from_ns: int) -> None:
        """The clock has gone back."""
        clock = Clock(to_ns, to_ns, is_simulated=True)
        self.run = self.file.next_run(self.run, clock, from_ns)

    def holds(self, run: int, stamp_ns: int) -> bool:
        if self._axis[0] != self.run:
            self._axis = (self.run, spans(self.file._connection))
        return any(
            span.start_ns <= stamp_ns < span.end_ns and span.run.id == run for span in self._axis[1]
        )

    def _rows(self, tag_id: str) -> list[tuple[int, int, Row]]:
        return [
            (run, number, row)
            for number, (run, row) in enumerate(self.rows)
            if tag_id in (EVERY_TAG, row.tag_id)
        ]

    # --- what there was -----------------------------------------------------------------------

    def readings(self, tag_id: str, sensor: str) -> list[Entry]:
        return sorted(
            (row.stamp_ns, number, reading.value)
            for run, number, row in self._rows(tag_id)
            if isinstance(row, ScanRow) and self.holds(run, row.stamp_ns)
            for reading in row.readings
            if reading.name == sensor
        )

    def events(self, tag_id: str, event: Event) -> list[Entry]:
        if event in (Event.PESTS_SEEN, Event.PESTS_CLEARED):
            return self._changes(tag_id, is_seen=event is Event.PESTS_SEEN)
        found = []
        for run, number, row in self._rows(tag_id):
            value: float | None = None
            if isinstance(row, LookRow) and event is Event.LOOKS:
                value = row.flower.bug_count
            elif isinstance(row, ScanRow) and row.status != STATUS_OK and event is Event.FAILURES:
                value = row.status
            elif isinstance(row, ScanRow) and row.status == STATUS_OK and event is Event.SCANS:
                value = len(row.readings)
            if value is not None and self.holds(run, row.stamp_ns):
                found.append((row.stamp_ns, number, float(value)))
        return sorted(found)

    def _changes(self, tag_id: str, *, is_seen: bool) -> list[Entry]:
        found = []
        had: dict[tuple[int, str], bool] = {}
        looks = [(row.stamp_ns, n, run, row) for run, n, row in self._rows(tag_id)]
        for stamp_ns, number, run, row in sorted(looks, key=lambda look: look[:2]):
            if not isinstance(row, LookRow):
                continue
            has = row.flower.anomaly
            is_change = has != had.get((run, row.tag_id), False)
            if is_change and has == is_seen and self.holds(run, stamp_ns):
                found.append((stamp_ns, number, float(row.flower.bug_count)))
            had[run, row.tag_id] = has
        return found

    def tries(self, tag_id: str) -> list[int]:
        return sorted(
            row.stamp_ns
            for run, _, row in self._rows(tag_id)
            if isinstance(row, ScanRow | LookRow) and self.holds(run, row.stamp_ns)
        )

    def silences(
        self, tag_id: str, start_ns: int, end_ns: int, now_ns: int
    ) -> list[tuple[int, float]]:
        tries = self.tries(tag_id)
        within = [stamp_ns for stamp_ns in tries if start_ns <= stamp_ns < end_ns]
        usual_ns = median(b - a for a, b in pairwise(within)) if len(within) > 1 else 0
        if tries:
            tries.append(max(now_ns, tries[-1]))
        return [
            (max(a, start_ns), (min(b, end_ns) - max(a, start_ns)) / 1e9)
            for a, b in pairwise(tries)
            if b - a > max(SILENCE_NS, 3 * usual_ns) and max(a, start_ns) < min(b, end_ns)
        ]

    def export(self, start_ns: int, end_ns: int, tag_id: str | None) -> list[PastRow]:
        # Each run carries what those before it have heard; it knows nothing of those behind it.
        places: dict[tuple[int, str], tuple[float, float]] = {}
        for since, row in self.rows:
            if not isinstance(row, LookRow | ScanRow):
                for run in range(since, self.run.id + 1):
                    places.setdefault((run, row.tag_id), (row.pose.x, row.pose.y))
        found = []
        scans = sorted(
            (row.stamp_ns, number, run, row)
            for run, number, row in self._rows(tag_id or EVERY_TAG)
            if isinstance(row, ScanRow) and start_ns <= row.stamp_ns < end_ns
        )
        for stamp_ns, _, run, row in scans:
            x, y = places.get((run, row.tag_id), (math.nan, math.nan))
            told = [(r.name, r.value) for r in row.readings] or [("", math.nan)]
            if self.holds(run, stamp_ns):
                found += [
                    PastRow(stamp_ns, row.tag_id, x, y, name, value, row.status, row.source)
                    for name, value in told
                ]
        return found


def check(answer: SeriesPast, request: SeriesRequest, entries: list[Entry], *, now_ns: int) -> None:
    """An answer holds all entries that there were: each, or each bucket's count and values."""
    end_ns = request.end_ns or now_ns + 1
    asked = [entry for entry in entries if request.start_ns <= entry[0] < end_ns]
    if not answer.is_bucketed:
        assert len(asked) <= request.max_points
        assert list(answer.stamps_ns) == [stamp_ns for stamp_ns, *_ in asked]
        assert repr(answer.means) == repr(tuple(value for *_, value in asked))
        assert answer.minima == answer.maxima == answer.means or any(map(math.isnan, answer.means))
        assert answer.counts == (1,) * len(asked)
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

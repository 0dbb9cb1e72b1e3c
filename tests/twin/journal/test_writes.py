from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

from lupin_twin.journal.rows import Row
from lupin_twin.journal.schema import open_reader
from lupin_twin.journal.writes import writes
from lupin_twin.past_writes import PastWrite, PastWrites, WritesRequest
from tests.support.journal import NOW, SECOND, kept, look, pin, scan

DAY = 86_400 * SECOND


def asked(path: Path, **query: float) -> PastWrites:
    connection = open_reader(path)
    try:
        return writes(connection, WritesRequest(**query))  # type: ignore[arg-type]
    finally:
        connection.close()


def test_all_is_told_in_the_order_of_hearing_and_only_once(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    failed = replace(scan("8", NOW + 3), readings=(), status=2)
    rows: list[Row] = [scan("7", NOW + 5), pin("7"), look("7", NOW + 4, anomaly=True), failed]
    rows += [scan("9", NOW + n, co2=400.0 + n, light=1.0) for n in range(7)]
    kept(path, rows)
    whole = asked(path)
    assert whole.is_all
    told = [
        (write.tag_id, write.stamp_ns - NOW, write.kind, write.status) for write in whole.writes
    ]
    assert told[:3] == [("7", 5, 0, 0), ("7", 4, 1, 0), ("8", 3, 0, 2)]
    seen = whole.writes[1]
    assert (seen.species, seen.anomaly, seen.bug_count, seen.has_seen) == ("lupin", True, 1, True)
    assert whole.writes[3].sensors == ("co2", "light")
    assert whole.writes[3].values == (400.0, 1.0)
    assert [(span.start_ns, span.end_ns) for span in whole.spans] == [(0, 2**63 - 1)]

    found: list[PastWrite] = []
    part = asked(path, max_count=3)
    while True:
        found += part.writes
        if part.is_all:
            break
        part = asked(path, after=part.last, max_count=3)
    assert tuple(found) == whole.writes
    assert asked(path, after=whole.last).writes == ()
    kept(path, [scan("7", NOW - 60 * SECOND)])
    late = asked(path, after=whole.last)
    assert [write.stamp_ns for write in late.writes] == [NOW - 60 * SECOND]
    assert late.journal == whole.journal


def test_from_the_beginning_only_so_far_back(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    now = time.time_ns()
    kept(path, [scan("7", now - n * DAY) for n in range(9, -1, -1)])
    assert len(asked(path, reach_s=2.5 * 86_400).writes) == 3
    assert len(asked(path, reach_count=4).writes) == 4
    assert len(asked(path, reach_s=2.5 * 86_400, reach_count=2).writes) == 2
    assert len(asked(path, reach_s=1e9).writes) == 10
    empty = tmp_path / "empty.sqlite"
    kept(empty, [])
    assert (asked(empty).writes, asked(empty).is_all) == ((), True)

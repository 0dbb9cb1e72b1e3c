from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from lupin_twin.journal.writes import writes
from lupin_twin.past_writes import PastWrite, PastWrites, WritesRequest
from tests.support.log_life import BEGUN, SECOND, Life, failure, lived, look, pin, scan
from tests.twin.journal.conftest import Copied

DAY = 86_400 * SECOND


def asked(connection: Any, site: str = "local", **query: Any) -> PastWrites:
    return writes(connection, WritesRequest(**query), site)


def test_all_is_told_in_the_order_of_receiving_and_only_once(
    tmp_path: Path, copied: Copied
) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        life.write([scan("7", BEGUN + 5), pin("7"), look("7", BEGUN + 4, anomaly=True)])
        life.write([failure("8", BEGUN + 3)])
        life.write(scan("9", BEGUN + n, co2=400.0 + n, light=1.0) for n in range(7))
        whole = asked(life.connection)
        assert whole.is_all
        assert len(whole.journal) == 32
        told = [(w.tag_id, w.stamp_ns - BEGUN, w.kind, w.status) for w in whole.writes]
        assert told[:3] == [("7", 5, 0, 0), ("7", 4, 1, 0), ("8", 3, 0, 2)]
        seen = whole.writes[1]
        assert (seen.species, seen.anomaly, seen.bug_count, seen.has_seen) == (
            ("lupin", True, 1, True)
        )
        assert whole.writes[3].sensors == ("co2", "light")
        assert whole.writes[3].values == (400.0, 1.0)
        assert [(span.start_ns, span.end_ns) for span in whole.spans] == [(0, 2**63 - 1)]
        assert asked(*copied(life.connection)) == whole

        found: list[PastWrite] = []
        part = asked(life.connection, max_count=3)
        while True:
            found += part.writes
            if part.is_all:
                break
            part = asked(life.connection, after=part.last, max_count=3)
        assert tuple(found) == whole.writes
        assert asked(life.connection, after=whole.last).writes == ()
        life.write([scan("7", BEGUN - 60 * SECOND)])
        late = asked(life.connection, after=whole.last)
        assert [write.stamp_ns for write in late.writes] == [BEGUN - 60 * SECOND]
        assert late.journal == whole.journal


def test_copies_of_what_was_known_are_no_writes(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        life.write([scan(), look()])
        life.begin(BEGUN - SECOND)
        life.write([scan("8", BEGUN)])
        assert [(w.run, w.tag_id) for w in asked(life.connection).writes] == (
            [(1, "7"), (1, "7"), (2, "8")]
        )


def test_from_the_beginning_only_so_far_back(tmp_path: Path) -> None:
    now = time.time_ns()

    def count(life: Life, **query: Any) -> int:
        return len(asked(life.connection, **query).writes)

    with lived(tmp_path / "j.sqlite") as life:
        life.write(scan("7", now - n * DAY) for n in range(9, -1, -1))
        assert count(life, reach_s=2.5 * 86_400) == 3
        assert count(life, reach_count=4) == 4
        assert count(life, reach_s=2.5 * 86_400, reach_count=2) == 2
        assert count(life, reach_s=1e9) == 10
    with lived(tmp_path / "empty.sqlite") as life:
        empty = asked(life.connection)
        assert (empty.writes, empty.is_all) == ((), True)

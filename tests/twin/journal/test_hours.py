"""What follows from rows does not depend on the order in which they came, nor on the engine."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_twin.journal.appending import Appender
from lupin_twin.journal.hours import count_rows, delete_before
from lupin_twin.journal.schema import SiteLog
from tests.support.log_life import BEGUN, HOUR, MINUTE, lived, look, scan, steps
from tests.twin.journal.conftest import Copied, Living

_DERIVED = ("hour", "tally", "event")


def derived(log: SiteLog) -> list[list[tuple[Any, ...]]]:
    """The three tables, without sums, and the sums."""
    found = [
        sorted(log.execute(f"SELECT {columns} WHERE site = :site").fetchall())
        for columns in (
            "series, hour, CAST(n AS TEXT), CAST(low AS TEXT), CAST(high AS TEXT) FROM hour",
            "run, event, hour, n, total, low, high, first_ns, last_ns FROM tally",
            "run, event, stamp_ns, seq, tag, value FROM event",
        )
    ]
    totals = "SELECT series, hour, CAST(total AS TEXT) FROM hour WHERE site = :site"
    return [*found, [tuple(json.loads(row[2])) for row in sorted(log.execute(totals).fetchall())]]


@given(steps, st.randoms(use_true_random=False))
@settings(deadline=None, max_examples=30)
def test_what_is_counted_in_another_order_on_the_other_engine_is_the_same(
    living: Living, copied: Copied, told: list[tuple[str, Any]], random: Any
) -> None:
    with living(told) as life:
        log = SiteLog(life.connection)
        archive = SiteLog(*copied(life.connection))
        for table in _DERIVED:
            archive.execute(f"DELETE FROM {table} WHERE site = :site")
        numbers = list(range(1, 1 + Appender(life.connection).last_seq))
        random.shuffle(numbers)
        for number in numbers:
            count_rows(archive, number - 1, number)
        *there, there_sums = derived(archive)
        *here, here_sums = derived(log)
        assert there == here
        for one, other in zip(there_sums, here_sums, strict=True):
            assert one == pytest.approx(other, rel=1e-12, abs=1e-6)


def test_what_is_older_than_a_stamp_goes_at_once(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        stamps = [BEGUN + n * 30 * MINUTE for n in range(8)]
        life.write(scan(at_ns=at_ns) for at_ns in stamps)
        life.write(look(at_ns=at_ns, anomaly=n % 2 == 0) for n, at_ns in enumerate(stamps))
        log = SiteLog(life.connection)
        delete_before(log, 2, BEGUN + 2 * HOUR)
        assert [len(rows) for rows in derived(log)[:3]] == [4, 8, 15]
        delete_before(log, 1, BEGUN + 2 * HOUR)
        assert [len(rows) for rows in derived(log)[:3]] == [2, 4, 7]

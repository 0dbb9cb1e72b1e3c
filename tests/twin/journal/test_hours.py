from __future__ import annotations

from pathlib import Path

from lupin_twin.journal.hours import delete_before
from lupin_twin.journal.schema import SiteLog
from tests.support.log_life import BEGUN, HOUR, MINUTE, lived, look, scan


def counts(log: SiteLog) -> list[int]:
    tables = ("hour", "tally", "event")
    return [log.execute(f"SELECT count(*) FROM {table}").fetchone()[0] for table in tables]


def test_what_is_older_than_a_stamp_goes_at_once(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        stamps = [BEGUN + n * 30 * MINUTE for n in range(8)]
        life.write(scan(at_ns=at_ns) for at_ns in stamps)
        life.write(look(at_ns=at_ns, anomaly=n % 2 == 0) for n, at_ns in enumerate(stamps))
        log = SiteLog(life.connection)
        delete_before(log, 2, BEGUN + 2 * HOUR)
        assert counts(log) == [4, 8, 15]
        delete_before(log, 1, BEGUN + 2 * HOUR)
        assert counts(log) == [2, 4, 7]

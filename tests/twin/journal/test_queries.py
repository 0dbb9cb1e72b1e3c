from pathlib import Path

import pytest

from lupin_twin.core.past import SeriesRequest
from lupin_twin.journal.queries import series
from tests.support.journal import SECOND, scan
from tests.support.log_life import BEGUN, LATEST, MINUTE, lived

END = BEGUN + (LATEST + 200) * MINUTE


def temperature(start_ns: int = 0, end_ns: int = 0, points: int = 500) -> SeriesRequest:
    return SeriesRequest("7", "temperature", start_ns, end_ns, points)


def test_as_many_readings_as_points_come_singly_and_more_in_buckets(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        life.write(scan(at_ns=BEGUN + n * SECOND, temperature=float(n)) for n in range(10))
        exact = series(life.connection, temperature(BEGUN, BEGUN + 10 * SECOND, 10), END)
        assert exact.means == tuple(map(float, range(10)))
        assert exact.counts == (1,) * 10
        assert not exact.is_bucketed
        fewer = series(life.connection, temperature(BEGUN, BEGUN + 10 * SECOND, 9), END)
        assert fewer.is_bucketed
        assert fewer.counts == (2, *(1,) * 8)


def test_too_many_scans_come_by_the_hour(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        life.write(scan(at_ns=BEGUN + n * MINUTE) for n in range(300))
        request = temperature(BEGUN, BEGUN + 300 * MINUTE, 299)
        monkeypatch.setattr("lupin_twin.journal.counts.MAX_ROWS", 300)
        assert len(series(life.connection, request, END).stamps_ns) > 200
        monkeypatch.setattr("lupin_twin.journal.counts.MAX_ROWS", 299)
        assert series(life.connection, request, END).counts == (60,) * 5

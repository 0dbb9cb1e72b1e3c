from __future__ import annotations

from pathlib import Path

from lupin_twin.journal.checking import overview
from lupin_twin.journal.retention import DAY_NS, Limits, note_limits
from tests.support.log_life import BEGUN, SECOND, failure, lived, look, pin, scan


def test_rows_sensors_and_reach_are_those_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    late, early = BEGUN + 9 * SECOND, BEGUN - 60 * SECOND
    with lived(path) as life:
        life.write([pin(), scan(b=1.0, a=2.0), failure("8"), scan("9", c=1.0), look(at_ns=late)])
        life.write([scan("9", early)])
        life.connection.execute("UPDATE run SET is_simulated = 0")
        life.begin(5 * SECOND)
        life.write([scan("9", 7 * SECOND)])
        note_limits(life.connection, Limits(days=36_500.0, max_bytes=5_000_000))
        found = overview(life.connection, path)
    assert (found.kept_ns, found.kept_bytes) == (36_500 * DAY_NS, 5_000_000)
    assert found.rows["tag"] == 3
    assert found.failures == 1
    assert found.sensors == ("a", "b", "c", "temperature")
    extents = [(extent.first_ns, extent.last_ns) for extent in found.runs]
    assert extents == [(early, late), (7 * SECOND, 7 * SECOND)]


def test_what_was_quarantined_beside_it_is_named(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    for name in ("j.sqlite.damaged-20261121T141500Z", "j.sqlite.damaged-20261121T141500Z-wal"):
        (tmp_path / name).write_bytes(b"12345")
    (tmp_path / "k.sqlite.damaged-20261121T141500Z").write_bytes(b"1")
    with lived(path) as life:
        found = overview(life.connection, path)
    assert found.quarantined == (("j.sqlite.damaged-20261121T141500Z", 5),)

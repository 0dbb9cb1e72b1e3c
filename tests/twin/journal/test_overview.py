from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from pathlib import Path

from lupin_twin.journal.overview import Overview, overview
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import open_reader
from lupin_twin.past import HOUR_NS
from tests.support.journal import CLOCK, NOW, SECOND, kept, look, opened, pin, scan


def overview_of(path: Path) -> Overview:
    with closing(open_reader(path)) as connection:
        return overview(connection, path)


def test_an_empty_journal_has_nothing_in_it(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [], CLOCK)
    found = overview_of(path)
    assert found.rows == {"scan": 0, "look": 0, "pin": 0, "tag": 0, "rollup": 0}
    assert (found.failures, found.sensors, found.rolled_ns) == (0, (), None)
    assert [(extent.first_ns, extent.last_ns) for extent in found.runs] == [(None, None)]
    assert found.file_bytes == path.stat().st_size


def test_rows_sensors_and_reach_are_those_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    late, early = NOW + 9 * SECOND, NOW - 60 * SECOND
    failed = replace(scan("8"), readings=(), status=2)
    kept(path, [pin(), scan(b=1.0, a=2.0), failed, scan("9", c=1.0), look(at_ns=late)])
    kept(path, [scan("9", early)])
    simulated = Clock(5 * SECOND, NOW + HOUR_NS, is_simulated=True)
    kept(path, [scan("9", 7 * SECOND)], simulated)
    found = overview_of(path)
    assert found.rows == {"scan": 5, "look": 1, "pin": 1, "tag": 3, "rollup": 0}
    assert found.failures == 1
    assert found.sensors == ("a", "b", "c", "temperature")
    extents = [(extent.first_ns, extent.last_ns) for extent in found.runs]
    assert extents == [(early, late), (7 * SECOND, 7 * SECOND)]


def test_limits_and_rollups_stand_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan(), scan(at_ns=NOW + 3 * HOUR_NS)], CLOCK)
    with opened(path, Limits(days=36_500.0, max_bytes=5_000_000)) as file:
        while file.look_after():
            pass
    found = overview_of(path)
    assert (found.kept_ns, found.kept_bytes) == (36_500 * 24 * HOUR_NS, 5_000_000)
    hour = NOW // HOUR_NS * HOUR_NS
    assert found.rows["rollup"] == 2
    assert found.rolled_ns == (hour, hour + 4 * HOUR_NS)


def test_what_was_set_aside_beside_it_is_named(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [])
    for name in ("j.sqlite.damaged-20261121T141500Z", "j.sqlite.damaged-20261121T141500Z-wal"):
        (tmp_path / name).write_bytes(b"12345")
    (tmp_path / "k.sqlite.damaged-20261121T141500Z").write_bytes(b"1")
    assert overview_of(path).set_aside == (("j.sqlite.damaged-20261121T141500Z", 5),)

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from lupin_twin.journal.fixed import places_of
from lupin_twin.journal.newest import Scans, looks_of
from lupin_twin.journal.schema import open_reader
from lupin_twin.journal.spans import FOREVER_NS
from tests.support.journal import NOW, kept, look, pin, scan


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "j.sqlite"


@contextmanager
def reading(path: Path) -> Iterator[sqlite3.Connection]:
    with closing(open_reader(path)) as connection:
        yield connection


def damage(path: Path, sql: str) -> None:
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(sql)


def test_of_each_series_the_newest_or_the_first(path: Path) -> None:
    kept(path, [scan("1", NOW + n) for n in (3, 1, 2)] + [scan("2", NOW + 9, humidity=1.0)])
    with reading(path) as connection:
        newest = Scans.of(connection, 1, FOREVER_NS, "DESC")
        first = Scans.of(connection, 1, NOW + 8, "ASC")
    assert newest.stamp.tolist() == [NOW + 3, NOW + 9]
    assert newest.sensors.tolist() == [1, 1]
    assert first.stamp.tolist() == [NOW + 1]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_damaged_rows_give_way_to_the_next_that_is_whole(path: Path, count: int) -> None:
    kept(path, [row for n in range(3) for row in (scan(at_ns=NOW + n), look(at_ns=NOW + n))])
    for table in ("scan", "look"):
        damage(path, f"UPDATE {table} SET lag_us = 5 WHERE stamp_ns > {NOW + 2 - count}")
    with reading(path) as connection:
        scans = Scans.of(connection, 1, FOREVER_NS, "DESC")
        looks = looks_of(connection, 1, FOREVER_NS)
    expected = [NOW + 2 - count] if count < 3 else []
    assert scans.stamp.tolist() == looks.stamp.tolist() == expected


def test_damaged_places_are_left_out(path: Path) -> None:
    kept(path, [pin("1"), pin("2"), pin("3")])
    damage(path, "UPDATE pin SET stamp_ns = 7 WHERE tag = 2")
    with reading(path) as connection:
        assert places_of(connection, 1, FOREVER_NS).tags.tolist() == [1, 3]


def test_a_stamp_that_was_sent_is_part_of_the_check(path: Path) -> None:
    kept(path, [replace(scan(), own_stamp_ns=-1), scan("2")])
    with reading(path) as connection:
        assert len(Scans.of(connection, 1, FOREVER_NS, "DESC").tag) == 2
    damage(path, "UPDATE scan SET own_stamp_ns = 5 WHERE own_stamp_ns = -1")
    with reading(path) as connection:
        assert Scans.of(connection, 1, FOREVER_NS, "DESC").tag.tolist() == [2]

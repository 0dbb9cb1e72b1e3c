from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lupin_twin.journal.rows import KIND_FLOWER, Row
from tests.support.journal import NOW, SECOND, kept, known, look, pin, scan, select


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "j.sqlite"


FAILED = replace(scan(at_ns=NOW + 5), readings=(), status=2, detail="no answer")
BLIND = replace(scan(at_ns=NOW + 6), readings=(), kind=KIND_FLOWER, status=1, detail="dark")


@pytest.mark.parametrize("row", [scan(), look(), look(anomaly=True), pin(), FAILED, BLIND])
def test_what_is_handed_over_is_there(path: Path, row: Row) -> None:
    assert kept(path, [row]) == (1, 0)
    assert known(path) == {row}


@pytest.mark.parametrize("row", [scan(), look(), pin(), FAILED])
def test_the_same_heard_again_is_nothing_new(path: Path, row: Row) -> None:
    assert kept(path, [row, row]) == (1, 0)
    assert kept(path, [row, replace(row, arrival_ns=row.arrival_ns + SECOND)]) == (0, 0)
    assert known(path) == {row}


def test_an_older_one_is_new_and_the_same_older_one_is_not(path: Path) -> None:
    rows = [scan(at_ns=NOW + n * SECOND) for n in (5, 3, 4, 3, 5)]
    assert kept(path, rows) == (3, 0)
    assert kept(path, rows) == (0, 0)


def test_what_differs_in_tag_source_status_or_sensors_is_not_the_same(path: Path) -> None:
    rows = [
        scan(),
        scan("8"),
        scan(source="other"),
        scan(humidity=50.0),
        replace(scan(), status=2),
    ]
    assert kept(path, rows) == (5, 0)
    assert known(path) == set(rows)


def test_a_stamp_from_the_future_is_known_by_what_was_sent(path: Path) -> None:
    future = replace(scan(), own_stamp_ns=4_070_908_800 * SECOND)
    again = replace(future, stamp_ns=NOW + 9 * SECOND)
    assert kept(path, [future]) == (1, 0)
    assert kept(path, [again]) == (0, 0)
    assert known(path) == {future}


def test_without_a_stamp_nothing_can_be_known_again(path: Path) -> None:
    rows = [replace(scan(at_ns=NOW + n), own_stamp_ns=0) for n in range(2)]
    assert kept(path, rows) == (2, 0)


def test_numbers_go_over_all_kinds_and_on_after_a_restart(path: Path) -> None:
    kept(path, [scan(), look(), pin()])
    kept(path, [scan(at_ns=NOW + 1)])
    ids = [
        number
        for table in ("scan", "look", "pin")
        for (number,) in select(path, f"SELECT id FROM {table}")
    ]
    assert sorted(ids, key=str) == [1, 2, 3, 4]


def test_a_text_that_is_no_unicode_is_kept_as_far_as_it_is(path: Path) -> None:
    row = replace(scan(), source="a\udcffb", detail="c\udcffd")
    assert kept(path, [row]) == (1, 0)
    assert known(path) == {replace(row, source="a?b", detail="c?d")}

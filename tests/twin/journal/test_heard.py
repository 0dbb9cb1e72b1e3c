"""The latest of one run; that it is what a replay leaves is shown in test_asof."""

from __future__ import annotations

import gc
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from lupin_twin.bounds import MAX_SENSORS_PER_TAG
from lupin_twin.journal.heard import Known, heard
from lupin_twin.journal.rows import Row
from lupin_twin.journal.schema import open_reader
from lupin_twin.journal.spans import FOREVER_NS
from lupin_twin.state import Reading, TagState, Try
from tests.support.journal import NOW, SECOND, kept, look, opened, pin, scan


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "j.sqlite"


def known(path: Path, until_ns: int = FOREVER_NS, *, only_places: bool = False) -> Known:
    with closing(open_reader(path)) as reader:
        return heard(reader, 1, until_ns, only_places=only_places)


def only_tag(path: Path, rows: list[Row]) -> TagState:
    kept(path, rows)
    (tag,) = known(path).tags
    return tag


def test_nothing_is_known_of_an_empty_run(path: Path) -> None:
    with opened(path):
        pass
    assert list(known(path).tags) == []


def test_tags_come_in_the_order_of_their_numbers_whatever_they_are_called(path: Path) -> None:
    kept(path, [scan("rose 🌹"), pin("b\n\t"), look("a"), scan("b\n\t")])
    found = known(path)
    assert [tag.tag_id for tag in found.tags] == ["rose 🌹", "b\n\t", "a"]
    assert list(found.numbers) == [1, 2, 3]
    assert list(found.are_observed) == [True, True, True]


def test_places_alone(path: Path) -> None:
    kept(path, [scan("1"), pin("2"), look("3")])
    (tag,) = known(path, only_places=True).tags
    assert tag == TagState("2", pin("2").pose)


def test_numbers_that_need_all_their_digits_keep_them(path: Path) -> None:
    tag = only_tag(path, [scan(a=0.1, b=-1e300), pin(x=0.1)])
    assert [reading.value for reading in tag.readings] == [0.1, -1e300]
    assert tag.pose == pin(x=0.1).pose


def test_of_several_sets_each_sensor_has_its_latest(path: Path) -> None:
    rows: list[Row] = [
        scan(at_ns=NOW + 3, a=1.0, b=2.0),
        scan(at_ns=NOW + 5, b=3.0, c=4.0),
        scan(at_ns=NOW + 4, source="other", a=5.0, c=6.0),
    ]
    readings = {reading.name: reading for reading in only_tag(path, rows).readings}
    assert readings == {
        "a": Reading("a", 5.0, NOW + 4),
        "b": Reading("b", 3.0, NOW + 5),
        "c": Reading("c", 4.0, NOW + 5),
    }


@pytest.mark.parametrize("count", [MAX_SENSORS_PER_TAG, MAX_SENSORS_PER_TAG + 1])
def test_a_tag_has_so_many_sensors_and_no_more(path: Path, count: int) -> None:
    rows: list[Row] = [
        replace(scan(), readings=(Reading(f"s{number}", 1.0),)) for number in range(count)
    ]
    assert len(only_tag(path, rows).readings) == min(count, MAX_SENSORS_PER_TAG)


def test_the_last_try_is_told_with_its_words(path: Path) -> None:
    failed = replace(
        scan(at_ns=NOW + SECOND), readings=(), status=2, detail="zu heiß 🌡", own_stamp_ns=5
    )
    tag = only_tag(path, [scan(), failed])
    assert tag.last_try == Try(NOW + SECOND, 2, "zu heiß 🌡")
    assert tag.last_observed_ns == NOW


def test_a_tag_that_only_failed_was_observed_when_it_was_first_tried(path: Path) -> None:
    rows: list[Row] = [
        replace(scan(at_ns=NOW + n), readings=(), status=status, detail="no")
        for n, status in ((7, 1), (3, 2), (5, 1))
    ]
    kept(path, rows)
    found = known(path)
    assert [tag.last_observed_ns for tag in found.tags] == [NOW + 3]
    assert list(found.are_observed) == [False]
    assert [tag.last_observed_ns for tag in known(path, NOW + 6).tags] == [NOW + 3]


def test_garbage_is_looked_for_again_afterwards(path: Path) -> None:
    kept(path, [scan()])
    assert gc.isenabled()
    known(path)
    assert gc.isenabled()
    gc.disable()
    try:
        known(path)
        assert not gc.isenabled()
    finally:
        gc.enable()

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_twin.journal.packing import Bucket, unpack_buckets
from lupin_twin.journal.rollups import Folded, Folding, get_meta, set_meta
from lupin_twin.journal.schema import open_writer, transaction
from lupin_twin.past import HOUR_NS
from tests.support.journal import CLOCK, NOW, kept, opened, scan, select

HOUR = NOW // HOUR_NS


def fold(path: Path, last_id: int, steps: int = 10**9) -> bool:
    """Fold some steps, as one life of a twin; returns whether that was all."""
    connection = open_writer(path)
    folding = Folding(connection, last_id)
    has_more = True
    while has_more and steps:
        steps -= 1
        with transaction(connection):
            has_more = folding.step()
    connection.close()
    return not has_more


def buckets(path: Path, sensors: int = 1) -> dict[tuple[object, object], list[Bucket]]:
    return {
        (series, hour): unpack_buckets(packed, sensors)
        for series, hour, packed in select(path, "SELECT * FROM rollup")
        if isinstance(packed, bytes)
    }


def test_an_hour_of_a_sensor_is_one_bucket(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    values = [20.0, 22.0, math.nan, 27.0, math.inf]
    kept(path, [scan(at_ns=HOUR * HOUR_NS + n, temperature=v) for n, v in enumerate(values)])
    kept(path, [scan(at_ns=(HOUR + 1) * HOUR_NS, temperature=5.0)])
    assert fold(path, 6)
    assert buckets(path) == {
        (1, HOUR): [Bucket(3, 23.0, 20.0, 27.0)],
        (1, HOUR + 1): [Bucket(1, 5.0, 5.0, 5.0)],
    }


def test_what_comes_late_is_merged_into_its_hour(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan(at_ns=NOW + HOUR_NS, temperature=1.0), scan(at_ns=NOW + 9, temperature=10.0)])
    assert fold(path, 2)
    kept(path, [scan(at_ns=NOW, temperature=20.0)])
    assert fold(path, 3)
    assert buckets(path)[1, HOUR] == [Bucket(2, 15.0, 10.0, 20.0)]


@pytest.mark.parametrize("lives", [1, 2, 3, 4, 5])
def test_each_reading_is_counted_once_however_often_folding_is_cut_short(
    tmp_path: Path, lives: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lupin_twin.journal.rollups._ROWS_READ", 7)
    monkeypatch.setattr("lupin_twin.journal.rollups._ROWS_WRITTEN", 3)
    path = tmp_path / "j.sqlite"
    rows = [scan(str(n % 10), NOW + n, temperature=float(n)) for n in range(50)]
    kept(path, rows)
    for _ in range(20):
        if fold(path, 50, 8 + lives):
            break
        kept(path, [scan("new", NOW + 99, temperature=7.0)])
    assert folded_to(path, 1) == 50
    found = buckets(path)
    assert sum(bucket.n for (bucket,) in found.values()) == 50
    assert [bucket.high for (bucket,) in found.values()] == [40.0 + n for n in range(10)]


def folded_to(path: Path, series: int) -> int:
    connection = open_writer(path)
    number = Folded(connection).up_to(series)
    connection.close()
    return number


def test_while_it_folds_it_says_of_each_series_how_far_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lupin_twin.journal.rollups._ROWS_WRITTEN", 1)
    path = tmp_path / "j.sqlite"
    kept(path, [scan(tag, NOW) for tag in "123"])
    assert not fold(path, 3, 3)  # read, and two of three series written
    assert [folded_to(path, series) for series in (1, 2, 3)] == [3, 3, 0]
    assert len(buckets(path)) == 2


def test_a_damaged_row_and_a_damaged_rollup_cost_themselves_alone(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan("1", temperature=1.0), scan("2", temperature=2.0), scan("1", NOW + 1)])
    connection = open_writer(path)
    connection.execute("UPDATE scan SET readings = x'00' WHERE id = 1")
    connection.execute("INSERT INTO rollup VALUES (2, ?, x'00')", (HOUR,))
    connection.close()
    assert fold(path, 3)
    assert buckets(path) == {
        (1, HOUR): [Bucket(1, 21.5, 21.5, 21.5)],
        (2, HOUR): [Bucket(1, 2.0, 2.0, 2.0)],
    }


def test_the_files_own_numbers_are_kept(tmp_path: Path) -> None:
    connection = open_writer(tmp_path / "j.sqlite")
    assert get_meta(connection, "rolled_id") == 0
    set_meta(connection, rolled_id=7, purged_id=2)
    set_meta(connection, rolled_id=9)
    assert get_meta(connection, "rolled_id") == 9
    assert get_meta(connection, "purged_id") == 2
    connection.close()


@settings(deadline=None, max_examples=50)
@given(st.lists(st.tuples(st.integers(0, 3), st.floats(-1e6, 1e6)), min_size=1, max_size=40))
def test_rollups_are_those_of_a_plain_sum(
    tmp_path_factory: pytest.TempPathFactory, told: list[tuple[int, float]]
) -> None:
    path = tmp_path_factory.mktemp("rollups") / "j.sqlite"
    rows = [
        scan(at_ns=(HOUR + hour) * HOUR_NS + n, temperature=value)
        for n, (hour, value) in enumerate(told)
    ]
    with opened(path) as file:
        run = file.first_run(CLOCK)
        file.append([(run, row) for row in rows])
        while file._fold(0.0):
            pass
    for (_, hour), (bucket,) in buckets(path).items():
        assert isinstance(hour, int)
        values = [value for of, value in told if of == hour - HOUR]
        assert bucket.n == len(values)
        assert bucket.mean == pytest.approx(sum(values) / len(values), rel=1e-9, abs=1e-6)
        assert bucket.low == pytest.approx(min(values), rel=1e-6)
        assert bucket.high == pytest.approx(max(values), rel=1e-6)

from __future__ import annotations

import math
from contextlib import closing
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_twin.journal.packing import Bucket, pack_buckets
from lupin_twin.journal.schema import open_reader
from lupin_twin.journal.series import newest, series
from lupin_twin.past import HOUR_NS, MAX_POINTS, SeriesPast, SeriesRequest
from lupin_twin.state import Reading
from tests.support.journal import NOW, SECOND, kept, look, scan
from tests.support.past_reference import check
from tests.support.past_strategy import (
    BEGUN,
    LATEST,
    MINUTE,
    give_up,
    lived,
    periods,
    steps,
    upkeep,
)

END = BEGUN + (LATEST + 200) * MINUTE


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("series")


numbers = count()


def ask(path: Path, request: SeriesRequest, now_ns: int = END) -> SeriesPast:
    connection = open_reader(path)
    try:
        return series(connection, request, now_ns)
    finally:
        connection.close()


def temperature(start_ns: int = 0, end_ns: int = 0, points: int = 500) -> SeriesRequest:
    return SeriesRequest("7", "temperature", start_ns, end_ns, points)


@given(steps, periods, st.integers(1, 40), st.sampled_from(["temperature", "co2"]))
@settings(deadline=None, max_examples=30)
def test_it_is_that_of_a_plain_list(
    folder: Path, told: list[tuple[str, Any]], period: tuple[int, int], points: int, sensor: str
) -> None:
    with lived(folder / f"{next(numbers)}.sqlite", told) as reference:
        for tag_id in ("7", "ü 9"):
            request = SeriesRequest(tag_id, sensor, *period, points)
            answer = series(reference.file._connection, request, END)
            check(answer, request, reference.readings(tag_id, sensor), now_ns=END)
            ended = SeriesRequest(tag_id, sensor, *(period if period[1] else (0, END)), MAX_POINTS)
            every = series(reference.file._connection, ended, END)
            finite = [
                (stamp_ns, value)
                for stamp_ns, value in zip(every.stamps_ns, every.means, strict=True)
                if math.isfinite(value)
            ]
            last = newest(reference.file._connection, ended, points)
            assert last == finite[-points:]


@given(steps, periods, st.integers(1, 40), st.integers(0, LATEST))
@settings(deadline=None, max_examples=40)
def test_rollups_go_on_where_scans_were_given_up(
    folder: Path, told: list[tuple[str, Any]], period: tuple[int, int], points: int, minute: int
) -> None:
    one_run = [step for step in told if step[0] != "back"]
    with lived(folder / f"{next(numbers)}.sqlite", one_run) as reference:
        connection = reference.file._connection
        everything = reference.readings("7", "temperature")
        give_up(reference, BEGUN + minute * MINUTE)
        request = temperature(*period, points)
        answer = series(connection, request, END)
        # A reading that is none has left no trace in a rollup, and so no beginning of all.
        if period[0] or all(math.isfinite(value) for *_, value in everything):
            check(answer, request, everything, now_ns=END)


def test_of_a_scan_that_names_a_sensor_twice_the_later_one_is_the_newest(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    twice = (Reading("temperature", 1.0), Reading("temperature", 2.0))
    kept(path, [replace(scan(at_ns=NOW), readings=twice)])
    with closing(open_reader(path)) as connection:
        for most, values in ((1, [2.0]), (2, [1.0, 2.0]), (3, [1.0, 2.0])):
            found = newest(connection, temperature(NOW, NOW + 1), most)
            assert found == [(NOW, value) for value in values]


def test_as_many_readings_as_points_are_told_and_one_more_are_buckets(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan(at_ns=NOW + n * SECOND, temperature=float(n)) for n in range(10)])
    exact = ask(path, temperature(NOW, NOW + 10 * SECOND, 10))
    assert exact.means == tuple(map(float, range(10)))
    assert exact.counts == (1,) * 10
    assert not exact.is_bucketed
    assert ask(path, temperature(NOW, NOW + 10 * SECOND, 9)) == SeriesPast(
        NOW,
        NOW + 10 * SECOND,
        1_111_111_112,
        tuple(NOW + n * 1_111_111_112 for n in range(9)),
        (2, *(1,) * 8),
        (0.5, *map(float, range(2, 10))),
        (0.0, *map(float, range(2, 10))),
        tuple(map(float, range(1, 10))),
    )


def test_the_period_ends_before_its_end_and_now_is_told(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan(at_ns=NOW + n) for n in range(3)])
    assert ask(path, temperature(NOW, NOW + 2)).stamps_ns == (NOW, NOW + 1)
    assert ask(path, temperature(NOW + 1), NOW + 2).stamps_ns == (NOW + 1, NOW + 2)
    assert ask(path, temperature(NOW + 3), NOW + 2) == SeriesPast(NOW + 3, NOW + 3)


def test_what_was_never_heard_is_empty(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [look(), scan("8")])
    assert ask(path, temperature()).stamps_ns == ()
    assert ask(path, SeriesRequest("8", "co2")).stamps_ns == ()
    assert ask(path, SeriesRequest("99", "co2")).stamps_ns == ()


def test_a_reading_that_is_none_is_told_and_not_counted(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(
        path, [scan(at_ns=NOW + n, temperature=v) for n, v in enumerate([math.nan, 1.0, math.inf])]
    )
    assert repr(ask(path, temperature()).means) == "(nan, 1.0, inf)"
    assert ask(path, temperature(NOW, NOW + 3, 2)).counts == (1,)


def test_hours_come_from_rollups_alone(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with lived(path, []) as reference:
        hours = 30
        reference.write(
            scan(at_ns=BEGUN + n * 10 * MINUTE, temperature=n + 0.1) for n in range(6 * hours)
        )
        upkeep(reference)
        connection = reference.file._connection
        # Were a scan read, it would show.
        connection.execute("UPDATE scan SET readings = x''")
        answer = series(connection, temperature(BEGUN + 1, BEGUN + hours * HOUR_NS, 10), END)
    assert answer.start_ns == BEGUN
    assert answer.bucket_ns == 3 * HOUR_NS
    assert answer.counts == (18,) * 10
    assert answer.minima == tuple(18 * n + 0.1 for n in range(10))
    assert answer.maxima == tuple(18 * n + 17.1 for n in range(10))


def test_too_many_scans_are_told_by_the_hour(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan(at_ns=BEGUN + n * MINUTE) for n in range(300)])
    request = temperature(BEGUN, BEGUN + 300 * MINUTE, 299)
    monkeypatch.setattr("lupin_twin.journal.series.MAX_SCANS", 300)
    assert len(ask(path, request).stamps_ns) > 200
    monkeypatch.setattr("lupin_twin.journal.series.MAX_SCANS", 299)
    assert ask(path, request).counts == (60,) * 5


def test_while_a_damaged_file_is_read_rollups_are_not_asked(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with lived(path, []) as reference:
        reference.write(scan(at_ns=BEGUN + n * MINUTE) for n in range(120))
        upkeep(reference)
        connection = reference.file._connection
        connection.execute("UPDATE meta SET value = 0 WHERE key = 'rolled_id'")
        connection.execute("INSERT INTO meta VALUES ('salvage', 'x')")
        answer = series(connection, temperature(BEGUN, BEGUN + 2 * HOUR_NS, 2), END)
    assert answer.counts == (60, 60)


def test_damaged_bytes_cost_their_own_reading_or_hour(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with lived(path, []) as reference:
        reference.write(scan(at_ns=BEGUN + n * 30 * MINUTE, temperature=1.0) for n in range(8))
        upkeep(reference)
        connection = reference.file._connection
        connection.execute("UPDATE scan SET readings = x'00' WHERE id = 1")
        connection.execute("UPDATE rollup SET buckets = x'00' WHERE hour % 4 = 0")
        connection.execute(
            "UPDATE rollup SET buckets = ? WHERE hour % 4 = 1",
            (pack_buckets([Bucket(70_000, 2.0, -1e300, 3.0)]),),
        )
        answer = series(connection, temperature(BEGUN, BEGUN + 4 * HOUR_NS, 4), END)
        assert len(answer.stamps_ns) == 3
        assert max(answer.counts) == 70_000
        assert min(answer.minima) == -1e300
        assert len(series(connection, temperature(BEGUN), END).stamps_ns) == 7


def test_few_scans_that_were_given_up_are_told_by_the_hour(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite", []) as reference:
        reference.write(scan(at_ns=BEGUN + n * 30 * MINUTE, temperature=1.0) for n in range(8))
        give_up(reference, BEGUN + 3 * HOUR_NS)
        answer = series(reference.file._connection, temperature(BEGUN), BEGUN + 4 * HOUR_NS - 1)
    assert answer.bucket_ns == HOUR_NS
    assert answer.counts == (2, 2, 2, 2)

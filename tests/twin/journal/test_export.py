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

from lupin_twin.journal.export import _STRETCH, LOT, Export, rows
from lupin_twin.journal.retention import Limits, purge_step
from lupin_twin.journal.rollups import set_meta
from lupin_twin.journal.schema import open_reader, open_writer, transaction
from lupin_twin.past import NotRemembered, PastRow
from lupin_twin.state import Reading
from tests.support.journal import CLOCK, NOW, SECOND, kept, look, opened, pin, scan
from tests.support.past_strategy import BEGUN, LATEST, MINUTE, lived, steps

END = BEGUN + (LATEST + 200) * MINUTE


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("export")


numbers = count()


def every(
    path: Path, start: int = 0, end: int = END, tag: str | None = None, sensor: str | None = None
) -> list[PastRow]:
    connection = open_reader(path)
    try:
        return [row for lot in rows(connection, start, end, tag, sensor) for row in lot]
    finally:
        connection.close()


@given(steps, st.integers(0, LATEST), st.integers(0, LATEST), st.sampled_from([None, "7"]))
@settings(deadline=None, max_examples=60)
def test_it_is_that_of_a_plain_list(
    folder: Path, told: list[tuple[str, Any]], one: int, other: int, tag_id: str | None
) -> None:
    start_ns, end_ns = (BEGUN + minute * MINUTE for minute in sorted((one, other)))
    with (
        lived(folder / f"{next(numbers)}.sqlite", told) as reference,
        pytest.MonkeyPatch.context() as patch,
    ):
        patch.setattr("lupin_twin.journal.export._STRETCH", 8)
        patch.setattr("lupin_twin.journal.export.LOT", 3)
        lots = list(rows(reference.file._connection, start_ns, end_ns, tag_id))
        expected = reference.export(start_ns, end_ns, tag_id)
    found = [row for lot in lots for row in lot]
    assert sorted(map(repr, found)) == sorted(map(repr, expected))
    assert [row.stamp_ns for row in found] == [row.stamp_ns for row in expected]
    assert all(0 < len(lot) <= 3 for lot in lots)


def test_a_row_says_all_there_is(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    failed = replace(scan("8", NOW + 1), readings=(), status=2, source="other")
    kept(path, [scan(co2=400.0, temperature=21.0), pin(), failed, look("9", NOW + 2)])
    first, second, third = every(path)
    assert first == PastRow(NOW, "7", 1.5, 2.5, "co2", 400.0, 0, "robot")
    assert second == PastRow(NOW, "7", 1.5, 2.5, "temperature", 21.0, 0, "robot")
    assert repr(third) == repr(PastRow(NOW + 1, "8", math.nan, math.nan, "", math.nan, 2, "other"))
    # Of one sensor its readings alone: what failed was a try at all of them.
    assert every(path, sensor="co2") == [first]
    assert every(path, tag="nobody") == []


def test_a_place_is_known_in_a_run_that_follows(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [pin()])
    with opened(path) as file:
        run = file.next_run(file.first_run(CLOCK), replace(CLOCK, stamp_ns=NOW - SECOND))
        file.append([(run, scan(at_ns=NOW - SECOND)), (run, pin(at_ns=NOW - SECOND, x=9.0))])
    assert [row.x for row in every(path)] == [1.5]


def test_lots_come_as_they_are_taken_and_nothing_is_held_open_between(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan(at_ns=NOW + n * SECOND) for n in range(3 * LOT)])
    reader, writer = open_reader(path), open_writer(path)
    lots = rows(reader, 0, END)
    taken = len(next(lots))
    assert 0 < taken <= LOT
    assert not reader.in_transaction
    writer.execute("INSERT INTO meta VALUES ('x', 1)")
    # All of the log can be put into the file while an export waits for its reader.
    busy, log, put = writer.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
    assert (busy, log, put) == (0, 0, 0)
    assert sum(map(len, lots)) == 3 * LOT - taken
    reader.close()
    writer.close()


def test_scans_of_many_readings_come_in_shorter_stretches(tmp_path: Path) -> None:
    """What is in memory at once is bounded by rows, not by scans."""
    path = tmp_path / "j.sqlite"
    wide = replace(scan(), readings=tuple(Reading(f"s{number}", 1.0) for number in range(64)))
    kept(path, [replace(wide, stamp_ns=NOW + n * SECOND // 100) for n in range(5_000)])
    reader = open_reader(path)
    export = Export(0, END, None, None)
    steps = []
    while (found := export.step(reader)) is not None:
        steps.append(len(found))
    assert sum(steps) == 5_000 * 64
    assert max(steps) <= 4 * 40_000
    reader.close()


def test_a_series_that_means_nothing_costs_no_search_for_each_of_its_scans(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan("1", NOW + n) for n in range(100)])
    writer = open_writer(path)
    writer.execute("DELETE FROM name")
    writer.close()
    reader = open_reader(path)
    asked: list[str] = []
    reader.set_trace_callback(asked.append)
    assert [row for lot in rows(reader, 0, END) for row in lot] == []
    assert len(asked) < 60
    reader.close()


def test_a_long_silence_is_one_step(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    year = 365 * 86_400 * SECOND
    kept(path, [scan(at_ns=NOW - year), scan(at_ns=NOW)])
    reader = open_reader(path)
    questions = 0

    def asked(_: str) -> None:
        nonlocal questions
        questions += 1

    reader.set_trace_callback(asked)
    assert [row.stamp_ns for lot in rows(reader, 0, END) for row in lot] == [NOW - year, NOW]
    assert questions < 60
    reader.close()


def test_series_that_come_while_it_is_taken_are_read_too(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan(at_ns=NOW + n * SECOND) for n in range(2 * LOT)])
    reader = open_reader(path)
    lots = rows(reader, 0, END)
    next(lots)
    kept(path, [scan("new", at_ns=NOW + 9_000 * SECOND)])
    assert [row.tag_id for lot in lots for row in lot][-1] == "new"
    reader.close()


def test_what_is_given_up_meanwhile_breaks_it_off_and_only_if_it_was_to_come(
    tmp_path: Path,
) -> None:
    path = tmp_path / "j.sqlite"
    count = 3 * _STRETCH
    kept(path, [scan(at_ns=NOW + n * SECOND) for n in range(count)])
    writer = open_writer(path)
    set_meta(writer, rolled_id=count, tallied_id=count)

    def give_up_to(number: int) -> None:
        """The first so many; it takes a few more or fewer."""
        horizon_ns = NOW + number * SECOND
        with transaction(writer):
            while purge_step(writer, Limits(0.0, 10**12), horizon_ns):
                pass

    with closing(writer), closing(open_reader(path)) as reader:
        give_up_to(100)  # long ago
        whole, late, early = (Export(0, END, None, None) for _ in range(3))

        def taken(export: Export, at_least: int) -> int:
            told = 0
            while told < at_least:
                told += len(export.step(reader) or [])
            return told

        taken(late, 1)
        told = taken(whole, 2 * _STRETCH)
        give_up_to(_STRETCH)
        # Who is past it already gets all of it.
        while (found := whole.step(reader)) is not None:
            told += len(found)
        assert told == count - 100
        with pytest.raises(NotRemembered, match="given up while"):
            late.step(reader)
        # And who has not begun begins later.
        left = 0
        while (found := early.step(reader)) is not None:
            left += len(found)
        assert left == count - _STRETCH

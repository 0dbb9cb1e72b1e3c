"""After any history, a log gives the same answers as a plain list of all its rows."""

import math
import sqlite3
from contextlib import closing
from dataclasses import replace
from functools import partial
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_twin.core.past import (
    EVERY_TAG,
    MAX_POINTS,
    Event,
    SeriesRequest,
    WritesRequest,
    recent_of,
)
from lupin_twin.journal.appending import Appender
from lupin_twin.journal.counts import count_rows
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import newest, series
from lupin_twin.journal.runs import runs, span_at
from lupin_twin.journal.schema import SiteLog
from lupin_twin.journal.writes import Export, lots, observed, recent, scans, writes
from tests.support.log_life import BEGUN, LATEST, MINUTE, Life, check, one_run, periods, steps
from tests.twin.journal.conftest import Engines, Living

END = BEGUN + (LATEST + 200) * MINUTE
COUNTED = (Event.SCANS, Event.FAILURES, Event.INSPECTIONS, Event.PESTS_SEEN, Event.PESTS_CLEARED)
Period = tuple[int, int]
_points = st.integers(1, 40)


@given(steps, periods, _points, st.sampled_from([EVERY_TAG, "7"]), st.randoms())
@settings(deadline=None, max_examples=50)
def test_the_answers_are_those_of_a_plain_list_on_either_engine(  # noqa: PLR0917
    living: Living,
    engines: Engines,
    lives: list[tuple[str, Any]],
    period: Period,
    points: int,
    tag_id: str,
    random: Any,
) -> None:
    with living(lives) as life:
        local, archive = engines(life.connection)
        for connection in (local, archive):
            check_events(life, connection, SeriesRequest(tag_id, Event.SCANS, *period, points))
            for sensor in ("temperature", "co2"):
                check_readings(life, connection, SeriesRequest("7", sensor, *period, points))
            check_export(life, connection, period, None if tag_id == EVERY_TAG else tag_id)
        check_writes(local, archive, period[0], random)
        check_counts(life, random)


@given(one_run, periods, _points, st.integers(0, LATEST))
@settings(deadline=None, max_examples=30)
def test_counts_of_deleted_rows_stay(  # noqa: PLR0917
    living: Living,
    engines: Engines,
    lives: list[tuple[str, Any]],
    period: Period,
    points: int,
    minute: int,
) -> None:
    with living(lives) as life:
        readings = life.readings("7", "temperature")
        life.delete(BEGUN + minute * MINUTE)
        for connection in engines(life.connection):
            for event in COUNTED:
                request = SeriesRequest(EVERY_TAG, event, *period, points)
                answer = series(connection, request, END)
                check(answer, request, life.events(EVERY_TAG, event), now_ns=END)
            # A reading that is no number leaves no trace in an hour.
            if all(math.isfinite(value) for *_, value in readings):
                request = SeriesRequest("7", "temperature", *period, points)
                check(series(connection, request, END), request, readings, now_ns=END)


def check_events(life: Life, connection: Any, request: SeriesRequest) -> None:
    tag_id, start_ns, end_ns = request.tag_id, request.start_ns, request.end_ns
    for event in COUNTED:
        request = replace(request, sensor_type=event)
        answer = series(connection, request, END)
        check(answer, request, life.events(tag_id, event), now_ns=END)
    silences = SeriesRequest(tag_id, Event.SILENCES, start_ns, end_ns)
    answer = series(connection, silences, END)
    begun_ns = start_ns or min(life.attempts(tag_id), default=END)
    expected = life.silences(tag_id, begun_ns, end_ns or END + 1, END)
    assert list(zip(answer.stamps_ns, answer.means, strict=True)) == expected


def check_readings(life: Life, connection: Any, request: SeriesRequest) -> None:
    answer = series(connection, request, END)
    check(answer, request, life.readings(request.tag_id, request.sensor_type), now_ns=END)
    ended = replace(request, end_ns=request.end_ns or END, max_points=MAX_POINTS)
    every = series(connection, ended, END)
    readings = zip(every.stamps_ns, every.means, strict=True)
    finite = [(stamp_ns, value) for stamp_ns, value in readings if math.isfinite(value)]
    period = ended.start_ns, ended.end_ns
    found = newest(connection, ended.sensor_type, *period, request.max_points)
    mine = found.get(ended.tag_id, [])
    assert mine == finite[len(finite) - len(mine) :]
    if len(finite) == len(every.means):
        assert len(mine) == min(len(finite), request.max_points)


def check_export(life: Life, connection: Any, period: Period, tag: str | None) -> None:
    start_ns, end_ns = period[0], period[1] or END
    expected = [
        # A value that is no number is null in the log.
        row if math.isfinite(row.value) else replace(row, value=math.nan)
        for row in life.export(start_ns, end_ns, tag)
    ]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("lupin_twin.journal.writes.STRETCH", 64)
        patch.setattr("lupin_twin.journal.writes.LOT", 3)
        export = Export(start_ns, end_ns, tag, None)
        found = [lot for step in iter(partial(export.step, connection), None) for lot in lots(step)]
    assert repr([row for lot in found for row in lot]) == repr(expected)
    assert all(0 < len(lot) <= 3 for lot in found)


def check_writes(local: Any, archive: SiteLog, start_ns: int, random: Any) -> None:
    """Both engines give the same; a query of a period gives that part of all writes."""
    whole = WritesRequest()
    every = writes(local, whole).writes
    end_ns = random.choice([END, *(write.stamp_ns for write in every)])  # at the very end
    sensors = frozenset({"temperature", "co2"})

    def found(log: Any) -> list[Any]:
        return [
            recent(log, end_ns),
            scans(log, start_ns, end_ns, sensors),
            observed(log, start_ns, end_ns).writes,
            writes(log, whole),
            [state_at(log, at_ns, "map") for at_ns in (start_ns, end_ns)],
        ]

    here, there = found(local), found(archive)
    assert repr(there) == repr(here)  # in which no number equals itself
    axis = runs(local.execute)
    by_stamp = sorted(every, key=lambda write: (write.stamp_ns, write.number))
    held = [(write, span_at(axis, write.stamp_ns)) for write in by_stamp]
    last = span_at(axis, end_ns)
    run = [write for write in by_stamp if last and write.run == last.run]
    expected = [
        recent_of(run, end_ns),
        tuple(
            write
            for write in run
            if start_ns <= write.stamp_ns <= end_ns and not sensors.isdisjoint(write.readings)
        ),
        tuple(
            write
            for write, span in held
            if start_ns <= write.stamp_ns < end_ns and span and span.run == write.run
        ),
    ]
    assert repr(here[:3]) == repr(expected)


def check_counts(life: Life, random: Any) -> None:
    """The counts of rows are the same in any order of arrival."""
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as copy:
        life.connection.backup(copy)
        log = SiteLog(copy)
        *here, here_sums = derived(log)
        for table in ("hour", "tally", "event"):
            copy.execute(f"DELETE FROM {table}")
        numbers = list(range(1, 1 + Appender(copy).last_seq))
        random.shuffle(numbers)
        for number in numbers:
            count_rows(log, number - 1, number, {})
        *there, there_sums = derived(log)
    assert there == here
    assert there_sums == pytest.approx(here_sums, rel=1e-12, abs=1e-6)


def derived(log: SiteLog) -> list[list[Any]]:
    """The three tables without sums of readings, and these sums."""
    found = [
        log.execute(f"SELECT {columns} FROM {table} ORDER BY {key}").fetchall()
        for table, columns, key in (
            ("hour", "series, hour, sensor, n, low, high", "series, hour, sensor"),
            ("tally", "*", "run, event, hour"),
            ("event", "*", "run, event, stamp_ns, seq"),
        )
    ]
    totals = log.execute("SELECT total FROM hour ORDER BY series, hour, sensor").fetchall()
    return [*found, [total for (total,) in totals]]

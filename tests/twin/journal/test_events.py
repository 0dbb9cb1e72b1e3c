from __future__ import annotations

from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_twin.journal.events import events
from lupin_twin.journal.rows import Row
from lupin_twin.journal.schema import open_reader
from lupin_twin.journal.series import series
from lupin_twin.past import EVERY_TAG, Event, SeriesPast, SeriesRequest
from tests.support.journal import NOW, SECOND, kept, look, scan
from tests.support.past_reference import check
from tests.support.past_strategy import BEGUN, LATEST, MINUTE, give_up, lived, periods, steps

END = BEGUN + (LATEST + 200) * MINUTE
COUNTED = (
    Event.SCANS,
    Event.FAILURES,
    Event.LOOKS,
    Event.PESTS_SEEN,
    Event.PESTS_CLEARED,
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("events")


numbers = count()


def ask(
    path: Path,
    event: Event,
    tag_id: str = EVERY_TAG,
    *,
    start: int = 0,
    end: int = 0,
    points: int = 500,
    now: int = END,
) -> SeriesPast:
    connection = open_reader(path)
    try:
        return series(connection, SeriesRequest(tag_id, event, start, end, points), now)
    finally:
        connection.close()


def told(answer: SeriesPast) -> list[tuple[int, float]]:
    assert not answer.is_bucketed
    return list(zip(answer.stamps_ns, answer.means, strict=True))


@given(steps, periods, st.integers(1, 30), st.sampled_from([EVERY_TAG, "7"]))
@settings(deadline=None, max_examples=60)
def test_they_are_those_of_a_plain_list(
    folder: Path, life: list[tuple[str, Any]], period: tuple[int, int], points: int, tag_id: str
) -> None:
    with lived(folder / f"{next(numbers)}.sqlite", life) as reference:
        connection = reference.file._connection
        for event in COUNTED:
            request = SeriesRequest(tag_id, event, *period, points)
            answer = events(connection, request, END)
            check(answer, request, reference.events(tag_id, event), now_ns=END)
        request = SeriesRequest(tag_id, Event.SILENCES, *period)
        start_ns = period[0] or min(reference.tries(tag_id), default=END)
        expected = reference.silences(tag_id, start_ns, period[1] or END + 1, END)
        assert told(events(connection, request, END)) == expected


@given(steps, periods, st.integers(1, 30), st.integers(0, LATEST))
@settings(deadline=None, max_examples=40)
def test_those_of_the_house_outlive_scans_that_were_given_up(
    folder: Path, life: list[tuple[str, Any]], period: tuple[int, int], points: int, minute: int
) -> None:
    one_run = [step for step in life if step[0] != "back"]
    with lived(folder / f"{next(numbers)}.sqlite", one_run) as reference:
        give_up(reference, BEGUN + minute * MINUTE)
        for event in COUNTED:
            request = SeriesRequest(EVERY_TAG, event, *period, points)
            answer = events(reference.file._connection, request, END)
            check(answer, request, reference.events(EVERY_TAG, event), now_ns=END)


def test_values_are_those_of_the_contract(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    failed = replace(scan(at_ns=NOW + 1), readings=(), status=2)
    rows: list[Row] = [
        scan(at_ns=NOW, temperature=1.0, co2=2.0),
        failed,
        replace(failed, kind=1, status=1, stamp_ns=NOW + 2),
        look(at_ns=NOW + 3),
        look(at_ns=NOW + 4, anomaly=True),
        look(at_ns=NOW + 5, anomaly=True),
        look(at_ns=NOW + 6),
    ]
    kept(path, rows)
    assert told(ask(path, Event.SCANS)) == [(NOW, 2.0)]
    assert told(ask(path, Event.FAILURES, "7")) == [(NOW + 1, 2.0), (NOW + 2, 1.0)]
    assert [value for _, value in told(ask(path, Event.LOOKS))] == [0.0, 1.0, 1.0, 0.0]
    assert told(ask(path, Event.PESTS_SEEN)) == [(NOW + 4, 1.0)]
    assert told(ask(path, Event.PESTS_CLEARED, "7")) == [(NOW + 6, 0.0)]
    assert told(ask(path, Event.SCANS, "8")) == []


def test_a_look_that_comes_late_changes_what_changed(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [look(at_ns=NOW), look(at_ns=NOW + 2, anomaly=True), look(at_ns=NOW + 4)])
    assert told(ask(path, Event.PESTS_SEEN)) == [(NOW + 2, 1.0)]
    kept(path, [look(at_ns=NOW + 1, anomaly=True)])
    assert told(ask(path, Event.PESTS_SEEN)) == [(NOW + 1, 1.0)]
    kept(path, [look(at_ns=NOW + 3)])
    assert told(ask(path, Event.PESTS_CLEARED)) == [(NOW + 3, 0.0)]


def test_events_without_end_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan(str(n % 3), NOW + n * SECOND) for n in range(100)])
    answer = ask(path, Event.SCANS, start=NOW, end=NOW + 100 * SECOND, points=10)
    assert answer.counts == (10,) * 10
    assert answer.bucket_ns == 10 * SECOND
    assert len(ask(path, Event.SCANS, points=100).stamps_ns) == 100


def test_runs_are_told_as_spans_of_the_period(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with lived(path, [("back", 30)]) as reference:
        reference.write([scan(at_ns=BEGUN + 100 * MINUTE)])
        connection = reference.file._connection

        def runs(start: int, end: int) -> list[tuple[int, float]]:
            return told(events(connection, SeriesRequest(EVERY_TAG, Event.RUNS, start, end), END))

        assert runs(BEGUN, BEGUN + 200 * MINUTE) == [
            (BEGUN, 30 * 60.0),
            (BEGUN + 30 * MINUTE, 170 * 60.0),
        ]
        assert runs(BEGUN + 40 * MINUTE, BEGUN + 50 * MINUTE) == [(BEGUN + 40 * MINUTE, 600.0)]
        answer = events(connection, SeriesRequest(EVERY_TAG, Event.RUNS), END)
        assert answer.minima == answer.maxima == (1.0,)

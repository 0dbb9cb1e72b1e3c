"""The past of a twin elsewhere is that of the same twin here: its own journal, both ways."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_bridge.twin.source import TwinUnavailableError
from lupin_bridge.twin.web_past import WebPast, grids_of
from lupin_twin.convert_past import Entries
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import series
from lupin_twin.journal.schema import open_reader
from lupin_twin.past import HOUR_NS, Event, Grid, PastRefused, SeriesRequest
from tests.support.elsewhere import Elsewhere
from tests.support.journal import kept, scan
from tests.support.log_life import BEGUN, LATEST, MINUTE, TAGS, lived, periods, steps

END = BEGUN + (LATEST + 200) * MINUTE
_numbers = count()
_asked = st.one_of(
    st.tuples(st.sampled_from([*TAGS, "nobody"]), st.sampled_from(["temperature", "co2"])),
    st.tuples(st.sampled_from([*TAGS, "*"]), st.sampled_from(sorted(set(Event) - {Event.RUNS}))),
    st.just(("*", Event.RUNS)),
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("elsewhere")


@given(steps, periods, st.integers(1, 40), _asked)
@settings(max_examples=50)
def test_a_series_is_the_twins_own(
    folder: Path,
    told: list[tuple[str, Any]],
    period: tuple[int, int],
    points: int,
    of: tuple[str, str],
) -> None:
    with lived(folder / f"{next(_numbers)}.sqlite", told) as life:
        connection = life.connection
        request = SeriesRequest(*of, *period, points)
        here = series(connection, request, END)
        there = Elsewhere(connection, END).ask(lambda past: past.series(request))
        assert repr(there) == repr(here)


@given(steps, st.integers(0, LATEST))
@settings(max_examples=20)
def test_a_state_is_the_twins_own(folder: Path, told: list[tuple[str, Any]], minute: int) -> None:
    with lived(folder / f"{next(_numbers)}.sqlite", told) as life:
        connection = life.connection
        at_ns = BEGUN + minute * MINUTE + 1
        there = Elsewhere(connection, END).ask(lambda past: past.state_at(at_ns))
        assert repr(there) == repr(state_at(connection, at_ns, "map"))


# --- one question, and answers that cannot be ---------------------------------------------------


@pytest.fixture
def twin(tmp_path: Path) -> Iterator[Elsewhere]:
    path = tmp_path / "j.sqlite"
    kept(path, [scan("7", BEGUN + n * MINUTE + 5, temperature=float(n)) for n in range(100)])
    connection = open_reader(path)
    yield Elsewhere(connection, END)
    connection.close()


def temperature(start_ns: int = 0, end_ns: int = 0, points: int = 500) -> SeriesRequest:
    return SeriesRequest("7", "temperature", start_ns, end_ns, points)


def test_a_period_without_an_end_ends_now_and_this_very_moment_is_in_it(twin: Elsewhere) -> None:
    past = twin.ask(lambda past: past.series(temperature(BEGUN)))
    assert past.end_ns == END + 1
    assert [request.end.nanosec for request in twin.asked] == [1]


def test_identical_questions_in_flight_are_asked_once(twin: Elsewhere) -> None:
    async def many(past: WebPast) -> int:
        await asyncio.gather(
            *[past.series(temperature(BEGUN)) for _ in range(5)],
            *[past.state_at(BEGUN + MINUTE) for _ in range(5)],
        )
        return len(twin.asked)

    assert twin.ask(many) == 2


def test_a_refusal_is_the_twins_own(twin: Elsewhere) -> None:
    def refuse(response: Any) -> None:
        response.ok, response.error_message = False, "points is 7"

    twin.spoil = refuse
    with pytest.raises(PastRefused, match="points is 7"):
        twin.ask(lambda past: past.series(temperature()))


@pytest.mark.parametrize("spoilt", ["stamps", "lengths", "grid", "far"])
def test_an_answer_that_cannot_be_is_told_and_not_believed(twin: Elsewhere, spoilt: str) -> None:
    def spoil(response: Any) -> None:
        match spoilt:
            case "stamps":
                response.stamps.reverse()
            case "lengths":
                response.means.pop()
            case "grid":
                response.stamps[-1].nanosec += 1
            case "far":
                response.stamps[-1].sec = 2**31 - 1

    twin.spoil = spoil
    with pytest.raises(TwinUnavailableError, match="answer cannot be used"):
        twin.ask(lambda past: past.series(temperature(BEGUN, BEGUN + 100 * MINUTE, 20)))


def test_what_was_deleted_is_known_by_its_hours() -> None:
    hours = (BEGUN, BEGUN + HOUR_NS, BEGUN + 5 * HOUR_NS)
    of = Entries(True, hours, (9, 9, 9), *[(1.0, 1.0, 1.0)] * 3)
    asked = temperature(BEGUN + 7, BEGUN + 6 * HOUR_NS)
    assert grids_of(of, asked.start_ns, asked) == [Grid(BEGUN, BEGUN + 6 * HOUR_NS, HOUR_NS)]
    events = SeriesRequest("7", Event.SCANS, BEGUN, BEGUN + HOUR_NS, 60)
    assert [
        told.bucket_ns for told in grids_of(of._replace(stamps_ns=hours[:1]), BEGUN, events)
    ] == [
        MINUTE,
        HOUR_NS,
    ]
    uneven = of._replace(stamps_ns=(BEGUN, BEGUN + MINUTE))
    assert [told.bucket_ns for told in grids_of(uneven, BEGUN, events)] == [MINUTE]


@pytest.mark.parametrize("minutes", [(0, 0, 0, 61), (0, 0, 0, 15), (0, 0, 30, 60, 60, 60)])
def test_buckets_that_only_happen_to_begin_with_an_hour_are_told_apart(
    tmp_path: Path, minutes: tuple[int, ...]
) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan("7", BEGUN + m * MINUTE + n, co2=float(n)) for n, m in enumerate(minutes)])
    connection = open_reader(path)
    try:
        for points in (1, 2, 3):
            request = SeriesRequest("7", "co2", BEGUN, BEGUN + 62 * MINUTE, points)
            here = series(connection, request, END)
            assert Elsewhere(connection, END).ask(lambda past, r=request: past.series(r)) == here  # type: ignore[misc]
    finally:
        connection.close()


def test_nothing_finite_in_buckets_is_a_period_all_the_same(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan("7", BEGUN + n * MINUTE, temperature=math.nan) for n in range(9)])
    connection = open_reader(path)
    try:
        request = temperature(BEGUN, BEGUN + 9 * MINUTE, 3)
        here = series(connection, request, END)
        assert (here.is_bucketed, here.stamps_ns) == (True, ())
        assert Elsewhere(connection, END).ask(lambda past: past.series(request)) == here
    finally:
        connection.close()

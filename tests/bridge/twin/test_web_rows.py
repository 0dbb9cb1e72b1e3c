"""The rows of a twin elsewhere are those of its own export, as far as its answers tell them."""

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
from lupin_msgs.srv import GetHistory

from lupin_bridge.twin import web_rows
from lupin_bridge.twin.source import TwinUnavailableError
from lupin_bridge.twin.web_past import WebPast
from lupin_bridge.twin.web_twin import MAX_REQUESTS
from lupin_twin.journal.export import rows
from lupin_twin.journal.schema import open_reader
from lupin_twin.past import HOUR_NS, MAX_POINTS, NotRemembered, PastRow
from tests.support.elsewhere import Elsewhere, gathered
from tests.support.journal import NOW, SECOND, kept, pin, scan
from tests.support.log_life import BEGUN, LATEST, MINUTE, lived, steps

END = BEGUN + (LATEST + 200) * MINUTE
_numbers = count()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("rows")


def as_told(row: PastRow) -> PastRow:
    """A row of the twin's own, as far as its answers tell it."""
    return replace(row, source="", status=row.status if not row.sensor else 0)


def placeless(row: PastRow) -> PastRow:
    return replace(row, x=math.nan, y=math.nan)


def there(twin: Elsewhere, *asked: Any) -> list[PastRow]:
    lots = twin.ask(lambda past: gathered(web_rows.rows(past, *asked)))
    assert all(0 < len(lot) <= web_rows.LOT for lot in lots)
    return [row for lot in lots for row in lot]


@given(
    steps,
    st.tuples(st.integers(0, LATEST), st.integers(0, LATEST + 300)),
    st.sampled_from([None, "7"]),
    st.sampled_from([None, "co2"]),
)
@settings(max_examples=40)
def test_they_are_those_of_the_twins_own_export(
    folder: Path,
    told: list[tuple[str, Any]],
    period: tuple[int, int],
    tag_id: str | None,
    sensor_type: str | None,
) -> None:
    start_ns, end_ns = (BEGUN + minute * MINUTE for minute in sorted(period))
    asked = (start_ns, end_ns, tag_id, sensor_type)
    with lived(folder / f"{next(_numbers)}.sqlite", told) as life:
        connection = life.connection
        here = [as_told(row) for lot in rows(connection, *asked) for row in lot]
        found = there(Elsewhere(connection, END), *asked)
    assert [row.stamp_ns for row in found] == [row.stamp_ns for row in here]
    if any(kind == "back" for kind, _ in told):
        # Of a place that was learnt behind its run's stretch of the axis no answer tells.
        found, here = [placeless(row) for row in found], [placeless(row) for row in here]
    assert sorted(map(repr, found)) == sorted(map(repr, here))


def test_windows_that_hold_too_much_are_cut_and_nothing_is_told_twice(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    number = MAX_POINTS + 1_000
    kept(
        path,
        [
            pin("7", NOW),
            *(scan("7", NOW + at * SECOND // 5, temperature=float(at)) for at in range(number)),
            scan("8", NOW + 400 * 24 * 3_600 * SECOND, temperature=1.0),
        ],
    )
    end_ns = NOW + 500 * 24 * 3_600 * SECOND
    connection = open_reader(path)
    try:
        twin = Elsewhere(connection, end_ns)
        found = there(twin, 0, end_ns, None, None)
    finally:
        connection.close()
    assert [row.value for row in found] == [*map(float, range(number)), 1.0]
    assert found[0].x == 1.5
    assert len(twin.asked) < 60, "a year without a reading is one step"


def test_questions_are_few_and_some_are_on_their_way_at_once(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    tags, days = 5, 20
    kept(
        path,
        [
            scan(f"{tag}", NOW + at * HOUR_NS, temperature=float(at), co2=float(tag))
            for at in range(24 * days)
            for tag in range(tags)
        ],
    )
    end_ns = NOW + 24 * days * HOUR_NS
    connection = open_reader(path)
    try:
        twin = Elsewhere(connection, end_ns)
        found = there(twin, 0, end_ns, None, None)
    finally:
        connection.close()
    assert len(found) == tags * days * 24 * 2
    assert [row.stamp_ns for row in found] == sorted(row.stamp_ns for row in found)
    # Each of three series of a tag in each window, of which there are few.
    assert len(twin.asked) < 5 * tags * 3
    assert twin.most_at_once == web_rows.AT_ONCE == MAX_REQUESTS - 1


def test_more_at_one_moment_than_can_be_held_ends_it_aloud(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan(f"{n}", NOW, temperature=float(n)) for n in range(5)])
    connection = open_reader(path)
    try:
        monkeypatch.setattr(web_rows, "MAX_ROWS", 5)
        asked = (0, NOW + SECOND, None, None)
        assert len(there(Elsewhere(connection, NOW + SECOND), *asked)) == 5
        monkeypatch.setattr(web_rows, "MAX_ROWS", 4)
        with pytest.raises(TwinUnavailableError, match=r"or 4 in all, within 1000 ns from"):
            there(Elsewhere(connection, NOW + SECOND), *asked)
    finally:
        connection.close()


def test_what_is_given_up_meanwhile_breaks_it_off_and_only_if_it_was_to_come(
    tmp_path: Path,
) -> None:
    path = tmp_path / "j.sqlite"
    number, hour = 3_000, 60  # a minute each
    end_ns = BEGUN + number * MINUTE

    with lived(path, []) as life, closing(open_reader(path)) as reader:

        def give_up_to(first: int) -> None:
            life.delete(BEGUN + first * MINUTE)

        async def told(past: WebPast, until: int, first: int) -> list[float]:
            """The values; as so many are there, those before `first` are given up."""
            found: list[float] = []
            async for lot in web_rows.rows(past, 0, end_ns, None, None):
                found += [row.value for row in lot]
                if found and len(found) >= until:
                    give_up_to(first)
                    until = number
            return found

        life.write([scan(at_ns=BEGUN + n * MINUTE, temperature=float(n)) for n in range(number)])
        twin = Elsewhere(reader, end_ns)
        give_up_to(10)  # long ago
        begun = int(twin.ask(lambda past: told(past, number, 0))[0])
        whole = [float(n) for n in range(begun, number)]
        # Who is past it already gets all of it.
        assert twin.ask(lambda past: told(past, 5 * hour, 2 * hour)) == whole
        with pytest.raises(NotRemembered, match="given up while") as caught:
            twin.ask(lambda past: told(past, 1, 20 * hour))
        assert not caught.value.is_lasting

        # And who has not told anything yet begins later.
        def goes(response: Any) -> None:
            if isinstance(response, GetHistory.Response) and response.maxima:
                give_up_to(30 * hour)

        twin.spoil = goes
        late = twin.ask(lambda past: told(past, number, 0))
        assert 20 * hour < late[0]
        assert late == whole[-len(late) :]

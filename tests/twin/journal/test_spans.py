from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count, pairwise
from pathlib import Path
from sqlite3 import Connection

import pytest
from hypothesis import given, settings

from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import open_reader
from lupin_twin.journal.spans import FOREVER_NS, Span, span_at, spans, spans_within
from tests.support.journal import opened, scan
from tests.support.replay import Heard, Step, steps

_numbers = count()


@contextmanager
def reader(path: Path) -> Iterator[Connection]:
    connection = open_reader(path)
    try:
        yield connection
    finally:
        connection.close()


def sim(at_ns: int) -> Clock:
    return Clock(at_ns, at_ns, is_simulated=True)


def bounds(found: tuple[Span, ...]) -> list[tuple[int, int, int]]:
    return [(span.run.id, span.start_ns, span.end_ns) for span in found]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("spans")


def test_without_a_run_there_is_no_span(tmp_path: Path) -> None:
    with opened(tmp_path / "j.sqlite"):
        pass
    with reader(tmp_path / "j.sqlite") as connection:
        assert spans(connection) == ()
        assert span_at(connection, 5) is None


def test_a_run_that_a_damaged_file_has_end_before_it_begins_is_there(tmp_path: Path) -> None:
    with opened(tmp_path / "j.sqlite") as file:
        run = file.first_run(sim(100))
        file._connection.execute("UPDATE run SET ended_stamp_ns = 5")
    with reader(tmp_path / "j.sqlite") as connection:
        assert spans(connection) == (Span(run, 0, FOREVER_NS),)


def test_one_run_has_all_of_the_axis(tmp_path: Path) -> None:
    with opened(tmp_path / "j.sqlite") as file:
        run = file.first_run(sim(100))
    with reader(tmp_path / "j.sqlite") as connection:
        assert spans(connection) == (Span(run, 0, FOREVER_NS),)
        assert span_at(connection, -1) is None
        assert span_at(connection, 0) == span_at(connection, 10**18) == Span(run, 0, FOREVER_NS)


def test_the_newest_run_has_what_several_hold_and_the_earlier_what_none_does(
    tmp_path: Path,
) -> None:
    with opened(tmp_path / "j.sqlite") as file:
        first = file.first_run(sim(100))
        second = file.next_run(first, sim(10), 200)
        third = file.next_run(second, sim(150), 160)
        file.next_run(third, sim(500), 170)
    with reader(tmp_path / "j.sqlite") as connection:
        assert bounds(spans(connection)) == [
            (2, 0, 150),
            (3, 150, 171),
            (1, 171, 500),
            (4, 500, FOREVER_NS),
        ]
        assert bounds(spans_within(connection, 150, 171)) == [(3, 150, 171)]
        assert bounds(spans_within(connection, 149, 172)) == [
            (2, 149, 150),
            (3, 150, 171),
            (1, 171, 172),
        ]
        assert spans_within(connection, 5, 5) == ()


def test_a_run_whose_end_nobody_saw_ended_with_the_last_that_was_heard(tmp_path: Path) -> None:
    with opened(tmp_path / "j.sqlite") as file:
        run = file.first_run(sim(100))
        file.append([(run, scan(at_ns=400)), (run, scan(at_ns=300))])
        file.first_run(sim(10))
    with reader(tmp_path / "j.sqlite") as connection:
        assert connection.execute("SELECT ended_stamp_ns FROM run").fetchall() == [(400,), (None,)]


def test_a_run_that_goes_on_after_another_has_no_end(tmp_path: Path) -> None:
    wall = Clock(10**18, 10**18, is_simulated=False)
    with opened(tmp_path / "j.sqlite") as file:
        file.first_run(wall)
        file.first_run(sim(10))
        file.first_run(wall)
    with reader(tmp_path / "j.sqlite") as connection:
        assert bounds(spans(connection)) == [(2, 0, 10**18), (1, 10**18, FOREVER_NS)]


@settings(max_examples=60, deadline=None)
@given(steps=steps)
def test_each_moment_has_the_span_of_the_newest_run_that_holds_it(
    folder: Path, steps: list[Step]
) -> None:
    path = folder / f"{next(_numbers)}.sqlite"
    with opened(path) as file:
        heard = Heard(file, steps)
    with reader(path) as connection:
        every = spans(connection)
        assert (every[0].start_ns, every[-1].end_ns) == (0, FOREVER_NS)
        assert all(one.end_ns == other.start_ns for one, other in pairwise(every))
        assert all(one.run != other.run for one, other in pairwise(every))
        for at_ns in heard.moments:
            span = span_at(connection, at_ns)
            assert span is not None
            assert span.run == heard.holder(at_ns).run

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np

from lupin_twin.journal.fixed import _MOST_KEPT, places_of, tag_ids_of
from lupin_twin.journal.schema import Kept, open_reader
from lupin_twin.journal.spans import FOREVER_NS
from tests.support.journal import NOW, kept, opened, pin, scan


def test_ids_of_tags_are_found_by_their_numbers(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan("b"), scan("ä"), scan("a")])
    with closing(open_reader(path)) as connection:
        assert tag_ids_of(connection, np.array([1, 2, 3, 4])) == ["b", "ä", "a", ""]
        assert tag_ids_of(connection, np.array([3])) == ["a"]
        kept(path, [scan("new")])
        assert tag_ids_of(connection, np.array([1, 2, 3, 4])) == ["b", "ä", "a", "new"]
        assert tag_ids_of(connection, np.array([], dtype=np.int64)) == []


def test_nothing_has_no_places_and_no_ids(tmp_path: Path) -> None:
    with opened(tmp_path / "j.sqlite"):
        pass
    with closing(open_reader(tmp_path / "j.sqlite")) as connection:
        assert places_of(connection, 1, FOREVER_NS).tags.tolist() == []
        assert tag_ids_of(connection, np.array([1])) == [""]


def test_a_reader_keeps_places_and_knows_those_that_come(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [pin("1"), pin("2", NOW + 5, x=9.0)])
    with closing(open_reader(path)) as connection:
        asked: list[str] = []
        first = places_of(connection, 1, FOREVER_NS)
        assert first.poses == [pin("1").pose, pin("2", x=9.0).pose]
        connection.set_trace_callback(asked.append)
        assert places_of(connection, 1, NOW).tags.tolist() == [1]
        assert places_of(connection, 1, NOW - 1).poses == []
        assert places_of(connection, 1, FOREVER_NS) is first
        assert not [sql for sql in asked if "pose" in sql]
        kept(path, [pin("3", NOW + 7)])
        more = places_of(connection, 1, FOREVER_NS)
        assert more.tags.tolist() == [1, 2, 3]
        assert more.poses[0] is first.poses[0], "what was known is not read again"
        assert more.poses[2] == pin("3").pose
        assert places_of(connection, 1, NOW + 6).tags.tolist() == [1, 2]
        # Of many runs it keeps the last few.
        for run in range(2, 3 * _MOST_KEPT):
            assert places_of(connection, run, FOREVER_NS).poses == []
            assert len(connection.kept) <= _MOST_KEPT


def test_what_one_reader_found_the_others_of_the_file_know(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [pin("1"), scan("2")])
    shared: Kept = {}
    with closing(open_reader(path, kept=shared)) as one:
        found = places_of(one, 1, FOREVER_NS)
        assert tag_ids_of(one, np.array([1, 2])) == ["1", "2"]
    with closing(open_reader(path, kept=shared)) as other, closing(open_reader(path)) as alone:
        assert places_of(other, 1, FOREVER_NS) is found
        assert places_of(alone, 1, FOREVER_NS) is not found
        # One that still sees a moment before has what was known then, and the other what is now.
        other.execute("BEGIN")
        assert tag_ids_of(other, np.array([1, 2, 3])) == ["1", "2", ""]
        kept(path, [pin("3"), scan("4")])
        for _ in range(2):
            assert places_of(alone, 1, FOREVER_NS).tags.tolist() == [1, 3]
            with closing(open_reader(path, kept=shared)) as third:
                assert places_of(third, 1, FOREVER_NS).tags.tolist() == [1, 3]
                assert tag_ids_of(third, np.array([1, 2, 3])) == ["1", "2", "3"]
            assert places_of(other, 1, FOREVER_NS).tags.tolist() == [1]
            assert tag_ids_of(other, np.array([1, 2, 3])) == ["1", "2", ""]


def test_what_was_purged_is_known_no_more(tmp_path: Path) -> None:
    """Though as many rows came as went, or more."""
    path = tmp_path / "j.sqlite"
    kept(path, [pin("1"), pin("2"), pin("3")])
    with closing(open_reader(path)) as connection:
        assert places_of(connection, 1, FOREVER_NS).tags.tolist() == [1, 2, 3]
        for gone, added in ((1, ["4"]), (2, ["5", "6"]), (3, [])):
            with closing(sqlite3.connect(path)) as writer, writer:
                writer.execute("DELETE FROM pin WHERE tag = ?", (gone,))
            kept(path, [pin(tag_id) for tag_id in added])
            is_there = "SELECT tag FROM pin ORDER BY tag"
            there = [tag for (tag,) in connection.execute(is_there)]
            assert gone not in there
            assert sorted(places_of(connection, 1, FOREVER_NS).tags.tolist()) == there

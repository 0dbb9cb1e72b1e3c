"""Chunks put in the order of time, within a bound on memory; and an index that lies."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.records import ChunkIndex
from mcap.writer import Writer

from lupin_bridge.bags.in_order import Asked, in_order

TIMES = [(5, 9, 7), (6, 2, 8), (20, 21, 20)]


@pytest.fixture
def chunks(tmp_path: Path) -> tuple[Path, list[ChunkIndex]]:
    """A file with a chunk of each of these times, and its index."""
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("a", "ros2msg", b"")
        one, other = (writer.register_channel(name, "cdr", schema) for name in ("/a", "/b"))
        for times in TIMES:
            for time_ns in times:
                writer.add_message(one, time_ns, b"%d" % time_ns, 0)
            writer.add_message(other, times[0], b"other", 0)
            writer.flush()  # type: ignore[no-untyped-call]
        writer.finish()  # type: ignore[no-untyped-call]
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    return path, list(summary.chunk_indexes)


def times_of(
    chunks: tuple[Path, list[ChunkIndex]], asked: Asked, *, newest_first: bool = False
) -> list[int]:
    with chunks[0].open("rb") as file:
        found = list(in_order(file, chunks[1], asked, newest_first=newest_first))
    assert all(it.data == b"%d" % it.log_ns for it in found)
    return [it.log_ns for it in found]


def test_chunks_that_overlap_are_in_order(chunks: tuple[Path, list[ChunkIndex]]) -> None:
    everything = [2, 5, 6, 7, 8, 9, 20, 20, 21]
    assert times_of(chunks, Asked({1})) == everything
    assert times_of(chunks, Asked({1}), newest_first=True) == everything[::-1]
    assert times_of(chunks, Asked({1}, from_ns=6, before_ns=20)) == [6, 7, 8, 9]
    assert times_of(chunks, Asked({1}, from_ns=6, before_ns=9)) == [6, 7, 8]
    assert times_of(chunks, Asked({9})) == []


def test_no_more_is_open_at_once_than_may_be(chunks: tuple[Path, list[ChunkIndex]]) -> None:
    path, indexes = chunks
    with path.open("rb") as file:
        # The first two chunks overlap, the third one stands alone.
        assert len(list(in_order(file, indexes, Asked({1}), max_open=1_900))) == 9
        with pytest.raises(ValueError, match="more than 1,500 bytes of it would have to be in mem"):
            list(in_order(file, indexes, Asked({1}), max_open=1_500))


def test_an_index_that_points_elsewhere_is_damage(chunks: tuple[Path, list[ChunkIndex]]) -> None:
    path, indexes = chunks
    indexes[1].chunk_start_offset += 1
    with pytest.raises(ValueError, match="is a chunk, which is not so"):
        times_of((path, indexes), Asked({1}))

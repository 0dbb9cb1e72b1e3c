from __future__ import annotations

import os
from pathlib import Path

import pytest

from lupin_bridge.bags import rotation
from lupin_bridge.bags.rotation import Limits, Recording
from tests.support.bags import CLOCK, MAP, OBSERVATIONS, TOPICS, is_open, no_file_above, read


def finished(recording: Recording) -> list[list[bytes]]:
    """What is in each file, in its order."""
    recording.finish()
    return [[data for *_, data in read(path)] for path in recording.paths]


def test_a_file_is_followed_when_it_is_old_enough_and_not_a_moment_before(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    recording = Recording(path, TOPICS, Limits(max_s=10.0), now_s=100.0)
    assert recording.rotate_if_due(0, 110.0) is None, "nothing is in it"
    recording.write(CLOCK, 1, 1, b"a")
    assert recording.rotate_if_due(2, 109.999) is None
    assert recording.rotate_if_due(2, 110.0) == tmp_path / "a_1.mcap"
    recording.write(CLOCK, 2, 2, b"b")
    assert recording.rotate_if_due(3, 119.999) is None
    assert recording.rotate_if_due(3, 120.0) == tmp_path / "a_2.mcap"
    assert finished(recording) == [[b"a"], [b"b"], []]


def test_a_file_is_followed_when_it_is_large_enough(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "a.mcap", TOPICS, Limits(max_bytes=30_000), now_s=0.0)
    sizes = []
    for number in range(40):
        size = recording.size
        if recording.rotate_if_due(number, float(number)):
            sizes.append(size)
        recording.write(CLOCK, number, number, os.urandom(2_000))
        recording.flush()
    assert len(sizes) >= 2
    assert all(30_000 <= size < 33_000 for size in sizes)
    assert sum(map(len, finished(recording))) == 40


def test_a_file_is_large_enough_at_its_limit_and_not_a_byte_before(tmp_path: Path) -> None:
    def follows(name: str, limit: int) -> tuple[int, bool]:
        recording = Recording(tmp_path / name, TOPICS, Limits(max_bytes=limit), now_s=0.0)
        recording.write(CLOCK, 1, 1, b"a")
        recording.flush()
        size, follows = recording.size, recording.rotate_if_due(2, 1.0) is not None
        recording.finish()
        assert not any(is_open(path) for path in recording.paths)
        return size, follows

    size, _ = follows("a.mcap", 0)
    assert follows("b.mcap", size) == (size, True)
    assert follows("c.mcap", size + 1) == (size, False)


def test_what_the_disk_does_not_take_of_a_finished_file_is_not_lost(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "a.mcap", TOPICS, Limits(max_s=1.0), now_s=0.0)
    data = os.urandom(100_000)
    recording.write(CLOCK, 1, 1, data)
    assert recording.rotate_if_due(2, 1.0)
    recording.write(CLOCK, 2, 2, b"b")
    with no_file_above(50_000):
        for _ in range(2):
            with pytest.raises(OSError, match="File too large"):
                recording.flush()
            assert recording.waiting > 50_000
    recording.flush()
    assert recording.waiting == 0
    assert not is_open(recording.paths[0])
    assert finished(recording) == [[data], [b"b"]]


def test_each_file_stands_alone(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "a.mcap", TOPICS, Limits(max_s=1.0), now_s=0.0)
    for number in range(5):
        recording.write(OBSERVATIONS, number, number, b"o%d" % number)
    recording.write(MAP, 5, 5, b"m5")
    recording.write(MAP, 6, 6, b"m6")
    recording.write(CLOCK, 7, 7, b"c7")
    assert recording.rotate_if_due(100, 1.0)
    recording.write(OBSERVATIONS, 100, 99, b"new")
    recording.finish()
    # What a late subscriber gets of each, by when it was published, and nothing of the clock.
    assert read(recording.paths[1]) == [
        ("/floranova/observations", 100, 2, b"o2"),
        ("/floranova/observations", 100, 3, b"o3"),
        ("/floranova/observations", 100, 4, b"o4"),
        ("/map", 100, 6, b"m6"),
        ("/floranova/observations", 100, 99, b"new"),
    ]
    assert recording.counts == [6, 2, 1], "what is repeated was recorded once"


def test_of_large_ones_fewer_are_kept_and_the_newest_always(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rotation, "MAX_REPEATED", 10)
    recording = Recording(tmp_path / "a.mcap", TOPICS, Limits(max_s=1.0), now_s=0.0)
    for data in (b"aaaaa", b"bbbbb", b"ccccc"):
        recording.write(OBSERVATIONS, 1, 1, data)
    recording.write(MAP, 2, 2, b"longer than the limit")
    assert recording.rotate_if_due(3, 1.0)
    assert finished(recording)[1] == [b"bbbbb", b"ccccc", b"longer than the limit"]


def test_somebody_elses_file_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "a_1.mcap").write_bytes(b"mine")
    recording = Recording(tmp_path / "a.mcap", TOPICS, Limits(max_s=1.0), now_s=0.0)
    recording.write(CLOCK, 1, 1, b"a")
    assert recording.rotate_if_due(2, 1.0) == tmp_path / "a_2.mcap"
    recording.finish()
    assert (tmp_path / "a_1.mcap").read_bytes() == b"mine"


def test_where_no_next_file_can_be_made_this_one_goes_on(tmp_path: Path) -> None:
    folder = tmp_path / "here"
    folder.mkdir()
    recording = Recording(folder / "a.mcap", TOPICS, Limits(max_s=1.0), now_s=0.0)
    recording.write(CLOCK, 1, 1, b"a")
    folder.rename(tmp_path / "gone")
    with pytest.raises(FileNotFoundError):
        recording.rotate_if_due(2, 1.0)
    recording.write(CLOCK, 2, 2, b"b")
    assert recording.rotate_if_due(3, 1.999) is None, "not tried again for a while"
    (tmp_path / "gone").rename(folder)
    assert recording.rotate_if_due(3, 2.0) == folder / "a_1.mcap"
    recording.write(CLOCK, 3, 3, b"c")
    assert finished(recording) == [[b"a", b"b"], [b"c"]]

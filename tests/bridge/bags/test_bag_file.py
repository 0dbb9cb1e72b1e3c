from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer

from lupin_bridge.bags.bag_file import BagFile
from lupin_bridge.bags.topics import Topic
from tests.support.bags import CLOCK, MAP, OBSERVATIONS, TOPICS, is_open, read, read_unfinished


def test_what_was_written_is_read_again_by_others(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    file = BagFile(path, TOPICS)
    file.write(OBSERVATIONS, 20, 10, b"one")
    file.flush()
    file.write(CLOCK, 21, 21, b"two")
    file.write(MAP, 22, 5, b"three")
    file.finish()
    file.flush_rest()
    assert is_open(path)
    file.close()
    assert not is_open(path)
    assert read(path) == [
        ("/floranova/observations", 20, 10, b"one"),
        ("/clock", 21, 21, b"two"),
        ("/map", 22, 5, b"three"),
    ]
    with path.open("rb") as opened:
        reader = make_reader(opened)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
    assert summary is not None
    for topic, channel in zip(TOPICS, summary.channels.values(), strict=True):
        schema = summary.schemas[channel.schema_id]
        assert (channel.topic, schema.name) == (topic.name, topic.type_name)
        assert (channel.message_encoding, schema.encoding) == ("cdr", "ros2msg")
        assert channel.metadata == {"offered_qos_profiles": topic.offered_qos}


def test_what_was_flushed_is_in_the_file_and_nothing_else_has_to_follow(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    file = BagFile(path, TOPICS)
    for number in range(3):
        file.write(OBSERVATIONS, number, number, b"%d" % number)
        file.flush()
        assert [data for *_, data in read_unfinished(path)] == [b"0", b"1", b"2"][: number + 1]
        assert (path.stat().st_size, file.waiting) == (file.size, 0)
    file.close()


def test_a_disk_that_has_not_kept_it_is_told_and_the_file_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fdatasync(_: int) -> None:
        raise OSError(errno.EIO, "Input/output error")

    file = BagFile(tmp_path / "a.mcap", TOPICS)
    monkeypatch.setattr(os, "fdatasync", fdatasync)
    with pytest.raises(OSError, match="Input/output error"):
        file.close()
    assert not is_open(file.path)


def test_it_is_gone_once_it_is_removed_or_its_name_another_s(tmp_path: Path) -> None:
    path, moved, other = (tmp_path / name for name in ("a.mcap", "b.mcap", "other"))
    other.write_bytes(b"somebody else's")
    file = BagFile(path, TOPICS)
    gone = [file.is_gone]
    path.rename(moved)  # it is written on there
    gone.append(file.is_gone)
    path.symlink_to(moved)
    gone.append(file.is_gone)
    path.unlink()
    moved.unlink()
    gone.append(file.is_gone)
    os.link(other, path)
    gone.append(file.is_gone)
    file.close()
    assert gone == [False, False, False, True, True]


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(b"mine")
    with pytest.raises(FileExistsError):
        BagFile(path, TOPICS)
    assert path.read_bytes() == b"mine"


def test_of_a_type_that_is_not_installed_no_file_is_made(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with pytest.raises(LookupError, match="gone_msgs/msg/Gone"):
        BagFile(path, [Topic("/gone", "gone_msgs/msg/Gone")])
    assert not path.exists()


def test_a_file_that_cannot_be_begun_is_closed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> int:
        raise MemoryError

    monkeypatch.setattr(Writer, "register_channel", fail)
    with pytest.raises(MemoryError):
        BagFile(tmp_path / "a.mcap", TOPICS)
    assert not is_open(tmp_path / "a.mcap")

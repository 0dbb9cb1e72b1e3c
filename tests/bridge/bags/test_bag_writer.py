from __future__ import annotations

import errno
import math
import os
import sys
import threading
import time
from pathlib import Path

import pytest

from lupin_bridge.bags import bag_writer
from lupin_bridge.bags.bag_writer import BagWriter, Heard
from lupin_bridge.bags.rotation import Limits, Recording
from lupin_bridge.telling import say
from tests.support.bags import CLOCK, OBSERVATIONS, TOPICS, no_file_above, read, read_unfinished
from tests.support.waiting import wait_for

NEVER = Limits()
NAMES = [topic.name for topic in TOPICS]


@pytest.fixture(autouse=True)
def _said_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """However long a test takes: no summary comes in between, and no complaint again."""
    monkeypatch.setattr(bag_writer, "TELL_S", math.inf)
    monkeypatch.setattr(bag_writer, "COMPLAIN_S", math.inf)


def writer_of(
    path: Path, said: list[str], limits: Limits = NEVER, max_queued: int = 10_000_000
) -> BagWriter:
    """A writer that has not started yet."""
    recording = Recording(path, TOPICS, limits, time.monotonic())
    return BagWriter(recording, NAMES, said.append, max_queued=max_queued)


def test_what_was_heard_is_in_the_file_soon_and_the_file_is_finished_at_the_end(
    tmp_path: Path,
) -> None:
    path, said = tmp_path / "a.mcap", list[str]()
    writer = writer_of(path, said)
    writer.start()
    for number in range(100):
        writer.put(Heard(OBSERVATIONS, number, number, b"%d" % number))
    wait_for(lambda: len(read_unfinished(path)) == 100, "all of it in the file")
    writer.put(Heard(CLOCK, 100, 100, b"last"))
    writer.end()
    assert [data for *_, data in read(path)][-2:] == [b"99", b"last"]
    assert (writer.lost, writer.is_whole, said) == (0, True, [])
    assert writer.summary() == ("101 messages (/floranova/observations 100, /map 0, /clock 1)")


def test_what_there_is_no_room_for_is_counted_and_told(tmp_path: Path) -> None:
    path, said = tmp_path / "a.mcap", list[str]()
    writer = writer_of(path, said, max_queued=2 * (200 + 1_000))
    for _ in range(3):
        writer.put(Heard(CLOCK, 1, 1, bytes(1_000)))
    writer.lose(4)
    writer.start()
    writer.end()
    assert len(read(path)) == 2
    assert writer.lost == 5
    assert said == ["5 messages lost so far: they come too fast"]
    assert writer.summary().endswith("; 5 lost")


def test_what_is_too_large_is_told_by_its_name_and_no_more_than_that(tmp_path: Path) -> None:
    path, said = tmp_path / "a.mcap", list[str]()
    writer = writer_of(path, said, max_queued=200_000)
    writer.put(Heard(CLOCK, 1, 1, bytes(200_000 - 199)))
    writer.put(Heard(CLOCK, 2, 2, bytes(200_000 - 200)))
    writer.start()
    writer.end()
    assert [log_ns for _, log_ns, *_ in read(path)] == [2]
    (line,) = said
    assert line.startswith("1 messages left out so far, too large for a recording, the last one of")
    assert line.endswith("/clock: 0.2 MB, 0.2 MB is the limit")
    assert writer.lost == 1


def test_a_disk_that_has_room_again_gets_all_of_it(tmp_path: Path) -> None:
    path, said = tmp_path / "a.mcap", list[str]()
    writer = writer_of(path, said)
    sent = [os.urandom(100_000) for _ in range(30)]
    with no_file_above(1_000_000):
        for data in sent:
            writer.put(Heard(CLOCK, 1, 1, data))
        writer.start()
        wait_for(lambda: said, "a complaint")
        assert f"cannot write {path}: File too large" in said[0]
        assert "2." in said[0].partition(";")[2], "so many MB wait"
    wait_for(lambda: "takes what is written again" in "".join(said), "the end of it")
    writer.end()
    assert [data for *_, data in read(path)] == sent
    assert (writer.lost, writer.is_whole) == (0, True)


def test_a_disk_that_stays_full_hangs_nothing_and_says_how_it_is_mended(tmp_path: Path) -> None:
    path, said = tmp_path / "a run.mcap", list[str]()
    writer = writer_of(path, said)
    with no_file_above(1_000_000):
        writer.start()
        writer.put(Heard(CLOCK, 1, 1, b"whole"))
        wait_for(lambda: read_unfinished(path), "the first message")
        for _ in range(30):
            writer.put(Heard(CLOCK, 1, 1, os.urandom(100_000)))
        writer.end()
    assert not writer.is_whole
    assert said[-1].startswith(f"{path} is not finished: File too large")
    assert said[-1].endswith(f"lupin-twin mcap recover '{path}'")
    assert read_unfinished(path)[0][3] == b"whole"


def test_while_the_disk_is_full_only_so_much_waits(tmp_path: Path) -> None:
    said = list[str]()
    recording = Recording(tmp_path / "a.mcap", TOPICS, NEVER, 0.0)
    writer = BagWriter(recording, NAMES, said.append, max_queued=250_000, max_waiting=100_000)
    with no_file_above(1_000_000):
        writer.start()

        def lost() -> int:
            writer.put(Heard(CLOCK, 1, 1, os.urandom(100_000)))
            return writer.lost if "cannot write" in "".join(said) else 0

        before = wait_for(lost, "a full disk")
        wait_for(lambda: lost() > before + 40, "many to be lost")
        assert 0 < recording.waiting < 400_000
    writer.end()
    assert writer.is_whole
    assert any("messages lost so far" in line for line in said)


def test_a_thread_that_fails_says_so_and_is_not_waited_for(tmp_path: Path) -> None:
    class Broken(Recording):
        def write(self, *_: object) -> None:
            raise RuntimeError("a fault")

    said, failures = list[str](), list[bool]()
    recording = Broken(tmp_path / "a.mcap", TOPICS, NEVER, 0.0)
    writer = BagWriter(recording, NAMES, said.append, lambda: failures.append(True))
    writer.start()
    writer.put(Heard(CLOCK, 1, 1, b"x"))
    wait_for(lambda: failures, "the failure")
    writer.end()
    assert not writer.is_whole
    assert said == ["recording has failed: RuntimeError('a fault')"]


def test_a_thread_that_fails_where_nothing_can_be_said_is_not_waited_for(tmp_path: Path) -> None:
    class Broken(Recording):
        def write(self, *_: object) -> None:
            raise RuntimeError("a fault")

    class Unheard(Exception):
        pass

    def say(_: str) -> None:
        raise Unheard

    ended = threading.Event()
    recording = Broken(tmp_path / "a.mcap", TOPICS, NEVER, 0.0)
    writer = BagWriter(recording, NAMES, say, ended.set)
    writer.put(Heard(CLOCK, 1, 1, b"x"))
    with pytest.raises(Unheard):  # as it would in its thread
        writer._run()
    assert ended.is_set()
    assert not writer.is_whole


def test_what_is_heard_is_written_when_nobody_can_be_told_any_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As by `2>&1 | tee log` whose tee was killed."""
    monkeypatch.setattr(bag_writer, "TELL_S", 0.0)
    path, failures = tmp_path / "a.mcap", list[bool]()
    reader, pipe = os.pipe()
    with os.fdopen(pipe, "w") as stderr:
        monkeypatch.setattr(sys, "stderr", stderr)
        recording = Recording(path, TOPICS, NEVER, time.monotonic())
        writer = BagWriter(recording, NAMES, say, lambda: failures.append(True))
        writer.start()
        writer.put(Heard(CLOCK, 0, 0, b"0"))
        wait_for(lambda: b"1 messages" in os.read(reader, 1000), "its first line")
        os.close(reader)
        for number in range(1, 4):
            writer.put(Heard(CLOCK, number, number, b"%d" % number))
            wait_for(lambda: len(read_unfinished(path)) > number, "it in the file")  # noqa: B023
        writer.end()
    assert [data for *_, data in read(path)] == [b"0", b"1", b"2", b"3"]
    assert (writer.is_whole, failures) == (True, [])


def test_the_next_file_is_told(tmp_path: Path) -> None:
    path, said = tmp_path / "a.mcap", list[str]()
    writer = writer_of(path, said, Limits(max_s=1e-6))
    writer.start()
    for number in range(2):
        writer.put(Heard(CLOCK, number, number, b"x"))
    writer.end()
    assert said == [f"recording goes on in {tmp_path / 'a_1.mcap'}"]
    assert len(read(tmp_path / "a_1.mcap")) == 1


def test_a_file_that_was_removed_is_told_and_followed_by_another(tmp_path: Path) -> None:
    path, said = tmp_path / "a.mcap", list[str]()
    writer = writer_of(path, said)
    writer.start()
    writer.put(Heard(OBSERVATIONS, 1, 1, b"gone"))
    wait_for(lambda: len(read_unfinished(path)) == 1, "it in the file")
    path.unlink()
    wait_for(lambda: bool(said), "the loss told")
    writer.put(Heard(OBSERVATIONS, 2, 2, b"here"))
    writer.end()
    assert said == [
        f"{path} was removed, and what was in it is lost",
        f"recording goes on in {tmp_path}/a_1.mcap",
    ]
    # What is latched comes once more.
    assert [data for *_, data in read(tmp_path / "a_1.mcap")] == [b"gone", b"here"]
    assert not writer.is_whole


def test_a_file_that_another_has_replaced_is_told_and_followed_by_another(tmp_path: Path) -> None:
    """As by `mcap recover a.mcap && mv a_recovered.mcap a.mcap` while it is written."""
    path, other, said = tmp_path / "a.mcap", tmp_path / "other", list[str]()
    other.write_bytes(b"somebody else's")
    writer = writer_of(path, said)
    writer.start()
    writer.put(Heard(CLOCK, 1, 1, b"before"))
    wait_for(lambda: len(read_unfinished(path)) == 1, "it in the file")
    other.rename(path)
    wait_for(lambda: bool(said), "the loss told")
    writer.put(Heard(CLOCK, 2, 2, b"behind"))
    writer.end()
    assert said == [
        (
            f"{path} is another file now: what was recorded into it is lost, unless that has "
            "another name"
        ),
        f"recording goes on in {tmp_path}/a_1.mcap",
    ]
    assert [data for *_, data in read(tmp_path / "a_1.mcap")] == [b"behind"]
    assert path.read_bytes() == b"somebody else's"
    assert not writer.is_whole


def test_what_the_disk_has_not_kept_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, said = tmp_path / "a.mcap", list[str]()
    writer = writer_of(path, said)

    def fail(_: int) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with monkeypatch.context() as broken:
        broken.setattr(os, "fdatasync", fail)
        writer.start()
        wait_for(lambda: said, "the failure")
    writer.end()
    assert set(said) == {"the disk has not kept what it took: Input/output error"}
    assert not writer.is_whole


def test_where_no_next_file_can_be_begun_it_is_told_and_tried_again(tmp_path: Path) -> None:
    folder = tmp_path / "gone"
    folder.mkdir()
    said = list[str]()
    writer = writer_of(folder / "a.mcap", said)
    writer.start()
    writer.put(Heard(CLOCK, 1, 1, b"lost"))
    wait_for(lambda: read_unfinished(folder / "a.mcap"), "it in the file")
    (folder / "a.mcap").unlink()
    folder.rmdir()
    wait_for(lambda: said, "the loss told")
    writer.put(Heard(CLOCK, 2, 2, b"between"))
    wait_for(lambda: len(said) > 1, "that there is no folder")
    folder.mkdir()

    def goes_on() -> bool:
        writer.put(Heard(CLOCK, 3, 3, b"here"))
        return "goes on" in said[-1]

    wait_for(goes_on, "the next file")
    writer.end()
    assert said[1] == "no next file can be begun: No such file or directory"
    assert said[-1] == f"recording goes on in {folder}/a_1.mcap"
    assert {data for *_, data in read(folder / "a_1.mcap")} == {b"here"}


def test_a_complaint_is_not_repeated_at_once(tmp_path: Path) -> None:
    said = list[str]()
    writer = writer_of(tmp_path / "a.mcap", said)
    for what, text in (("disk", "full"), ("disk", "still full"), ("sync", "failed")):
        writer._complain(what, text)
    assert said == ["full", "failed"]
    writer.start()
    writer.end()

"""Several files as one recording: in the order of time, each message once, few of them open."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from lupin_bridge.bags import rotation
from lupin_bridge.bags.recording import Recorded, Recording, RecordingError
from lupin_bridge.bags.recordings import Recordings
from lupin_bridge.bags.rotation import Limits
from tests.support.bags import CLOCK, MAP, OBSERVATIONS, TOPICS, is_open
from tests.support.messages import discovered, pose, scan
from tests.support.recordings import OBSERVATIONS as SCANS
from tests.support.recordings import TAGS, Sent, write_bag

ALL = {topic.name for topic in TOPICS}
KEPT = TOPICS[OBSERVATIONS].latched
assert KEPT == 3


def rotated(folder: Path, count: int, *, each: int) -> tuple[list[Path], list[bytes]]:
    """A recording with a new file after so many messages; its paths, and what was heard."""
    writer = rotation.Recording(folder / "a.mcap", TOPICS, Limits(max_s=each), now_s=1.0)
    chance = random.Random(count)
    heard = []
    for at in range(1, count + 1):
        writer.rotate_if_due(10 * at, float(at))
        topic = chance.choice([OBSERVATIONS, OBSERVATIONS, MAP, CLOCK])
        heard.append(b"%d" % (at // 2))  # many times the same, told apart by their moments
        writer.write(topic, 10 * at, 10 * at - 1, heard[-1])
    writer.finish()
    return writer.paths, heard


def data(messages: Sequence[Recorded]) -> list[bytes]:
    return [message.data for message in messages]


@pytest.mark.parametrize("each", [1, 5])
def test_what_a_recorder_repeats_comes_once_and_all_in_its_order(tmp_path: Path, each: int) -> None:
    paths, heard = rotated(tmp_path, 24, each=each)
    assert len(paths) == -(-24 // each)
    with Recordings(paths[::-1]) as named:
        assert data(list(named.messages(ALL))) == heard
    with Recordings([tmp_path]) as whole:
        assert data(list(whole.messages(ALL))) == heard
        assert (whole.start_ns, whole.end_ns, whole.file_count) == (10, 240, len(paths))
        for from_ns in range(10, 240, 35):
            before = list(whole.messages(ALL, before_ns=from_ns))
            since = list(whole.messages(ALL, from_ns=from_ns))
            assert data([*before, *since]) == heard
            # A recorder repeats it with a later moment than it had.
            of_map = [it.data for it in before if it.topic == "/map"]
            last = whole.last_before("/map", from_ns)
            assert (last.data if last else None) == (of_map[-1] if of_map else None)
        assert sum(is_open(path) for path in paths) <= 3
    assert not any(is_open(path) for path in paths)


def test_where_nothing_comes_again_little_is_looked_through(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the file before, what came a minute before at most."""
    writer = rotation.Recording(tmp_path / "a.mcap", TOPICS[CLOCK:], Limits(max_s=1.0), now_s=0.0)
    times = range(10**9, 301 * 10**9, 10**9)
    for at_ns in times:
        if at_ns == times[-1]:
            writer.rotate_if_due(at_ns, 1.0)
        writer.write(0, at_ns, at_ns - 1, b"")
    writer.finish()
    looked = 0
    newest_first = Recording.newest_first

    def counting(self: Recording, topic: str, most: int) -> Iterator[Recorded]:
        nonlocal looked
        for message in newest_first(self, topic, most):
            looked += 1
            yield message

    monkeypatch.setattr(Recording, "newest_first", counting)
    with Recordings(writer.paths) as recording:
        assert [it.log_ns for it in recording.messages({"/clock"})] == list(times)
        assert recording.file_count == 2
    assert looked == 61


def test_files_that_overlap_are_in_the_order_of_time(tmp_path: Path) -> None:
    times = [(1.0, 4.0, 9.0), (2.0, 3.0), (3.0, 8.0), (9.0, 9.5)]
    for number, at in enumerate(times):
        sent = [Sent(SCANS, it, scan(f"{number}")) for it in at]
        write_bag(tmp_path / f"{number}.mcap", sent)
    with Recordings([tmp_path]) as recording:
        found = [it.log_ns / 1e9 for it in recording.messages({SCANS})]
        assert found == sorted(it for at in times for it in at)
        for moment in (2.0, 3.5, 8.5, 9.25, 10.0):
            last = recording.last_before(SCANS, round(moment * 1e9))
            assert last is not None
            assert last.log_ns / 1e9 == max(it for it in found if it < moment)
        assert recording.last_before(SCANS, 10**9) is None


def test_one_recording_has_the_topics_of_all_and_one_start(tmp_path: Path) -> None:
    files = [tmp_path / "a.mcap", tmp_path / "b.mcap", tmp_path / "just begun.mcap"]
    write_bag(files[1], [Sent(SCANS, 10.0, scan("1")), Sent(SCANS, 20.0, scan("1"))])
    write_bag(files[0], [Sent(TAGS, 40.0, discovered({"7": pose()})), Sent(SCANS, 35.0, scan("1"))])
    write_bag(files[2], [])
    with Recordings(files) as recording:
        assert recording.name == f"{files[0]} and 2 more"
        assert {it.name: it.count for it in recording.topics} == {SCANS: 3, TAGS: 1}
        assert (recording.file_count, recording.duration_s) == (2, 30.0)
        recording.check_start(30.0)
        with pytest.raises(
            RecordingError, match=r"--start is 30\.001, must be at most 30\.000, the seconds that "
        ):
            recording.check_start(30.001)
    with pytest.raises(RecordingError, match=r"just begun\.mcap has no messages"):
        Recordings(files[2:])


def test_the_file_that_is_wrong_is_named(tmp_path: Path) -> None:
    files = [tmp_path / f"{name}.mcap" for name in "abc"]
    for number, file in enumerate(files):
        write_bag(file, [Sent(SCANS, 1.0 + number, scan("1"))], is_finished=number != 1)
    with pytest.raises(RecordingError, match=r"b\.mcap was not finished"):
        Recordings([tmp_path])
    write_bag(files[1], [Sent(SCANS, 2.0, discovered({}))])
    with pytest.raises(RecordingError, match=r"b\.mcap has /floranova/observations as lupin_msgs/"):
        Recordings([tmp_path])
    write_bag(files[1], [Sent(SCANS, 2.0, scan("1"))])
    with Recordings([tmp_path]) as recording:
        following = recording.messages({SCANS})
        next(following)
        files[2].unlink()  # of which it knows, and has not got it open
        with pytest.raises(RecordingError, match=r"cannot read .*c\.mcap: No such file"):
            list(following)

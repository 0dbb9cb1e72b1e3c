"""A recording as it is read: what is in it, and what is wrong with it."""

from __future__ import annotations

import os
import random
import re
from functools import partial
from pathlib import Path

import pytest
from mcap.writer import CompressionType, Writer

from lupin_bridge.bags import chunks
from lupin_bridge.bags import recording as module
from lupin_bridge.bags.in_order import in_order
from lupin_bridge.bags.recording import Recording, RecordingError, Topic, clock_ns
from lupin_bridge.bags.recordings import Recordings
from tests.support.messages import discovered, pose, scan
from tests.support.recordings import LATCHED, OBSERVATIONS, TAGS, Sent, write_bag

SENT = [
    *(Sent(OBSERVATIONS, 10.0 + it, scan(f"tag {it}", {"co2": float(it)})) for it in range(200)),
    Sent(TAGS, 215.5, discovered({"7": pose()})),
]


def moments(recording: Recording, *topics: str, **between: int) -> list[float]:
    return [it.log_ns / 1e9 for it in recording.messages(set(topics), **between)]


@pytest.mark.parametrize("is_chunked", [True, False])
@pytest.mark.parametrize("compression", list(CompressionType))
def test_what_is_in_it(tmp_path: Path, is_chunked: bool, compression: CompressionType) -> None:
    path = write_bag(tmp_path / "a.mcap", SENT, is_chunked=is_chunked, compression=compression)
    with Recording(path) as recording:
        assert (recording.start_ns, recording.end_ns) == (10_000_000_000, 215_500_000_000)
        assert not recording.has_clock
        [scans, tags] = recording.topics
        assert (scans.name, scans.type_name) == (OBSERVATIONS, "lupin_msgs/msg/Observation")
        assert (scans.encoding, scans.count, scans.offered_qos) == ("cdr", 200, LATCHED)
        assert (tags.name, tags.count) == (TAGS, 1)
        assert moments(recording, OBSERVATIONS) == [10.0 + it for it in range(200)]
        ten_s = 10**10
        assert moments(recording, OBSERVATIONS, from_ns=2 * ten_s, before_ns=22 * 10**9) == [20, 21]
        assert moments(recording, TAGS) == [215.5]
        last = recording.last_before(OBSERVATIONS, 3 * ten_s)
        assert last is not None
        assert last.log_ns == 29 * 10**9
        assert recording.last_before(TAGS, 3 * ten_s) is None


def test_messages_come_in_the_order_of_time(tmp_path: Path) -> None:
    with Recording(write_bag(tmp_path / "a.mcap", reversed(SENT))) as recording:
        assert moments(recording, OBSERVATIONS) == [10.0 + it for it in range(200)]


@pytest.mark.parametrize("is_chunked", [True, False])
def test_who_reads_elsewhere_in_it_meanwhile_is_in_nobodys_way(
    tmp_path: Path, is_chunked: bool
) -> None:
    with Recording(write_bag(tmp_path / "a.mcap", SENT, is_chunked=is_chunked)) as recording:
        times = []
        for message in recording.messages({OBSERVATIONS}, from_ns=206 * 10**9):
            times.append(message.log_ns / 1e9)
            last = recording.last_before(OBSERVATIONS, message.log_ns)
            assert last is not None
            assert last.log_ns / 1e9 == times[-1] - 1.0
        assert times == [206.0, 207.0, 208.0, 209.0]


def refused(path: Path) -> str:
    """Why a file cannot be read, all of it."""
    with pytest.raises(RecordingError) as error, Recording(path) as recording:
        list(recording.messages({OBSERVATIONS, TAGS}))
    return str(error.value)


def test_a_topic_of_two_channels_is_one_with_all_that_was_told_of_it(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2", "test")
        schema = writer.register_schema("a_msgs/msg/A", "ros2msg", b"")
        for at_ns, qos in enumerate(("first", "second")):
            key = {"offered_qos_profiles": qos}
            writer.add_message(writer.register_channel("/a", "cdr", schema, key), at_ns, b"", 0)
        writer.finish()  # type: ignore[no-untyped-call]
    with Recording(path) as recording:
        assert recording.topics == (Topic("/a", "a_msgs/msg/A", "cdr", 2, "first\nsecond"),)


def test_a_clock_that_told_no_time_is_none(tmp_path: Path) -> None:
    """As a recorder offers it that found no simulation."""
    for count, has_clock in ((0, False), (1, True)):
        path = tmp_path / f"{count}.mcap"
        with path.open("wb") as file:
            writer = Writer(file)
            writer.start("ros2", "test")
            schema = writer.register_schema("rosgraph_msgs/msg/Clock", "ros2msg", b"")
            clock = writer.register_channel("/clock", "cdr", schema)
            writer.add_message(writer.register_channel("/a", "cdr", schema), 1, b"", 1)
            for _ in range(count):
                writer.add_message(clock, 1, b"", 1)
            writer.finish()  # type: ignore[no-untyped-call]
        with Recording(path) as recording:
            assert recording.has_clock is has_clock
        with Recordings([path]) as recordings:
            assert recordings.has_clock is has_clock


@pytest.mark.parametrize("is_chunked", [True, False])
def test_what_is_longer_than_any_message_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_chunked: bool
) -> None:
    path = write_bag(tmp_path / "a.mcap", SENT, is_chunked=is_chunked)
    monkeypatch.setattr(module, "MAX_CHUNK", 100)
    assert "is broken (" in refused(path)


def test_what_is_too_large_is_not_called_broken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_bag(tmp_path / "a.mcap", SENT)

    def assert_says(why: str) -> None:
        said = refused(path)
        assert re.match(f"cannot read {path}: {why}; .* mcap compress --chunk-size", said), said

    with monkeypatch.context() as patch:
        patch.setattr(module, "in_order", partial(in_order, max_open=100))
        assert_says(
            "to be in the order of time, more than 100 bytes of it would have to be in memory"
        )
    monkeypatch.setattr(chunks, "MAX_CHUNK", 100)
    assert_says(r"a chunk has [\d,]+ bytes, must be at most 100")


def test_what_is_no_recording_is_said_to_be_none(tmp_path: Path) -> None:
    assert (
        refused(tmp_path / "no.mcap")
        == f"cannot read {tmp_path}/no.mcap: No such file or directory"
    )
    (tmp_path / "db3").write_bytes(b"SQLite format 3\0")
    assert refused(tmp_path / "db3") == f"{tmp_path}/db3 is no MCAP file"
    (tmp_path / "empty").touch()
    assert refused(tmp_path / "empty") == f"{tmp_path}/empty is no MCAP file"
    assert refused(tmp_path) == f"{tmp_path} is no file"
    os.mkfifo(tmp_path / "pipe")
    assert refused(tmp_path / "pipe") == f"{tmp_path}/pipe is no file"
    assert refused(write_bag(tmp_path / "b.mcap", [])) == f"{tmp_path}/b.mcap has no messages"


def test_a_broken_one_is_sent_to_be_mended(tmp_path: Path) -> None:
    path = tmp_path / "a run.mcap"
    whole = write_bag(path, SENT).read_bytes()
    footer = len(whole) - 8 - 20
    path.write_bytes(whole[:footer] + bytes(8) + whole[footer + 8 :])
    assert refused(path) == (
        f"{path} is broken (it has no index): what is whole of it is written anew by "
        f"lupin-twin mcap recover '{path}'"
    )


def test_one_that_was_not_finished_is_said_to_be_no_more_than_that(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a run.mcap", SENT, is_finished=False)
    said = (
        f"{path} was not finished (its recorder was killed, or is still at work): what is whole "
        f"of it is written anew by lupin-twin mcap recover '{path}'"
    )
    assert refused(path) == said
    whole = write_bag(path, SENT).read_bytes()
    for cut in (8, 10, 15, 16, 100, len(whole) // 2, len(whole) - 4, len(whole) - 1):
        path.write_bytes(whole[:cut])
        assert refused(path) == said


def test_whatever_is_flipped_is_a_refusal_or_a_recording(tmp_path: Path) -> None:
    whole = write_bag(tmp_path / "a.mcap", SENT).read_bytes()
    chance = random.Random(1)
    seen = set()
    for _ in range(150):
        broken = bytearray(whole)
        for _ in range(4):
            broken[chance.randrange(8, len(whole))] ^= 1 << chance.randrange(8)
        (tmp_path / "b.mcap").write_bytes(broken)
        try:
            with Recording(tmp_path / "b.mcap") as recording:
                seen.add(len(list(recording.messages({OBSERVATIONS}))))
        except RecordingError:
            seen.add(-1)
    assert -1 in seen


def test_the_time_out_of_its_bytes() -> None:
    assert clock_ns(bytes([0, 1, 0, 0, 7, 0, 0, 0, 5, 0, 0, 0])) == 7_000_000_005
    assert clock_ns(bytes([0, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 5])) == 7_000_000_005
    for nonsense in (b"", b"\0", bytes([0, 1, 0, 0, 7]), bytes([0, 9] + [0] * 10)):
        assert clock_ns(nonsense) is None

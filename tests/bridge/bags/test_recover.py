from __future__ import annotations

import random
import re
from pathlib import Path

import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from lupin_bridge.bags import chunks
from lupin_bridge.bags.bag_file import BagFile
from lupin_bridge.bags.chunks import RECORD
from lupin_bridge.bags.recover import Saved, recover
from tests.support.bags import (
    CLOCK,
    MAP,
    OBSERVATIONS,
    TOPICS,
    Entry,
    no_file_above,
    read,
    read_by_mcap,
)

A_CHUNK = 3
CHUNKS = 6


def recorded(path: Path, *, is_finished: bool = True) -> list[Entry]:
    """A recording of some chunks, or what a killed recorder leaves of it; returns its messages."""
    chance = random.Random(7)
    file = BagFile(path, TOPICS)
    sent: list[Entry] = []
    for number in range(CHUNKS * A_CHUNK):
        topic = (OBSERVATIONS, MAP, CLOCK)[number % 3]
        data = b"%d " % number + chance.randbytes(40)
        file.write(topic, 100 + number, 50 + number, data)
        sent.append((TOPICS[topic].name, 100 + number, 50 + number, data))
        if number % A_CHUNK == A_CHUNK - 1:
            file.flush()
    if is_finished:
        file.finish()
        file.flush_rest()
    file.close()
    return sent


def recovered(source: Path, content: bytes) -> tuple[Saved, list[Entry]]:
    """What comes out of a file with this content, which is not touched."""
    target = source.with_name("out.mcap")
    source.write_bytes(content)
    saved = recover(source, target)
    assert source.read_bytes() == content
    if not saved.messages:
        assert not target.exists()
        return saved, []
    found = read_by_mcap(target)
    assert saved.messages == len(found)
    target.unlink()
    return saved, found


def test_of_a_whole_file_nothing_is_lost(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    sent = recorded(path)
    saved, found = recovered(path, path.read_bytes())
    assert found == sent == read(path)
    assert (saved.lost, saved.is_finished) == ([], True)
    assert saved.counts == {topic.name: CHUNKS for topic in TOPICS}
    assert (saved.first_ns, saved.last_ns) == (100, 100 + CHUNKS * A_CHUNK - 1)


def test_of_an_unfinished_one_neither_and_it_says_so(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    sent = recorded(path, is_finished=False)
    saved, found = recovered(path, path.read_bytes())
    assert found == sent
    assert (saved.lost, saved.is_finished) == (["it was not finished: it has no end"], False)
    # It tells how its topics were published, as the source did.
    recover(path, tmp_path / "b.mcap")
    with (tmp_path / "b.mcap").open("rb") as file:
        reader = make_reader(file)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
    assert summary is not None
    assert {channel.topic: channel.metadata for channel in summary.channels.values()} == {
        topic.name: {"offered_qos_profiles": topic.offered_qos} for topic in TOPICS
    }


def test_the_earliest_and_the_latest_are_told_in_whatever_order_they_came(tmp_path: Path) -> None:
    file = BagFile(tmp_path / "a.mcap", TOPICS)
    for log_ns in (20, 30, 10):
        file.write(CLOCK, log_ns, 1, b"")
    file.finish()
    file.flush_rest()
    file.close()
    saved = recover(file.path, tmp_path / "b.mcap")
    assert (saved.first_ns, saved.last_ns) == (10, 30)


def test_a_message_fewer_than_the_index_counts_is_told(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2", "another")
        channel = writer.register_channel("/a", "cdr", 0)
        writer.add_message(channel, 1, b"content", 1)
        writer._Writer__statistics.message_count += 1  # type: ignore[attr-defined]
        writer.finish()  # type: ignore[no-untyped-call]
    saved, _ = recovered(path, path.read_bytes())
    assert saved.lost == ["1 messages fewer are saved than its index counts"]


def test_where_the_disk_is_full_no_part_is_left(tmp_path: Path) -> None:
    path, target = tmp_path / "a.mcap", tmp_path / "b.mcap"
    recorded(path)
    with no_file_above(500), pytest.raises(OSError, match="File too large"):
        recover(path, target)
    assert not target.exists()


def test_wherever_it_is_cut_off_all_before_is_saved(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    sent = recorded(path)
    whole = path.read_bytes()
    ends = chunk_ends(path)
    for cut in range(0, len(whole), 59):
        saved, found = recovered(path, whole[:cut])
        assert found == sent[: len(found)]
        assert len(found) >= A_CHUNK * sum(end <= cut for end in ends)
        assert saved.lost


def chunk_ends(path: Path) -> list[int]:
    """Where the chunks of a file end, as its index says."""
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    return [c.chunk_start_offset + c.chunk_length for c in summary.chunk_indexes]


def test_a_byte_that_was_flipped_costs_its_chunk_at_most(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    sent = recorded(path)
    whole = path.read_bytes()
    for at in range(0, len(whole), 47):
        damaged = bytearray(whole)
        damaged[at] ^= 0xFF
        saved, found = recovered(path, bytes(damaged))
        assert [entry for entry in sent if entry in found] == found
        missing = len(sent) - len(found)
        assert missing in (0, A_CHUNK), f"byte {at}: {saved.lost}"
        assert saved.lost or not missing


def test_an_index_that_would_reach_over_chunks_costs_no_message(tmp_path: Path) -> None:
    sent = recorded(tmp_path / "a.mcap", is_finished=False)
    content = bytearray((tmp_path / "a.mcap").read_bytes())
    at = 8
    while content[at] != Opcode.MESSAGE_INDEX:
        _, length = RECORD.unpack_from(content, at)
        at += RECORD.size + length
    content[at + 2] += 2  # 512 bytes more
    _, found = recovered(tmp_path / "b.mcap", bytes(content))
    assert found == sent


def test_without_the_definitions_messages_mean_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    recorded(path, is_finished=False)
    damaged = bytearray(path.read_bytes())
    damaged[200] ^= 0xFF  # in the first chunk, which has them
    saved, found = recovered(path, bytes(damaged))
    assert not found
    assert any("cannot be read: the check of a chunk does" in line for line in saved.lost)
    assert f"of what topic {(CHUNKS - 1) * A_CHUNK} messages are is lost" in "".join(saved.lost)


def test_a_chunk_that_is_larger_than_any_may_be_is_told_with_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent = recorded(tmp_path / "a.mcap")
    content = (tmp_path / "a.mcap").read_bytes()
    monkeypatch.setattr(chunks, "MAX_CHUNK", 1_000)
    saved, found = recovered(tmp_path / "b.mcap", content)
    assert found == sent[A_CHUNK:], "the first chunk has the definitions, too"
    assert re.search(
        r" cannot be read: a chunk has [\d,]+ bytes, must be at most 1,000", saved.lost[0]
    )


@pytest.mark.parametrize(
    ("compression", "is_chunked"),
    [
        (CompressionType.ZSTD, True),
        (CompressionType.NONE, True),
        (CompressionType.LZ4, True),
        (CompressionType.NONE, False),
    ],
)
def test_other_recorders_files_too(
    tmp_path: Path, compression: CompressionType, is_chunked: bool
) -> None:
    path = tmp_path / "a.mcap"
    data = [random.Random(number).randbytes(50_000) for number in range(10)]
    with path.open("wb") as file:
        writer = Writer(file, compression=compression, use_chunking=is_chunked)
        writer.start("ros2", "another")
        writer.add_metadata("about", {"of": "it"})
        writer.add_attachment(1, 2, "note", "text/plain", b"hello")
        schema = writer.register_schema("a_msgs/msg/A", "ros2msg", b"uint8 x")
        channel = writer.register_channel("/a", "cdr", schema, {"k": "v"})
        for number, content in enumerate(data):
            writer.add_message(channel, number, content, number, sequence=number + 5)
        writer.finish()  # type: ignore[no-untyped-call]
    whole = path.read_bytes()
    target = tmp_path / "out.mcap"
    assert recover(path, target).lost == []
    with target.open("rb") as file:
        reader = make_reader(file)
        assert [m.data for *_, m in reader.iter_messages()] == data
        assert [m.sequence for *_, m in reader.iter_messages()] == list(range(5, 15))
        assert [(m.name, m.metadata) for m in reader.iter_metadata()] == [("about", {"of": "it"})]
        assert [(a.name, a.data) for a in reader.iter_attachments()] == [("note", b"hello")]
    target.unlink()
    path.write_bytes(whole[:300_000])  # within the only chunk
    assert recover(path, target).messages > 2


def test_a_message_of_its_own_that_is_none_costs_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file, use_chunking=False)
        writer.start("ros2", "another")
        schema = writer.register_schema("a_msgs/msg/A", "ros2msg", b"uint8 x")
        channel = writer.register_channel("/a", "cdr", schema)
        for number in range(3):
            writer.add_message(channel, number, b"content", number)
        writer.finish()  # type: ignore[no-untyped-call]
    whole = path.read_bytes()
    at = whole.index(b"content") - 31  # the first message's record
    damaged = whole[:at] + b"\x05" + (3).to_bytes(8, "little") + b"..." + whole[at:]
    saved, found = recovered(path, damaged)
    assert (saved.lost, len(found)) == ([f"a message of 3 bytes at byte {at} is damaged"], 3)


@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r\n", b"no recording at all" * 50])
def test_of_what_is_none_no_file_is_left(tmp_path: Path, content: bytes) -> None:
    saved, found = recovered(tmp_path / "a.mcap", content)
    assert (saved.messages, found) == (0, [])
    assert saved.lost


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    recorded(path)
    whole = path.read_bytes()
    with pytest.raises(FileExistsError):
        recover(path, path)
    assert path.read_bytes() == whole

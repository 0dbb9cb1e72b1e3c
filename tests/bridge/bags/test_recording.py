"""Which files and folders are played, and how the others are refused with a remedy."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.writer import CompressionType

from lupin_bridge.bags.recording import Recording, RecordingError
from tests.support.messages import discovered, occupancy_grid, pose, scan
from tests.support.recordings import OBSERVATIONS, TAGS, Sent, write_bag


def sent(*at_s: float) -> list[Sent]:
    return [Sent(OBSERVATIONS, at, scan(f"tag {at}")) for at in at_s]


def times(*paths: Path) -> list[int]:
    with Recording(paths) as recording:
        return [it.log_ns // 10**9 for it in recording.messages([OBSERVATIONS])]


@pytest.mark.parametrize("compression", list(CompressionType))
def test_files_and_folders_are_played_as_one_recording_in_the_order_of_time(
    tmp_path: Path, compression: CompressionType
) -> None:
    """Overlapping ones too, with every compression that a recorder supports."""
    folder = tmp_path / "part"
    folder.mkdir()
    write_bag(folder / "b.mcap", sent(2, 5, 6), compression=compression)
    write_bag(folder / "a.mcap", sent(9, 1, 8), compression=compression)
    other = write_bag(tmp_path / "c.mcap", sent(4, 7, 3), compression=compression)
    assert times(folder, other) == [1, 2, 3, 4, 5, 6, 7, 8, 9]
    with Recording([folder, other]) as recording:
        assert (recording.start_ns, recording.end_ns) == (10**9, 9 * 10**9)
        part = recording.messages([OBSERVATIONS], from_ns=3 * 10**9, before_ns=5 * 10**9)
        assert [it.log_ns // 10**9 for it in part] == [3, 4]


def test_a_file_without_chunks_or_without_messages_is_read(tmp_path: Path) -> None:
    plain = write_bag(tmp_path / "plain.mcap", sent(1, 2), is_chunked=False)
    assert times(plain, write_bag(tmp_path / "empty.mcap", [])) == [1, 2]


def test_of_several_grids_only_maps_are_played(tmp_path: Path) -> None:
    grid = occupancy_grid([[0]])
    names = ["/costmap", "/gh1/map", "/local_costmap"]
    path = write_bag(tmp_path / "a.mcap", [*sent(1), *(Sent(name, 1, grid) for name in names)])
    with Recording([path]) as recording:
        assert recording.inputs.keys() == {OBSERVATIONS, "/gh1/map"}


def unfinished(path: Path) -> Path:
    return write_bag(path, sent(1, 2), is_finished=False)


def cut_off(path: Path) -> Path:
    os.truncate(write_bag(path, sent(*range(100))), 2_000)
    return path


def foreign(path: Path) -> Path:
    path.write_bytes(b"not a recording" * 100)
    return path


@pytest.mark.parametrize("make", [unfinished, cut_off, foreign])
def test_an_unreadable_file_is_named_with_the_command_that_repairs_it(
    tmp_path: Path, make: Callable[[Path], Path]
) -> None:
    path = make(tmp_path / "bad.mcap")
    with pytest.raises(RecordingError, match=rf"cannot read {path}: .*mcap recover {path}"):
        Recording([path])


def test_a_flipped_byte_is_reported_where_it_is(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.mcap", sent(*range(200)), compression=CompressionType.NONE)
    data = bytearray(path.read_bytes())
    at = data.index(b"tag 150")
    data[at] ^= 1
    path.write_bytes(data)
    with Recording([path]) as recording:
        messages = recording.messages([OBSERVATIONS])
        next(messages)
        with pytest.raises(RecordingError, match="cannot read"):
            list(messages)


@pytest.mark.parametrize(
    ("messages", "why"),
    [
        ([], "has no messages"),
        ([Sent("/map", 1, occupancy_grid([[0]]))], "has nothing that a twin subscribes to"),
    ],
)
def test_a_message_of_no_use_is_refused(tmp_path: Path, messages: list[Sent], why: str) -> None:
    path = write_bag(tmp_path / "a.mcap", messages)
    with pytest.raises(RecordingError, match=why), Recording([path]) as recording:
        _ = recording.inputs


def test_a_file_that_is_no_recording_is_refused(tmp_path: Path) -> None:
    one = write_bag(tmp_path / "b.mcap", sent(1))
    json = write_bag(tmp_path / "a.mcap", sent(1), encoding="json")
    tags = write_bag(tmp_path / "c.mcap", [Sent(OBSERVATIONS, 1, discovered({"a": pose(1, 2)}))])
    folder, fifo = tmp_path / "folder", tmp_path / "fifo"
    folder.mkdir()
    os.mkfifo(fifo)
    for paths, why in (
        ([json], "encoded as 'json', must be 'cdr'"),
        ([one, tags], "they are not parts of one recording"),
        ([tmp_path / "none.mcap"], "No such file"),
        ([folder], "is a folder without a .mcap file"),
        ([fifo], "is not a file"),
    ):
        with pytest.raises(RecordingError, match=why):
            Recording(paths)


def test_a_start_after_the_end_is_refused(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.mcap", [*sent(10, 12), Sent(TAGS, 11, discovered({}))])
    with Recording([path]) as recording:
        recording.check_start(2.0)
        with pytest.raises(RecordingError, match=r"--start is 2.5 s, and .* has 2.0 s"):
            recording.check_start(2.5)

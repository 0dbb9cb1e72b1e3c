"""Which recordings are played, how others are refused, and what the page shows of them."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from builtin_interfaces.msg import Time
from mcap.writer import CompressionType
from rosgraph_msgs.msg import Clock

from lupin_bridge.bags.recording import Recording, RecordingError
from tests.support.messages import occupancy_grid, scan
from tests.support.processes import Process, children_of, is_running, lupin_twin, twin_node, url_of
from tests.support.recordings import OBSERVATIONS, Sent, write_bag
from tests.support.web import Listener, listener, tag_ids


def sent(*at_s: float) -> list[Sent]:
    return [Sent(OBSERVATIONS, at, scan(f"tag {at}")) for at in at_s]


def times(path: Path) -> list[int]:
    with Recording(path) as recording:
        return [it.log_ns // 10**9 for it in recording.messages([OBSERVATIONS])]


@pytest.mark.parametrize("compression", list(CompressionType))
def test_a_folder_is_played_as_one_recording_in_the_order_of_time(
    tmp_path: Path, compression: CompressionType
) -> None:
    """Overlapping files too, with every compression that a recorder supports."""
    write_bag(tmp_path / "b.mcap", sent(2, 5, 6), compression=compression)
    write_bag(tmp_path / "a.mcap", sent(9, 1, 8), compression=compression)
    write_bag(tmp_path / "c.mcap", sent(4, 7, 3), compression=compression)
    assert times(tmp_path) == [1, 2, 3, 4, 5, 6, 7, 8, 9]
    with Recording(tmp_path) as recording:
        assert (recording.start_ns, recording.end_ns) == (10**9, 9 * 10**9)


def test_a_file_without_chunks_or_messages_is_read_and_of_several_grids_only_maps(
    tmp_path: Path,
) -> None:
    write_bag(tmp_path / "plain.mcap", sent(1, 2), is_chunked=False)
    write_bag(tmp_path / "empty.mcap", [])
    assert times(tmp_path) == [1, 2]
    grid = occupancy_grid([[0]])
    names = ["/costmap", "/gh1/map", "/local_costmap"]
    path = write_bag(tmp_path / "a.mcap", [*sent(1), *(Sent(name, 1, grid) for name in names)])
    with Recording(path) as recording:
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
        Recording(path)


def test_a_flipped_byte_is_reported_where_it_is(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.mcap", sent(*range(200)), compression=CompressionType.NONE)
    data = bytearray(path.read_bytes())
    at = data.index(b"tag 150")
    data[at] ^= 1
    path.write_bytes(data)
    with Recording(path) as recording:
        messages = recording.messages([OBSERVATIONS])
        next(messages)
        with pytest.raises(RecordingError, match="cannot read"):
            list(messages)


def test_what_is_no_recording_or_of_no_use_is_refused(tmp_path: Path) -> None:
    empty = write_bag(tmp_path / "d.mcap", [])
    mapped = write_bag(tmp_path / "e.mcap", [Sent("/map", 1, occupancy_grid([[0]]))])
    folder = tmp_path / "folder"
    folder.mkdir()
    for path, why in (
        (tmp_path / "none.mcap", "No such file"),
        (folder, "is a folder without a .mcap file"),
        (empty, "has no messages"),
        (mapped, "has nothing that a twin subscribes to"),
    ):
        with pytest.raises(RecordingError, match=why), Recording(path) as recording:
            _ = recording.inputs


def seen(tag_id: str, at_s: float, topic: str = OBSERVATIONS) -> Sent:
    return Sent(topic, at_s, scan(tag_id, {"co2": 1.0}, stamp_s=at_s))


def time_of(frame: Any) -> int:
    return int(frame["state"]["header"]["stamp"]["sec"])


@contextmanager
def demo_of(domain: int, path: Path, *words: str) -> Iterator[tuple[Process, Listener]]:
    """A demo of a recording. It deletes its journal and its player at the end."""
    folder = path.parent
    with (
        lupin_twin(domain, "demo", "--from", str(path), *words, TMPDIR=str(folder)) as demo,
        listener(url_of(demo)) as screen,
    ):
        yield demo, screen
        players = children_of(demo.pid, b"bags.player")
        assert demo.stop() == 0
        assert "Traceback" not in demo.output
        assert list(folder.glob("lupin-twin-*")) == []
        assert not any(map(is_running, players))


def test_a_recorded_clock_is_the_time(domain: int, tmp_path: Path) -> None:
    """The other stamps are from another clock. At the end of the recording, time stops."""
    sent = [Sent("/clock", 90_000.0 + it, Clock(clock=Time(sec=5_000 + it))) for it in range(20)]
    sent.append(Sent(OBSERVATIONS, 90_010.5, scan("1", {"co2": 1.0}, stamp_s=5_010.0)))
    path = write_bag(tmp_path / "run.mcap", sorted(sent, key=lambda it: it.at_s))
    with demo_of(domain, path, "--speed", "10") as (_, screen):
        status = screen.until(
            "status", lambda frame: bool(frame["journal"]["state"] == "recording")
        )
        assert status["origin"] == "recorded"
        shown = screen.until(
            "state", lambda frame: time_of(frame) == 5_019 and tag_ids(frame["state"]) == ["1"]
        )
        assert shown["state"]["tags"][0]["stale_seconds"] == 9.0
        assert len(list(tmp_path.glob("lupin-twin-*/journal.sqlite"))) == 1


def test_everything_in_a_folder_arrives_and_the_page_stays_at_its_end(
    domain: int, tmp_path: Path
) -> None:
    """More observations at once than the 50 that a publisher stores, on a renamed topic."""
    folder = tmp_path / "run"
    folder.mkdir()
    write_bag(folder / "run_1.mcap", [seen("last", 5_010.0, "/gh1/seen")])
    first = [seen(str(number), 5_000.0, "/gh1/seen") for number in range(70)]
    write_bag(folder / "run_0.mcap", first)
    with demo_of(domain, folder, "--speed", "5") as (demo, screen):
        screen.until(
            "state", lambda frame: time_of(frame) == 5_010 and len(tag_ids(frame["state"])) == 71
        )
        demo.wait_for_output("the end: 71 messages were published")


def test_a_second_twin_stops_the_player_because_its_journal_would_store_the_recording(
    domain: int, tmp_path: Path
) -> None:
    path = write_bag(tmp_path / "run.mcap", [seen("a", 5_000.0)])
    with twin_node(domain), demo_of(domain, path) as (demo, _):
        demo.wait_for_output("several twins run in ROS domain")
        demo.wait_for_output("the player ended with exit code 1")

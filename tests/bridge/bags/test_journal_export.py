"""A period of a journal as a recording, and the state of a twin that receives it."""

from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml
from lupin_msgs.msg import DiscoveredTags
from lupin_msgs.msg import Observation as ObservationMsg
from mcap.reader import make_reader
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock as ClockMessage

from lupin_bridge.bags import journal_export
from lupin_bridge.bags.journal_export import export
from lupin_twin.core import ingest
from lupin_twin.core.drops import Drop
from lupin_twin.core.history import Repeats
from lupin_twin.core.state import Observation, Pin, Pose, TagState, TwinStore, Write
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import open_reader
from lupin_twin.ros import convert
from tests.support.bags import is_open, no_file_above, read
from tests.support.journal import NOW, SECOND, append, inspection, opened, pin, scan
from tests.support.processes import run_here

FAILED_INSPECTION = Observation(
    "7", NOW, status=2, status_detail="dark", source="robot", mission="m1", kind=1
)
ROWS: list[Write] = [
    pin("7"),
    scan("7", temperature=20.0, humidity=60.0),
    pin("8", NOW + SECOND, x=8.5),
    inspection("8", NOW + SECOND, anomaly=True),
    scan("7", NOW + 2 * SECOND, temperature=21.0, light=float("nan")),
    replace(FAILED_INSPECTION, arrival_ns=NOW + 2000),
    # Late, and from a robot whose clock is ahead: such a clock does not count.
    replace(scan("8", NOW + SECOND), own_stamp_ns=NOW * 3),
    replace(scan("8", NOW + 3 * SECOND), readings={}, status=1, status_detail="no way"),
    inspection("7", NOW + 4 * SECOND),
    replace(pin("9", NOW + 5 * SECOND), pose=Pose(1.0, 2.0, 3.0, 0.0, 0.0, 1.0, 1e-9)),
    *(scan("7", NOW + 6 * SECOND + n, temperature=float(n)) for n in range(9)),
]
SIMULATED = Clock(50 * SECOND, 50 * SECOND, is_simulated=True)
FOR_EVER = {"sec": 9223372036, "nsec": 854775807}
# All that rosbag2 reads.
QOS: dict[str, Any] = {
    "history": "keep_last",
    "reliability": "reliable",
    "deadline": FOR_EVER,
    "lifespan": FOR_EVER,
    "liveliness": "automatic",
    "liveliness_lease_duration": FOR_EVER,
    "avoid_ros_namespace_conventions": False,
}


def exported(
    path: Path, target: Path, start_ns: int = 0, end_ns: int = 2**62, namespace: str = ""
) -> tuple[int, int]:
    with closing(open_reader(path)) as connection:
        return export(connection, target, start_ns, end_ns, namespace)


def fed(target: Path) -> tuple[dict[str, str], list[str]]:
    """The tags of a new twin that receives a recording, and its journal's observations."""
    store, repeats, written = TwinStore(), Repeats(), list[str]()
    for topic, log_ns, _, data in read(target):
        if topic == "/floranova/observations":
            msg = deserialize_message(data, ObservationMsg)
            write = ingest.observation(*convert.received(msg), "map", log_ns)
            assert not isinstance(write, Drop)
            assert ingest.apply(write, store, repeats) is None
            written.append(repr(write))
        elif topic == "/perception/discovered_tags":
            found = convert.received_tags(deserialize_message(data, DiscoveredTags))
            for pinned in list(ingest.discoveries(found, "", "map", store.is_pinned)):
                assert not isinstance(pinned, Drop)
                assert ingest.apply(pinned, store, repeats) is None
    return by_id(store.snapshot(NOW * 2, "map").tags), written


def by_id(tags: tuple[TagState, ...]) -> dict[str, str]:
    """By their ids, with NaN comparable. A recording does not keep the order of a tag's sensors."""
    return {
        tag.tag_id: repr(replace(tag, readings=tuple(sorted(tag.readings, key=lambda r: r.name))))
        for tag in tags
    }


@pytest.mark.parametrize(("until_s", "lot"), [(0, 2_000), (2, 3), (5, 2), (7, 1)])
def test_a_twin_that_receives_the_recording_has_the_state_at_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, until_s: int, lot: int
) -> None:
    path, target = tmp_path / "j.sqlite", tmp_path / "a.mcap"
    append(path, ROWS)
    monkeypatch.setattr(journal_export, "LOT", lot)
    end_ns = NOW + until_s * SECOND
    made = exported(path, target, 0, end_ns + 1)
    tags, written = fed(target)
    with closing(open_reader(path)) as connection:
        assert tags == by_id(state_at(connection, end_ns, "map").tags)
    messages = [row for row in ROWS if row.stamp_ns <= end_ns]
    assert sum(made) == len(messages) == len(read(target))
    assert [entry[1] for entry in read(target)] == [row.arrival_ns for row in messages]
    assert written == [
        repr(replace(row, own_stamp_ns=row.stamp_ns, arrival_ns=0))
        for row in messages
        if not isinstance(row, Pin)
    ]


def test_types_and_qos_are_read_from_the_file(tmp_path: Path) -> None:
    path, target = tmp_path / "j.sqlite", tmp_path / "a.mcap"
    append(path, [scan("7", 60 * SECOND)], SIMULATED)
    exported(path, target)
    with target.open("rb") as opened:
        reader = make_reader(opened)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
    assert summary is not None
    for channel in summary.channels.values():
        schema = summary.schemas[channel.schema_id]
        assert (channel.message_encoding, schema.encoding) == ("cdr", "ros2msg")
        is_clock = schema.name == "rosgraph_msgs/msg/Clock"
        [profile] = yaml.safe_load(channel.metadata["offered_qos_profiles"])
        assert profile == QOS | {
            "depth": 10 if is_clock else 50,
            "durability": "volatile" if is_clock else "transient_local",
        }


def test_a_recording_begins_with_the_earlier_positions(tmp_path: Path) -> None:
    path, target = tmp_path / "j.sqlite", tmp_path / "a.mcap"
    append(path, ROWS)
    made = exported(path, target, NOW + 4 * SECOND, NOW + 6 * SECOND, namespace="/house/")
    assert made == (1, 2)
    first, *_ = read(target)
    assert first[:2] == ("/house/perception/discovered_tags", NOW + 4 * SECOND + 2000)
    message = deserialize_message(first[3], DiscoveredTags)
    assert convert.nanoseconds(message.header.stamp) == NOW + SECOND
    found = [(tag.tag_id, tag.pose_in_map.position.x) for tag in message.tags]
    assert found == [("7", 1.5), ("8", 8.5)]
    target.unlink()
    made = exported(path, target, NOW + 5 * SECOND, NOW + 6 * SECOND + 1)
    assert made == (1, 2)


def test_simulated_time_comes_with_a_clock_topic(tmp_path: Path) -> None:
    path, target = tmp_path / "j.sqlite", tmp_path / "a.mcap"
    row = scan("7", 60 * SECOND)
    late = replace(scan("7", 61 * SECOND), arrival_ns=65 * SECOND)
    append(path, [row, late], SIMULATED)
    exported(path, target)
    (topic, log_ns, _, data), observation, (*_, later), _ = read(target)
    assert (topic, log_ns) == ("/clock", row.arrival_ns)
    time = convert.nanoseconds(deserialize_message(data, ClockMessage).clock)
    assert row.stamp_ns <= time <= row.stamp_ns + SECOND
    assert observation[:2] == ("/floranova/observations", row.arrival_ns)
    # By arrival, not by observation: a clock does not go back.
    assert convert.nanoseconds(deserialize_message(later, ClockMessage).clock) == 65 * SECOND


def test_positions_from_an_earlier_run_are_exported(tmp_path: Path) -> None:
    path, target = tmp_path / "j.sqlite", tmp_path / "a.mcap"
    again = Clock(50 * SECOND, NOW + 60 * SECOND, is_simulated=True)
    row = replace(scan("7", 60 * SECOND), arrival_ns=NOW + 70 * SECOND)
    with opened(path) as file:
        first = file.start(Clock(100 * SECOND, NOW, is_simulated=True), is_believed=False).run
        file.append([(first, pin("7", 100 * SECOND)), (first, scan("7", 100 * SECOND))])
        file.append([(file.begin(again, first), row)])
    assert exported(path, target, 55 * SECOND, 90 * SECOND) == (1, 1)
    assert [(entry[0], entry[1]) for entry in read(target)] == [
        ("/clock", row.arrival_ns),
        ("/perception/discovered_tags", row.arrival_ns),
        ("/floranova/observations", row.arrival_ns),
    ]


def test_an_empty_or_failed_export_leaves_no_file_and_overwrites_none(tmp_path: Path) -> None:
    path, target = tmp_path / "j.sqlite", tmp_path / "a.mcap"
    append(path, ROWS)
    assert exported(path, target, 0, NOW) == (0, 0)
    assert not target.exists()
    target.write_bytes(b"mine")
    with pytest.raises(FileExistsError):
        exported(path, target)
    assert target.read_bytes() == b"mine"
    target.unlink()
    # Room for SQLite's 32 KiB beside a journal that is read, but not for the recording.
    append(path, [scan("7", NOW + 9 * SECOND + n, temperature=float(n)) for n in range(2_000)])
    with no_file_above(45_000), pytest.raises(OSError, match="File too large"):
        exported(path, target)
    assert not target.exists()
    assert not is_open(target)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "j.sqlite"
    append(made, [pin(), *(scan(at_ns=NOW + n * SECOND, a=n / 3) for n in range(10))])
    return made


def test_export_writes_a_recording_of_a_period(path: Path, tmp_path: Path) -> None:
    target = tmp_path / "a.mcap"
    words = ("export", target, "--journal", path, "--from", "1763700003", "--to", "1763700005")
    done = run_here("journal", *words)
    assert (done.returncode, done.stdout, done.stderr) == (
        0,
        f"2 observations and 1 messages of discovered tags are in {target}\n",
        "",
    )
    assert [topic for topic, *_ in read(target)] == [
        "/perception/discovered_tags",
        "/floranova/observations",
        "/floranova/observations",
    ]
    done = run_here("journal", *words)
    assert (done.returncode, f"{target} already exists" in done.stderr) == (1, True)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("a.csv",), "a.csv does not end in .mcap"),
        (("nowhere/a.mcap",), "nowhere/a.mcap: No such file or directory"),
        (("a.mcap", "--to", "5"), "has nothing in that period"),
    ],
)
def test_a_recording_that_cannot_be_made_is_one_clear_line(
    path: Path, tmp_path: Path, words: tuple[str, ...], text: str
) -> None:
    done = run_here("journal", "export", tmp_path / words[0], *words[1:], "--journal", path)
    assert done.returncode == 1
    assert text in done.stderr
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.glob("*.mcap"))

from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest
from lupin_msgs.msg import DiscoveredTags, Observation
from mcap.reader import make_reader
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock as ClockMessage

from lupin_bridge.bags.journal_export import LOT, export, offered_qos
from lupin_bridge.feed.relay import Topic
from lupin_twin.core import ingest
from lupin_twin.core.drops import Drop
from lupin_twin.core.history import Repeats
from lupin_twin.core.state import TagState, TwinStore, Write
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import open_reader
from lupin_twin.ros import convert
from tests.bridge.bags.test_journal_messages import FAILED_LOOK
from tests.bridge.cli.test_journal import Said
from tests.support.bags import is_open, no_file_above, read
from tests.support.journal import NOW, SECOND, kept, look, pin, scan

ROWS: list[Write] = [
    pin("7"),
    scan("7", temperature=20.0, humidity=60.0),
    pin("8", NOW + SECOND, x=8.5),
    look("8", NOW + SECOND, anomaly=True),
    scan("7", NOW + 2 * SECOND, temperature=21.0, light=float("nan")),
    replace(FAILED_LOOK, arrival_ns=NOW + 2000),
    scan("8", NOW + SECOND),
    look("7", NOW + 4 * SECOND),
    pin("9", NOW + 5 * SECOND),
    *(scan("7", NOW + 6 * SECOND + n, temperature=float(n)) for n in range(LOT + 1)),
]


def exported(
    path: Path, target: Path, start_ns: int = 0, end_ns: int = 2**62, namespace: str = ""
) -> tuple[int, int]:
    with closing(open_reader(path)) as connection:
        return export(connection, target, start_ns, end_ns, namespace)


def fed(target: Path) -> dict[str, str]:
    """The tags of a fresh twin that hears a recording."""
    store, repeats = TwinStore(), Repeats()
    for topic, log_ns, _, data in read(target):
        if topic == "/floranova/observations":
            msg = deserialize_message(data, Observation)
            write = ingest.observation(convert.received(msg), "map", log_ns)
            assert not isinstance(write, Drop)
            assert ingest.apply(write, store, repeats) is None
        elif topic == "/perception/discovered_tags":
            heard = convert.received_tags(deserialize_message(data, DiscoveredTags))
            for pinned in list(ingest.discoveries(heard, "map", store.is_pinned)):
                assert not isinstance(pinned, Drop)
                assert ingest.apply(pinned, store, repeats) is None
    return by_id(store.snapshot(NOW * 2, "map").tags)


def by_id(tags: tuple[TagState, ...]) -> dict[str, str]:
    """By their ids, and NaN comparable; in which order a tag's sensors came is not told."""
    return {
        tag.tag_id: repr(replace(tag, readings=tuple(sorted(tag.readings, key=lambda r: r.name))))
        for tag in tags
    }


@pytest.mark.parametrize("until_s", [0, 2, 5, 7])
def test_who_hears_it_knows_what_the_journal_says_of_its_end(tmp_path: Path, until_s: int) -> None:
    path, target = tmp_path / "j.sqlite", tmp_path / "a.mcap"
    kept(path, ROWS)
    end_ns = NOW + until_s * SECOND
    observations, tags = exported(path, target, 0, end_ns + 1)
    with closing(open_reader(path)) as connection:
        assert fed(target) == by_id(state_at(connection, end_ns, "map").tags)
    messages = [row for row in ROWS if row.stamp_ns <= end_ns]
    assert observations + tags == len(messages) == len(read(target))
    assert [entry[1] for entry in read(target)] == [row.arrival_ns for row in messages]


def test_other_programs_learn_types_and_qos_from_the_file(tmp_path: Path) -> None:
    path, target = tmp_path / "j.sqlite", tmp_path / "a.mcap"
    kept(path, ROWS)
    exported(path, target)
    with target.open("rb") as opened:
        reader = make_reader(opened)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
    assert summary is not None
    for channel in summary.channels.values():
        schema = summary.schemas[channel.schema_id]
        assert (channel.message_encoding, schema.encoding) == ("cdr", "ros2msg")
        topic = Topic(channel.topic, schema.name, depth=50)
        assert channel.metadata == {"offered_qos_profiles": offered_qos(topic)}


def test_a_period_begins_with_the_places_of_before(tmp_path: Path) -> None:
    path, target = tmp_path / "j.sqlite", tmp_path / "a.mcap"
    kept(path, ROWS)
    made = exported(path, target, NOW + 4 * SECOND, NOW + 6 * SECOND, namespace="/house/")
    assert made == (1, 2)
    first, *_ = read(target)
    assert first[:2] == ("/house/perception/discovered_tags", NOW + 4 * SECOND + 2000)
    tags = deserialize_message(first[3], DiscoveredTags).tags
    assert [(tag.tag_id, tag.pose_in_map.position.x) for tag in tags] == [("7", 1.5), ("8", 8.5)]
    target.unlink()
    made = exported(path, target, NOW + 5 * SECOND, NOW + 6 * SECOND + 1)
    assert made == (1, 2)


def test_simulated_time_is_told_by_the_clock(tmp_path: Path) -> None:
    path, target = tmp_path / "j.sqlite", tmp_path / "a.mcap"
    row = scan("7", 60 * SECOND)
    late = replace(scan("7", 61 * SECOND), arrival_ns=65 * SECOND)
    kept(path, [row, late], Clock(50 * SECOND, 50 * SECOND, is_simulated=True))
    exported(path, target)
    (topic, log_ns, _, data), observation, (*_, later), _ = read(target)
    assert (topic, log_ns) == ("/clock", row.arrival_ns)
    time = convert.nanoseconds(deserialize_message(data, ClockMessage).clock)
    assert row.stamp_ns <= time <= row.stamp_ns + SECOND
    assert observation[:2] == ("/floranova/observations", row.arrival_ns)
    # Not when it was observed, but when it was heard: a clock does not go back.
    assert convert.nanoseconds(deserialize_message(later, ClockMessage).clock) == 65 * SECOND


def test_of_nothing_or_a_part_no_file_is_left_and_none_is_overwritten(tmp_path: Path) -> None:
    path, target = tmp_path / "j.sqlite", tmp_path / "a.mcap"
    kept(path, ROWS)
    assert exported(path, target, 0, NOW) == (0, 0)
    assert not target.exists()
    target.write_bytes(b"mine")
    with pytest.raises(FileExistsError):
        exported(path, target)
    assert target.read_bytes() == b"mine"
    target.unlink()
    # Room for what SQLite has beside a journal that is read, 32 KiB, and not for all of it.
    with no_file_above(45_000), pytest.raises(OSError, match="File too large"):
        exported(path, target)
    assert not target.exists()
    assert not is_open(target)


# --- the command ---------------------------------------------------------------------------------


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "j.sqlite"
    kept(made, [pin(), *(scan(at_ns=NOW + n * SECOND, a=n / 3) for n in range(10))])
    return made


def test_export_writes_a_recording_of_a_period(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "a.mcap"
    words = ("export", target, "--journal", path, "--from", "1763700003", "--to", "1763700005")
    said = Said(capsys, *words)
    assert (said.code, said.out, said.err) == (
        0,
        f"2 observations and 1 messages of discovered tags are in {target}\n",
        "",
    )
    assert [topic for topic, *_ in read(target)] == [
        "/perception/discovered_tags",
        "/floranova/observations",
        "/floranova/observations",
    ]
    said = Said(capsys, *words)
    assert (said.code, f"{target} is there already" in said.err) == (1, True)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("a.csv",), "a.csv does not end in .mcap"),
        (("a.mcap", "--tag", "7"), "--tag is for CSV"),
        (("a.mcap", "--sensor", "a"), "--sensor is for CSV"),
        (("nowhere/a.mcap",), "nowhere/a.mcap: No such file or directory"),
        (("a.mcap", "--to", "5"), "holds nothing of that period"),
    ],
)
def test_a_recording_that_cannot_be_made_is_one_clear_line(
    path: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    text: str,
) -> None:
    said = Said(capsys, "export", tmp_path / words[0], *words[1:], "--journal", path)
    assert said.code == 1
    assert text in said.err
    assert said.err.count("\n") == 1
    assert not list(tmp_path.glob("*.mcap"))

"""Exports a period of a journal as a recording of its messages: an MCAP file, as rosbag2's.

The journal does not keep all of a message. What it lacks has its default: where the robot saw a tag
at each scan (a tag's place comes as a discovered tag), and the hour of the simulated day. The stamp
is the one by which the twin counts it. The frame is empty, which stands for the one that the twin
expects.
"""

from __future__ import annotations

import heapq
import os
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from operator import itemgetter
from pathlib import Path
from typing import Final

from lupin_msgs.msg import DiscoveredTag, DiscoveredTags
from mcap.writer import CompressionType, Writer
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock

from lupin_bridge.bags.recording import MESSAGE_ENCODING
from lupin_bridge.feed.relay import ENCODING, schema_text
from lupin_twin.core.interfaces import CLOCK, DISCOVERED_TAGS, OBSERVATIONS, Topic
from lupin_twin.core.state import Pin, Pose, Write
from lupin_twin.journal import sql
from lupin_twin.journal.rows import listed_rows
from lupin_twin.journal.runs import Run, cut, runs, spans
from lupin_twin.journal.schema import LOCAL_SITE, SiteLog, one_view
from lupin_twin.ros.convert import observation_message, pose_message, time_msg

# A QoS profile as rosbag2 writes it since version 9 of its metadata (Jazzy), which it also assumes
# for a file without metadata. No deadline, no lifespan: RMW_DURATION_INFINITE.
_PROFILE: Final = """\
- history: keep_last
  depth: {depth}
  reliability: reliable
  durability: {durability}
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: automatic
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
"""


def offered_qos(topic: Topic) -> str:
    """The QoS with which a topic is published, as rosbag2 writes it."""
    durability = "transient_local" if topic.is_latched else "volatile"
    return _PROFILE.format(depth=topic.depth, durability=durability)


# --- the rows -------------------------------------------------------------------------------------

# Rows that are in memory at once.
LOT: Final = 2_000


class JournalRows:
    """The writes of a period, `start_ns <= stamp < end_ns`.

    `places` are the tags' places before it: by an earlier write, or an earlier run of the clock.
    """

    def __init__(self, connection: sqlite3.Connection, start_ns: int, end_ns: int) -> None:
        self._connection = connection
        self._period = {"site": LOCAL_SITE, "start": start_ns, "end": end_ns}
        with one_view(connection):
            every = runs(connection.execute)
            self._spans = cut(spans(every), start_ns, end_ns)
            by_id = {run.id: run for run in every}
            self.runs: dict[int, Run] = {span.run: by_id[span.run] for span in self._spans}
            self.places = self._places_before(start_ns)

    def __iter__(self) -> Iterator[tuple[Run, Write]]:
        """Yield each write with its run of the clock, in the order of receipt."""
        with one_view(self._connection):
            for _, run, row in heapq.merge(self._observed(), self._placed(), key=itemgetter(0)):
                yield run, row

    def _places_before(self, start_ns: int) -> list[Pin]:
        first: dict[str, Pin] = {}
        for run in self.runs.values():
            for _, pin, is_copy in self._pins(run):
                if is_copy or pin.stamp_ns < start_ns:
                    first.setdefault(pin.tag_id, pin)
        return list(first.values())

    def _observed(self) -> Iterator[tuple[int, Run, Write]]:
        """Yield scans and inspections as (number, run, row), in the order of their numbers."""
        seqs = [seq for (seq,) in self._connection.execute(sql.NUMBERS, self._period)]
        for start in range(0, len(seqs), LOT):
            lot = seqs[start : start + LOT]
            rows = [
                (row.number, run, row)
                for run in self.runs.values()
                for row in listed_rows(SiteLog(self._connection), run.id, lot, lot)
                if self._holds(run, row.stamp_ns)
            ]
            yield from sorted(rows, key=itemgetter(0))

    def _placed(self) -> list[tuple[int, Run, Write]]:
        rows: list[tuple[int, Run, Write]] = [
            (seq, run, pin)
            for run in self.runs.values()
            for seq, pin, is_copy in self._pins(run)
            if not is_copy and self._holds(run, pin.stamp_ns)
        ]
        return sorted(rows, key=itemgetter(0))

    def _pins(self, run: Run) -> Iterator[tuple[int, Pin, bool]]:
        of_run = self._period | {"run": run.id}
        for row in self._connection.execute(sql.PLACES, of_run):
            seq, tag, stamp_ns, arrival_ns, is_copy, *pose = row
            yield seq, Pin(tag, Pose(*pose), stamp_ns, arrival_ns), bool(is_copy)

    def _holds(self, run: Run, stamp_ns: int) -> bool:
        return any(
            span.run == run.id and span.start_ns <= stamp_ns < span.end_ns for span in self._spans
        )


def discovered(pins: Sequence[Pin]) -> DiscoveredTags:
    """lupin_msgs/DiscoveredTags."""
    tags = [DiscoveredTag(tag_id=pin.tag_id, pose_in_map=pose_message(pin.pose)) for pin in pins]
    msg = DiscoveredTags(tags=tags)
    msg.header.stamp = time_msg(max(pin.stamp_ns for pin in pins))
    return msg


# --- the file -------------------------------------------------------------------------------------

_OBSERVATIONS, _TAGS, _CLOCK = range(3)


def export(
    connection: sqlite3.Connection, path: Path, start_ns: int, end_ns: int, namespace: str = ""
) -> tuple[int, int]:
    """Write what was received with `start_ns <= stamp < end_ns` into a new file.

    Returns how many observations, and messages of discovered tags, were written.

    A message's log time is when it arrived, by the wall clock, as in a recorder. Places that tags
    had before come first. In simulated time, `/clock` comes before each message. If nothing was
    received, no file is left.

    Raises:
        OSError: the file cannot be made or written, and none is left; FileExistsError: it is there
            already.
        LookupError: the message types are not installed.

    """
    rows = JournalRows(connection, start_ns, end_ns)
    root = f"/{namespace.strip('/')}/".replace("//", "/")
    topics = [replace(it, name=root + it.name) for it in (OBSERVATIONS, DISCOVERED_TAGS)]
    if any(run.begun.is_simulated for run in rows.runs.values()):
        topics.append(replace(CLOCK, depth=10))
    texts = {topic.type_name: schema_text(topic.type_name) for topic in topics}
    with ExitStack() as if_not_kept, path.open("xb") as file:
        if_not_kept.callback(path.unlink)
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="ros2", library="lupin-twin")
        schemas = {
            name: writer.register_schema(name, ENCODING, text.encode())
            for name, text in texts.items()
        }
        channels = [
            writer.register_channel(
                topic.name,
                MESSAGE_ENCODING,
                schemas[topic.type_name],
                # Without it rosbag2 plays everything as volatile.
                {"offered_qos_profiles": offered_qos(topic)},
            )
            for topic in topics
        ]
        written = _write(writer, channels, rows)
        writer.finish()  # type: ignore[no-untyped-call]
        file.flush()
        os.fdatasync(file.fileno())
        if any(written):
            if_not_kept.pop_all()
    return written


def _write(writer: Writer, channels: Sequence[int], rows: JournalRows) -> tuple[int, int]:
    counts = [0, 0]

    def write(topic: int, at_ns: int, message: object) -> None:
        writer.add_message(channels[topic], at_ns, bytes(serialize_message(message)), at_ns)

    for run, row in rows:
        at_ns = row.arrival_ns
        if run.begun.is_simulated:
            # What ROS time was when it arrived.
            now_ns = max(row.stamp_ns, at_ns - run.begun.arrival_ns + run.begun.stamp_ns)
            write(_CLOCK, at_ns, Clock(clock=time_msg(now_ns)))
        if rows.places and not sum(counts):
            write(_TAGS, at_ns, discovered(rows.places))
            counts[_TAGS] += 1
        if isinstance(row, Pin):
            topic, message = _TAGS, discovered([row])
        else:
            topic, message = _OBSERVATIONS, observation_message(row, "")
        write(topic, at_ns, message)
        counts[topic] += 1
    return counts[_OBSERVATIONS], counts[_TAGS]

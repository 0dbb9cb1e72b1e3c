"""A period of a journal as a recording of the messages that made it."""

from __future__ import annotations

import sqlite3
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from lupin_bridge.bags import journal_messages
from lupin_bridge.bags.bag_file import BagFile
from lupin_bridge.bags.journal_rows import JournalRows
from lupin_bridge.bags.topics import Topic
from lupin_twin.journal.rows import PinRow
from lupin_twin.parameters import TwinParameters

_OBSERVATIONS, _TAGS, _CLOCK = range(3)
# Of so many messages the chunks reach the file together.
_FLUSH_EVERY: Final = 1_000


@dataclass(frozen=True, slots=True)
class Exported:
    """How many messages of each kind."""

    observations: int
    tags: int


def export(
    connection: sqlite3.Connection, path: Path, start_ns: int, end_ns: int, namespace: str = ""
) -> Exported:
    """Write what was heard with `start_ns <= stamp < end_ns` into a new file.

    A message is logged when it arrived, by the wall clock, as a recorder would have. Places that
    tags had before come first. Where time was simulated, `/clock` tells it before each message.
    Where nothing was heard no file is left.

    Raises:
        OSError: the file cannot be made or written, and there is none then; FileExistsError: it is
            there already.
        LookupError: the message types are not installed.

    """
    rows = JournalRows(connection, start_ns, end_ns)
    file = BagFile(path, _topics(namespace, has_clock=rows.is_simulated))
    with ExitStack() as otherwise:
        otherwise.callback(path.unlink)
        otherwise.callback(file.close)
        written = _write(file, rows)
        file.finish()
        file.flush_rest()
        otherwise.pop_all()
    file.close()
    if not written.observations + written.tags:
        path.unlink()
    return written


def _topics(namespace: str, *, has_clock: bool) -> list[Topic]:
    names = TwinParameters()
    root = f"/{namespace.strip('/')}/".replace("//", "/")
    topics = [
        Topic(root + names.observations_topic, "lupin_msgs/msg/Observation", 50),
        Topic(root + names.discovered_tags_topic, "lupin_msgs/msg/DiscoveredTags", 50),
        Topic("/clock", "rosgraph_msgs/msg/Clock"),
    ]
    return topics if has_clock else topics[:_CLOCK]


def _write(file: BagFile, rows: JournalRows) -> Exported:
    counts = [0, 0]
    for run, row in rows:
        at_ns = row.arrival_ns
        if run.begun.is_simulated:
            # What ROS time was when it arrived.
            now_ns = max(row.stamp_ns, at_ns - run.begun.arrival_ns + run.begun.stamp_ns)
            file.write(_CLOCK, at_ns, at_ns, journal_messages.clock(now_ns))
        if rows.places and not sum(counts):
            file.write(_TAGS, at_ns, at_ns, journal_messages.discovered(rows.places))
            counts[_TAGS] += 1
        if isinstance(row, PinRow):
            topic, data = _TAGS, journal_messages.discovered([row])
        else:
            topic, data = _OBSERVATIONS, journal_messages.observation(row)
        file.write(topic, at_ns, at_ns, data)
        counts[topic] += 1
        if sum(counts) % _FLUSH_EVERY == 0:
            file.flush()
    observations, tags = counts
    return Exported(observations, tags)
